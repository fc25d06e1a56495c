"""Hands with one moving jaw: closing pushes the object against the part of the hand that does not move."""

from __future__ import annotations

from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.model.configuration import with_mimics
from manipcli.plan.grasp_contacts import finger_links
from manipcli.plan.hand import moved_links
from manipcli.plan.motion import Grip, PlanningState
from manipcli.plan.planner import ROBOT, Planner
from manipcli.plan.prediction import put

FURTHEST: Final = 0.03
"""[m] An object further from the fixed jaw is not predicted to be pushed there."""
STEP: Final = 5e-4
"""[m] Distance between two examined places of the object."""


def against_jaw(planner: Planner, state: PlanningState, body: str, grip: Grip) -> PlanningState:
    """The state with the object where a hand with one moving jaw pushes it, along the tool's y; else the same state.

    A link of a jointed thing stays: its joint holds it. The object is not rotated, and it slides on what it stands on:
    the real push also depends on friction.
    """
    robot = planner.robot
    if len(finger_links(robot, grip.joints)) != 1 or any(joint.child == body for joint in planner.scene.joints):
        return state
    jaw = {ROBOT + link for link in moved_links(robot, grip.joints)}
    X_WT = planner.tool_pose(state)
    y = X_WT.R[:, 1]
    along = y if float(_closing(planner, state, grip, X_WT.p) @ y) > 0.0 else -y
    X_WO = planner.body_pose(state, body)
    for distance in np.arange(0.0, FURTHEST, STEP):
        there = put(planner, state, {body: Transform.of(xyz=distance * along) @ X_WO})
        hits = planner.grasping(there, body).every(state.position)
        touching = {name for hit in hits for name in (hit.a, hit.b) if name.startswith(ROBOT)}
        if touching - jaw:
            return there
    return state


def _closing(planner: Planner, state: PlanningState, grip: Grip, point: Array) -> Array:
    """(3,) Displacement of the moving jaw at a point of the world, when it closes."""
    robot, kinematics = planner.robot, planner.kinematics
    link = robot.joint(grip.joints[0]).child
    q = np.array(state.position)
    q[list(robot.indices(grip.joints))] += 0.01 * (grip.target - q[list(robot.indices(grip.joints))])
    closed = kinematics.forward(np.asarray(with_mimics(robot, q)), link)
    return np.asarray((closed @ kinematics.forward(state.position, link).inverse()).apply(point) - point)
