"""Attachments in planning: a suction cup grips or lets go; the forces on an object that an attachment holds."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.model.collision import Carried
from manipcli.model.holding import surface
from manipcli.plan.motion import CLOSING, Motion, PlanningState
from manipcli.plan.planner import Pairs, Planner

MOST: Final = 1e3
"""Largest ratio to the weight that is computed."""
HALVINGS: Final = 40
ATTACHING: Final = 0.1
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


class AttachedForce:
    """The forces on an object that the attachment of the tool holds.

    Args:
        planner, state: the robot with the object.
        centre: (3,) [m] the object's centre of mass in the world.
        mu: coefficient of friction.
    """

    def __init__(self, planner: Planner, state: PlanningState, centre: Array, mu: float) -> None:
        assert planner.robot.holding is not None
        X_WT = planner.tool_pose(state)
        self._holding, self._mu, self._R_TW = planner.robot.holding, mu, X_WT.R.T
        self._arm = self._R_TW @ (centre - X_WT.p)

    def most(self, force: Array, *, beside: Array | None = None) -> float:
        """The largest s, at most `MOST`, for which s `force` (3,) [N] and `beside` (3,) [N] are held.

        What is held is convex, so that bisection finds it.
        """
        extra = np.zeros(3) if beside is None else beside
        low, high = 0.0, MOST
        if not self._holds(extra):
            return 0.0
        if self._holds(high * force + extra):
            return MOST
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            low, high = (middle, high) if self._holds(middle * force + extra) else (low, middle)
        return low

    def _holds(self, force: Array) -> bool:
        """Whether the tool can resist a force (3,) [N] at the centre of mass."""
        f = -self._R_TW @ force
        return self._holding.load(np.concatenate((f, np.cross(self._arm, f))), self._mu).share <= 1.0
