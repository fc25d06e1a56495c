"""Depth cameras for the planner and for `locate`: pictures of the scene as the robot believes it to be."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.plan.motion import PlanningState
from manipcli.plan.sight import Sighting, depth_text
from manipcli.render.lens import Lens
from manipcli.render.scene_camera import X_SC, SceneCamera, View
from manipcli.render.stage import Stage, stage_of
from manipcli.scene.scene import Body, Scene
from manipcli.simulate.mount import mount_of
from manipcli.simulate.sensors.camera import CameraSpec
from manipcli.spec.sensors import SensorSpec

COARSE: Final = 80
"""Width [pixel] of the pictures from which the planner sees what hides a body."""
AWAY: Final = (0.0, 0.0, -1e3)
"""(3,) [m] Where surfaces are that a picture must not show: behind the camera."""
WRITTEN: Final = 1e-3 / math.sqrt(12.0)
"""[m] Standard deviation of the rounding of depth to 1 mm, as its message has it."""


def camera_sights(sensors: Mapping[str, SensorSpec], robot: RobotModel, scene: Scene) -> dict[str, CameraSight]:
    """The depth cameras among the sensors of a checked task, by name; `scene` as the robot believes it to be."""
    cameras = {name: spec for name, spec in sensors.items() if isinstance(spec, CameraSpec) and spec.depth}
    return {name: CameraSight(spec, robot, scene) for name, spec in cameras.items()}


class CameraSight:
    """A depth camera, a `Sight` of the planner; its pictures are rendered when they are asked for."""

    def __init__(self, spec: CameraSpec, robot: RobotModel, scene: Scene) -> None:
        self.spec = spec
        self.lens = spec.lens
        self._robot, self._scene = robot, scene
        self._mount = mount_of(spec, robot, scene)
        self.link = self._mount.parent if self._mount.on_link else ""
        self.X_LC = self._mount.X_PS @ X_SC
        self.depths = max(spec.limits.depth.least, spec.near), spec.limits.depth.most
        self.latency = (0.0 if spec.rate is None else 1.0 / spec.rate) + spec.delay

    @property
    def cone(self) -> float:
        """[rad] Half the opening angle of the largest cone about its optical axis that is in the picture."""
        lens = self.lens
        across = min(lens.cx + 0.5, lens.width - 0.5 - lens.cx) / lens.fx
        down = min(lens.cy + 0.5, lens.height - 0.5 - lens.cy) / lens.fy
        return math.atan(max(1e-3, min(across, down)))

    @cached_property
    def _stage(self) -> Stage:
        return stage_of(self._robot, self._scene)

    @cached_property
    def _camera(self) -> SceneCamera:
        return SceneCamera(self._stage, self.lens, self.spec.near)

    @cached_property
    def _coarse(self) -> SceneCamera:
        lens, less = self.lens, max(1.0, self.lens.width / COARSE)
        size = max(1, round(lens.width / less)), max(1, round(lens.height / less))
        centre = (lens.cx + 0.5) / less - 0.5, (lens.cy + 0.5) / less - 0.5
        return SceneCamera(self._stage, Lens(*size, lens.fx / less, lens.fy / less, *centre), self.spec.near)

    def pose(self, state: PlanningState) -> Transform:
        """X_WC."""
        return self._mount.pose(self._world(state)) @ X_SC

    def background(self, state: PlanningState, bodies: Sequence[str]) -> Array:
        """(h, w) depth [m] of everything believed but these bodies; infinite where nothing is."""
        view = self._camera.view(self._world(state), self.pose(state))
        return self._camera.shoot(self._without(view, bodies), colour=False).depth

    def noise(self, depth: Array) -> Array:
        """(h, w) standard deviation of measured depth (h, w) [m], by its data, at right angles to the surface."""
        own = self.spec.noise.depth
        sigma = own.white + own.quadratic * np.square(depth - own.offset)
        return np.asarray(np.sqrt(sigma**2 + own.bias**2 + own.quantisation**2 / 12.0 + WRITTEN**2))

    def sighting(self, state: PlanningState, body: str) -> Sighting:
        """How its picture of this state shows a movable body, where that is worst within its `known`."""
        found = [self._sighting(state, self._scene.body(body), offset) for offset in _offsets(self._scene.body(body))]
        inside = min(found, key=lambda one: one.inside)
        shown = min(found, key=lambda one: one.shown)
        return replace(shown, inside=inside.inside, misses=inside.misses, pixels=min(one.pixels for one in found))

    def _sighting(self, state: PlanningState, body: Body, offset: Array) -> Sighting:
        """The same with the body, and what is in its place, moved by `offset` (3,) [m]."""
        k = self._scene.movable.index(body)
        X_WO = Transform(R=state.bodies[k].R, p=state.bodies[k].p + offset)
        state = replace(state, bodies=(*state.bodies[:k], X_WO, *state.bodies[k + 1 :]))
        X_WC = self.pose(state)
        inside, misses = self._inside(X_WC.inverse() @ X_WO, body)
        camera = self._coarse
        part = self._stage.parts.index(body.name)
        view = camera.view(self._world(state), X_WC)
        alone = camera.shoot(self._without(view, [body.name], others=True), colour=False).part == part
        seen = camera.shoot(view, colour=False).part
        count, visible = int(alone.sum()), int((seen == part).sum())
        hiders = np.bincount(seen[alone & (seen != part)], minlength=1)
        hider = self._stage.parts[int(np.argmax(hiders))] if hiders.any() else ""
        pixels = visible * self.lens.width * self.lens.height // (camera.lens.width * camera.lens.height)
        return Sighting(inside, misses, visible / count if count else 1.0, hider, pixels)

    def _inside(self, X_CO: Transform, body: Body) -> tuple[float, str]:
        """Share of the corners of the bounding box in the picture at depths that it measures; what the others are."""
        signs = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T
        corners = X_CO.apply(body.centre + signs * body.size)
        (least, most), lens, z = self.depths, self.lens, corners[:, 2]
        measured = (z >= least) & (z <= most)
        u, v = lens.project(corners / np.where(z > 0.0, 1.0, np.nan)[:, None]).T
        framed = (u >= -0.5) & (u <= lens.width - 0.5) & (v >= -0.5) & (v <= lens.height - 0.5)
        found = float(np.mean(measured & framed))
        if found == 1.0:
            return found, ""
        if np.sum(~framed) >= np.sum(framed & ~measured):
            return found, "is outside its picture"
        worst = z[framed & ~measured]
        return found, depth_text(least, most, float(worst[0]))

    def _without(self, view: View, bodies: Sequence[str], *, others: bool = False) -> View:
        """A view without these bodies, or with them alone."""
        own = np.isin(self._stage.part_of, [self._stage.parts.index(body) for body in bodies])
        return replace(view, position=np.where((own != others)[:, None], AWAY, view.position))

    def _world(self, state: PlanningState) -> WorldState:
        """The state that a picture is rendered from."""
        world = WorldState.room(len(state.position), len(state.bodies))
        world.position[:] = state.position
        for k, X_WO in enumerate(state.bodies):
            world.body_position[k], world.body_quat_xyzw[k] = X_WO.p, X_WO.quat_xyzw
        return world


def _offsets(body: Body) -> Iterator[Array]:
    """Where a body can be from where it is believed to be: there, and the outermost places of its region (3,) [m]."""
    yield np.zeros(3)
    known = body.known
    if known is None:
        return
    half = np.array([known.radius, known.radius, 0.0]) if known.radius is not None else known.half
    signs = np.array(np.meshgrid(*[[-1.0, 1.0] if length > 0.0 else [0.0] for length in half])).reshape(3, -1).T
    outward = signs * half
    if known.radius is not None:
        outward /= math.sqrt(2.0)
    yield from (each for each in outward if each.any())
