"""Prediction of a hand that closes on a body: where its fingers stop, and how it then carries the body."""

from __future__ import annotations

from dataclasses import replace

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import frozen
from manipcli.model.collision import Carried
from manipcli.plan.hand import closed_on
from manipcli.plan.motion import CLOSING, Grip, PlanningState
from manipcli.plan.one_jaw import against_jaw
from manipcli.plan.planner import Pairs, Planner
from manipcli.plan.sweep import refuse_collision


def closed_around(
    planner: Planner,
    state: PlanningState,
    body: str,
    grip: Grip,
    posture: str,
    *,
    allowed: Pairs,
    must_hold: bool,
    roomier: str,
) -> PlanningState:
    """The state with the hand closed on a body; each finger stops where its first link touches the body.

    Args:
        planner, state: before.
        body: what it closes on.
        grip: the goal of the hand.
        posture: its name, for messages.
        allowed: pairs of parts that may touch, besides the hand and the body.
        must_hold: whether closing without touching the body is refused.
        roomier: the hint if the fingers are in collision: how to grasp where they have more room.

    Raises:
        NotPlannable: the fingers are in collision, or the hand does not touch the body and `must_hold`.
    """
    robot = planner.robot
    now = against_jaw(planner, state, body, grip)
    closed, touched = closed_on(robot, planner.grasping(now, body), now.position, grip.joints, grip.target)
    if must_hold and not touched:
        raise NotPlannable(
            f"the hand, closed to '{posture}', does not touch '{body}'",
            hint="move the hand to the object first, or close it further",
        )
    stopped = replace(grip, target=frozen(closed[robot.indices(grip.joints)]))
    query = planner.query(state, planner.hand_contacts(body) | allowed)
    try:
        refuse_collision(planner, state, query, CLOSING, None, stopped)
    except NotPlannable as refusal:
        raise refusal.but(hint=roomier or None) from refusal
    X_LW = planner.kinematics.forward(closed, planner.tool_link).inverse()
    carried = Carried(body=body, link=planner.tool_link, X_LO=X_LW @ planner.body_pose(now, body))
    return replace(now.moved(closed), carried=carried, closed=True)
