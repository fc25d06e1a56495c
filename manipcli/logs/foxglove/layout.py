"""Layout of a run in Foxglove: 3D, steps, curves, cause and log, made with the layouts of foxglove-sdk."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from importlib.util import find_spec
from typing import TYPE_CHECKING, Final

from manipcli.core.errors import InvalidArgument
from manipcli.logs.foxglove.models import TOPIC
from manipcli.record import channels, schemas
from manipcli.record.foreign.snapshot import joint_state
from manipcli.record.foreign.topics import Topics
from manipcli.record.read.chunk import singly
from manipcli.render.drawing import WORLD, draw, floors_of
from manipcli.render.placing import Poses
from manipcli.replay.camera import Camera, framing
from manipcli.replay.playback import Playback
from manipcli.replay.verdict_page import verdict_page

if TYPE_CHECKING:
    from foxglove import layouts as fl

MOST_CURVES: Final = 40
"""In one panel."""
GRID: Final = 10.0
"""Edge of the ground grid [m]."""


def check_installed() -> None:
    """
    Raises:
        InvalidArgument: foxglove-sdk is not installed.
    """
    if find_spec("foxglove") is None:
        hint = "run `pip install 'manipcli[live]'`"
        raise InvalidArgument("USE149", "--foxglove needs the library foxglove-sdk, which is not installed", hint=hint)


def layout_json(playback: Playback, topics: Topics) -> str:
    """The layout of a run, for a log with these topics."""
    from foxglove import layouts as fl

    left: list[fl.SplitItem] = [fl.SplitItem(proportion=3, content=_scene(playback))]
    if channels.EVENTS in topics.all:
        left.append(fl.SplitItem(proportion=1, content=_steps()))
    right: list[fl.SplitItem] = [
        fl.SplitItem(
            proportion=2,
            content=fl.MarkdownPanel(title="Cause", config=fl.MarkdownConfig(markdown=verdict_page(playback))),
        )
    ]
    curves = _curves(playback, topics)
    if curves:
        tabs = fl.TabContainer(tabs=[fl.TabItem(title=str(panel.title), content=panel) for panel in curves])
        right.append(fl.SplitItem(proportion=3, content=tabs))
    if channels.ROSOUT in topics.all:
        log = fl.LogPanel(title="Events", config=fl.LogConfig(topic_to_render=channels.ROSOUT, show_name=False))
        right.append(fl.SplitItem(proportion=2, content=log))
    columns = [
        fl.SplitItem(proportion=3, content=fl.SplitContainer(direction="column", items=left)),
        fl.SplitItem(proportion=2, content=fl.SplitContainer(direction="column", items=right)),
    ]
    return fl.Layout(content=fl.SplitContainer(direction="row", items=columns)).to_json()


def _scene(playback: Playback) -> fl.ThreeDeePanel:
    from foxglove import layouts as fl

    shown = fl.BaseRendererSceneUpdateTopicSettings(visible=True)
    return fl.ThreeDeePanel(
        title="Scene",
        config=fl.ThreeDeeConfig(
            follow_tf=WORLD,
            fixed_frame=WORLD,
            follow_mode="follow-none",
            camera_state=_view(_camera(playback)),
            scene=fl.BaseRendererSceneSettings(transforms=fl.BaseRendererTransforms(visible=False)),
            layers={"grid": fl.BaseRendererGridLayerSettings(visible=True, frame_id=WORLD, size=GRID, divisions=GRID)},
            # The shapes of the description and of the markers are those of `/scene`, and their meshes are not found.
            topics={
                TOPIC: shown,
                channels.ROBOT_DESCRIPTION: fl.BaseRendererUrdfTopicSettings(visible=False),
                channels.MARKERS: fl.BaseRendererRosMarkerTopicSettings(visible=False),
            },
        ),
    )


def _camera(playback: Playback) -> Camera:
    """The view that frames what moves."""
    drawing, poses = draw(playback.robot, playback.scene), playback.poses()
    floors = floors_of(playback.scene)
    fixed = (
        frozenset(body.name for body in playback.scene.bodies if body.fixed) if playback.scene is not None else floors
    )
    start = Poses(poses.position[0], poses.quat_xyzw[0])
    return framing(drawing, start, leave_out=fixed if len(fixed) + 1 < len(drawing.frames) else floors)


def _view(camera: Camera) -> fl.ThreeDeeCameraState:
    """A camera as Foxglove writes it: polar angle from z, and azimuth from -y towards -x [deg]."""
    from foxglove import layouts as fl

    x, y, z = (a - b for a, b in zip(camera.eye, camera.target, strict=True))
    return fl.ThreeDeeCameraState(
        perspective=True,
        distance=camera.distance,
        target_offset=camera.target,
        phi=math.degrees(math.acos(z / camera.distance)),
        theta_offset=math.degrees(math.atan2(-x, -y)),
        fovy=camera.field,
    )


def _steps() -> fl.StateTransitionsPanel:
    from foxglove import layouts as fl

    def series(label: str, kind: str, field: str) -> fl.StateTransitionsSeries:
        return fl.StateTransitionsSeries(
            label=label, value=f'{channels.EVENTS}{{kind=="{kind}"}}.{field}', enabled=True
        )

    rows = [series("step", "step_started", "step"), series("phase", "phase_started", "text")]
    return fl.StateTransitionsPanel(title="Steps", config=fl.StateTransitionsConfig(paths=rows, is_synced=True))


def _curves(playback: Playback, topics: Topics) -> list[fl.PlotPanel]:
    """States of joints, errors of controllers, forces of contacts; one panel for each quantity."""
    slides = {joint.name for joint in playback.robot.joints if joint.type == "prismatic"} if playback.robot else set()
    named = {name: _names(topics, name) for name, topic in topics.all.items() if topic.type == schemas.JOINT_STATE}
    panels = []
    for field, turning, sliding in (("position", "rad", "m"), ("velocity", "rad/s", "m/s"), ("effort", "N m", "N")):
        joints = named.get(channels.JOINT_STATES, ())
        paths = {name: f"{channels.JOINT_STATES}.{field}[{k}]" for k, name in enumerate(joints)}
        panels.append(_plot(field.capitalize(), _unit(paths, slides, turning, sliding), paths))
    errors = {
        name: f"{topic}.position[{k}]"
        for topic, names in named.items()
        if topic.endswith("/error")
        for k, name in enumerate(names)
    }
    panels.append(_plot("Error", _unit(errors, slides, "rad", "m"), errors))
    if channels.CONTACTS in topics.all:
        panels.append(_plot("Contacts", "N", {"normal force": f"{channels.CONTACTS}.contacts[:].force"}))
    return [panel for panel in panels if panel.config.paths]


def _unit(names: Collection[str], slides: Collection[str], turning: str, sliding: str) -> str:
    """Units of the joints of a panel."""
    return " or ".join(
        [
            *([turning] if any(name not in slides for name in names) else []),
            *([sliding] if any(name in slides for name in names) else []),
        ]
    )


def _plot(title: str, unit: str, paths: Mapping[str, str]) -> fl.PlotPanel:
    from foxglove import layouts as fl

    series = [fl.PlotSeries(value=path, label=name, enabled=True) for name, path in [*paths.items()][:MOST_CURVES]]
    config = fl.PlotConfig(
        paths=series, y_axis_label=unit, is_synced=True, show_legend=True, legend_display="left", sidebar_dimension=150
    )
    return fl.PlotPanel(title=title, config=config)


def _names(topics: Topics, name: str) -> tuple[str, ...]:
    """The joints of a topic, from its first message."""
    for _, data, places in topics.messages([name]):
        for _, reader in singly(data, places):
            return tuple(joint_state(reader)[0])
    return ()
