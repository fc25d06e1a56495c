"""Cost of a plan, to compare whole plans of a task; everything in seconds.

    cost = duration
         + CLEARANCE_WEIGHT   (1 - min(d, ROOM) / ROOM)              per step; d: clearance of its free motions [m]
         + LIMIT_WEIGHT       (1 - min(l, LIMIT_ROOM) / LIMIT_ROOM)  per step; l: share of a joint's range to its limit
         + SINGULARITY_WEIGHT (1 - min(s, SINGULAR) / SINGULAR)      per step; s: smallest singular value of the tool
         + GRASP_WEIGHT       min(1, 1 / r)                          per grasp; r: weights that it holds (grasp_margin)

Each term but the first is 0 where there is ample room, and its weight at the worst: how many seconds longer a plan may
take that avoids it. Motions are sampled at `SAMPLES` points.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.clearance import least_distance
from manipcli.model.configuration import position_limits, with_joints, with_mimics
from manipcli.plan.grasp_margin import grasp_margin
from manipcli.plan.motion import Motion, StepPlan
from manipcli.plan.planner import Planner

CLEARANCE_WEIGHT: Final = 1.0
"""[s] for a step whose free motion comes within the planner's clearance of something."""
ROOM: Final = 0.05
"""[m] More clearance than this is not better."""
LIMIT_WEIGHT: Final = 0.5
"""[s] for a step with a joint at its limit."""
LIMIT_ROOM: Final = 0.1
"""Share of a joint's range: further from its limit than this is not better."""
SINGULARITY_WEIGHT: Final = 0.5
"""[s] for a step with the arm in a singularity."""
SINGULAR: Final = 0.1
"""Smallest singular value of the tool's Jacobian (metres and radians) above which more is not better."""
GRASP_WEIGHT: Final = 5.0
"""[s] for a grasp that holds just the weight; half of it for one that holds two weights."""
SAMPLES: Final = 8
"""Points of a motion that are looked at."""
FREE: Final = frozenset({"move", "reach", "carry", "home"})
"""Labels of motions that keep away from everything; the others are meant to touch or to come near."""


@dataclass(frozen=True, slots=True)
class StepCost:
    """The cost of a step [s], by term."""

    duration: float
    clearance: float = 0.0
    limits: float = 0.0
    singularity: float = 0.0
    grasp: float = 0.0

    @property
    def total(self) -> float:
        """[s]."""
        return self.duration + self.clearance + self.limits + self.singularity + self.grasp


def step_cost(planner: Planner, plan: StepPlan) -> StepCost:
    """The cost of the plan of a step."""
    near, limit, singular = ROOM, LIMIT_ROOM, SINGULAR
    for motion in plan.motions:
        positions = _sampled(planner, motion)
        if positions is None:
            continue
        limit = min(limit, _to_limit(planner, motion, positions))
        if planner.robot.tool is not None:
            singular = min(singular, *(planner.solver.least_singular_value(q) for q in positions))
        if motion.label in FREE:
            near = min(near, _clearance(planner, motion, positions))
    margin = grasp_margin(planner, plan)
    return StepCost(
        duration=plan.duration,
        clearance=CLEARANCE_WEIGHT * (1.0 - max(near, 0.0) / ROOM),
        limits=LIMIT_WEIGHT * (1.0 - limit / LIMIT_ROOM),
        singularity=SINGULARITY_WEIGHT * (1.0 - singular / SINGULAR),
        grasp=0.0 if margin is None else GRASP_WEIGHT * min(1.0, 1.0 / max(margin.ratio, 1.0)),
    )


def _sampled(planner: Planner, motion: Motion) -> Array | None:
    """(k, n) positions of all joints in a motion of the arm; None for any other motion."""
    trajectory = motion.trajectory
    if trajectory is None or motion.begins is None:
        return None
    chosen = np.unique(np.linspace(0, len(trajectory.times) - 1, SAMPLES).round().astype(int))
    q = with_joints(planner.robot, motion.begins.position, trajectory.names, trajectory.positions[chosen])
    return with_mimics(planner.robot, q)


def _clearance(planner: Planner, motion: Motion, positions: Array) -> float:
    """[m] Least distance of the robot, and of what it holds, from everything it must not touch."""
    assert motion.begins is not None  # of a motion with positions
    found = least_distance(planner.query(motion.begins, motion.allowed), positions)
    return ROOM if found is None else found[1].distance


def _to_limit(planner: Planner, motion: Motion, positions: Array) -> float:
    """Least distance of a joint that moves from its limits, as a share of its range; inf without limits."""
    assert motion.trajectory is not None  # of a motion with positions
    names = motion.trajectory.names
    lower, upper = position_limits(planner.robot.joint(name) for name in names)
    width = upper - lower
    arm = positions[:, planner.robot.indices(names)]
    share = np.minimum(arm - lower, upper - arm)[:, np.isfinite(width)] / width[np.isfinite(width)]
    return max(0.0, float(share.min())) if share.size else np.inf
