"""What a motion of a step must keep: constraints of the step, those derived from what is held, and torque limits."""

from __future__ import annotations

import numpy as np

from manipcli.core.geometry import Array
from manipcli.plan.keep import Kept, margins
from manipcli.plan.keeps import KEEPS
from manipcli.plan.keeps.upright import derived
from manipcli.plan.kept_problem import ROUNDING
from manipcli.plan.motion import PlanningState
from manipcli.plan.path_dynamics import PathDynamics
from manipcli.plan.planner import Planner
from manipcli.plan.timing_bound import TimingBound
from manipcli.plan.timing_bounds.torque import TorqueBound

_SAMPLES = 50  # of a straight line, at which loads at rest are examined


def keeps_of(planner: Planner, state: PlanningState, label: str) -> tuple[Kept, ...]:
    """Constraints of a motion with this label, from this state; those derived last."""
    found = [member.open(spec, planner, state) for spec in planner.keep for member in KEEPS]
    if not any(kept is not None and kept.name == "upright" for kept in found):
        found.append(derived(planner, state))
    return tuple(kept for kept in found if kept is not None and label not in kept.exempt)


def applying(keeps: tuple[Kept, ...], end: Array) -> tuple[Kept, ...]:
    """Without derived constraints that the end (n) of the motion does not keep: it is meant to."""
    return tuple(kept for kept in keeps if not kept.derived or margins((kept,), end[None])[0] >= -ROUNDING)


def bounds_of(
    planner: Planner, state: PlanningState, names: tuple[str, ...], points: Array, keeps: tuple[Kept, ...]
) -> tuple[TimingBound, ...]:
    """Bounds on the timing along `points` (k, m) of the joints `names`."""
    dynamics = PathDynamics(planner, state, names)
    if len(points) == 2:
        points = np.linspace(points[0], points[1], _SAMPLES)
    torque = TorqueBound(planner.robot, dynamics, names, points)
    stated = tuple(kept.bound(dynamics) for kept in keeps if kept.bound is not None)
    return (torque, *stated) if torque.applies else stated
