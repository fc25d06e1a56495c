"""What the plot of a page shows: curves with their limits, margins of the expectations, and marks."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from manipcli.core.geometry import Array
from manipcli.judge.margin_curves import MarginCurve
from manipcli.model.robot import RobotModel
from manipcli.replay.marks import marks
from manipcli.replay.pack import Json, Pack
from manipcli.replay.playback import Playback, PlotTable

Limit = tuple[float | None, float | None] | None
"""Lower and upper limit, None where there is none; None without either."""
MARGINS = "margins"
"""Name of the table of margins."""
BRIDGED = 3.0
"""Display samples between two known margins that are joined by a line."""


def curves_json(playback: Playback, pack: Pack) -> Json:
    """`curves` and `marks` of the head of a page."""
    tables: list[Json] = [
        {
            "name": table.name,
            "columns": table.columns,
            "units": table.units,
            "limits": limits(table, playback.robot),
            "values": pack.add(table.values, "f"),
        }
        for table in playback.curves()
    ]
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


def _margins(playback: Playback, pack: Pack) -> Json:
    """The margins in their units, and `relative`: divided by the tolerances, which compares those of several units."""
    curves = playback.margins
    sampled_curves = [sampled(curve, playback.times) for curve in curves]
    return {
        "name": MARGINS,
        "columns": [curve.outcome.name for curve in curves],
        "units": [curve.unit or "tolerances" for curve in curves],
        "limits": [(0.0, None)] * len(curves),
        "values": pack.add(np.stack([margins for margins, _ in sampled_curves], axis=1), "f"),
        "relative": pack.add(np.stack([relative for _, relative in sampled_curves], axis=1), "f"),
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
