"""What cannot work with a robot is told before anything is built, at its place, with what would."""

import re
from functools import cache
from pathlib import Path

import pytest

from manipcli.control import (
    ComputedTorqueController,
    GripperController,
    JointTrajectoryController,
    PidController,
)
from manipcli.control.factory import build_controllers, controller_findings
from manipcli.core.errors import InvalidArgument, InvalidInput
from manipcli.model.build_robot import build_robot
from manipcli.spec.load import load_controllers_text, load_robot
from manipcli.task.vocabulary import controllers_spec

ROBOTS = Path(__file__).parents[3] / "robots"
CASES = [
    ("arm7_hand3", "type: forward_command, joints: [joint_1], command_interface: velocity, gravity_compensation: true",
     "CTRL147", "gravity_compensation needs the effort interface, not velocity"),
    ("arm7_hand3", "type: pid, joints: [joint_1], gains: {joint_1: {p: 1}, joint_2: {p: 1}}",
     "CTRL102", "'joint_2' has gains, but is not a joint of the controller"),
    ("arm7_hand3", "type: pid, joints: [joint_1], gains: {joint_1: {}}", "CTRL103", "has gains that are all zero"),
    ("arm7_hand3", "type: pid, joints: [joint_1, joint_2], gains: {joint_1: {p: 1}}",
     "CTRL103", "'joint_2' has no gains"),
    ("arm7_hand3", "type: pid, joints: [joint_1], gains: {joint_1: {p: 1, ff_velocity_scale: 1}}",
     "CTRL182", "has no effect in a `pid`"),
    ("arm7_hand3", "type: pid, joints: [joint_1], gains: {joint_1: {p: 1}}, "
     "reference_and_state_interfaces: [velocity, position]", "CTRL182", "cannot be controlled together"),
    ("arm7_hand3", "type: pid, joints: [joint_1, joint_2], gains: "
     "{joint_1: {p: 1}, joint_2: {p: 1, save_i_term: false}}", "CTRL182", "save_i_term differs"),
    ("arm7_hand3", "type: pid, joints: [joint_1], command_interface: velocity, gravity_compensation: true, "
     "gains: {joint_1: {p: 1}}", "CTRL147", "gravity_compensation needs the effort interface, not velocity"),
    ("arm7_hand3", "type: computed_torque, joints: [joint_1], gains: {joint_1: {}}", "CTRL103", "are all zero"),
    ("arm7_hand3", "type: computed_torque, joints: [joint_1], constraints: {joints: {joint_2: {goal: 0.1}}}",
     "CTRL104", "'joint_2' has tolerances, but is not a joint of the controller"),
    ("arm7_hand3", "type: force_torque_broadcaster, link: plam", "CTRL184", "'plam' is not in robot"),
    ("panda", "type: force_torque_broadcaster, link: panda_link0", "CTRL184", "has no parent"),
    ("arm7_hand3", "type: force_torque_broadcaster, link: palm, joints: [joint_1]", "CTRL184", "it reads no joints"),
    ("arm7_hand3", "type: joint_state_broadcaster, joints: [joint_9]", "CTRL144", "'joint_9' is not in robot"),
    ("arm7_hand3", "type: gripper, joints: [finger_1_distal], command_interface: position, max_effort: 1",
     "CTRL147", "max_effort needs the effort interface, not position"),
    ("arm7_hand3", "type: cartesian_impedance, joints: [joint_1], stiffness: {translation: 1, rotation: 1}",
     "CTRL186", "joint_2, joint_3, joint_4, joint_5, joint_6, joint_7 move link 'tool', too"),
]  # fmt: skip


@cache
def robot(name):
    path = ROBOTS / name / "robot.yaml"
    file = load_robot(path)
    return build_robot(file.spec, file=path, source=file.source)[0]


@pytest.mark.parametrize(("name", "text", "code", "told"), CASES, ids=[case[3] for case in CASES])
def test_what_cannot_work_is_told_at_its_place_and_not_built(name, text, code, told):
    file = load_controllers_text(f"controllers:\n  one: {{{text}}}\n", "c.yaml", model=controllers_spec())
    findings = controller_findings(file.spec, robot(name), 1e-3, place=lambda loc: file.place(*loc))
    errors = [finding for finding in findings if finding.severity == "error"]
    assert [(f.code, told in f.message, f.place.line, bool(f.hint) or code == "CTRL184") for f in errors] == [
        (code, True, 2, True)
    ]
    with pytest.raises(InvalidInput):
        build_controllers(file.spec, robot(name), 1e-3)


@pytest.mark.parametrize(
    ("gains", "named"),
    [
        ({"p": 1.0, "q": 2.0}, "the gains of joint 'a' have an unknown field 'q'"),
        ({"p": -1.0}, "the gains of joint 'a': p -1.0: "),
        ({"p": "1"}, "the gains of joint 'a': p '1': "),
        (3.0, "the gains of joint 'a': 3.0: "),
    ],
)
@pytest.mark.parametrize(
    "kind", [JointTrajectoryController, GripperController, PidController, ComputedTorqueController]
)
def test_wrong_gains_in_python_are_told_with_their_joint(kind, gains, named):
    with pytest.raises(InvalidArgument, match=re.escape(f"controller 'c': {named}")):
        kind(name="c", joints=["a"], gains={"a": gains})


def test_what_is_told_of_a_claimed_mimic_joint_agrees():
    """Its gains are those of the joint that it follows: that one is claimed, not the gains renamed."""
    text = "type: gripper, joints: [panda_finger_joint2], gains: {panda_finger_joint1: {p: 1000, d: 10}}"
    file = load_controllers_text(f"controllers:\n  one: {{{text}}}\n", "c.yaml", model=controllers_spec())
    findings = controller_findings(file.spec, robot("panda"), 1e-3)
    assert {finding.code: finding.hint for finding in findings if finding.severity == "error"} == {
        "CTRL143": "claim 'panda_finger_joint1' instead",
        "CTRL102": "remove them, or add 'panda_finger_joint1' to `joints`",
    }
