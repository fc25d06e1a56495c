"""The line on which the tool meets a body: how fast, from where, and how hard the arm can press there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.model.motor_limits import EffortLimits
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
    along = _leverage(planner, q, axis)
    mobility = along @ np.linalg.solve(planner.kinematics.mass_matrix(q)[np.ix_(columns, columns)], along)
    return 1.0 / max(float(mobility), 1e-9)


def _leverage(planner: Planner, q: Array, axis: Array) -> Array:
    """J^T a: the effort of each joint of the arm per force of the tool along `axis` (3,)."""
    solver, tool = planner.solver, planner.robot.tool
    J = planner.kinematics.jacobian(q, solver.link, None if tool is None else tool.X_LT)
    return np.asarray(J[:3, list(solver.columns)].T @ axis)


def approach_speed(force: float, mass: float, period: float) -> float:
    """[m/s] at which an impact of a `mass` [kg] that lasts one control `period` [s] has this `force` [N]: F t / m."""
    return min(max(force * period / mass, SLOWEST), FASTEST)


@dataclass(frozen=True, slots=True)
class StrongestForce:
    """The largest force of the tool along an axis, and the joint that limits it; infinite without limits."""

    force: float
    joint: str
    effort: float


def strongest_force(planner: Planner, q: Array, axis: Array) -> StrongestForce:
    """What the arm can press with along `axis` a (3,) at rest: |g(q) + J^T a F| is within the effort of each joint."""
    solver, load = planner.solver, _leverage(planner, q, axis)
    columns = list(solver.columns)
    gravity = np.array(planner.kinematics.gravity(q))[columns]
    limits = EffortLimits.of(planner.robot).least[columns]
    with np.errstate(divide="ignore", invalid="ignore"):
        most = np.where(load == 0.0, np.inf, (limits - np.sign(load) * gravity) / np.abs(load))
    k = int(np.argmin(most))
    return StrongestForce(max(0.0, float(most[k])), solver.joints[k], float(limits[k]))


def refuse_too_strong(planner: Planner, q: Array, axis: Array, force: float) -> None:
    """
    Raises:
        NotPlannable: the arm cannot press with `force` [N] along `axis` (3,); names the joint and what it can give.
    """
    most = strongest_force(planner, q, axis)
    if force <= most.force:
        return
    unit = "N m" if planner.robot.joint(most.joint).type != "prismatic" else "N"
    limit = f"joint '{most.joint}' reaches its limit of {most.effort:g} {unit}"
    message = f"the arm cannot press with {force:g} N here: at {most.force:.3g} N {limit}, after gravity"
    raise NotPlannable(message, hint=f"press with less than {most.force:.3g} N, or where the arm has more leverage")


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
    builder.reach("above", Transform.of(xyz=point - FAR * axis, R=R), speed=speed, free=True, leaving="spin")
    X_WA, state = planner.tool_pose(builder.now), builder.now
    travel, near = 0.0, gap(planner, state, body)
    for _ in range(ADVANCES):
        if near - left < 1e-4:
            break
        travel += near - left
        if travel > FAR + SEEN / 2.0:
            break
        q = planner.solver.solve(_along(X_WA, travel, axis), state.position, planner.rng)
        state = state.moved(q)
        near = gap(planner, state, body)
    if near - left >= 1e-3:
        hint = "set another point under `at`, or close the hand before: `move: {to: POSE}`"
        raise NotPlannable(f"the hand does not meet '{body}' on the line of the tool", hint=hint)
    if travel > 0.0:
        touching = planner.may_touch(builder.now, [body])
        builder.straight("approach", _along(X_WA, travel, axis), speed=speed, allowed=touching)
    return planner.tool_pose(builder.now)


def _along(X: Transform, distance: float, axis: Array) -> Transform:
    return Transform.of(xyz=distance * axis) @ X
