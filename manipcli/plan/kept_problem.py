"""Path problems whose configurations keep constraints: projection, and edges examined at small steps.

A configuration is projected by Newton steps on its least margin m(q), dq = (target - m) grad m / |grad m|^2, with the
gradient by differences. A part of the margin is kept in reserve for the smooth curve through the waypoints.
Source: Berenson, Srinivasa, Ferguson and Kuffner, "Manipulation planning on constraint manifolds" (ICRA 2009).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.plan.path_planner import PathProblem

ROUNDING: Final = 1e-6
"""Margins [m or rad] above the negative of this are kept."""
STEP: Final = 0.02
"""[rad or m] Of the joint that moves most, between examined configurations."""
LONGEST: Final = 0.3
"""[rad or m] Step of the trees: longer edges leave the constraint."""
_RESERVE: Final = 0.004  # rad or m of margin along edges: for the curve between waypoints
_DIFFERENCE: Final = 1e-6
_NEWTON: Final = 20

Margin = Callable[[Array], Array]
"""(k, n) configurations to the least margin (k) [rad or m] of all constraints at each."""


def kept_problem(problem: PathProblem, margin: Margin) -> PathProblem:
    """The problem with the constraints of `margin`; start and goals may use the reserve."""
    ends = np.vstack((problem.start, problem.goals))
    reserve = max(min(_RESERVE, 0.5 * float(margin(ends).min())), 0.0)

    def project(q: Array) -> Array | None:
        return projected(margin, q, reserve)

    def edge(a: Array, b: Array) -> bool:
        return bool(margin(between(a, b, STEP)).min() >= reserve - ROUNDING) and problem.edge(a, b)

    def valid(q: Array) -> bool:
        return bool(margin(q[None])[0] >= reserve - ROUNDING) and problem.valid(q)

    return replace(problem, valid=valid, edge=edge, project=project)


def projected(margin: Margin, q: Array, least: float) -> Array | None:
    """The configuration near `q` (m) whose margin is at least `least`; None if Newton's method finds none."""
    q = np.array(q)
    for _ in range(_NEWTON):
        around = np.vstack((q, q + _DIFFERENCE * np.eye(len(q))))
        values = margin(around)
        if values[0] >= least:
            return q
        slope = (values[1:] - values[0]) / _DIFFERENCE
        square = float(slope @ slope)
        if square < 1e-12:
            return None
        q = q + (1.05 * (least - values[0]) + ROUNDING) / square * slope
    return None


def between(a: Array, b: Array, step: float) -> Array:
    """(k, m) from a to b, both included, in steps of at most `step` of the joint that moves most."""
    count = max(1, int(np.ceil(float(np.max(np.abs(b - a))) / step)))
    return np.asarray(a + np.linspace(0.0, 1.0, count + 1)[:, None] * (b - a))
