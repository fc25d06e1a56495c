"""Bounds of second order in time as constraints of toppra, evaluated at the grid points of a path."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import ModuleType

import numpy as np

from manipcli.core.geometry import Array
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.timing_bound import Terms, TimingBound

_LEAST = 1e-3  # of the largest speed, at which friction is linearised
_REFINED = 3  # rounds with viscous friction: each linearises it at the speeds of the one before


class Bounded:
    """Bounds along one path."""

    def __init__(
        self,
        spline: Callable[..., Array],
        grid: Array,
        limits: MotionLimits,
        bounds: Sequence[TimingBound],
    ) -> None:
        """
        Args:
            spline: (s, order) -> the path and its derivatives, (k, n).
            grid: (k) values of s.
            limits: of the joints, for the largest speed along the path.
            bounds: may be empty.
        """
        self._terms: list[Terms] = []
        self._rubs: list[Array | None] = []
        self.rounds = 1
        """How often the path is timed."""
        if not bounds:
            return
        path = spline(grid), spline(grid, 1), spline(grid, 2)
        self._most = np.min(limits.velocity / np.maximum(np.abs(path[1]), 1e-9), axis=1)
        self._terms = [bound.terms(*path) for bound in bounds]
        self._rubs = [bound.viscous(path[1]) for bound in bounds]
        if any(rub is not None for rub in self._rubs):
            self.rounds = _REFINED

    def constraints(self, toppra: ModuleType, speeds: Array | None) -> list[object]:
        """For toppra; `speeds` (k): s' of the round before."""
        if not self._terms:
            return []
        at = self._most if speeds is None else np.asarray(speeds)
        made = []
        for terms, rub in zip(self._terms, self._rubs, strict=True):
            made.append(_constraint(toppra, terms if rub is None else _rubbing(terms, rub, at, self._most)))
        return made


def _rubbing(terms: Terms, rub: Array, speeds: Array, most: Array) -> Terms:
    """With viscous friction, `rub` (k, m) times s'.

    s' is the root of x = s'^2: below its tangent at `speeds` (k), and above its chord from 0 to `most` (k).
    """
    against = rub > 0.0
    # A tangent at a speed at which friction takes all that rest leaves, or more, would forbid rest.
    room = np.where(against, -terms.c / np.where(against, rub, 1.0), np.inf).min(axis=1)
    at = np.clip(speeds, np.minimum(_LEAST * most, room), room)[:, None]
    slope = np.where(against, rub / (2.0 * at), rub / most[:, None])
    return Terms(terms.a, terms.b + slope, terms.c + np.where(against, 0.5 * rub * at, 0.0))


def _constraint(toppra: ModuleType, terms: Terms) -> object:
    """a s'' + b s'^2 + c <= 0, at both ends of each interval between grid points."""
    linear = toppra.constraint.linear_constraint
    base = linear.LinearConstraint
    m = terms.a.shape[1]

    def params(self: object, path: object, grid: Array, *_: object) -> object:
        return linear.canlinear_colloc_to_interpolate(*terms, np.eye(m), np.zeros(m), None, None, grid, identical=True)

    made = type("Bound", (base,), {"compute_constraint_params": params})()
    made.identical = True
    made.set_discretization_type(toppra.constraint.DiscretizationType.Interpolation)
    return made
