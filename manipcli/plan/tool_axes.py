"""Plausibility of the tool frame (+z out of the hand, y along the closing direction), and of an object's width."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.model.configuration import with_mimics
from manipcli.plan.hand import moved_links
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import ROBOT, Planner

ALONG = 0.5
"""Two directions with a larger cosine count as the same."""
ACROSS = 0.7
"""Tangent of the largest angle, 35 deg, between the closing direction of the fingers and y."""
BEHIND = 0.03
"""[m] A tool frame further behind the fingers than this is not between them."""
LEAST = 2e-3
"""[m] Shorter displacements have no direction."""
_WRITE = "`tool: {link: ..., pose: {xyz: ..., rpy: ...}}` in the robot file"


def too_wide(planner: Planner, state: PlanningState, body: str, opened: str, poses: Sequence[Transform]) -> str | None:
    """A hint if the body overlaps fingers on both sides of the hand, at its pose `opened`, in every tool pose.

    Args:
        planner, state: the robot, and all poses.
        body: the object to grasp.
        opened: the pose of the hand.
        poses: `X_WT` to check.
    """
    robot, q = planner.robot, _posed(planner, state, opened)
    X_WT = planner.solver.forward(q)
    side = {
        ROBOT + link: bool((X_WT.inverse() @ planner.kinematics.forward(q, link)).p[1] > 0.0)
        for link in moved_links(robot, planner.gripper_joints)
    }
    parts = overlaps(planner, state, body, opened)
    for goal in poses:
        if len({side[name] for name in parts(goal) if name in side}) < 2:
            return None
    return f"open the hand further, `open: POSE`: '{body}' is wider than the hand in its pose '{opened}'"


def overlaps(planner: Planner, state: PlanningState, body: str, opened: str) -> Callable[[Transform], frozenset[str]]:
    """The parts that overlap, `body` among them, by the tool pose X_WT, with the hand at its pose `opened`."""
    q = _posed(planner, state, opened)
    X_WT = planner.solver.forward(q)
    k = [movable.name for movable in planner.scene.movable].index(body)

    def parts(goal: Transform) -> frozenset[str]:
        X_WO = X_WT @ goal.inverse() @ state.bodies[k]  # the body brought to the hand, which needs no arm
        there = replace(state, bodies=(*state.bodies[:k], X_WO, *state.bodies[k + 1 :]))
        return frozenset(name for hit in planner.grasping(there, body).every(q) for name in (hit.a, hit.b))

    return parts


def _posed(planner: Planner, state: PlanningState, posture: str) -> Array:
    """(n) The positions of all joints with the hand in a pose of the robot."""
    robot = planner.robot
    pose, q = robot.pose(posture), np.array(state.position)
    for name, value in zip(pose.joints, pose.positions, strict=True):
        if name in planner.gripper_joints:
            q[robot.indices((name,))] = value
    return np.asarray(with_mimics(robot, q))


def misplaced(planner: Planner, state: PlanningState, opened: str, closed: str) -> str | None:
    """A hint if the tool frame does not look like a hand's, else None.

    A heuristic on the shapes of the fingers, for a hint only: with two poses of the hand, `opened` and `closed`,

        o = mean of the fingers - origin of the last link of the arm,    d_k = displacement of shape k when closing

    in the tool frame, o must point along +z, the d_k along y, and the mean must not lie ahead of the frame.
    """
    robot = planner.robot
    fingers = moved_links(robot, planner.gripper_joints)
    last = robot.joint(planner.solver.joints[-1]).child

    def in_tool_frame(posture: str) -> tuple[Array, Array]:
        """(k, 3) the fingers' shapes, and (3,) the last link of the arm."""
        q = _posed(planner, state, posture)
        X_TW = planner.solver.forward(q).inverse()
        shapes = [
            (X_TW @ planner.kinematics.forward(q, link.name) @ shape.X_LS).p
            for link in robot.links
            if link.name in fingers
            for shape in link.collisions
        ]
        return np.array(shapes).reshape(-1, 3), (X_TW @ planner.kinematics.forward(q, last)).p

    before, wrist = in_tool_frame(opened)
    if not len(before):
        return None
    middle = before.mean(axis=0)
    out = middle - wrist
    length = float(np.linalg.norm(out))
    if length > LEAST and out[2] < ALONG * length:
        where = "back into the hand" if out[2] < -ALONG * length else "sideways"
        return f"point the tool's +z out of the hand (it seems to point {where}): {_WRITE}"
    if middle[2] > BEHIND:
        where = f"{1000 * middle[2]:.0f} mm behind the fingers"
        return f"put the tool frame between the fingertips (it seems to be {where}): {_WRITE}"
    moved = in_tool_frame(closed)[0] - before
    across, along = float(np.linalg.norm(moved[:, 0])), float(np.linalg.norm(moved[:, 1]))
    if across > LEAST and across > ACROSS * along:
        return f"align the tool's y with the direction in which the fingers close (it seems to be another): {_WRITE}"
    return None
