"""What the plot of a page shows: curves with their limits, margins of the expectations, and marks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

import numpy as np

from manipcli.core.geometry import Array
from manipcli.judge.margin_curves import MarginCurve
from manipcli.model.robot import RobotModel
from manipcli.replay.level_of_detail import Rows, needed_rows, value_errors
from manipcli.replay.marks import marks
from manipcli.replay.pack import LARGEST, Json, Pack
from manipcli.replay.playback import Playback, PlotTable

Limit = tuple[float | None, float | None] | None
"""Lower and upper limit, None where there is none; None without either."""
MARGINS = "margins"
"""Name of the table of margins."""
SHARE = 1.0 / 500.0
"""Largest deviation of a drawn line from the sampled values, as a share of the range of its column."""
MOST = 200_000
"""Most numbers of a table."""
BRIDGED = 3.0
"""Display samples between two known margins that are joined by a line."""


def curves_json(playback: Playback, pack: Pack) -> Json:
    """`curves` and `marks` of the head of a page."""
    tables: list[Json] = []
    for table in playback.curves():
        rows = _rows(playback, table.values)
        tables.append(
            {
                "name": table.name,
                "columns": table.columns,
                "units": table.units,
                "limits": limits(table, playback.robot),
                **_packed(playback, rows, pack, values=table.values),
            }
        )
    if playback.margins:
        tables.append(_margins(playback, pack))
    return {"curves": tables, "marks": [asdict(mark) for mark in marks(playback)]}


def limits(table: PlotTable, robot: RobotModel | None) -> list[Limit]:
    """The limits of each column by the robot's description: of positions, velocities and efforts."""
    joints = {} if robot is None else {joint.name: joint.limits for joint in robot.joints}
    found: list[Limit] = []
    for column in table.columns:
        of = joints.get(column)
        ends: Limit = None
        if of is not None and table.name in ("joint position", "joint reference"):
            ends = of.lower, of.upper
        elif of is not None and table.name in ("joint velocity", "joint effort"):
            most = of.velocity if table.name == "joint velocity" else of.effort
            ends = None if most is None else (-most, most)
        found.append(None if ends == (None, None) else ends)
    return found


def _rows(playback: Playback, values: Array, *, always: Sequence[int] = ()) -> Rows:
    """Rows between which lines deviate by at most `SHARE` of the range of each column (T, c), or by a multiple if
    these were more than `MOST` numbers."""
    share = SHARE
    always = [*always, *(playback.index(end) for gap in playback.gaps for end in gap)]
    values = np.clip(values, -LARGEST, LARGEST)
    while True:
        rows = needed_rows(len(values), value_errors(playback.times, values, share), always=always)
        if rows.size * values.shape[1] <= MOST or share >= 1.0:
            return rows
        share *= 2.0


def _packed(playback: Playback, rows: Rows, pack: Pack, **tables: Array) -> Json:
    """Times and values of the rows, with an unknown row inside each gap."""
    times = playback.times[rows]
    inside = np.searchsorted(times, [(start + end) / 2.0 for start, end in playback.gaps])
    found: Json = {"times": pack.add(np.insert(times, inside, [sum(gap) / 2.0 for gap in playback.gaps]), "f")}
    for name, values in tables.items():
        found[name] = pack.add(np.insert(values[rows], inside, np.nan, axis=0), "f")
    return found


def _margins(playback: Playback, pack: Pack) -> Json:
    """The margins in their units, and `relative`: divided by the tolerances, which compares those of several units."""
    curves = playback.margins
    sampled_curves = [sampled(curve, playback.times) for curve in curves]
    values, relative = (np.stack(columns, axis=1) for columns in zip(*sampled_curves, strict=True))
    deciding = [playback.index(curve.outcome.at) for curve in curves if curve.outcome.at is not None]
    rows = _rows(playback, np.concatenate([values, relative], axis=1), always=deciding)
    return {
        "name": MARGINS,
        "columns": [curve.outcome.name for curve in curves],
        "units": [curve.unit or "tolerances" for curve in curves],
        "limits": [(0.0, None)] * len(curves),
        **_packed(playback, rows, pack, values=values, relative=relative),
        "since": [curve.since if np.isfinite(curve.since) else None for curve in curves],
        "tightest": [_tightest(curve) for curve in curves],
    }


def _tightest(curve: MarginCurve) -> Json | None:
    """The deciding moment of an expectation, in the unit of its curve."""
    outcome = curve.outcome
    value = outcome.margin if curve.unit else outcome.relative
    if outcome.at is None or value is None or outcome.relative is None:
        return None
    return {
        "at": outcome.at,
        "value": value,
        "relative": outcome.relative,
        "met": not outcome.missed,
        "text": outcome.text,
    }


def sampled(curve: MarginCurve, times: Array) -> tuple[Array, Array]:
    """(T,) margins and relative margins at the display times (T,); NaN where none is known nearby.

    Of several margins nearest to one time the least counts, so that no violation is lost between two times.
    """
    at = np.searchsorted((times[1:] + times[:-1]) / 2.0, curve.times)
    found = []
    for values in (curve.margins, curve.relative):
        known = np.isfinite(values)
        least = np.full(len(times), np.inf)
        np.minimum.at(least, at[known], values[known])
        there = np.flatnonzero(np.isfinite(least))
        least[np.isinf(least)] = np.nan
        if len(there) > 1:
            gap = np.diff(there)[np.clip(np.searchsorted(there, np.arange(len(times))) - 1, 0, len(there) - 2)]
            inside = (np.arange(len(times)) > there[0]) & (np.arange(len(times)) < there[-1])
            fill = np.isnan(least) & inside & (gap <= BRIDGED)
            least[fill] = np.interp(times[fill], times[there], least[there])
        found.append(least)
    return found[0], found[1]
