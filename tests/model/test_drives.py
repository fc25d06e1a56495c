"""Transmissions and actuators as descriptions and robot files state them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.description.elements import TransmissionTag
from manipcli.description.transmissions.differential import DifferentialTransmission
from manipcli.description.transmissions.four_bar import FourBarLinkageTransmission
from manipcli.description.transmissions.simple import SimpleTransmission
from manipcli.model.build_robot import build_robot, rebuild_robot
from manipcli.model.drivetrain import Drivetrain
from manipcli.model.robot import Actuator, RobotModel
from manipcli.spec.load import load_robot_text

INERTIAL = '<inertial><mass value="1"/><inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>'
LIMIT = '<limit lower="-1" upper="1" velocity="2" effort="10"/><axis xyz="0 0 1"/>'
EFFORT = "<hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface>"


def joint(name: str, parent: str, child: str, more: str = "") -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="revolute">{ends}{LIMIT}{more}</joint>\n'


def arm(drives: str) -> str:
    links = "".join(f'<link name="{name}">{INERTIAL}</link>\n' for name in "abcd")
    follower = joint("copy", "c", "d", '<mimic joint="bar"/>')
    return f'<robot name="r">\n{links}{joint("foo", "a", "b")}{joint("bar", "b", "c")}{follower}{drives}</robot>'


def ros1(kind: str, *parts: str) -> str:
    return (
        f'<transmission name="t"><type>transmission_interface/{kind}</type>\n' + "\n".join(parts) + "</transmission>\n"
    )


def ros2(kind: str, *parts: str) -> str:
    joints = "".join(f'<joint name="{name}"><command_interface name="effort"/></joint>' for name in ("foo", "bar"))
    head = f'<ros2_control name="c" type="system"><hardware><plugin>p/P</plugin></hardware>{joints}\n'
    plugin = f'<transmission name="t"><plugin>transmission_interface/{kind}</plugin>\n'
    return head + plugin + "\n".join(parts) + "</transmission></ros2_control>\n"


def built(folder: Path, drives: str) -> RobotModel:
    return read(folder, drives)[0]


def read(folder: Path, drives: str, more: str = "") -> tuple[RobotModel, tuple[Diagnostic, ...]]:
    (folder / "r.urdf").write_text(arm(drives), encoding="utf-8")
    located = load_robot_text(f"robot: r\ndescription: r.urdf\n{more}", "robot.yaml")
    return build_robot(located.spec, file=folder / "robot.yaml", source=located.source)


def refused(folder: Path, drives: str, more: str = "") -> str:
    with pytest.raises(InvalidInput) as caught:
        read(folder, drives, more)
    return "\n".join(f"{finding} | {finding.hint}" for finding in caught.value.findings)


ROLES1 = (
    f'<joint name="bar"><role>joint2</role>{EFFORT}<offset>-0.5</offset>'
    "<mechanicalReduction>-2</mechanicalReduction></joint>",
    f'<joint name="foo"><role>joint1</role>{EFFORT}<offset>0.5</offset>'
    "<mechanicalReduction>2</mechanicalReduction></joint>",
    '<actuator name="bar_motor"><role>actuator2</role><mechanicalReduction>-50</mechanicalReduction></actuator>',
    '<actuator name="foo_motor"><role>actuator1</role><mechanicalReduction>50</mechanicalReduction></actuator>',
)
ROLES2 = (
    '<joint name="bar" role="joint2"><offset>-0.5</offset><mechanical_reduction>-2</mechanical_reduction></joint>',
    '<joint name="foo" role="joint1"><offset>0.5</offset><mechanical_reduction>2</mechanical_reduction></joint>',
    '<actuator name="bar_motor" role="actuator2"><mechanical_reduction>-50</mechanical_reduction></actuator>',
    '<actuator name="foo_motor" role="actuator1"><mechanical_reduction>50</mechanical_reduction></actuator>',
)


@pytest.mark.parametrize("kind", [DifferentialTransmission, FourBarLinkageTransmission], ids=lambda kind: kind.__name__)
@pytest.mark.parametrize(("form", "parts"), [(ros1, ROLES1), (ros2, ROLES2)], ids=["ros1", "ros2"])
def test_pairs_are_bound_by_role_whatever_the_order(
    tmp_path: Path, kind: type[DifferentialTransmission], form: type[str], parts: tuple[str, ...]
) -> None:
    """Case 12: bar is joint2 and stands first; names in the order of the alphabet would swap them, too."""
    drivetrain = Drivetrain.of(built(tmp_path, form(kind.__name__, *parts)))
    assert drivetrain.transmission.blocks == (kind((50.0, -50.0), (2.0, -2.0), (0.5, -0.5)),)
    assert drivetrain.names == ("foo_motor", "bar_motor")
    assert drivetrain.joints == (0, 1)


def simple2(inside: str) -> str:
    return ros2("SimpleTransmission", f'<joint name="foo" role="joint1">{inside}</joint>')


def test_what_a_simple_transmission_states_is_read_and_the_rest_is_1_and_0(tmp_path: Path) -> None:
    """Case 11: 325.949 at the joint; without it 1.0, and an offset of 0.0."""
    stated = simple2("<mechanical_reduction>325.949</mechanical_reduction>")
    for drives, reduction in ((stated, 325.949), (simple2(""), 1.0)):
        drivetrain = Drivetrain.of(built(tmp_path, drives))
        assert drivetrain.transmission.blocks == (SimpleTransmission(reduction, 0.0),)
        assert drivetrain.names == ("t",)


@pytest.mark.parametrize(
    ("inside", "why"),
    [
        ("<mechanical_reduction>0</mechanical_reduction>", "reduction is 0; expected a number other than 0"),
        ("<mechanical_reduction>fifty</mechanical_reduction>", "fifty</mechanical_reduction>: expected a finite"),
        ("<mechanical_reduction>1,5</mechanical_reduction>", "1,5</mechanical_reduction>: expected a finite"),
        ("<offset>nan</offset>", "nan</offset>: expected a finite number"),
    ],
)
def test_a_number_that_is_none_is_an_error_at_its_place(tmp_path: Path, inside: str, why: str) -> None:
    """Case 11: 0 is not built; where ros2_control takes a default without a word, a bad number is refused."""
    told = refused(tmp_path, simple2(inside))
    assert why in told
    assert "r.urdf:11:" in told


@pytest.mark.parametrize(
    ("drives", "why"),
    [
        (ros1("DifferentialTransmission", *ROLES1[:3]), "has 2 joints and 1 actuators; expected 2 each"),
        (ros1("FourBarLinkageTransmission", *ROLES1[1:]), "has 1 joints and 2 actuators; expected 2 each"),
        (ros1("SimpleTransmission", *ROLES1), "has 2 joints and 2 actuators; expected 1 each"),
        (
            ros1("DifferentialTransmission", *(part.replace("joint2", "joint1") for part in ROLES1)),
            "roles of its joints are 'joint1' and 'joint1'; expected joint1 and joint2",
        ),
        (
            ros2("FourBarLinkageTransmission", *(part.replace(' role="actuator1"', "") for part in ROLES2)),
            "roles of its actuators are 'actuator2' and none",
        ),
        (ros1("SimpleTransmission", ROLES1[0].replace('"bar"', '"baz"'), ROLES1[2]), "did you mean 'bar'"),
    ],
)
def test_wrong_counts_roles_and_names_are_refused(tmp_path: Path, drives: str, why: str) -> None:
    """Case 12, and 65: the message names the transmission or joint, at its line."""
    told = refused(tmp_path, drives)
    assert why in told
    assert "'t'" in told


def test_an_unknown_type_is_told_with_the_nearest_and_left_out(tmp_path: Path) -> None:
    robot, findings = read(tmp_path, ros1("DiferentialTransmission", *ROLES1))
    del findings  # loading tells errors; `check` tells warnings, which test_checks looks at
    assert Drivetrain.of(robot).names == ()


OWN = """\
transmissions:
  wrist: {type: differential, joints: [foo, bar], actuators: [left, right], actuator_reduction: [30, -40],
    joint_offset: [10 deg, 0]}
actuators:
  left: {effort: 2.5 N m, velocity: 3000 deg/s, rotor_inertia: 1.0e-5, efficiency: 0.9, latency: 2}
"""


def test_a_robot_file_states_transmissions_and_actuators(tmp_path: Path) -> None:
    """Instead of a description's of the same joints."""
    both = ros1("SimpleTransmission", ROLES1[0], ROLES1[2])
    for drives in ("", both, ros1("DifferentialTransmission", *ROLES1)):
        robot, _ = read(tmp_path, drives, OWN)
        drivetrain = Drivetrain.of(robot)
        (wrist,) = drivetrain.transmission.blocks
        assert wrist == DifferentialTransmission((30.0, -40.0), (1.0, 1.0), (np.radians(10.0), 0.0))
        left, right = drivetrain.actuators
        assert right == Actuator("right")
        assert (left.effort, left.rotor_inertia, left.efficiency, left.latency) == (2.5, 1e-5, 0.9, 2)
        assert left.velocity == pytest.approx(np.radians(3000.0))


def test_the_robot_of_a_log_has_the_same_drives(tmp_path: Path) -> None:
    located = load_robot_text(f"robot: r\ndescription: r.urdf\n{OWN}", "robot.yaml")
    for drives in (
        "",
        simple2("<mechanical_reduction>7</mechanical_reduction>"),
        ros2("FourBarLinkageTransmission", *ROLES2),
    ):
        robot = built(tmp_path, drives)
        again = rebuild_robot(load_robot_text("robot: r\ndescription: r.urdf\n", "r.yaml").spec, robot.urdf.encode())
        assert again.transmissions == robot.transmissions
        own, _ = read(tmp_path, drives, OWN)
        again = rebuild_robot(located.spec, own.urdf.encode())
        assert (again.transmissions, again.actuators) == (own.transmissions, own.actuators)


def test_compat_chooses_the_efforts_of_a_four_bar(tmp_path: Path) -> None:
    drives = ros2("FourBarLinkageTransmission", *ROLES2)
    (linkage,) = Drivetrain.of(read(tmp_path, drives, "compat: ros1\n")[0]).transmission.blocks
    assert linkage == FourBarLinkageTransmission((50.0, -50.0), (2.0, -2.0), (0.5, -0.5), "ros1")


SIMPLE = "transmissions: {t: {joints: [foo], actuators: [m]}}\n"


@pytest.mark.parametrize(
    ("more", "why"),
    [
        (SIMPLE.replace("foo", "fooo"), "robot.yaml:3:30: error[ROBOT340]: transmission 't': joint 'fooo' is not in"),
        (SIMPLE.replace("foo", "fooo"), "did you mean 'foo'"),
        (SIMPLE.replace("foo", "copy"), "joint 'copy' mimics 'bar'"),
        (
            SIMPLE.replace("}}", "}, u: {joints: [foo], actuators: [n]}}"),
            "joint 'foo' already belongs to transmission 't'",
        ),
        (
            SIMPLE.replace("}}", "}, u: {joints: [bar], actuators: [m]}}"),
            "actuator 'm' already belongs to transmission 't'",
        ),
        (SIMPLE.replace("[foo]", "[foo, bar]"), "joints has 2 items; a simple transmission needs 1"),
        (SIMPLE.replace("{joints", "{type: diferential, joints"), "differential"),
        (SIMPLE.replace("[m]", "[m], actuator_reduction: [0]"), "a reduction must not be 0"),
        (SIMPLE.replace("[m]", "[m], actuator_reduction: [.inf]"), "finite"),
        (SIMPLE + "actuators: {mm: {effort: 1}}\n", "of the robot | did you mean 'm'"),
        (SIMPLE + "actuators: {m: {effort: 0}}\n", "effort"),
        (SIMPLE + "actuators: {m: {efort: 1}}\n", "did you mean 'effort'"),
        (SIMPLE + "actuators: {m: {efficiency: 1.1}}\n", "efficiency"),
        (SIMPLE + "actuators: {m: {latency: 1.5}}\n", "latency"),
    ],
)  # fmt: skip
def test_mistakes_in_a_robot_file_are_told_at_their_place(tmp_path: Path, more: str, why: str) -> None:
    told = refused(tmp_path, "", more)
    assert why in told
    assert "robot.yaml:" in told


def test_an_actuator_too_slow_for_its_joints_is_noted(tmp_path: Path) -> None:
    """A differential's turns for both joints at once: 30 (2 + 2) rad/s, beyond the 100 that it has."""
    own = OWN.replace("3000 deg/s", "100")
    (note,) = [finding for finding in read(tmp_path, "", own)[1] if finding.code == "ROBOT345"]
    assert note.severity == "note"
    assert "actuator 'left' is limited to 100 rad/s or m/s and needs 120 with foo and bar" in str(note)
    fast = read(tmp_path, "", own.replace("velocity: 100", "velocity: 120"))[1]
    assert "ROBOT345" not in {finding.code for finding in fast}


def test_half_of_a_described_pair_is_not_replaced(tmp_path: Path) -> None:
    told = refused(tmp_path, ros1("DifferentialTransmission", *ROLES1), SIMPLE.replace("t:", "u:"))
    assert "transmission 'u' replaces only joint 'foo' of 't' in the description" in told
    assert "let 'u' drive all joints of 't': foo and bar" in told


def test_a_joint_that_both_generations_describe_is_driven_once(tmp_path: Path) -> None:
    drives = ros1("DifferentialTransmission", *ROLES1) + ros2("DifferentialTransmission", *ROLES2)
    assert Drivetrain.of(built(tmp_path, drives)).names == ("foo_motor", "bar_motor")


def test_actuators_of_a_recording_are_computed_at_once(tmp_path: Path) -> None:
    """(T, n) joints to (T, a) actuators: a simple one on the second joint, then none on the others."""
    robot = built(tmp_path, ros1("SimpleTransmission", ROLES1[0], ROLES1[2]))
    joints = np.random.default_rng(0).normal(size=(3, 7, 3))
    position, velocity, effort = Drivetrain.of(robot).state(*joints)
    np.testing.assert_allclose(position, (joints[0][:, [1]] + 0.5) * -50.0)
    np.testing.assert_allclose(velocity, joints[1][:, [1]] * -50.0)
    np.testing.assert_allclose(effort, joints[2][:, [1]] / -50.0)
    assert isinstance(robot.transmissions[0], TransmissionTag)
