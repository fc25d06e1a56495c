"""Jointed things in planning: positions of joints, the state with a link moved, the tool's path along a joint.

A hand that holds a link at X_CT keeps it: with the link C at the position q of its joint, the tool is at

    X_WT(q) = X_WC(q) X_CT,   X_WC(q) = X_WP X_PJ motion(axis, q)
"""

from __future__ import annotations

from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform, cross
from manipcli.core.prose import amount
from manipcli.plan.motion import JointGoal, PlanningState
from manipcli.plan.path import ANGULAR_STEP, LINEAR_STEP
from manipcli.plan.planner import Planner
from manipcli.plan.prediction import put
from manipcli.scene.joints import SceneJoint

LEVER: Final = 0.01
"""[m] A tool nearer to the axis of a hinge turns it by a torque, not by a force."""
PLACES: Final = 101
"""Positions at which a joint is examined for whether it stays."""
HALVINGS: Final = 30


def position_of(planner: Planner, state: PlanningState, joint: SceneJoint) -> float:
    """[rad or m] of a joint."""
    return joint.position(planner.body_pose(state, joint.parent), planner.body_pose(state, joint.child))


def link_at(planner: Planner, state: PlanningState, joint: SceneJoint, position: float) -> Transform:
    """X_WC of the link at a position of its joint."""
    return joint.child_pose(planner.body_pose(state, joint.parent), position)


def moved_to(planner: Planner, state: PlanningState, joint: SceneJoint, position: float) -> PlanningState:
    """The state with a joint at another position, and with all that moves with its link."""
    X_WC, there = planner.body_pose(state, joint.child), link_at(planner, state, joint, position)
    shift = there @ X_WC.inverse()
    loads = planner.aboard(state, joint.child)
    return put(planner, state, {joint.child: there, **{name: shift @ planner.body_pose(state, name) for name in loads}})


def along(
    planner: Planner, state: PlanningState, joint: SceneJoint, position: float, X_WT: Transform
) -> tuple[Transform, ...]:
    """Poses of a tool that is now at `X_WT` and holds the link, up to a `position` of the joint; near neighbours."""
    here = position_of(planner, state, joint)
    X_CT = link_at(planner, state, joint, here).inverse() @ X_WT
    arm = tool_twist(planner, state, joint, X_WT)
    far = abs(position - here)
    steps = max(far * float(np.linalg.norm(arm[:3])) / LINEAR_STEP, far * float(np.linalg.norm(arm[3:])) / ANGULAR_STEP)
    shares = np.linspace(0.0, 1.0, max(1, int(np.ceil(steps - 1e-9))) + 1)[1:]
    return (X_WT, *(link_at(planner, state, joint, here + u * (position - here)) @ X_CT for u in shares))


def tool_twist(planner: Planner, state: PlanningState, joint: SceneJoint, X_WT: Transform) -> Array:
    """(6) velocity of the point T and angular velocity, in the world, of what moves with the link at 1 rad/s or m/s."""
    X_WJ = planner.body_pose(state, joint.parent) @ joint.X_PJ
    axis = X_WJ.R @ joint.axis
    if joint.slides:
        return np.concatenate((axis, np.zeros(3)))
    return np.concatenate((cross(axis, X_WT.p - X_WJ.p), axis))


def weight(planner: Planner, state: PlanningState, joint: SceneJoint, position: float) -> float:
    """[N m or N] The effort at a joint, at a position, by the weight of its link and of what is in it or on it."""
    moved = moved_to(planner, state, joint, position)
    effort = 0.0
    for name in (joint.child, *planner.aboard(state, joint.child)):
        body = planner.scene.body(name)
        middle = planner.body_pose(moved, name) @ body.X_OI
        effort += body.mass * float(planner.scene.gravity @ tool_twist(planner, moved, joint, middle)[:3])
    return effort


def needed(joint: SceneJoint, position: float, speed: float, weight: float = 0.0) -> float:
    """[N m or N] The effort that moves a joint at a constant `speed`, besides an effort by weight, at a position."""
    return float(np.sign(speed)) * joint.friction - joint.passive_effort(position, speed) - weight


def does_not_stay(planner: Planner, state: PlanningState, joint: SceneJoint, goal: JointGoal) -> str:
    """Why a joint leaves a goal when the hand lets go: spring and weight exceed its friction; "" where it stays."""

    def drive(position: float) -> float:
        return joint.passive_effort(position) + weight(planner, state, joint, position)

    there = drive(goal.position)
    sense = float(np.sign(there))
    off = goal.position + sense * goal.within
    if sense == goal.side or not joint.lower < off < joint.upper:
        return ""
    if min(sense * there, sense * drive(off)) <= joint.friction:
        return ""
    cause = "spring" if sense * joint.passive_effort(goal.position) > joint.friction else "weight"
    at, unit = amount(goal.position, joint.unit), joint.effort_unit
    on = stays_from(planner, state, joint, goal)
    held = f"; it stays from {amount(on, joint.unit)} on" if on is not None else ""
    return (
        f"'{joint.name}' does not stay at {at} when the hand lets go: its {cause} moves it with "
        f"{amount(abs(there), unit)}, its friction holds {amount(joint.friction, unit)}{held}"
    )


def stays_from(planner: Planner, state: PlanningState, joint: SceneJoint, goal: JointGoal) -> float | None:
    """[rad or m] The next position beyond a goal, on its side, at which the joint stays or moves on; None for none.

    The weight has the effort a cos q + b sin q on a hinge, and a constant one on a slide.
    """
    a = weight(planner, state, joint, 0.0)
    b = 0.0 if joint.slides else weight(planner, state, joint, np.pi / 2.0)

    def back(q: float) -> float:
        by_weight = a if joint.slides else a * np.cos(q) + b * np.sin(q)
        return float(-goal.side * (joint.passive_effort(q) + by_weight)) - joint.friction

    end = joint.upper if goal.side > 0.0 else joint.lower
    if not goal.side or not np.isfinite(end):
        return None
    places = np.linspace(goal.position, end, PLACES)
    k = next((k for k, q in enumerate(places) if back(q) <= 0.0), None)
    if k is None:
        return None
    falls, stays = float(places[max(k - 1, 0)]), float(places[k])
    for _ in range(HALVINGS):
        middle = (falls + stays) / 2.0
        falls, stays = (falls, middle) if back(middle) <= 0.0 else (middle, stays)
    return stays


def wrench_of(twist: Array, effort: float) -> Array:
    """(6) [N, N m] What a tool that moves with a `twist` (6) must give for an effort at the joint.

    It is a force along the path; near the axis of a hinge it is a torque about it. Power at the tool is power at the
    joint: wrench . twist = effort.
    """
    lever = float(np.linalg.norm(twist[:3]))
    if lever > LEVER * float(np.linalg.norm(twist[3:])):
        return np.concatenate((effort * twist[:3] / lever**2, np.zeros(3)))
    return np.concatenate((np.zeros(3), effort * twist[3:] / float(twist[3:] @ twist[3:])))
