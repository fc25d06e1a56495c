"""Curves in a Rerun recording.

/joints/<joint>/position, reference, velocity, effort, error    [rad, m, ...]
/joints/<joint>/position_limits, velocity_limits, effort_limits  lines
/curves/<quantity>/<name>                                         the others
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.geometry import Array
from manipcli.replay.playback import Playback, PlotTable
from manipcli.replay.rerun.timelines import Timelines

if TYPE_CHECKING:
    import rerun as rr

JOINT = "joint "
"""How the name of a table of joints begins: `joint position`."""
LIMIT_COLOUR = (220, 60, 60)
REFERENCE_COLOUR = (240, 150, 30)


@dataclass(frozen=True, slots=True)
class Chart:
    """A view of curves: its title with the unit, and the entities that it shows."""

    title: str
    paths: tuple[str, ...]


def log_curves(
    to: rr.RecordingStream, playback: Playback, numbers: tuple[PlotTable, ...], lines: Timelines
) -> tuple[tuple[Chart, ...], dict[str, tuple[Chart, ...]]]:
    """Logs all curves; `numbers`: of sensors.

    Returns:
        The charts of all joints and of the other quantities; and by joint the charts of this joint with its limits.
    """
    whole: list[Chart] = []
    joints: dict[str, dict[str, tuple[str, str]]] = {}
    for table in (*playback.curves(), *numbers):
        by_unit: dict[str, list[str]] = {}
        for k, (column, unit) in enumerate(zip(table.columns, table.units, strict=True)):
            path = _path(table, column)
            _log_curve(to, path, table, k, lines)
            by_unit.setdefault(unit, []).append(path)
            if table.name.startswith(JOINT):
                joints.setdefault(column, {})[table.name.removeprefix(JOINT)] = path, unit
        whole += (Chart(f"{table.name} [{unit}]", tuple(paths)) for unit, paths in by_unit.items())
    margins = [
        PlotTable("margins", (margin.outcome.name,), ("",), margin.times, margin.relative[:, None])
        for margin in playback.margins
    ]
    for table in margins:
        _log_curve(to, _path(table, table.columns[0]), table, 0, lines)
    if margins:
        whole.append(Chart("margins [tolerances]", tuple(_path(table, table.columns[0]) for table in margins)))
    limits = _log_limits(to, playback, lines)
    return tuple(whole), {name: _charts(of, limits.get(name, {})) for name, of in joints.items()}


def _path(table: PlotTable, column: str) -> str:
    import rerun as rr

    if table.name.startswith(JOINT):
        return f"/joints/{rr.escape_entity_path_part(column)}/{table.name.removeprefix(JOINT)}"
    # A pair in contact as two parts, and no spaces: an escaped path is hard to read.
    parts = [table.name.replace(" ", "_"), *column.split(" – ")]
    return "/".join(["/curves", *map(rr.escape_entity_path_part, parts)])


def _log_curve(to: rr.RecordingStream, path: str, table: PlotTable, k: int, lines: Timelines) -> None:
    import rerun as rr

    kept = corners(table.values[:, k])
    to.send_columns(path, lines.columns(table.times[kept]), rr.Scalars.columns(scalars=table.values[kept, k]))
    reference = table.name == "joint reference"
    name = f"{table.columns[k]} reference" if reference else table.columns[k]
    style = rr.SeriesLines(names=name, widths=0.8) if reference else rr.SeriesLines(names=name)
    to.log(path, style, static=True)


def corners(values: Array) -> np.ndarray:
    """Indices of (T,) values without those between two equal ones: the line through them is the same."""
    same = (values[1:] == values[:-1]) | (np.isnan(values[1:]) & np.isnan(values[:-1]))
    return np.flatnonzero(~(np.concatenate([[False], same]) & np.concatenate([same, [False]])))


def _log_limits(to: rr.RecordingStream, playback: Playback, lines: Timelines) -> dict[str, dict[str, str]]:
    """Limits as lines from the start to the end: their entities by joint and quantity."""
    import rerun as rr

    found: dict[str, dict[str, str]] = {}
    ends = lines.columns([playback.start, playback.end] if playback.end > playback.start else [playback.start])
    for joint in playback.robot.joints if playback.robot is not None else ():
        if joint.name not in playback.joint_names:
            continue
        limits = joint.limits
        for quantity, values in (
            ("position", [value for value in (limits.lower, limits.upper) if value is not None]),
            ("velocity", [] if limits.velocity is None else [-limits.velocity, limits.velocity]),
            ("effort", [] if limits.effort is None else [-limits.effort, limits.effort]),
        ):
            if not values:
                continue
            path = f"/joints/{rr.escape_entity_path_part(joint.name)}/{quantity}_limits"
            count = 2 if playback.end > playback.start else 1
            columns = rr.Scalars.columns(scalars=values * count).partition([len(values)] * count)
            to.send_columns(path, ends, columns)
            names = [f"{quantity} limit {value:g}" for value in values]
            to.log(path, rr.SeriesLines(names=names, colors=[LIMIT_COLOUR] * len(values)), static=True)
            found.setdefault(joint.name, {})[quantity] = path
    return found


def _charts(of: dict[str, tuple[str, str]], limits: dict[str, str]) -> tuple[Chart, ...]:
    """Position with reference, velocity, effort and error of one joint, with its limits."""
    charts = []
    for quantity, others in (("position", ("reference",)), ("velocity", ()), ("effort", ()), ("error", ())):
        if quantity in of:
            path, unit = of[quantity]
            more = (of[other][0] for other in others if other in of)
            limit = (limits[quantity],) if quantity in limits else ()
            charts.append(Chart(f"{quantity} [{unit}]", (path, *more, *limit)))
    return tuple(charts)
