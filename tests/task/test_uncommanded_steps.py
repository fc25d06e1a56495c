"""What no controller could carry out is told when the files are read, at the step that asks for it."""

from pathlib import Path

import pytest

from manipcli.core.errors import InvalidInput
from manipcli.task.load_task import load_task

ROOT = Path(__file__).parents[2]
ARM = [f"panda_joint{k}" for k in range(1, 8)]
SCENE = "scene:\n  block: {box: {size: [4 cm, 4 cm, 4 cm]}, mass: 50 g, pose: {xyz: [0.5, 0, 0.02]}}\n"


def controllers(*groups: tuple[str, list[str]]) -> str:
    """A controllers file: one controller a group of (type, joints)."""
    text = "controllers:\n"
    for k, (kind, joints) in enumerate(groups):
        gains = ", ".join(f"{name}: {{p: 1}}" for name in joints)
        text += f"  c{k}: {{type: {kind}, joints: [{', '.join(joints)}], gains: {{{gains}}}}}\n"
    return text


def told(tmp_path: Path, claims: str, steps: str, *, robot: Path = ROOT / "robots/panda/robot.yaml") -> list[str]:
    (tmp_path / "controllers.yaml").write_text(claims)
    file = tmp_path / "task.yaml"
    file.write_text(f"task: t\nrobot: {robot}\ncontrollers: controllers.yaml\n{SCENE}steps:\n{steps}")
    try:
        load_task(file, allow_outside=True)
    except InvalidInput as refused:
        return [
            f"{f.code} {f.place.line if f.place else 0} {f.message} | {f.hint}"
            for f in refused.findings
            if not f.code.startswith("TASK31")  # what the hand holds is another matter
        ]
    return []


HAND = ("gripper", ["panda_finger_joint1"])
WHOLE = controllers(("joint_trajectory", ARM), HAND)
SPLIT = controllers(("joint_trajectory", ARM[:3]), ("joint_trajectory", ARM[3:]), HAND)
HANDLESS = controllers(("joint_trajectory", [*ARM, "panda_finger_joint1"]))

ACROSS = [
    "  - move: {to: home}\n",
    "  - move: {to: {panda_joint1: 0.1, panda_joint4: -2.0}}\n",
    "  - move: {pose: {xyz: [0.5, 0, 0.5], rpy: [180 deg, 0, 0]}}\n",
    "  - follow: {joint_names: [panda_joint1, panda_joint7], points: [{positions: [0, 0], time_from_start: 3}]}\n",
    "  - pick: {object: block}\n",
    "  - lift: {object: block}\n",
    "  - pour: {object: block, into: floor}\n",
    "  - place: {object: block}\n",
]
GRASPING = [
    "  - grasp: {}\n",
    "  - release: {}\n",
    "  - pick: {object: block}\n",
    "  - place: {object: block}\n",
]


@pytest.mark.slow
@pytest.mark.parametrize("step", [*ACROSS, *GRASPING, "  - wait: 1 s\n"])
def test_an_arm_and_a_hand_with_a_controller_each_can_do_every_step(tmp_path: Path, step: str) -> None:
    assert told(tmp_path, WHOLE, step) == []


@pytest.mark.slow
@pytest.mark.parametrize("step", ACROSS)
def test_joints_of_two_controllers_are_refused_at_the_step_with_both_names(tmp_path: Path, step: str) -> None:
    (found,) = told(tmp_path, SPLIT, step)
    assert found.startswith("TASK232 7 ")
    assert "(c0)" in found
    assert "(c1)" in found


def test_joints_of_one_of_two_controllers_can_be_moved(tmp_path: Path) -> None:
    assert told(tmp_path, SPLIT, "  - move: {to: {panda_joint1: 0.1, panda_joint3: 0.2}}\n") == []


@pytest.mark.parametrize("step", GRASPING)
def test_a_hand_that_no_gripper_controller_moves_is_refused(tmp_path: Path, step: str) -> None:
    found = told(tmp_path, HANDLESS, step)
    assert found
    for one in found:
        assert one.startswith("TASK232 7 ")
        assert "gripper" in one


def test_a_hand_under_another_type_is_told_with_its_controller(tmp_path: Path) -> None:
    claims = controllers(("joint_trajectory", ARM), ("joint_trajectory", HAND[1]))
    of_pick = told(tmp_path, claims, "  - pick: {object: block}\n")
    assert of_pick
    for found in of_pick:
        assert "controller 'c1' (" in found
        assert "controllers.yaml:3:14) of type `joint_trajectory` | change it to `type: gripper`" in found
    (found,) = told(tmp_path, claims, "  - move: {to: home}\n")
    assert "if one of them moves a hand, change it to `type: gripper`" in found
    mixed = told(tmp_path, HANDLESS, "  - release: {}\n")
    assert "| remove the hand's joints from 'c0', and add a controller of type `gripper`" in mixed[0]


def test_an_arm_under_a_type_that_follows_nothing_is_told_with_its_controller(tmp_path: Path) -> None:
    joints = ", ".join(ARM)
    claims = f"controllers:\n  arm: {{type: forward_command, joints: [{joints}], command_interface: effort}}\n"
    (found,) = told(tmp_path, claims, "  - lift: {object: block}\n")
    assert "'panda_joint1': it belongs to controller 'arm' (" in found
    assert "controllers.yaml:2:15) of type `forward_command` | change the type of 'arm' to `joint_traj" in found


def test_a_trajectory_for_the_joint_of_a_gripper_is_refused(tmp_path: Path) -> None:
    follow = "  - follow: {joint_names: [panda_finger_joint1], points: [{positions: [0.02], time_from_start: 1}]}\n"
    (found,) = told(tmp_path, WHOLE, follow)
    assert "does not follow trajectories" in found
    assert told(tmp_path, HANDLESS, follow) == []


def test_two_gripper_controllers_are_refused_where_a_hand_is_moved_and_only_there(tmp_path: Path) -> None:
    two = controllers(("joint_trajectory", ARM[:6]), ("gripper", [ARM[6]]), HAND)
    (found,) = told(tmp_path, two, "  - move: {to: {panda_joint1: 0.1}}\n  - release: {}\n")
    assert found.startswith("TASK232 8 ")
    assert "'c1', 'c2'" in found


def test_an_arm_without_a_tool_cannot_lead_one_but_can_move_its_joints(tmp_path: Path) -> None:
    robot = tmp_path / "bare.yaml"
    robot.write_text("robot: bare\ndescription: package://pybullet_data/kuka_iiwa/model.urdf\n")
    claims = controllers(("joint_trajectory", [f"lbr_iiwa_joint_{k}" for k in range(1, 8)]))
    steps = "  - move: {to: {lbr_iiwa_joint_1: 0.1}}\n  - move: {pose: {xyz: [0.5, 0, 0.5]}}\n"
    (found,) = told(tmp_path, claims, steps, robot=robot)
    assert found.startswith("TASK232 8 ")
    assert "no tool frame" in found


def test_an_unknown_name_is_not_told_twice(tmp_path: Path) -> None:
    (found,) = told(tmp_path, SPLIT, "  - move: {to: hom}\n")
    assert found.startswith("TASK230")
