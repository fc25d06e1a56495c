"""The picture of a map: where the object may be, the clearance and the manipulability, seen from above."""

from __future__ import annotations

import numpy as np

from manipcli.core.geometry import Array
from manipcli.replay.figure import Kind
from manipcli.replay.map_figure import Layer, Map, Outline, map_figure
from manipcli.spec.counted import group
from manipcli.sweep.reach.placement import LARGEST, outline
from manipcli.sweep.reach.reach_map import ReachMap
from manipcli.task.task import Task


def render_picture(found: ReachMap, task: Task, kind: Kind) -> bytes:
    """The bytes of the figure file; of several yaws the best values of each place, and the share that is planned."""
    grid, placement = found.grid, found.placement
    shape = len(grid.y), len(grid.x)
    reasons = np.full(shape, -2, dtype=np.int64)
    share, clearance, manipulability = (np.full(shape, np.nan) for _ in range(3))
    index = {(code, reason): k for k, (code, reason, _) in enumerate(found.reasons)}
    for cell, results in found.cells.items():
        planned = [result for result in results if result.planned]
        share[cell] = len(planned) / len(results)
        reasons[cell] = -1 if planned else min(index[result.code, result.reason] for result in results)
        clearance[cell] = max((1000.0 * result.clearance for result in planned if result.clearance), default=np.nan)
        manipulability[cell] = max((one.manipulability for one in planned if one.manipulability), default=np.nan)
    layers = [Layer("clearance [mm]", clearance), Layer("manipulability", manipulability)]
    if grid.yaw:
        layers.insert(0, Layer("share of the yaws", share, top=1.0))
    frame = f" in {placement.frame}" if placement.frame else ""
    title = f"{found.task}: '{placement.body}' for '{found.question.step}'"
    return map_figure(
        Map(
            title=f"{title}: {found.planned} of {len(found.results)} points can be planned",
            axes=(f"x{frame} [m]", f"y{frame} [m]"),
            x=np.array(grid.x),
            y=np.array(grid.y),
            reasons=reasons,
            good=f"can be planned{' with a yaw' if grid.yaw else ''} ({found.planned})" if found.planned else "",
            legend=tuple(f"{reason} ({count})" for _, reason, count in found.reasons),
            layers=tuple(layers),
            outlines=_outlines(found, task),
            base=_flat(found, task.robot.X_WB.p[None, :2])[0],
        ),
        kind,
    )


def _outlines(found: ReachMap, task: Task) -> tuple[Outline, ...]:
    """Of the bodies that are not inside others; of the object where the file has it."""
    spec, own = task.spec.scene, found.placement.body
    shown = []
    for body in task.true.scene.bodies:
        written = group(body.name, spec) or body.name
        if max(body.size[:2]) > LARGEST or (written in spec and spec[written].inside and written != own):
            continue
        shown.append(Outline(body.name, _flat(found, outline(body)), moved=written == own))
    return tuple(shown)


def _flat(found: ReachMap, points: Array) -> Array:
    return found.placement.from_world(points)
