"""A robot's semantic description (SRDF), as MoveIt reads it: groups, states, end effectors, disabled collisions.

The elements and attributes are those that srdfdom parses.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final
from xml.sax.saxutils import quoteattr

from manipcli.model.normalised_urdf import number
from manipcli.model.robot import Group, RobotModel
from manipcli.model.self_collision import SelfCollisionMatrix

REASONS: Final = {
    "adjacent": "Adjacent",
    "ignored": "User",
    "always": "Always",
    "default": "Default",
    "never": "Never",
}
"""Kind of a pair of links -> why MoveIt does not check it; other kinds are checked."""


def srdf(robot: RobotModel, matrix: SelfCollisionMatrix, *, hand: Sequence[str] = ()) -> str:
    """The SRDF text.

    Args:
        robot: the robot.
        matrix: of its pairs of links.
        hand: joints of hands; joints that do not move the tool count as such, too.
    """
    lines = ['<?xml version="1.0" encoding="utf-8"?>', f"<robot name={quoteattr(robot.name)}>"]
    for group in robot.groups:
        lines += [f"  <group name={quoteattr(group.name)}>", *_members(robot, group), "  </group>"]
    for pose in robot.poses:
        values = dict(zip(pose.joints, pose.positions, strict=True))
        for group in robot.groups:
            own = [name for name in group.joints if name in values]
            if own:
                lines.append(f"  <group_state name={quoteattr(pose.name)} group={quoteattr(group.name)}>")
                lines += [
                    f"    <joint name={quoteattr(name)} value={quoteattr(number(values[name]))}/>" for name in own
                ]
                lines.append("  </group_state>")
    for group in robot.groups:
        if is_end_effector(robot, group, hand):
            lines += _end_effector(robot, group)
    lines.append(
        f'  <virtual_joint name="world_joint" type="fixed" parent_frame="world" child_link={quoteattr(robot.root)}/>'
    )
    lines += [f"  <passive_joint name={quoteattr(name)}/>" for name in robot.following]
    for pair in matrix.pairs:
        reason = REASONS.get(pair.kind)
        if reason is not None:
            ends = f"link1={quoteattr(pair.a)} link2={quoteattr(pair.b)}"
            lines.append(f'  <disable_collisions {ends} reason="{reason}"/>')
    return "\n".join([*lines, "</robot>"]) + "\n"


def is_end_effector(robot: RobotModel, group: Group, hand: Sequence[str]) -> bool:
    """Whether a group is a hand: one of its joints is in `hand`, or none of them moves the tool."""
    if any(name in hand for name in group.joints):
        return True
    if robot.tool is None:
        return False
    return not {*group.joints} & {*_moving(robot, robot.tool.link)}


def _members(robot: RobotModel, group: Group) -> list[str]:
    """The chain from above the first joint to the tip, if it has all joints of the group and no other; else its joints.

    MoveIt's solvers of inverse kinematics need a chain.
    """
    if group.tip is not None:
        base = robot.joint(group.joints[0]).parent
        between = [name for name in _moving(robot, group.tip) if name not in _moving(robot, base)]
        if between == [*group.joints]:
            return [f"    <chain base_link={quoteattr(base)} tip_link={quoteattr(group.tip)}/>"]
    return [f"    <joint name={quoteattr(name)}/>" for name in group.joints]


def _moving(robot: RobotModel, link: str) -> list[str]:
    """The independent joints from the root to a link."""
    by_child = {joint.child: joint for joint in robot.joints}
    found = []
    while link in by_child:
        joint = by_child[link]
        if joint.independent:
            found.append(joint.name)
        link = joint.parent
    return found[::-1]


def _end_effector(robot: RobotModel, hand: Group) -> list[str]:
    """The hand below the nearest group that carries all its joints; nothing without such a group."""
    parents = {robot.joint(name).parent for name in hand.joints}
    carrying = [
        (len(_moving(robot, group.tip)), group)
        for group in robot.groups
        if group is not hand and group.tip is not None and parents <= robot.descendants(group.tip)
        and not {*group.joints} & {*hand.joints}
    ]  # fmt: skip
    if not carrying:
        return []
    _, arm = max(carrying, key=lambda found: found[0])
    assert arm.tip is not None
    names = f"name={quoteattr(hand.name)} parent_link={quoteattr(arm.tip)}"
    return [f"  <end_effector {names} group={quoteattr(hand.name)} parent_group={quoteattr(arm.name)}/>"]
