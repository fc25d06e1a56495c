"""Guesses about arms and hands: laws that hold whatever the links are called and however the hand is mounted."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manipcli.model.build_robot import build_robot
from manipcli.model.configuration import zero_configuration
from manipcli.model.hand.closure import HandShape, guess_closure
from manipcli.model.hand.parts import RobotParts, guess_parts
from manipcli.model.hand.shape_points import ShapePoints
from manipcli.model.hand.tool_frame import INSIDE, ToolFrame, guess_tool_frame
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.onboard.first_task import TaskSearch
from manipcli.onboard.limits import propose_limits
from manipcli.onboard.onboard import floor_scene
from manipcli.onboard.robot_draft import NOTHING_TO_HOLD_WITH, RobotDraft, draft_robot
from manipcli.onboard.writer import Entry, block
from manipcli.spec.robot import RobotSpec
from tests.onboard import small_robots as small

LINKS = [f"l{k}" for k in range(7)]


def built(tmp_path: Path, text: str) -> RobotModel:
    path = tmp_path / "small.urdf"
    path.write_text(text)
    return build_robot(RobotSpec(robot="small", description=str(path)), file=tmp_path / "robot.yaml")[0]


def parts_of(robot: RobotModel) -> RobotParts:
    kinematics = Kinematics(robot)
    return guess_parts(robot, ShapePoints(kinematics), kinematics)


def tool_of(robot: RobotModel) -> ToolFrame:
    kinematics = Kinematics(robot)
    hand = parts_of(robot).hand
    assert hand is not None
    shape = HandShape(hand, kinematics, ShapePoints(kinematics), zero_configuration(robot))
    return guess_tool_frame(shape, guess_closure(shape), width=0.04)


@settings(max_examples=8, deadline=None)
@given(st.permutations(["gripper", "hand", "base", "tool", "finger_1", "wrist", "link"]), st.booleans())
def test_names_do_not_matter(tmp_path_factory: pytest.TempPathFactory, names: list[str], reversed_: bool) -> None:
    fingers = small.gripper("p", reversed_=reversed_, names=("arm", "shoulder"))
    text = small.robot(small.arm(names), small.palm("p", parent=names[6]), fingers)
    parts = parts_of(built(tmp_path_factory.mktemp("names"), text))
    assert parts.arm is not None
    assert parts.arm.joints == tuple(f"j_{name}" for name in names[1:])
    assert (parts.arm.base, parts.arm.tip) == (names[0], "p")
    assert parts.hand is not None
    assert (parts.hand.palm, set(parts.hand.joints)) == ("p", {"slide_arm", "slide_shoulder"})


def test_an_arm_without_a_hand_has_none(tmp_path: Path) -> None:
    parts = parts_of(built(tmp_path, small.robot(small.arm(LINKS))))
    assert parts.hand is None
    assert parts.arm is not None
    assert (len(parts.arm.joints), parts.arm.tip) == (6, "l6")


def test_a_hand_alone_has_no_arm(tmp_path: Path) -> None:
    parts = parts_of(built(tmp_path, small.robot(small.palm("p"), small.gripper("p"))))
    assert parts.arm is None
    assert parts.hand is not None
    assert len(parts.hand.joints) == 2


@pytest.mark.parametrize("reversed_", [False, True])
def test_the_tool_is_between_the_tips_along_the_closing_direction(tmp_path: Path, reversed_: bool) -> None:
    robot = built(tmp_path, small.robot(small.palm("p"), small.gripper("p", reversed_=reversed_)))
    frame = tool_of(robot)
    assert frame.link == "p"
    assert frame.X_PT.p == pytest.approx([0.02 + small.FINGER - INSIDE, 0.0, 0.0], abs=1e-3)
    assert np.abs(frame.X_PT.R[:, 1]) == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)
    assert frame.X_PT.R[:, 2] == pytest.approx([1.0, 0.0, 0.0], abs=1e-6)
    assert (frame.widest, frame.narrowest) == pytest.approx((small.OPENING, 0.0), abs=1e-3)


def test_curling_fingers_stay_off_what_the_object_stands_on(tmp_path: Path) -> None:
    """Their tips go along circles: 7 mm further out on the way than around a block of 4 cm."""
    frame = tool_of(built(tmp_path, small.robot(small.palm("p"), small.curling("p"))))
    furthest = 0.02 + 0.08  # the fingers stretched, along x
    assert furthest - INSIDE - 1e-3 < frame.X_PT.p[0] < furthest - INSIDE + 2e-3
    assert frame.X_PT.p[1:] == pytest.approx([0.0, 0.0], abs=1e-3)


@pytest.mark.parametrize("reversed_", [False, True])
def test_open_is_where_the_fingers_are_apart(tmp_path: Path, reversed_: bool) -> None:
    robot = built(tmp_path, small.robot(small.palm("p"), small.gripper("p", reversed_=reversed_)))
    draft = draft_robot(robot, floor_scene())
    assert draft.closure is not None
    opened, closed = (0.0, small.OPENING / 2) if reversed_ else (small.OPENING / 2, 0.0)
    assert draft.closure.opened == pytest.approx([opened, opened])
    assert draft.closure.closed == pytest.approx([closed, closed], abs=2e-3)


def test_a_last_joint_beside_which_its_parent_goes_on_is_a_jaw(tmp_path: Path) -> None:
    robot = built(tmp_path, small.robot(small.arm(LINKS), small.fixed("l6", "p"), small.one_jaw("p")))
    draft = draft_robot(robot, floor_scene())
    hand, closure, frame = draft.parts.hand, draft.closure, draft.frame
    assert hand is not None
    assert closure is not None
    assert frame is not None
    assert (hand.palm, hand.joints, "p" in hand.fixed) == ("p", ("turn",), True)
    assert (float(closure.opened[0]), float(closure.closed[0])) == (1.6, 0.0)
    assert frame.X_PT.R[:, 2] == pytest.approx([1.0, 0.0, 0.0], abs=1e-6)
    assert np.abs(frame.X_PT.R[:, 1]) == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)
    # In front of the fixed jaw, whose face is at y = -0.01, by half the block and its distance.
    assert frame.X_PT.p[1] == pytest.approx(-0.01 + 0.02 + 0.006, abs=2e-3)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> RobotDraft:
    """An arm with a hand, whose description has no velocities and efforts of the arm."""
    text = small.robot(
        small.arm(LINKS, limits='velocity="0" effort="0"'), small.palm("p", parent="l6"), small.gripper("p")
    )
    return draft_robot(built(tmp_path_factory.mktemp("whole"), text), floor_scene())


def test_home_is_free_and_inside_the_limits(whole: RobotDraft) -> None:
    assert whole.search is not None
    assert whole.parts.arm is not None
    arm = whole.home[whole.robot.indices(whole.parts.arm.joints)]
    assert np.all(np.abs(arm) < 0.95 * 2.6)
    assert not whole.search.query.touches(whole.home)
    tool = whole.robot.tool
    assert tool is not None
    X_WT = Kinematics(whole.robot).forward(whole.home, tool.link) @ tool.X_LT
    assert X_WT.p[2] > 0.1
    J = Kinematics(whole.robot).jacobian(whole.home, tool.link, tool.X_LT)[
        :, whole.robot.indices(whole.parts.arm.joints)
    ]
    assert np.linalg.svd(J, compute_uv=False)[-1] > 0.02  # not near a singularity


def test_proposed_efforts_hold_the_arm_and_proposed_speeds_are_slow(whole: RobotDraft) -> None:
    kinematics, robot = Kinematics(whole.robot), whole.robot
    assert whole.parts.arm is not None
    rng = np.random.default_rng(3)
    n = len(robot.moving_joints)
    for name in whole.parts.arm.joints:
        limits, k = robot.joint(name).limits, robot.joint_names.index(name)
        assert limits.effort is not None
        assert limits.velocity is not None
        for q in rng.uniform(-1.0, 1.0, (20, n)) * np.array([min(2.6, j.limits.range[1]) for j in robot.moving_joints]):
            assert abs(kinematics.gravity(q)[k]) < limits.effort
            J = kinematics.jacobian(q, "p")
            assert np.linalg.norm(J[:3, k]) * limits.velocity <= 1.05


def test_stated_limits_stay(tmp_path: Path) -> None:
    robot = built(tmp_path, small.robot(small.arm(LINKS)))
    joints = tuple(f"j_{name}" for name in LINKS[1:])
    found = propose_limits(Kinematics(robot), joints, (), dict.fromkeys(joints, 1.0))
    assert {limits.missing for limits in found.values()} == {()}
    assert all(limits.spec.model_fields_set == {"acceleration"} for limits in found.values())


def test_a_flange_without_weight_can_hold_a_tool(tmp_path: Path) -> None:
    robot = built(tmp_path, small.robot(small.arm(LINKS, limits='velocity="2" effort="0"')))
    joints = tuple(f"j_{name}" for name in LINKS[1:])
    found = propose_limits(Kinematics(robot), joints, (), dict.fromkeys(joints, 1.0))
    weight = 9.81 * 0.5 * len(joints)  # of the links that move
    last = found[joints[-1]]
    assert last.spec.effort == pytest.approx(0.05 * weight * 0.1, rel=0.1)
    assert last.evidence.startswith("effort: a load of 5% of the arm's mass, 100 mm from its axis")


def test_fingers_without_shapes_are_told_and_hold_nothing(tmp_path: Path) -> None:
    bare = [re.sub("<collision>.*?</collision>", "", element) for element in small.gripper("p")]
    robot = built(tmp_path, small.robot(small.arm(LINKS), small.palm("p", parent="l6"), bare))
    draft = draft_robot(robot, floor_scene())
    assert draft.closure is not None and draft.frame is not None
    assert not draft.closure.measured
    poses = block(draft.entries["poses"])
    assert poses["open"].check and "no shapes to measure" in poses["open"].why
    assert "mm" not in draft.frame.evidence
    assert any(note.startswith(NOTHING_TO_HOLD_WITH) for note in draft.notes)


def test_the_gap_of_the_fingers_is_told(whole: RobotDraft) -> None:
    assert whole.closure is not None
    assert whole.closure.evidence.startswith("the gap between the fingers is at most 80 mm, at least ")


def test_a_hand_that_does_not_close_gets_a_wider_closed(tmp_path: Path) -> None:
    robot = built(tmp_path, small.robot(small.palm("p"), small.gripper("p")))
    draft = draft_robot(robot, floor_scene())
    written: list[Mapping[str, Entry]] = []
    search = TaskSearch(
        tmp_path,
        draft,
        write_robot=written.append,
        package_path=(),
        allow_outside=False,
        on_progress=lambda _: None,
    )
    assert not search.search().passed  # there are no files: no task passes
    closed = [poses["closed"].value for poses in written if "closed" in poses]
    assert draft.closure is not None
    ends = [0.04 - share * (0.04 - float(draft.closure.closed[0])) for share in (0.75, 0.5)]
    assert closed == [{"hand": pytest.approx([end] * 2, abs=1e-4)} for end in ends]
