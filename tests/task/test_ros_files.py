"""Tasks whose controllers file is one of ROS, as it is, and what a robot makes of it.

Numbers in brackets: cases of ros2_control's own tests.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.core.errors import InvalidInput
from manipcli.pipeline import run_task
from manipcli.task.load_task import load_task

ROOT = Path(__file__).parents[2]
JOINTS = [f"joint_{k}" for k in range(1, 8)]
ROS_1 = f"""\
arm7:
  joint_state_controller: {{type: joint_state_controller/JointStateController, publish_rate: 50}}
  arm_controller:
    type: "effort_controllers/JointTrajectoryController"
    joints: [{", ".join(JOINTS)}]
    gains: {{{", ".join(f"{joint}: {{p: 300, d: 18, i: 0, i_clamp: 1}}" for joint in JOINTS)}}}
    constraints: {{goal_time: 5.0, joint_1: {{goal: 0.05, trajectory: 0.05}}}}
"""
ROS_2 = f"""\
/**:
  controller_manager:
    ros__parameters:
      update_rate: 1000
      arm_controller: {{type: joint_trajectory_controller/JointTrajectoryController}}
      joint_state_broadcaster: {{type: joint_state_broadcaster/JointStateBroadcaster}}
      direct: {{type: position_controllers/JointGroupPositionController}}
  arm_controller:
    ros__parameters:
      joints: [{", ".join(JOINTS)}]
      command_interfaces: [position]
      state_interfaces: [position, velocity]
      constraints: {{goal_time: 0.5}}
  direct: {{ros__parameters: {{joints: [{", ".join(JOINTS)}]}}}}
"""


def task_file(tmp_path: Path, controllers: str, steps: str = "  - move: {to: {joint_1: 0.2}}\n") -> Path:
    (tmp_path / "controllers.yaml").write_text(controllers)
    file = tmp_path / "task.yaml"
    file.write_text(
        f"task: t\nrobot: {ROOT}/robots/arm7_hand3/robot.yaml\ncontrollers: controllers.yaml\n"
        f"simulation: {{engine: kinematic}}\nsteps:\n{steps}"
    )
    return file


@pytest.mark.slow
@pytest.mark.parametrize("controllers", [ROS_1, ROS_2], ids=["ROS 1", "ROS 2"])
def test_a_task_runs_with_a_file_of_ros_as_it_is(tmp_path: Path, controllers: str) -> None:
    report = run_task(task_file(tmp_path, controllers), log=tmp_path / "t.mcap", allow_outside=True)
    assert report.verdict.verdict == "passed", report.verdict.text


def errors(tmp_path: Path, controllers: str) -> list[str]:
    try:
        load_task(task_file(tmp_path, controllers, "  - wait: 1 s\n"), allow_outside=True)
    except InvalidInput as refused:
        return [f"{finding} | {finding.hint}" for finding in refused.findings if finding.severity == "error"]
    return []


@pytest.mark.parametrize("interface", ["effort", "velocity"])
def test_a_listing_without_gains_loads_but_would_not_move(tmp_path: Path, interface: str) -> None:
    listing = f"""\
arm_controller:
  type: "{interface}_controllers/JointTrajectoryController"
  joints:
    - joint_1
  constraints:
    goal_time: 5.0
    joint_1:
      goal: 0.05
      trajectory: 0.05
"""
    (line,) = errors(tmp_path, listing)
    assert "controllers.yaml:2:3: error[CTRL103]: controller 'arm_controller': joint 'joint_1' has no gains" in line
    hint = "add `gains: {joint_1: {p: ..., d: ...}}`; `manipcli tune ROBOT CONTROLLERS` proposes them"
    assert f"has no gains; on the {interface} interface it would not move | {hint}" in line
    assert errors(tmp_path, listing + "  gains: {joint_1: {p: 3, d: 0.5}}\n") == []
    (line,) = errors(tmp_path, listing + "  gains: {joint_1: {i_clamp: 1}}\n")
    assert "would not move | give gains.joint_1.p; `manipcli tune" in line
    assert errors(tmp_path, listing.replace(f'"{interface}_', '"position_')) == []


def test_a_hand_on_positions_needs_no_gains(tmp_path: Path) -> None:
    hand = """\
controller_manager:
  ros__parameters:
    arm_controller: {type: joint_trajectory_controller/JointTrajectoryController}
    hand_controller: {type: position_controllers/GripperActionController}
arm_controller: {ros__parameters: {joints: [joint_1], command_interfaces: [position]}}
hand_controller: {ros__parameters: {joint: finger_1_proximal}}
"""
    assert errors(tmp_path, hand) == []
    (line,) = errors(tmp_path, hand.replace("position_controllers", "effort_controllers"))
    assert "controller 'hand_controller': joint 'finger_1_proximal' has no gains; on the effort" in line


def interfaces(command: str, state: str = "position, velocity") -> str:
    return (
        "controller_manager: {ros__parameters: {x: {type: joint_trajectory_controller/JointTrajectoryController}}}\n"
        f"x: {{ros__parameters: {{joints: [joint_1], command_interfaces: [{command}], state_interfaces: [{state}],\n"
        "  gains: {joint_1: {p: 3}}}}\n"
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "command",
    ["position", "position, velocity", "position, velocity, acceleration", "velocity", "effort", "position, effort"],
)
def test_legal_sets_of_command_interfaces(tmp_path: Path, command: str) -> None:  # [64]
    assert errors(tmp_path, interfaces(command)) == []
    assert errors(tmp_path, interfaces(command, "position, velocity, acceleration")) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "command",
    [
        "bad_name",
        "effort, velocity",
        "effort, acceleration",
        "velocity, acceleration",
        "acceleration",
        "position, acceleration",
        "position, position",
    ],
)
def test_sets_of_command_interfaces_that_are_refused(tmp_path: Path, command: str) -> None:  # [64]
    (line,) = errors(tmp_path, interfaces(command))
    assert "controllers.yaml:2:" in line
    assert "command_interfaces" in line or "interface" in line


@pytest.mark.slow
@pytest.mark.parametrize("state", ["", "effort", "velocity", "velocity, acceleration", "acceleration", "bad_name"])
def test_sets_of_state_interfaces_that_are_refused(tmp_path: Path, state: str) -> None:  # [64]
    found = errors(tmp_path, interfaces("position", state))
    assert len(found) == 1, found
    assert "controllers.yaml:2:" in found[0]
    assert "state_interfaces" in found[0] or "state interface" in found[0]


@pytest.mark.slow
@pytest.mark.parametrize("command", ["velocity", "effort", "position, effort"])
@pytest.mark.parametrize("state", ["position", "velocity"])
def test_laws_that_need_position_and_velocity(tmp_path: Path, command: str, state: str) -> None:  # [64]
    assert errors(tmp_path, interfaces(command, state))


@pytest.mark.slow
def test_an_empty_list_of_command_interfaces_is_refused(tmp_path: Path) -> None:  # [64]
    (line,) = errors(tmp_path, interfaces(""))
    assert "controllers.yaml:2:62: error[CTRL206]: x.command_interfaces: expected at least 1 item, got none" in line


def test_an_update_rate_that_does_not_divide_the_control_rate_is_an_error(tmp_path: Path) -> None:  # [63]
    text = ROS_2.replace("state_interfaces:", "update_rate: 300\n      state_interfaces:")
    (line,) = errors(tmp_path, text)
    assert "controllers.yaml:12:20: error[CTRL163]: controller 'arm_controller': update rate 300 Hz" in line
    faster = ROS_2.replace("state_interfaces:", "update_rate: 2000\n      state_interfaces:")
    assert "CTRL163" in errors(tmp_path, faster)[0]
    assert errors(tmp_path, text.replace("300", "250")) == []


def test_a_controller_of_a_vendor_is_named_where_steps_lack_it(tmp_path: Path) -> None:
    vendor = ROS_2.replace("joint_trajectory_controller/JointTrajectoryController", "acme_controllers/Mover")
    with pytest.raises(InvalidInput) as refused:
        load_task(task_file(tmp_path, vendor), allow_outside=True)
    told = [(finding.code, finding.severity) for finding in refused.value.findings]
    assert ("TASK232", "error") in told
    assert told.count(("CTRL214", "warning")) == 1
    (left_out,) = (finding for finding in refused.value.findings if finding.code == "CTRL214")
    assert "'arm_controller': type 'acme_controllers/Mover'" in left_out.message
