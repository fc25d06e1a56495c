"""Motions of a robot that holds by an attachment without fingers: a suction cup grips, or lets go."""

from __future__ import annotations

from dataclasses import replace

from manipcli.core.errors import NotPlannable
from manipcli.model.collision import Carried
from manipcli.model.holding import surface
from manipcli.plan.motion import CLOSING, Motion, PlanningState
from manipcli.plan.planner import Pairs, Planner

ATTACHING = 0.1
"""[s] Time that a suction cup takes to grip or to let go."""


def attached(planner: Planner, state: PlanningState, body: str | None, allowed: Pairs) -> tuple[Motion, PlanningState]:
    """The motion that attaches a body to the tool, and the state after it.

    Raises:
        NotPlannable: the tool is too far from the body.
    """
    holding = planner.robot.holding
    if body is None or holding is None:
        raise NotPlannable("no object to attach to the tool", hint="name it: `grasp: {object: ...}`")
    X_WO, X_WT = planner.body_pose(state, body), planner.tool_pose(state)
    missed = holding.missed(surface(planner.scene.body(body), X_WO, X_WT), body)
    if missed:
        raise NotPlannable(f"{CLOSING}: {missed}", hint="move the tool to the object first")
    X_LW = planner.kinematics.forward(state.position, planner.tool_link).inverse()
    carried = Carried(body=body, link=planner.tool_link, X_LO=X_LW @ X_WO)
    allowed |= planner.hand_contacts(body)
    motion = Motion(CLOSING, None, None, ATTACHING, begins=state, allowed=allowed, takes=body)
    return motion, replace(state, carried=carried, closed=True)


def freed(state: PlanningState) -> tuple[Motion, PlanningState]:
    """The motion that frees what is attached to the tool, and the state after it."""
    return Motion("open", None, None, ATTACHING, begins=state, lets_go=True), replace(state, carried=None, closed=False)
