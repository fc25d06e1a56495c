from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from manipcli.core.geometry import Transform
from manipcli.description.elements import Mimic
from manipcli.model.robot import RobotModel, Tool
from manipcli.plan.claimed_joints import arm_joints

ARM = tuple(f"joint_{k}" for k in range(1, 8))
FINGERS = ("finger_left_joint", "finger_right_joint")


@pytest.mark.parametrize(
    ("link", "hand", "expected"),
    [
        ("link_7", FINGERS, ARM),
        ("link_3", FINGERS, ARM[:3]),
        ("base", FINGERS, ()),
        ("finger_left", FINGERS, ARM),
        ("finger_left", (), (*ARM, FINGERS[0])),
        ("finger_left", (FINGERS[0], "joint_7"), ARM[:6]),
    ],
)
def test_the_arm_moves_the_tool_without_the_hand(
    make_arm7: Callable[..., RobotModel], link: str, hand: tuple[str, ...], expected: tuple[str, ...]
) -> None:
    """A tool in a fingertip is moved by the finger, too, which the arm leaves to the hand."""
    robot = replace(make_arm7(), tool=Tool(link, Transform.identity()))
    assert arm_joints(robot, hand) == expected


def test_what_follows_another_joint_is_no_joint_of_the_arm(make_arm7: Callable[..., RobotModel]) -> None:
    robot = make_arm7()
    joints = tuple(replace(one, mimic=Mimic("joint_1")) if one.name == "joint_4" else one for one in robot.joints)
    robot = replace(robot, joints=joints, tool=Tool("link_7", Transform.identity()))
    assert arm_joints(robot, FINGERS) == tuple(name for name in ARM if name != "joint_4")
    assert arm_joints(replace(robot, tool=None), FINGERS) == ()
