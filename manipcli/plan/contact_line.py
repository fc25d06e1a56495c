"""The line on which the tool meets a body: how fast, and from where."""

from __future__ import annotations

from typing import Final

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.plan.arm_force import leverage
from manipcli.plan.motion import PlanningState
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.planner import Planner
from manipcli.plan.pose_error import pointed

HOVER: Final = 0.005
"""[m] Gap between the hand, or what it holds, and a body along which it moves: above the clearance."""
CLOSE: Final = 0.0025
"""[m] Gap from which the hand approaches slowly: more than its controllers deviate."""
FAR: Final = 0.08
"""[m] Distance of the tool's origin from the point, from which the hand comes straight on."""
SEEN: Final = 0.2
"""[m] Greatest gap that is measured."""
ADVANCES: Final = 40
"""Steps to the gap; each is as long as the gap is at least."""
FASTEST: Final = 0.05
"""[m/s]"""
SLOWEST: Final = 0.0005
"""[m/s]"""


def effective_mass(planner: Planner, q: Array, axis: Array) -> float:
    """1 / (a^T J M^-1 J^T a) [kg]: the inertia that the arm has at the tool along the unit vector a, `axis` (3,)."""
    columns = list(planner.solver.columns)
    along = leverage(planner, q, np.append(axis, np.zeros(3)))
    mobility = along @ np.linalg.solve(planner.kinematics.mass_matrix(q)[np.ix_(columns, columns)], along)
    return 1.0 / max(float(mobility), 1e-9)


def approach_speed(force: float, mass: float, period: float) -> float:
    """[m/s] at which an impact of a `mass` [kg] that lasts one control `period` [s] has this `force` [N]: F t / m."""
    return min(max(force * period / mass, SLOWEST), FASTEST)


def gap(planner: Planner, state: PlanningState, body: str) -> float:
    """[m] from the robot, or what the hand holds, to the body; at most `SEEN`."""
    hits = list(planner.grasping(state, body, margin=SEEN).every(state.position))
    if state.carried is not None:
        held = planner.checker.at(state.bodies, carried=state.carried, margin=SEEN).every(state.position)
        hits += [hit for hit in held if {hit.a, hit.b} == {state.carried.body, body}]
    return min((hit.distance for hit in hits), default=SEEN)


def hover(
    builder: MotionBuilder,
    planner: Planner,
    body: str,
    point: Array,
    axis: Array,
    *,
    speed: float,
    left: float = HOVER,
) -> Transform:
    """Move the tool before a body, its z axis along `axis`, and on to a gap; X_WT there.

    Args:
        builder: of the step.
        planner: of the step.
        body: to be touched.
        point: (3,) in the world, on the line on which the tool's origin moves.
        axis: (3,) unit vector in the world, from the hand to the body.
        speed: share of the limits.
        left: the gap [m].

    Raises:
        NotPlannable: the tool cannot be there, or its line does not meet the body.
    """
    R = pointed(planner.tool_pose(builder.now).R, axis)
    try:
        builder.reach("above", Transform.of(xyz=point - FAR * axis, R=R), speed=speed, free=True, leaving="spin")
    except NotPlannable as refusal:
        if refusal.reason not in ("reach", "orientation"):
            raise
        raise refusal.but(hint=f"move '{body}' nearer, or press in another `direction`") from refusal
    X_WA = planner.tool_pose(builder.now)
    travel = travel_to(planner, builder.now, body, X_WA, axis, left=left, most=FAR + SEEN / 2.0)
    if travel > 0.0:
        touching = planner.may_touch(builder.now, [body])
        builder.straight("approach", ahead(X_WA, travel, axis), speed=speed, allowed=touching)
    return planner.tool_pose(builder.now)


def travel_to(
    planner: Planner, state: PlanningState, body: str, X_WA: Transform, axis: Array, *, left: float, most: float
) -> float:
    """[m] by which the tool moves from `X_WA` along the axis, at most `most`, until the gap to a body is `left` [m].

    Raises:
        NotPlannable: the hand does not meet the body there, or the arm does not reach so far.
    """
    travel, near = 0.0, gap(planner, state, body)
    for _ in range(ADVANCES):
        if near - left < 1e-4:
            break
        travel += near - left
        if travel > most:
            break
        state = state.moved(planner.solver.solve(ahead(X_WA, travel, axis), state.position, planner.rng))
        near = gap(planner, state, body)
    if near - left >= 1e-3:
        hint = "move along another line, or close the hand before: `move: {to: POSE}`"
        raise NotPlannable(f"the hand does not meet '{body}' on the line of the tool", hint=hint)
    return travel


def ahead(X: Transform, distance: float, axis: Array) -> Transform:
    """A pose that is moved by `distance` [m] along the unit vector `axis` (3,)."""
    return Transform.of(xyz=distance * axis) @ X
