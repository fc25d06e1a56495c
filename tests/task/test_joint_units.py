"""An angle is told where a joint slides and a length where it turns, in all three files, each at its value."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.core.errors import InvalidInput
from manipcli.task.load_task import load_task


def link(name: str) -> str:
    inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    return f'<link name="{name}"><inertial><mass value="1"/>{inertia}</inertial></link>'


def joint(name: str, kind: str, parent: str, child: str) -> str:
    limit = '<axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="2" effort="10"/>'
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{limit}</joint>'


# A joint is called as a verb and a field are: names of joints are only where a file speaks of joints.
URDF = (
    '<robot name="r">'
    + "".join(map(link, "abcd"))
    + joint("lift", "prismatic", "a", "b")
    + joint("turn", "revolute", "b", "c")
    + joint("spin", "continuous", "c", "d")
    + '<transmission name="t"><type>transmission_interface/SimpleTransmission</type>'
    + '<joint name="lift"/><actuator name="m"><mechanicalReduction>50</mechanicalReduction></actuator></transmission>'
    + "</robot>"
)
ROBOT = """\
robot: r
description: r.urdf
groups: {arm: {joints: [lift, turn]}, wrist: {joints: [spin]}, slide: {joints: [lift]}}
poses:
  home: {arm: [5 cm, 10 deg], wrist: {spin: 1 rad}}
limits:
  lift: {velocity: 5 cm/s, acceleration: 1 m/s2, upper: 50 cm, effort: 5 N}
  turn: {velocity: 98 deg/s, acceleration: 2}
transmissions: {t: {joints: [lift], actuators: [m], joint_offset: [1 cm]}}
actuators: {m: {velocity: 3000 rpm}}
"""
CONTROLLERS = """\
controllers:
  turn:
    type: joint_trajectory
    joints: [lift, turn]
    gains: {lift: {p: 1, error_deadband: 1 mm}, turn: {p: 1}}
    constraints: {stopped_velocity_tolerance: 5 deg/s, joints: {turn: {goal: 3 deg}, lift: {goal: 3 cm}}}
  wrist:
    type: gripper
    joints: [spin]
    gains: {spin: {p: 1}}
    speed: 10 deg/s
"""
TASK = """\
task: t
robot: robot.yaml
controllers: controllers.yaml
params: {far: 5 deg, reach: 1 cm}
scene: {turn: {box: {size: [5 cm, 5 cm, 5 cm]}, mass: 1, pose: {xyz: [2, 0, 1 m]}}}
replan: {joints: 5 cm}
steps:
  - move: {to: {lift: 5 cm, turn: $far, spin: 0.1}}
  - follow: {joint_names: [turn, lift], points: [{positions: [5 deg, 5 cm], time_from_start: 3 s}]}
expect:
  - tracking: {group: slide, within: 5 mm}
  - not: {tracking: {group: arm, within: 5 deg}}
"""


FILES = {"robot": ROBOT, "controllers": CONTROLLERS, "task": TASK}


def load(folder: Path, written: str = "", instead: str = "", *overrides: str) -> list[str]:
    (folder / "r.urdf").write_text(URDF)
    for name, text in FILES.items():
        (folder / f"{name}.yaml").write_text(text.replace(written, instead) if written else text)
    try:
        load_task(folder / "task.yaml", overrides=overrides)
    except InvalidInput as invalid:
        errors = [one for one in invalid.findings if one.severity == "error"]
        return [f"{one.place} {one.message}".replace(f"{folder}/", "") for one in errors]
    return []


def test_each_joint_takes_its_own_units_and_plain_numbers(tmp_path: Path) -> None:
    assert load(tmp_path) == []


@pytest.mark.parametrize(
    ("written", "instead", "value", "told"),
    [
        ("[5 cm, 10 deg]", "[10 deg, 9 deg]", "10 deg", "joint 'lift' is prismatic: '10 deg' is an angle"),
        ("{spin: 1 rad}", "{spin: 1 m}", "1 m", "joint 'spin' is continuous: '1 m' is a length"),
        ("velocity: 5 cm/s", "velocity: 98 deg/s", "98 deg/s", "'98 deg/s' is an angular velocity"),
        ("acceleration: 1 m/s2", "acceleration: 1 rad/s2", "1 rad/s2", "expected an acceleration (m/s^2"),
        ("effort: 5 N", "effort: 5 N m", "5 N m", "expected a force"),
        ("[1 cm]", "[1 deg]", "1 deg", "transmissions.t.joint_offset[0]: joint 'lift' is prismatic"),
        ("deadband: 1 mm", "deadband: 1 deg", "1 deg", "'1 deg' is an angle"),
        ("{goal: 3 deg}", "{goal: 3 cm}", "3 cm", "joint 'turn' is revolute: '3 cm' is a length"),
        ("speed: 10 deg/s", "speed: 10 cm/s", "10 cm/s", "joint 'spin' is continuous"),
        ("lift: 5 cm", "lift: 5 deg", "5 deg", "steps[0].move.to.lift: joint 'lift' is prismatic"),
        ("turn: $far", "turn: 2 * $reach", "2 *", "(from '2 * $reach') is a length; expected an angle (rad, deg"),
        ("[5 deg, 5 cm]", "[6 cm, 5 cm]", "6 cm", "joint 'turn' is revolute"),
        ("within: 5 mm", "within: 5 deg", "5 deg", "joint 'lift' is prismatic"),
        ("group: slide, within: 5 mm", "group: wrist, within: 5 mm", "5 mm", "joint 'spin' is continuous"),
    ],
)
def test_a_unit_of_the_other_kind_is_told(tmp_path: Path, written: str, instead: str, value: str, told: str) -> None:
    (found,) = load(tmp_path, written, instead)
    (name,) = (name for name, text in FILES.items() if written in text)
    text = FILES[name].replace(written, instead)
    before = text[: text.index(instead) + instead.index(value)]
    place = f"{name}.yaml:{before.count(chr(10)) + 1}:{len(before) - before.rfind(chr(10))}"
    assert found.startswith(f"{place} ")
    assert told in found


def test_an_override_is_told_as_it_was_typed(tmp_path: Path) -> None:
    (told,) = load(tmp_path, "", "", "robot.limits.turn.velocity=5 cm/s")
    assert told.startswith("--set robot.limits.turn.velocity=5 cm/s limits.turn.velocity: joint 'turn' is revolute")
