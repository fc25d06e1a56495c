"""Files of ROS 2 as they are, from the command line: a controllers file, and a FollowJointTrajectory goal as a step."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Pendulum = Callable[..., Path]
RunCli = Callable[..., Any]

CONTROLLERS = """\
/**: {ros__parameters: {gains: {"$(var side)nge": {p: 60, d: 8}}}}
controller_manager:
  ros__parameters:
    arm: {type: joint_trajectory_controller/JointTrajectoryController}
    ft: {type: force_torque_sensor_broadcaster/ForceTorqueSensorBroadcaster}
gz_ros_control: {ros__parameters: {hold_joints: true}}
arm: {ros__parameters: {joints:['$(var side)nge'], command_interfaces: [effort], my_own: 3}}
/**: {ros__parameters: {use_sim_time: true}}
ft: {ros__parameters: {frame_id: label, sensor_name: ft}}
"""
TASK = """\
task: swing
robot: robot.yaml
controllers: controllers.yaml
steps:
  - follow:
      trajectory:
        header: {frame_id: ''}
        joint_names: [hinge]
        points:
          - {positions: [0.1], time_from_start: {sec: 1, nanosec: 0}}
          - {positions: [0.3], velocities: [0.0], time_from_start: {sec: 2, nanosec: 0}}
      multi_dof_trajectory: {header: {}, joint_names: [], points: []}
      path_tolerance: [{name: hinge, position: PATH, velocity: 0.0, acceleration: 0.0}]
      goal_tolerance: [{name: hinge, position: 0.05}]
      goal_time_tolerance: {sec: 1, nanosec: 0}
"""


@pytest.mark.parametrize(("path", "code"), [("0.05", 0), ("0.001", 1)])
def test_files_of_ros_2_run_and_a_goal_has_its_own_tolerances(
    path: str, code: int, pendulum: Pendulum, call_cli: RunCli
) -> None:
    """The controller itself has no tolerance: it would pass either way."""
    folder: Path = pendulum("args: {side: hi}")
    (folder / "controllers.yaml").write_text(CONTROLLERS)
    (folder / "task.yaml").write_text(TASK.replace("PATH", path))
    ran = call_cli("run", "task.yaml", cwd=folder)
    assert ran.code == code, ran.err
    assert ("joint 'hinge' exceeds its path tolerance" in ran.out) == bool(code)
    assert "frame_id 'label' is not a link with a parent in robot 'pendulum': left out" in ran.err


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("{name: hinge, position: 0.05}", "{name: hing, position: 0.05}"), "joint 'hing' is not in the trajectory"),
        (("velocity: 0.0, acc", "velocity: -2.0, acc"), "must be 0 or more, or -1 (not enforced), not -2"),
        (("      multi_dof", "      joint_names: [hinge]\n      multi_dof"), "'joint_names' is given next to"),
        (("points: []", "points: [1]"), "poses of several axes are not supported"),
    ],
)
def test_a_goal_that_is_wrong_is_refused_at_its_place(
    change: tuple[str, str], message: str, pendulum: Pendulum, call_cli: RunCli
) -> None:
    folder = pendulum("args: {side: hi}")
    (folder / "controllers.yaml").write_text(CONTROLLERS)
    (folder / "task.yaml").write_text(TASK.replace("PATH", "0.05").replace(*change))
    ran = call_cli("check", "task.yaml", cwd=folder)
    assert ran.code == 1
    assert message in ran.out + ran.err


def test_an_arm_that_is_too_weak_is_told_before_what_it_hits(pendulum: Pendulum, call_cli: RunCli) -> None:
    """1 kg that sticks out 0.5 m needs 4.9 N m, which nothing here allows; it falls onto the table."""
    folder = pendulum("mount: {xyz: [0, 0, 1]}\nposes: {out: {all: [-1.5]}, higher: {all: [-1.9]}}\n")
    urdf = folder / "pendulum.urdf"
    box = (
        '<collision><origin xyz="0 0 -0.3"/><geometry><box size="0.04 0.04 0.5"/></geometry></collision></link>\n<joint'
    )
    text = urdf.read_text().replace("0 0 -0.25", "0 0 -0.5").replace('effort="20"', 'effort="2"')
    urdf.write_text(text.replace("</link>\n<joint", box))
    (folder / "controllers.yaml").write_text(
        "controllers: {arm: {type: joint_trajectory, joints: [hinge], gains: {hinge: {p: 400, d: 40}}}}\n"
    )
    (folder / "task.yaml").write_text(
        "task: weak\nrobot: robot.yaml\ncontrollers: controllers.yaml\nstart: out\nreplan: false\n"
        "scene: {table: {box: {size: [2, 2, 0.1]}, pose: {xyz: [0, 0, 0.55]}, fixed: true}}\n"
        "steps: [{move: {to: higher}}]\nwatch: [{always: {no_collision: {pairs: [[robot, table]]}}}]\n"
    )
    ran = call_cli("run", "task.yaml", cwd=folder)
    assert ran.code == 1
    assert "'move_1' failed: joint 'hinge' falls for lack of effort: gravity needs" in ran.out
    assert "its limit is 2 N m" in ran.out
