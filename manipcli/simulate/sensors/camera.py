"""`camera`: colours, depth, parts and points of what a pinhole camera sees.

    sensors:
      eye:
        type: camera
        link: palm
        at: {xyz: [0, 0, 5 cm], rpy: [0, -90 deg, 0]}     # its frame S looks along x, with z up
        fov: 60 deg

Topics in /sensors/NAME: `image_raw` (rgb8), `depth` (16UC1 in mm, 0: not measured), `segmentation` with `labels`,
`points`, and `camera_info`, all in the optical frame `NAME_optical` (z forward, x right, y down, REP 103). Pictures are
of the visual shapes of robot and scene, exact in depth along every ray, the same with every engine. A picture is
rendered when it arrives; ticks without a picture cost nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from manipcli.conditions.condition import Problem
from manipcli.conditions.sensed import Sensed
from manipcli.core.geometry import Transform
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.render.drawing import frame_names
from manipcli.render.lens import Lens
from manipcli.render.scene_camera import X_SC, SceneCamera, Shot
from manipcli.render.stage import stage_of
from manipcli.scene.scene import Scene
from manipcli.simulate import camera_messages as messages
from manipcli.simulate.depth_noise import CameraLimits, CameraNoise, DepthMeasurement, Draw
from manipcli.simulate.sensor import Picture, SensorContext, SensorMember, Topic
from manipcli.spec.base import Model, problem
from manipcli.spec.mounted_sensor import MountedSpec
from manipcli.spec.quantity import Angle, Frequency, Length

MOST_PIXELS, MOST_POINTS = 1 << 22, 4_000_000
"""Of a picture; of a cloud, which is one message, and readers refuse more than 64 MiB."""
OPTICAL = "_optical"


class IntrinsicsSpec(Model):
    """The pinhole in pixels; the centre of the upper left pixel has the coordinates (0, 0)."""

    fx: Annotated[float, Field(gt=0, le=1e6)] = Field(description="Focal length along rows [pixel].")
    fy: Annotated[float, Field(gt=0, le=1e6)] = Field(description="Focal length along columns [pixel].")
    cx: Annotated[float, Field(ge=-1e6, le=1e6)] = Field(description="Column of the principal point [pixel].")
    cy: Annotated[float, Field(ge=-1e6, le=1e6)] = Field(description="Row of the principal point [pixel].")


class CameraSpec(MountedSpec):
    """A camera: colours, depth, parts and points of what it sees."""

    type: Literal["camera"] = Field(description="A camera.")
    rate: Annotated[Frequency, Field(gt=0)] | None = Field(
        25.0, description="Pictures per second [Hz]: the control rate divided by a whole number. Default 25 Hz."
    )
    resolution: tuple[Annotated[int, Field(gt=0)], Annotated[int, Field(gt=0)]] = Field(
        (320, 240), description="Width and height of the pictures [pixel]. Default [320, 240]."
    )
    fov: Angle = Field(1.0471975511965976, description="Horizontal field of view, below 180 deg. Default 60 deg.")
    intrinsics: IntrinsicsSpec | None = Field(None, description="The pinhole in pixels, instead of `fov`.")
    near: Annotated[Length, Field(ge=1e-4, le=10)] = Field(
        0.01, description="What is nearer is transparent, such as the camera's own housing [m]. Default 1 cm."
    )
    color: bool = Field(True, description="Publish coloured pictures. Default true.")
    depth: bool = Field(True, description="Publish depth. Default true.")
    segmentation: bool = Field(False, description="Publish the part that each pixel shows. Default false.")
    cloud: bool = Field(False, description="Publish points: 16 bytes per pixel. Default false.")
    noise: CameraNoise = Field(CameraNoise(), description="Noise. Default: none.")
    limits: CameraLimits = Field(CameraLimits(), description="What it can measure.")

    @model_validator(mode="after")
    def _consistent(self) -> CameraSpec:
        if self.intrinsics is not None and "fov" in self.model_fields_set:
            raise problem("conflict", "the lens is given twice: by fov and by intrinsics", at=("fov",), key=True)
        if not (self.color or self.depth or self.segmentation or self.cloud):
            hint = "set one of color, depth, segmentation, cloud to true"
            raise problem("conflict", "the camera publishes nothing", at=("type",), hint=hint)
        return self

    @property
    def lens(self) -> Lens:
        """The pinhole."""
        if self.intrinsics is None:
            return Lens.of_field(*self.resolution, self.fov)
        given = self.intrinsics
        return Lens(*self.resolution, given.fx, given.fy, given.cx, given.cy)

    @property
    def bytes(self) -> int:
        """Of the messages of a picture."""
        width, height = self.resolution
        return width * height * (3 * self.color + 2 * self.depth + 2 * self.segmentation + 16 * self.cloud)


def check(spec: CameraSpec, robot: RobotModel, scene: Scene) -> Iterator[Problem]:
    """Pictures that cannot be: a lens of 180 deg or more, too many pixels."""
    if not 0.0 < spec.fov < np.pi - 1e-3:
        degrees = float(np.rad2deg(spec.fov))
        hint = "a pinhole sees less than 180 deg: use several cameras, or `type: range` for distances around it"
        if 0.0 < spec.fov < 180.0 and "fov" in spec.model_fields_set and degrees > 360.0:
            hint = f"a number is in rad: write '{spec.fov:g} deg'"
        yield Problem(("fov",), f"a field of view of {degrees:.4g} deg is not between 0 and 180 deg", hint, "SENS130")
    width, height = spec.resolution
    most, with_ = (MOST_POINTS, " with `cloud`") if spec.cloud else (MOST_PIXELS, "")
    if width * height > most:
        hint = "lower the resolution; 640x480 is 0.3 million pixels"
        message = f"{width} x {height} is {width * height / 1e6:.3g} million pixels, more than {most / 1e6:.2g} million"
        yield Problem(("resolution",), message + with_, hint, "SENS131")


def topics(spec: CameraSpec, robot: RobotModel) -> tuple[Topic, ...]:
    """The messages of a picture."""
    kinds = {
        messages.IMAGE: ("sensor_msgs/msg/Image", spec.color),
        messages.DEPTH: ("sensor_msgs/msg/Image", spec.depth),
        messages.SEGMENTATION: ("sensor_msgs/msg/Image", spec.segmentation),
        messages.LABELS: ("vision_msgs/msg/LabelInfo", spec.segmentation),
        messages.POINTS: ("sensor_msgs/msg/PointCloud2", spec.cloud),
        messages.CAMERA_INFO: ("sensor_msgs/msg/CameraInfo", True),
    }
    return tuple(Topic(kind, suffix=suffix, frame=OPTICAL) for suffix, (kind, wanted) in kinds.items() if wanted)


def frames(spec: CameraSpec) -> Mapping[str, Transform]:
    """The optical frame."""
    return {OPTICAL: X_SC}


def sensed(spec: CameraSpec, robot: RobotModel, scene: Scene) -> Sensed:
    """How many pixels show each part, if it tells them apart."""
    width, height = spec.resolution
    parts = frame_names(robot, scene) if spec.segmentation else ()
    return Sensed("camera", picture=messages.SEGMENTATION, parts=parts, most={"pixels": width * height})


class CameraExposure:
    """Takes the pictures of one camera."""

    def __init__(self, spec: CameraSpec, context: SensorContext) -> None:
        self._spec = spec
        assert context.mount is not None
        self._mount = context.mount
        lens = spec.lens
        self._camera = SceneCamera(stage_of(context.robot, context.scene), lens, spec.near)
        interval = context.period if spec.rate is None else 1.0 / spec.rate
        self._measurement = DepthMeasurement(spec.noise, spec.limits, (lens.height, lens.width), interval)
        self._info = messages.camera_info(lens)
        self._labels = messages.labels(self._camera.stage.parts)

    def expose(self, state: WorldState, rng: np.random.Generator) -> Callable[[], Sequence[Picture]]:
        """The picture of this state; rendered when it is called."""
        view = self._camera.view(state, self._mount.pose(state) @ X_SC)
        draw = self._measurement.draw(rng)
        return lambda: self._pictures(self._camera.shoot(view, colour=self._spec.color), draw)

    def _pictures(self, shot: Shot, draw: Draw) -> list[Picture]:
        spec = self._spec
        found = []
        if shot.colour is not None:
            found.append(messages.image(shot.colour))
        if spec.depth or spec.cloud:
            depth = self._measurement.measure(shot.depth, shot.cosine, draw)
            if spec.depth:
                found.append(messages.depth(depth))
            if spec.cloud:
                found.append(messages.points(self._camera.lens.points(depth), shot.colour))
        if spec.segmentation:
            found += [messages.segmentation(shot.part, len(self._camera.stage.parts)), self._labels]
        return [*found, self._info]


MEMBER = SensorMember(
    name="camera",
    spec=CameraSpec,
    quantities=lambda spec, robot: (),
    topics=topics,
    open=CameraExposure,
    check=check,
    frames=frames,
    sensed=sensed,
)
