"""Closed loops: four-bar linkages against their closed form, in planning and in both engines; and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from manipcli.core.errors import InvalidInput
from manipcli.model.build_robot import build_robot, rebuild_robot
from manipcli.model.configuration import configuration, with_mimics
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.pipeline import run_task
from manipcli.plan.inverse_kinematics import InverseKinematics
from manipcli.record.read.reading import open_recording
from manipcli.spec.robot import RobotSpec

A, B, C, D = 0.04, 0.07, 0.06, 0.08
"""[m] Crank, coupler, rocker and ground."""
MOMENTS = '<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/>'
PIN = {"between": ["coupler", "rocker"], "at": [B, 0, 0], "at_other": [C, 0, 0], "driven_by": "drive"}


def four_bar(drive: str = 'lower="0.6" upper="2.2"', swing: str = 'lower="-0.5" upper="3.1"') -> str:
    """A linkage in the plane of x and y, its angles about z; the pin is open with all joints at zero."""
    links = "".join(
        f'<link name="{name}"><inertial><origin xyz="{x} 0 0"/><mass value="0.1"/>{MOMENTS}</inertial></link>'
        for name, x in (("base", 0.0), ("crank", A / 2), ("coupler", B / 2), ("rocker", C / 2))
    )
    joints = "".join(
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{x} 0 0"/><axis xyz="0 0 1"/><limit {limits} velocity="9" effort="5"/></joint>'
        for name, parent, child, x, limits in (
            ("drive", "base", "crank", 0.0, drive),
            ("elbow", "crank", "coupler", A, 'lower="-3.1" upper="3.1"'),
            ("swing", "base", "rocker", D, swing),
        )
    )
    return f'<robot name="four_bar">{links}{joints}</robot>'


def built(folder: Path, urdf: str, **loop: Any) -> tuple[RobotModel, RobotSpec]:
    (folder / "four_bar.urdf").write_text(urdf)
    spec = RobotSpec.model_validate(
        {
            "robot": "four_bar",
            "description": "four_bar.urdf",
            "groups": {"hand": {"joints": ["drive"]}},
            "poses": {"home": {"hand": [1.5]}},
            "loops": [PIN | loop],
        }
    )
    return build_robot(spec, file=folder / "robot.yaml")[0], spec


def rocker_angle(theta: np.ndarray) -> np.ndarray:
    """Of the open linkage: the circles of coupler and rocker meet on the upper side."""
    joint = A * np.column_stack([np.cos(theta), np.sin(theta)])
    away = np.array([D, 0.0]) - joint
    length = np.linalg.norm(away, axis=1)
    along = (length**2 + B**2 - C**2) / (2.0 * length)
    beside = np.sqrt(B**2 - along**2)
    e = away / length[:, None]
    pin = joint + along[:, None] * e + beside[:, None] * np.column_stack([-e[:, 1], e[:, 0]])
    return np.arctan2(pin[:, 1], pin[:, 0] - D)


def test_passive_joints_follow_the_closed_form(tmp_path: Path) -> None:
    robot, spec = built(tmp_path, four_bar())
    theta = np.linspace(0.6, 2.2, 333)
    drive, elbow, swing = (robot.joint_names.index(name) for name in ("drive", "elbow", "swing"))
    q = np.zeros((len(theta), 3))
    q[:, drive] = theta
    for made in (robot, rebuild_robot(spec, robot.urdf.encode())):
        followed = with_mimics(made, q)
        assert followed[:, swing] == pytest.approx(rocker_angle(theta), abs=1e-7)
        kinematics = Kinematics(made)
        for row in followed[::40]:
            points = [kinematics.forward(row, link).apply([x, 0.0, 0.0]) for link, x in (("coupler", B), ("rocker", C))]
            assert points[0] == pytest.approx(points[1], abs=1e-8)
    mimic = robot.joint("elbow").mimic
    assert mimic is not None
    slope = np.gradient(followed[:, elbow], theta)
    assert mimic.ratio(theta)[1:-1] == pytest.approx(slope[1:-1], abs=1e-3)  # type: ignore[index]
    assert ("coupler", "rocker") in robot.collision_ignore
    assert {joint.name for joint in robot.moving_joints if joint.independent} == {"drive"}


def test_the_pin_is_where_it_is_at_zero_unless_stated(tmp_path: Path) -> None:
    """A parallelogram is closed with all joints at zero: elbow = -drive, swing = drive."""
    urdf = four_bar('lower="0.2" upper="1.6"').replace(f'<origin xyz="{D} 0 0"/>', f'<origin xyz="{B} 0 0"/>')
    robot, _ = built(tmp_path, urdf, at_other=None)
    q = with_mimics(robot, configuration(robot) * 0.0 + 0.8)
    assert dict(zip(robot.joint_names, q, strict=True)) == pytest.approx({"drive": 0.8, "elbow": -0.8, "swing": 0.8})


def test_inverse_kinematics_reaches_poses_of_a_link_that_the_loop_moves(tmp_path: Path) -> None:
    robot, _ = built(tmp_path, four_bar())
    solver = InverseKinematics(Kinematics(robot), ("drive",), "coupler")
    goal = solver.forward(with_mimics(robot, np.full(3, 0.9)))
    found = solver.track(goal, with_mimics(robot, np.full(3, 1.9)))
    assert found.converged
    assert found.q[robot.joint_names.index("drive")] == pytest.approx(0.9, abs=1e-4)


@pytest.mark.parametrize(
    ("urdf", "loop", "code", "says"),
    [
        (four_bar(), {"at": [0.5, 0, 0]}, "ROBOT361", "does not close with 'drive' at 0.6 rad"),
        (four_bar('lower="0.6" upper="3.1"', 'lower="-0.5" upper="2.2"'), {}, "ROBOT361", "only with 'drive' from 0.6"),
        (four_bar(), {"driven_by": "dirve"}, "ROBOT360", "joint 'dirve' is not in the loop"),
        (four_bar(), {"between": ["coupler", "roker"]}, "ROBOT306", "link 'roker' is not in the robot"),
        (four_bar().replace('axis xyz="0 0 1"', 'axis xyz="1 0 0"'), {}, "ROBOT361", "does not close"),
        (
            four_bar().replace("<limit lower=\"-0.5\"", '<mimic joint="drive"/><limit lower="-0.5"'),
            {},
            "ROBOT360",
            "mimics 'drive' in the description, too",
        ),
    ],
)  # fmt: skip
def test_what_cannot_close_is_refused(tmp_path: Path, urdf: str, loop: dict[str, Any], code: str, says: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        built(tmp_path, urdf, **loop)
    assert [finding.code for finding in refused.value.findings if finding.severity == "error"] == [code]
    assert says in str(refused.value)


@pytest.mark.parametrize("engine", ["pybullet", "mujoco"])
def test_physics_keeps_the_pin_closed_while_one_motor_moves_it(tmp_path: Path, engine: str) -> None:
    (tmp_path / "four_bar.urdf").write_text(four_bar())
    (tmp_path / "robot.yaml").write_text(
        "robot: four_bar\ndescription: four_bar.urdf\nmount: {xyz: [0, 0, 0.3], rpy: [90 deg, 0, 0]}\n"
        "groups: {hand: {joints: [drive]}}\nposes: {home: {hand: [1.5]}}\nlimits: {drive: {acceleration: 30}}\n"
        f"loops: [{{between: [coupler, rocker], at: [{B}, 0, 0], at_other: [{C}, 0, 0], driven_by: drive}}]\n"
    )
    (tmp_path / "c.yaml").write_text(
        "controllers: {h: {type: joint_trajectory, joints: [drive], command_interface: position}}\n"
    )
    (tmp_path / "task.yaml").write_text(
        f"task: four_bar\nrobot: robot.yaml\ncontrollers: c.yaml\nsimulation: {{engine: {engine}}}\n"
        "steps: [{move: {to: {drive: 0.7}}}, {move: {to: {drive: 2.1}}}]\n"
    )
    report = run_task(tmp_path / "task.yaml", log=tmp_path / "log.mcap")
    assert report.verdict.verdict == "passed", report.verdict.text
    states = open_recording(tmp_path / "log.mcap").states
    names = ("drive", "elbow", "swing")
    drive, swing = states.position[:, names.index("drive")], states.position[:, names.index("swing")]
    assert float(np.ptp(drive)) > 1.3
    assert swing == pytest.approx(rocker_angle(drive), abs=2e-3)
