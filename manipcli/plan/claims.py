"""Which controller commands which joints, and what of a step no controller could carry out.

A trajectory goes to one controller, and so does a goal of the hand: neither can be split. This is known from the files
alone, so it is told before anything is planned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from manipcli.model.condition import Problem
from manipcli.model.robot import RobotModel
from manipcli.spec.controllers_file import ControllersSpec

Loc = tuple[str | int, ...]


@dataclass(frozen=True, slots=True)
class Claim:
    """The joints that one controller commands."""

    controller: str
    joints: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Claims:
    """All controllers of a robot: those that follow trajectories, and those that open and close a hand."""

    followers: tuple[Claim, ...]
    grippers: tuple[Claim, ...]

    @classmethod
    def of(cls, spec: ControllersSpec) -> Claims:
        """Those of a controllers file."""
        named = spec.controllers.items()
        return cls(
            followers=tuple(Claim(name, one.joints) for name, one in named if one.role == "follower"),
            grippers=tuple(Claim(name, one.joints) for name, one in named if one.role == "hand"),
        )

    @property
    def hand(self) -> tuple[str, ...]:
        """The joints that a gripper controller moves."""
        return tuple(name for claim in self.grippers for name in claim.joints)


def arm_joints(robot: RobotModel, hand: Sequence[str]) -> tuple[str, ...]:
    """The independent joints from the root to the tool that are not the hand's; none for a robot without a tool."""
    by_child = {joint.child: joint for joint in robot.joints}
    link = "" if robot.tool is None else robot.tool.link
    found = []
    while link in by_child:
        joint = by_child[link]
        if joint.independent and joint.name not in hand:
            found.append(joint.name)
        link = joint.parent
    return tuple(reversed(found))


def unfollowed(claims: Claims, joints: Sequence[str], loc: Loc) -> tuple[Problem, ...]:
    """Empty if one controller follows trajectories of all these joints."""
    gripped = [name for name in joints if name in claims.hand]
    if gripped:
        message = f"joint '{gripped[0]}' is moved by a gripper controller, which follows no trajectory"
        return (Problem(loc, message, "`move`, `grasp` or `release` move the hand"),)
    owners = [claim for claim in claims.followers if set(joints) & set(claim.joints)]
    if len(owners) < 2:
        return ()
    shares = " and ".join(f"'{_first(joints, claim)}' ({claim.controller})" for claim in owners)
    return (
        Problem(
            loc,
            f"joints of {len(owners)} controllers cannot be moved at once: {shares}",
            "move them one controller after the other, or give them one controller in the controllers file",
        ),
    )


def unmoved_joints(claims: Claims, joints: Sequence[str], loc: Loc) -> tuple[Problem, ...]:
    """Empty if one controller follows trajectories of these joints, and one moves those of them that are the hand's."""
    arm = [name for name in joints if name not in claims.hand]
    return unfollowed(claims, arm, loc) + (_two_hands(claims, loc) if len(arm) < len(joints) else ())


def unmoved_tool(claims: Claims, robot: RobotModel, loc: Loc) -> tuple[Problem, ...]:
    """Empty if the robot has a tool, and one controller follows trajectories of the joints that move it."""
    if robot.tool is None:
        hint = "add `tool: {link: ...}` to the robot file"
        return (Problem(loc, f"robot '{robot.name}' has no tool frame, so there is nothing to lead there", hint),)
    joints = arm_joints(robot, claims.hand)
    if not joints:
        hint = "say another link under `tool` in the robot file"
        return (Problem(loc, f"no joint of robot '{robot.name}' moves its tool at link '{robot.tool.link}'", hint),)
    return unfollowed(claims, joints, loc)


def unmoved_hand(claims: Claims, robot: RobotModel, posture: str, loc: Loc) -> tuple[Problem, ...]:
    """Empty if one gripper controller moves the hand to this pose of the robot."""
    if not set(robot.pose(posture).joints) & set(claims.hand):
        hint = "add a controller of type `gripper` for the hand's joints to the controllers file"
        return (Problem(loc, f"pose '{posture}' has no joint that a gripper controller moves", hint),)
    return _two_hands(claims, loc)


def _two_hands(claims: Claims, loc: Loc) -> tuple[Problem, ...]:
    if len(claims.grippers) < 2:
        return ()
    names = ", ".join(f"'{claim.controller}'" for claim in claims.grippers)
    message = f"a step moves one hand, and {len(claims.grippers)} gripper controllers move joints of hands: {names}"
    return (Problem(loc, message, "give one gripper controller; one of type `joint_trajectory` moves other fingers"),)


def _first(joints: Sequence[str], claim: Claim) -> str:
    return next(name for name in joints if name in claim.joints)
