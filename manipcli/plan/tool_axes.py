"""Whether the tool frame lies in the hand as steps take it to: +z out of the hand, y the way in which it closes; and
whether a body fits between the open fingers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.model.configuration import with_mimics
from manipcli.plan.hand import moved_links
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import ROBOT, Planner

ALONG = 0.5
"""Cosine from which on two directions are taken for one."""
ACROSS = 0.7
"""Tangent of the angle from which on two directions are taken for two: the fingers close 35 deg aside of y."""
BEHIND = 0.03
"""[m] A tool frame so far behind the fingers is not between them."""
LEAST = 2e-3
"""[m] Shorter ways have no direction."""
_WRITE = "`tool: {link: ..., pose: {xyz: ..., rpy: ...}}` in the robot file"


def too_wide(planner: Planner, state: PlanningState, body: str, opened: str, poses: Sequence[Transform]) -> str | None:
    """A hint where fingers on both sides of the hand, in its pose `opened`, are in the body wherever the tool is to be.

    Args:
        planner, state: whose robot, and where everything is.
        body: what is to be taken.
        opened: the pose of the hand.
        poses: `X_WT` that are tried.
    """
    robot, q = planner.robot, _posed(planner, state, opened)
    X_WT = planner.solver.forward(q)
    side = {
        ROBOT + link: bool((X_WT.inverse() @ planner.kinematics.forward(q, link)).p[1] > 0.0)
        for link in moved_links(robot, planner.gripper_joints)
    }
    k = [one.name for one in planner.scene.movable].index(body)
    for goal in poses:
        X_WO = X_WT @ goal.inverse() @ state.bodies[k]  # the body brought to the hand, which needs no arm
        there = replace(state, bodies=(*state.bodies[:k], X_WO, *state.bodies[k + 1 :]))
        hits = planner.grasping(there, body).every(q)
        if len({side[name] for hit in hits for name in (hit.a, hit.b) if name in side}) < 2:
            return None
    return f"'{body}' is wider than the hand opens in its pose '{opened}'"


def _posed(planner: Planner, state: PlanningState, posture: str) -> Array:
    """(n) The positions of all joints with the hand in a pose of the robot."""
    robot = planner.robot
    pose, q = robot.pose(posture), np.array(state.position)
    for name, value in zip(pose.joints, pose.positions, strict=True):
        if name in planner.gripper_joints:
            q[robot.indices((name,))] = value
    return np.asarray(with_mimics(robot, q))


def misplaced(planner: Planner, state: PlanningState, opened: str, closed: str) -> str | None:
    """A hint where the tool frame does not look as if it were the hand's; None where it does.

    A guess from the shapes of the fingers, good for a hint alone: with two poses of the hand, `opened` and `closed`,

        o = mean of the fingers - origin of the last link of the arm,    d_k = way of shape k from open to closed

    in the tool frame. o is to point along +z, the d_k along y, and the mean not to lie ahead of the frame.
    """
    robot = planner.robot
    fingers = moved_links(robot, planner.gripper_joints)
    last = robot.joint(planner.solver.joints[-1]).child

    def seen(posture: str) -> tuple[Array, Array]:
        """(k, 3) the fingers' shapes, and (3,) the last link of the arm, in the tool frame."""
        q = _posed(planner, state, posture)
        X_TW = planner.solver.forward(q).inverse()
        shapes = [
            (X_TW @ planner.kinematics.forward(q, link.name) @ shape.X_LS).p
            for link in robot.links
            if link.name in fingers
            for shape in link.collisions
        ]
        return np.array(shapes).reshape(-1, 3), (X_TW @ planner.kinematics.forward(q, last)).p

    before, wrist = seen(opened)
    if not len(before):
        return None
    middle = before.mean(axis=0)
    out = middle - wrist
    length = float(np.linalg.norm(out))
    if length > LEAST and out[2] < ALONG * length:
        where = "back into the hand" if out[2] < -ALONG * length else "aside"
        return f"the tool's +z is to point out of the hand, and seems to point {where}: {_WRITE}"
    if middle[2] > BEHIND:
        where = f"{1000 * middle[2]:.0f} mm behind the fingers"
        return f"the tool frame is to lie between the fingertips, and seems to lie {where}: {_WRITE}"
    ways = seen(closed)[0] - before
    across, along = float(np.linalg.norm(ways[:, 0])), float(np.linalg.norm(ways[:, 1]))
    if across > LEAST and across > ACROSS * along:
        return f"the tool's y is to be the direction in which the fingers close, and seems to be another: {_WRITE}"
    return None
