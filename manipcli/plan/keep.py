"""Contract of constraints on the motions of a step (`keep:` in task files).

A constraint bounds configurations, the timing, or both. For configurations it gives a margin, from which the check of a
motion, the projection of a configuration and the search of a path follow; for the timing a `TimingBound`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.plan.kept_problem import ROUNDING
from manipcli.plan.motion import PlanningState
from manipcli.plan.path_dynamics import PathDynamics
from manipcli.plan.planner import Planner
from manipcli.plan.timing_bound import TimingBound
from manipcli.spec.keep import KeepSpec

POURING = frozenset({"tilt", "dose", "tilt back"})
"""Labels of the motions that tilt a container."""
RESERVE = 0.002
"""[m] Of a margin that is a length."""
NEAR = frozenset({"approach", "lower", "withdraw"})
"""Labels of the motions next to an object or its place."""


@dataclass(frozen=True, slots=True)
class Kept:
    """A constraint in one planning state.

    Attributes:
        name: the key in task files.
        margin: positions (k, n) of all joints -> (k) [rad or m], negative where it is violated; None for a constraint
            on the timing alone.
        text: (n) -> what is violated, with the amount.
        bound: on the timing of the joints of these dynamics; None for a constraint on configurations alone.
        exempt: labels of motions that it does not apply to.
        derived: not written by the user: it applies only to motions whose end keeps it.
        reserve: [rad or m] of the margin that chosen paths leave to the run, whose tracking is not exact.
    """

    name: str
    margin: Callable[[Array], Array] | None = None
    text: Callable[[Array], str] = lambda _: ""
    bound: Callable[[PathDynamics], TimingBound] | None = None
    exempt: frozenset[str] = frozenset()
    derived: bool = False
    reserve: float = 0.0


@dataclass(frozen=True, slots=True)
class KeepMember:
    """A member of the seam.

    Attributes:
        name: the key in task files.
        open: (spec, planner, state) -> the constraint; None where the spec has none, or where it says nothing in this
            state (nothing is held).
        clause: (spec) -> the constraint in English; called only where the spec has it.
    """

    name: str
    open: Callable[[KeepSpec, Planner, PlanningState], Kept | None]
    clause: Callable[[KeepSpec], str]


def reserving(keeps: tuple[Kept, ...], start: Array, end: Array) -> tuple[Kept, ...]:
    """The constraints for a path from `start` to `end` (n), tighter by their reserves.

    Where an end leaves less margin, the reserve is half of what it leaves.
    """
    return tuple(_reserving(kept, np.stack((start, end))) for kept in keeps)


def _reserving(kept: Kept, ends: Array) -> Kept:
    margin = kept.margin
    if margin is None or kept.reserve <= 0.0:
        return kept
    reserve = min(kept.reserve, 0.5 * float(margin(ends).min()))
    if reserve <= 0.0:
        return kept
    return replace(kept, margin=lambda q: margin(q) - reserve, reserve=0.0)


def margins(keeps: tuple[Kept, ...], q: Array) -> Array:
    """(k) the least margin [rad or m] of all constraints at positions (k, n); infinite without any."""
    found = [kept.margin(q) for kept in keeps if kept.margin is not None]
    return np.asarray(np.min(found, axis=0)) if found else np.full(len(q), np.inf)


def refuse_unkept(keeps: tuple[Kept, ...], times: Array, q: Array) -> None:
    """Check all positions (k, n) of a motion.

    Raises:
        NotPlannable: names the constraint, the largest violation and its time.
    """
    for kept in keeps:
        if kept.margin is None:
            continue
        margin = kept.margin(q)
        k = int(np.argmin(margin))
        if margin[k] < -ROUNDING:
            at_start = margin[0] < -ROUNDING
            k = 0 if at_start else k
            hint = "make the constraint wider" if at_start else "make the constraint wider, or `move` in between"
            when = "at the start" if at_start else f"at t = {times[k]:.3f} s"
            raise NotPlannable(f"{kept.text(q[k])} {when}", hint=hint, reason="constraint")
