"""Parts of a robot as an SRDF states them."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.description.srdf import read_srdf
from manipcli.model.build_robot import build_robot
from manipcli.model.robot import RobotModel
from manipcli.onboard.from_srdf import StatedParts, stated_parts
from manipcli.onboard.robot_entries import group_entries
from manipcli.onboard.writer import plain
from manipcli.spec.robot import RobotSpec
from tests.onboard import small_robots as small
from tests.onboard.test_guesses import built

LINKS = [f"l{k}" for k in range(7)]


def stated(tmp_path: Path, robot: RobotModel, body: str) -> StatedParts:
    path = tmp_path / "r.srdf"
    path.write_text(f'<robot name="r">{body}</robot>')
    return stated_parts(robot, read_srdf(path))


@pytest.mark.parametrize("left_out", ["j_l1", "j_l3", "j_l6"])
def test_the_group_in_the_robot_file_has_the_joints_of_the_srdf(tmp_path: Path, left_out: str) -> None:
    robot = built(tmp_path, small.robot(small.arm(LINKS)))
    own = [joint.name for joint in robot.joints if joint.name != left_out]
    joints = "".join(f'<joint name="{name}"/>' for name in own)
    parts = stated(tmp_path, robot, f'<group name="a">{joints}</group>').parts
    groups = {name: plain(entry) for name, entry in group_entries(robot, parts, "a", "hand").items()}
    spec = RobotSpec.model_validate({"robot": "r", "description": str(tmp_path / "small.urdf"), "groups": groups})
    read_back = build_robot(spec, file=tmp_path / "robot.yaml")[0]
    assert list(read_back.groups[0].joints) == own


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_hand_gets_the_arm_that_carries_it(tmp_path: Path, side: str) -> None:
    """Two equal arms, one with a hand; its end effector states its parent link alone."""
    arms = {side: [f"{side}{k}" for k in range(7)] for side in ("left", "right")}
    ends = {"left": arms["left"][6], "right": arms["right"][6]}
    joints = "".join(
        f'<joint name="to_{own}" type="fixed"><parent link="body"/><child link="{names[0]}"/>'
        f'<origin xyz="0 {y} 0"/></joint>'
        for (own, names), y in zip(arms.items(), (0.5, -0.5), strict=True)
    )
    hand = (small.palm("p", parent=ends[side]), small.gripper("p", names=("one", "two")))
    robot = built(tmp_path, small.robot(['<link name="body"/>', joints], *map(small.arm, arms.values()), *hand))
    groups = "".join(
        f'<group name="{own}"><chain base_link="{names[0]}" tip_link="{names[6]}"/></group>'
        for own, names in arms.items()
    )
    effector = '<group name="hand"><joint name="slide_one"/><joint name="slide_two"/></group>'
    effector += '<end_effector name="e" parent_link="p" group="hand"/>'
    found = stated(tmp_path, robot, groups + effector)
    assert found.arm_name == side
    assert found.parts.arm is not None
    assert found.parts.arm.tip == "p"


def test_groups_that_contain_each_other_have_the_joints_of_both(tmp_path: Path) -> None:
    robot = built(tmp_path, small.robot(small.palm("p"), small.gripper("p")))
    first, second = (joint.name for joint in robot.joints if joint.independent)
    groups = f'<group name="a"><joint name="{first}"/><group name="b"/></group>'
    groups += f'<group name="b"><joint name="{second}"/><group name="a"/></group>'
    hand = stated(tmp_path, robot, f'{groups}<end_effector name="e" parent_link="p" group="a"/>').parts.hand
    assert hand is not None
    assert set(hand.joints) == {first, second}
