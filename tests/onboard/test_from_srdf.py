"""Parts of a robot as an SRDF states them."""

from __future__ import annotations

from pathlib import Path

from manipcli.description.srdf import read_srdf
from manipcli.onboard.from_srdf import stated_parts
from tests.onboard import small_robots as small
from tests.onboard.test_guesses import built


def test_groups_that_contain_each_other_have_the_joints_of_both(tmp_path: Path) -> None:
    robot = built(tmp_path, small.robot(small.palm("p"), small.gripper("p")))
    first, second = (joint.name for joint in robot.joints if joint.independent)
    path = tmp_path / "r.srdf"
    path.write_text(
        f'<robot name="r"><group name="a"><joint name="{first}"/><group name="b"/></group>'
        f'<group name="b"><joint name="{second}"/><group name="a"/></group>'
        '<end_effector name="e" parent_link="p" group="a"/></robot>'
    )
    hand = stated_parts(robot, read_srdf(path)).parts.hand
    assert hand is not None
    assert set(hand.joints) == {first, second}
