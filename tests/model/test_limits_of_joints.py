"""Soft limits and those of ros2_control: what is read, what a robot file changes, and that a log keeps it."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import pytest

from manipcli.core.errors import InvalidInput
from manipcli.description.elements import JointLimits, SoftLimits
from manipcli.description.expanded import read_description
from manipcli.description.packages import Packages
from manipcli.description.urdf.urdf import Parts, read_parts
from manipcli.model.build_robot import bare_robot, build_robot
from manipcli.model.normalised_urdf import engine_urdf
from manipcli.model.robot import RobotModel
from manipcli.spec.robot import LimitsSpec, RobotSpec

INERTIAL = '<inertial><mass value="2"/><inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial>'
LIMIT = '<limit lower="-1" upper="2" velocity="3" effort="4"/>'
SAFETY = '<safety_controller soft_lower_limit="-0.8" soft_upper_limit="1.8" k_position="20" k_velocity="5"/>'
SOFT = SoftLimits(-0.8, 1.8, 20.0, 5.0)


def description(inside: str = LIMIT, *, kind: str = "revolute", control: str = "") -> str:
    joint = f'<joint name="j" type="{kind}"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>{inside}</joint>'
    hardware = "<hardware><plugin>p/P</plugin></hardware>"
    component = f'<ros2_control name="c" type="system">{hardware}<joint name="j">{control}</joint></ros2_control>'
    links = "".join(f'<link name="{name}">{INERTIAL}</link>' for name in "ab")
    return f'<robot name="r">{links}{joint}{component if control else ""}</robot>'


def read(folder: Path, text: str) -> Parts:
    path = folder / "r.urdf"
    path.write_text(text, encoding="utf-8")
    return read_parts(read_description(path, packages=Packages(path)))


def limits_of(folder: Path, text: str) -> JointLimits:
    parts = read(folder, text)
    assert parts.errors == ()
    return parts.joints[0].limits


def test_soft_limits_are_those_of_the_safety_controller(tmp_path: Path) -> None:
    assert limits_of(tmp_path, description(LIMIT + SAFETY)).soft == SOFT
    assert limits_of(tmp_path, description()).soft is None


@pytest.mark.parametrize(
    ("limits", "within"),
    [
        (JointLimits(-1.0, 2.0, soft=SOFT), (-0.8, 1.8)),
        (JointLimits(-1.0, 2.0), (-1.0, 2.0)),
        (JointLimits(-1.0, 2.0, soft=SoftLimits(-0.8, 1.8, k_velocity=5.0)), (-1.0, 2.0)),  # they do not act
        (JointLimits(-1.0, 2.0, soft=SoftLimits(None, 1.8, 20.0)), (-1.0, 1.8)),
        (JointLimits(-1.0, 2.0, soft=SoftLimits(-3.0, 3.0, 20.0)), (-1.0, 2.0)),
        (JointLimits(soft=SoftLimits(None, 1.8, 20.0)), (-math.inf, 1.8)),
    ],
)
def test_a_joint_is_kept_within_the_soft_limits_that_act(limits: JointLimits, within: tuple[float, float]) -> None:
    assert limits.within_soft == within


@pytest.mark.parametrize(
    ("kind", "written", "soft"),
    [
        ("revolute", 'soft_lower_limit="-0.8" soft_upper_limit="1.8"', None),  # no gain: they do not act
        ("revolute", 'k_velocity="5"', SoftLimits(k_velocity=5.0)),
        ("revolute", 'k_position="9" k_velocity="5"', SoftLimits(k_velocity=5.0)),  # URDF's 0 and 0 are none
        ("continuous", 'soft_upper_limit="1" k_position="9" k_velocity="5"', SoftLimits(k_velocity=5.0)),
    ],
)
def test_soft_limits_that_say_nothing(tmp_path: Path, kind: str, written: str, soft: SoftLimits | None) -> None:
    assert limits_of(tmp_path, description(f"{LIMIT}<safety_controller {written}/>", kind=kind)).soft == soft


def test_a_negative_gain_is_an_error(tmp_path: Path) -> None:
    (error,) = read(tmp_path, description(f'{LIMIT}<safety_controller k_velocity="-1"/>')).errors
    assert "joint 'j': k_velocity is -1" in error.message


def test_limits_are_needed_by_a_revolute_joint_and_not_by_a_continuous_one(tmp_path: Path) -> None:
    """Case 66."""
    assert limits_of(tmp_path, description("", kind="continuous")) == JointLimits()
    (error,) = read(tmp_path, description("")).errors
    assert "joint 'j' is revolute and has no <limit>" in error.message


@pytest.mark.parametrize("limits", ['lower="-inf" upper="inf"', 'lower="-pi" upper="-1"', 'lower="nan" upper="1"'])
def test_a_limit_that_is_no_number_is_told_and_nothing_follows_from_it(tmp_path: Path, limits: str) -> None:
    findings = read(tmp_path, description(f'<limit {limits} velocity="3" effort="4"/>')).findings
    assert {finding.code for finding in findings} == {"URDF004"}


def interface(name: str, low: float | str, high: float | str, more: str = "") -> str:
    bounds = f'<param name="min">{low}</param><param name="max">{high}</param>'
    return f'<command_interface name="{name}">{bounds}{more}</command_interface>'


@pytest.mark.parametrize(
    ("control", "changed"),
    [
        (interface("position", -0.5, 9), {"lower": -0.5}),  # narrows, never widens
        (interface("position", -9, 1), {"upper": 1.0}),
        (interface("position", 5, 9), {}),  # would leave nothing: an error, and nothing follows from it
        (interface("velocity", -2, 2.5), {"velocity": 2.0}),  # the smaller of the sizes, both ways
        (interface("velocity", -8, 8), {}),
        (interface("effort", -1, 3), {"effort": 1.0}),
        (interface("acceleration", -7, 6), {"acceleration": 6.0}),
        (interface("jerk", -70, 60), {"jerk": 60.0}),
        (interface("velocity", -2, 2, '<limits enable="false"/>'), {"velocity": None}),
        (interface("position", -0.5, 0.5, '<limits enable="false"/>'), {"lower": None, "upper": None}),
        (interface("velocity", -2, 2, '<limits enable="true"/>'), {"velocity": 2.0}),
        ('<limits enable="false"/>' + interface("effort", -1, 1), {"effort": None}),
    ],
)
def test_what_a_command_interface_says_narrows_a_limit_or_takes_it_away(
    tmp_path: Path, control: str, changed: dict[str, float | None]
) -> None:
    """Case 66."""
    expected = dataclasses.replace(JointLimits(-1.0, 2.0, 3.0, 4.0), **changed)
    assert limits_of(tmp_path, description(control=control)) == expected


def test_what_we_write_says_the_same(tmp_path: Path) -> None:
    """The description of a log, also of a revolute joint whose limits were taken away."""
    for control in ("", interface("position", -0.5, 0.5, '<limits enable="false"/>')):
        robot = bare_robot(read(tmp_path, description(LIMIT + SAFETY, control=control)))
        again = limits_of(tmp_path, robot.urdf)
        assert again == robot.joints[0].limits
        assert again.soft == SOFT
    assert again.lower is None
    assert 'type="continuous"' in engine_urdf(robot, tmp_path)


def built(folder: Path, text: str, **limits: float) -> RobotModel:
    path = folder / "r.urdf"
    path.write_text(text, encoding="utf-8")
    spec = RobotSpec(robot="r", description="r.urdf", limits={"j": LimitsSpec(**limits)})
    return build_robot(spec, file=folder / "robot.yaml")[0]


def test_a_robot_file_states_soft_limits(tmp_path: Path) -> None:
    own = {"soft_lower": -0.9, "soft_upper": 1.0, "k_position": 10.0, "k_velocity": 2.0}
    assert built(tmp_path, description(), **own).joints[0].limits.soft == SoftLimits(-0.9, 1.0, 10.0, 2.0)
    assert built(tmp_path, description(LIMIT + SAFETY), soft_upper=1.5).joints[0].limits.soft == dataclasses.replace(
        SOFT, upper=1.5
    )
    assert built(tmp_path, description(LIMIT + SAFETY), velocity=1.0).joints[0].limits.soft == SOFT


@pytest.mark.slow
@pytest.mark.parametrize(
    ("own", "told"),
    [
        ({"soft_upper": 2.5, "k_position": 1.0}, "soft_upper 2.5 is outside its limits"),
        ({"soft_lower": 0.0}, "without k_position"),
        (
            {"soft_lower": 0.5, "soft_upper": 0.5, "k_position": 1.0},
            "soft lower limit 0.5 is not below soft upper limit 0.5",
        ),
    ],
)
def test_soft_limits_that_cannot_act_are_refused(tmp_path: Path, own: dict[str, float], told: str) -> None:
    with pytest.raises(InvalidInput, match=told):
        built(tmp_path, description(), **own)


def test_an_acceleration_of_the_description_is_kept_where_the_robot_file_says_none(tmp_path: Path) -> None:
    text = description(control=interface("acceleration", -7, 7))
    assert built(tmp_path, text, velocity=1.0).joints[0].limits.acceleration == 7.0
    assert built(tmp_path, text, acceleration=3.0).joints[0].limits.acceleration == 3.0
