"""Hands in planning: which joints form a finger, and where the fingers stop on an object."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, frozen
from manipcli.model.collision import Carried, CollisionQuery
from manipcli.model.configuration import with_mimics
from manipcli.model.robot import RobotModel

STEPS = 40
"""Number of steps of a closing hand at which contact is checked."""
SPEED = 1.0
"""Default speed of a hand's references [rad/s or m/s]."""
PRESSES = 1e-3
"""[m] A finger that is deeper than this in the object to release still presses on it."""


def fingers(robot: RobotModel, joints: Sequence[str]) -> tuple[tuple[int, ...], ...]:
    """Indices into the `joints` of a hand, by finger: joints below the same first joint form a finger."""
    mover = {joint.child: joint for joint in robot.joints}
    found: dict[str, list[int]] = {}
    for k, name in enumerate(joints):
        first, link = name, robot.joint(name).parent
        while link in mover:
            if mover[link].name in joints:
                first = mover[link].name
            link = mover[link].parent
        found.setdefault(first, []).append(k)
    return tuple(tuple(finger) for finger in found.values())


def handless(robot: RobotModel, posture: str) -> bool:
    """Whether the robot holds without fingers: by suction, or by a weld without this pose of a hand."""
    holding = robot.holding
    if holding is None or holding.kind == "suction":
        return holding is not None
    return posture in ("open", "closed") and posture not in {pose.name for pose in robot.poses}


def posture_values(robot: RobotModel, name: str) -> dict[str, float]:
    """The joint values of a pose of the hand; none for a robot that holds without fingers."""
    if handless(robot, name):
        return {}
    pose = robot.pose(name)
    return dict(zip(pose.joints, pose.positions, strict=True))


def closing_speed(robot: RobotModel, joints: Sequence[str], stated: float | None) -> float:
    """Speed of a hand's references [rad/s or m/s]: as stated, else at most the least velocity limit of its joints."""
    if stated is not None:
        return stated
    limits = (robot.joint(name).limits.velocity for name in joints)
    return min([SPEED, *(limit for limit in limits if limit)])


def moved_links(robot: RobotModel, joints: Sequence[str]) -> frozenset[str]:
    """The links below `joints` and below those that mimic them."""
    driven = set(joints) | {joint.name for joint in robot.joints if joint.mimic and joint.mimic.joint in joints}
    return frozenset().union(*(robot.descendants(robot.joint(name).child) for name in driven))


def ramp(here: Array, target: Array, distance: Array) -> Array:
    """(k, m): every joint moved from `here` towards `target` (m) by at most `distance` (k) [rad or m].

    This is how a gripper controller moves its references: all joints at one speed, the nearest arrives first.
    """
    delta = target - here
    return np.asarray(here + np.clip(delta, -distance[:, None], distance[:, None]))


def closed_on(
    robot: RobotModel, query: CollisionQuery, q: Array, joints: tuple[str, ...], target: Array
) -> tuple[Array, frozenset[str]]:
    """Where the hand stops when each finger closes towards `target` until one of its links touches.

    Args:
        robot: whose hand it is.
        query: checks the hand against the object, and nothing else.
        q: (n) all moving joints, the hand open.
        joints: (m) of the hand.
        target: (m) position of a hand that closes on nothing.

    Returns:
        (n) the predicted position, and the links that touch there, as `robot/<link>`.
    """
    columns = robot.indices(joints)
    parts = fingers(robot, joints)
    links = [{f"robot/{link}" for link in moved_links(robot, [joints[j] for j in finger])} for finger in parts]
    moving = np.ones(len(joints), dtype=bool)
    here = q[columns]
    position = np.array(q)
    touched: set[str] = set()
    for distance in np.linspace(0.0, float(np.max(np.abs(target - here))), STEPS + 1)[:, None]:
        reference = ramp(here, target, distance)[0]
        position[columns] = np.where(moving, reference, position[columns])
        position = np.array(with_mimics(robot, position))
        if not query.touches(position):
            continue
        names = {name for hit in query.every(position) for name in (hit.a, hit.b)}
        for finger, own in zip(parts, links, strict=True):
            if own & names:
                moving[list(finger)] = False
                touched |= own & names
        if not moving.any():
            break
    return frozen(position), frozenset(touched)


def pressing(robot: RobotModel, query: CollisionQuery, q: Array, joints: Sequence[str]) -> str | None:
    """The deepest part, at `q` (n), of a hand that still holds what the query checks, as `robot/<link>`, else None.

    A hand holds when at least two fingers (or its only one) are deeper than `PRESSES`.
    """
    hits = [hit for hit in query.every(q) if hit.distance < -PRESSES]
    parts = fingers(robot, joints)
    found: list[tuple[float, str]] = []
    for finger in parts:
        own = {f"robot/{link}" for link in moved_links(robot, [joints[j] for j in finger])}
        found += sorted((hit.distance, link) for hit in hits for link in {hit.a, hit.b} & own)[:1]
    return min(found)[1] if found and len(found) >= min(2, len(parts)) else None


def closed_hand(joint: str, carried: Carried | None) -> NotPlannable:
    """The refusal of a motion of a joint of a hand that an earlier step closed."""
    what = "an earlier step closed" if carried is None else f"holds '{carried.body}'"
    hint = f"open the hand with `release`{'' if carried is None else ' or `place`'}"
    return NotPlannable(f"joint '{joint}' belongs to the hand, which {what}", hint=hint)


def no_gripper(posture: str) -> NotPlannable:
    """The refusal of a step that moves the hand to a pose without a gripper controller."""
    return NotPlannable(
        f"pose '{posture}' has no joint that a gripper controller moves",
        hint="add a controller of type `gripper` for the hand's joints to the controllers file",
    )
