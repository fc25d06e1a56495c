"""The hand at the tool frame: its numbers are those of its drawing, and of Pinocchio's reading of the URDF."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from manipcli.core.geometry import Transform
from manipcli.model.build_robot import build_robot
from manipcli.model.hand.tool_hand import ToolHand, tool_hand
from manipcli.model.hand.words import axis_text, opening_text
from manipcli.model.robot import RobotModel, Tool
from manipcli.report.tool_hand import render_text, tool_object
from manipcli.spec.robot import RobotSpec
from tests.onboard import small_robots as small

LINKS = [f"l{k}" for k in range(7)]
OUT_ALONG_Z = Transform.of(xyz=(0.07, 0.0, 0.0), rpy=(0.0, np.pi / 2, 0.0))
"""+z along x of the palm, y along its y: out of the hand of `small.gripper`, between its tips."""


def _built(tmp_path: Path, text: str) -> RobotModel:
    path = tmp_path / "small.urdf"
    path.write_text(text)
    return build_robot(RobotSpec(robot="small", description=str(path)), file=tmp_path / "robot.yaml")[0]


@pytest.fixture
def robot(tmp_path: Path) -> RobotModel:
    parts = small.arm(LINKS), small.palm("p", parent="l6"), small.gripper("p")
    return replace(_built(tmp_path, small.robot(*parts)), tool=Tool("p", OUT_ALONG_Z))


def _hand(robot: RobotModel) -> ToolHand:
    hand = tool_hand(robot)
    assert hand is not None
    return hand


def _poses(robot: RobotModel, q: np.ndarray) -> dict[str, pin.SE3]:
    """Poses of all links as Pinocchio reads them from the URDF."""
    model = pin.buildModelFromXML(robot.urdf)
    data = model.createData()
    theirs = pin.neutral(model)
    for name, value in zip(robot.joint_names, q, strict=True):
        theirs[model.joints[model.getJointId(name)].idx_q] = value
    pin.framesForwardKinematics(model, data, theirs)
    return {link.name: data.oMf[model.getFrameId(link.name)] for link in robot.links}


def test_the_fingers_of_a_gripper_are_as_it_was_drawn(robot: RobotModel) -> None:
    hand = _hand(robot)
    assert hand.stated
    assert (hand.along_y, hand.out_along_z, axis_text(hand)) == (True, True, "y of the tool frame")
    assert {tip.link for tip in hand.tips} == {"left", "right"}
    assert (hand.narrowest, hand.widest) == pytest.approx((0.0, small.OPENING), abs=1e-9)
    # Tips end 10 mm beyond the frame; a finger is 10 mm thick beside the gap.
    tips = hand.tips_at(hand.opened)
    assert tips[:, 2] == pytest.approx([0.02 + small.FINGER - 0.07] * 2, abs=1e-9)
    assert sorted(tips[:, 1]) == pytest.approx([-small.OPENING / 2 - 0.005, small.OPENING / 2 + 0.005], abs=1e-9)


def test_the_gap_changes_as_the_joints_move_the_tips_along_the_axis(robot: RobotModel) -> None:
    hand, rng = _hand(robot), np.random.default_rng(3)
    columns = robot.indices(hand.joints)
    for step in (1e-6, 0.01):
        q = rng.uniform(-0.5, 0.5, len(robot.joint_names))
        q[columns] = rng.uniform(0.01, 0.02, 2)
        there = np.array(q)
        there[columns] += step * np.array([1.0, 0.5])
        apart = [abs(float((tips[0] - tips[1]) @ hand.axis)) for tips in (hand.tips_at(q), hand.tips_at(there))]
        assert hand.gap_at(there) - hand.gap_at(q) == pytest.approx(apart[1] - apart[0], abs=1e-12)
        assert apart[1] - apart[0] == pytest.approx(1.5 * step, abs=1e-12)


def test_tool_and_tips_are_where_pinocchio_has_them(robot: RobotModel) -> None:
    hand, rng = _hand(robot), np.random.default_rng(4)
    for _ in range(3):
        q = rng.uniform(0.0, 0.03, len(robot.joint_names))
        poses = _poses(robot, q)
        X_WT = poses["p"] * pin.SE3(np.array(OUT_ALONG_Z.R), np.array(OUT_ALONG_Z.p))
        assert hand.pose(q).matrix == pytest.approx(X_WT.homogeneous, abs=1e-12)
        expected = [X_WT.inverse().act(poses[tip.link].act(np.array(tip.p_L))) for tip in hand.tips]
        assert hand.tips_at(q) == pytest.approx(np.array(expected), abs=1e-12)


def test_an_axis_that_is_not_y_is_reported_in_the_tool_frame(robot: RobotModel) -> None:
    quarter = Transform.of(rpy=(0.0, 0.0, np.pi / 2))
    hand = _hand(replace(robot, tool=Tool("p", OUT_ALONG_Z @ quarter)))
    assert not hand.along_y
    assert np.abs(hand.axis) == pytest.approx([1.0, 0.0, 0.0], abs=1e-9)
    assert (hand.narrowest, hand.widest) == pytest.approx((0.0, small.OPENING), abs=1e-9)
    assert "not y" in opening_text(hand)
    back = _hand(replace(robot, tool=Tool("p", Transform.of(rpy=(0.0, -np.pi / 2, 0.0)))))
    assert not back.out_along_z
    assert "do not point along +z" in opening_text(back)


def test_without_a_stated_tool_the_frame_is_that_of_init(robot: RobotModel) -> None:
    hand = _hand(replace(robot, tool=None))
    assert not hand.stated
    assert (hand.tool.link, hand.along_y, hand.out_along_z) == ("p", True, True)
    assert hand.tool.X_LT.p == pytest.approx([0.02 + small.FINGER - 0.012, 0.0, 0.0], abs=1e-3)
    assert "measured on the hand, not stated" in render_text(None, hand)
    assert "guessed for a hand without shapes" in render_text(None, replace(hand, measured=False))


def test_of_two_hands_that_of_the_tool_counts(tmp_path: Path) -> None:
    elements = [*small.palm("base")]
    for side in "ab":
        links = [f"{side}_{link}" for link in LINKS]
        elements += [*small.arm(links), *small.fixed("base", links[0]), *small.palm(f"{side}_p", parent=links[-1])]
        elements += small.gripper(f"{side}_p", names=(f"{side}1", f"{side}2"))
    robot = _built(tmp_path, small.robot(elements))
    for side in "ab":
        hand = tool_hand(replace(robot, tool=Tool(f"{side}1", Transform.identity())))
        assert hand is not None
        assert {*hand.joints} == {f"slide_{side}1", f"slide_{side}2"}


def test_a_robot_without_fingers_has_a_tool_only(tmp_path: Path) -> None:
    robot = replace(_built(tmp_path, small.robot(small.arm(LINKS))), tool=Tool("l6", Transform.of(xyz=(0.1, 0, 0))))
    assert tool_hand(robot) is None
    assert render_text(robot.tool, None) == (
        "tool: frame in link 'l6', xyz [100, 0, 0] mm, rpy [0, 0, 0] deg; its +z is the approach direction"
    )
    assert render_text(None, None) == ""
    assert tool_object(None, None) is None
