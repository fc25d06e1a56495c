"""The layout that a Rerun recording opens with: 3D, pictures, curves, steps, events and verdict at first sight."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from manipcli.replay.camera import Camera
from manipcli.replay.rerun.bodies import LAYERS
from manipcli.replay.rerun.curves import Chart
from manipcli.replay.rerun.sensors import Views
from manipcli.replay.rerun.story import EVENTS, VERDICT
from manipcli.replay.rerun.timelines import TIME

if TYPE_CHECKING:
    import rerun.blueprint as rrb

MOST_JOINTS = 32
"""Joints with a tab of their own."""

MOST_LEGEND = 8
"""Curves with a legend; one of more would hide them. The name of a curve is shown under the pointer."""

MOST_BESIDE = 4
"""Pictures beside each other; more are tabs."""


@dataclass(frozen=True, slots=True)
class Contents:
    """What a recording has to show: the first view, charts, charts by joint, and views of sensors."""

    camera: Camera
    charts: tuple[Chart, ...]
    joints: dict[str, tuple[Chart, ...]]
    views: Views
    has_steps: bool


def layout(contents: Contents) -> rrb.Blueprint:
    """The blueprint."""
    import rerun.blueprint as rrb

    seen = rrb.Spatial3DView(
        name="3D",
        origin="/world",
        contents=["/world/**", *(f"/{layer}/**" for layer in LAYERS)],
        overrides={f"/{layer}": rrb.EntityBehavior(visible=False) for layer in LAYERS},
        eye_controls=rrb.EyeControls3D(
            position=contents.camera.eye, look_target=contents.camera.target, eye_up=(0, 0, 1)
        ),
    )
    left: list[rrb.View | rrb.Container] = [seen]
    shares = [6.0]
    sensors: list[rrb.View | rrb.Container] = [
        rrb.Spatial2DView(origin=camera, contents=[path], name=_name(path, camera))
        for path, camera in contents.views.pictures.items()
    ]
    sensors += (rrb.TensorView(origin=path, name=path.removeprefix("/sensors/")) for path in contents.views.tensors)
    if sensors:
        left.append(rrb.Horizontal(*sensors) if len(sensors) <= MOST_BESIDE else rrb.Tabs(*sensors))
        shares.append(3.0)
    if contents.has_steps:
        left.append(rrb.StateTimelineView(origin="/steps", name="steps"))
        shares.append(1.5)
    charts = [_view(chart) for chart in contents.charts]
    charts += (rrb.Vertical(*map(_view, of), name=name) for name, of in list(contents.joints.items())[:MOST_JOINTS])
    right: list[rrb.View | rrb.Container] = [rrb.TextDocumentView(origin=VERDICT, name="verdict")]
    if charts:
        right.append(rrb.Tabs(*charts, name="curves"))
    columns = rrb.archetypes.TextLogColumns(text_log_columns=["LogLevel", "Body"])
    right.append(rrb.TextLogView(origin=EVENTS, name="events", columns=columns))
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(*left, row_shares=shares),
            rrb.Vertical(*right),
            column_shares=[3, 2],
        ),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIME),
        auto_views=False,
    )


def _view(chart: Chart) -> rrb.TimeSeriesView:
    import rerun.blueprint as rrb

    legend = rrb.PlotLegend(visible=len(chart.paths) <= MOST_LEGEND)
    return rrb.TimeSeriesView(origin="/", contents=list(chart.paths), name=chart.title, plot_legend=legend)


def _name(path: str, camera: str) -> str:
    """`kinect/depth`"""
    return camera.rpartition("/")[2] + path.removeprefix(camera)
