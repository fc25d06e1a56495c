"""Robot and controllers files: mistakes at their places, ROS's own forms, and the resolved text."""

from __future__ import annotations

import json

import pytest

from manipcli.control.controllers.joint_trajectory import JointTrajectorySpec
from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.spec.load import load_controllers_text, load_robot_text
from manipcli.spec.resolved import resolved
from manipcli.spec.schema import controllers_schema, robot_schema
from manipcli.task.vocabulary import controllers_spec, robot_spec

PAPER = """\
arm_controller:
  type: "effort_controllers/JointTrajectoryController"
  joints:
    - joint1
  constraints:
    goal_time: 5.0
    joint1:
      goal: 0.05
      trajectory: 0.05
"""
ROS2 = """\
controller_manager:
  ros__parameters:
    update_rate: 100
    joint_state_broadcaster: {type: joint_state_broadcaster/JointStateBroadcaster}
    arm: {type: joint_trajectory_controller/JointTrajectoryController}
arm:
  ros__parameters:
    joints: [a, b]
    command_interfaces: [effort]
    gains: {a: {p: 3.0, i_clamp_max: 1.0, i_clamp_min: -1.0, normalize_error: true}}
    constraints: {goal_time: 0.5, a: {goal: 0.0, trajectory: 0.1}}
"""
OWN = """\
arm:
  type: joint_trajectory
  joints: [a]
  gains: {a: {p: 3}}
hand: {type: gripper, joints: [f], speed: 60 deg/s}
"""


def lines(findings: tuple[Diagnostic, ...]) -> list[str]:
    return [str(finding) for finding in findings]


def refused(text: str, *overrides: str) -> list[str]:
    with pytest.raises(InvalidInput) as caught:
        load_controllers_text(text, "c.yaml", overrides=overrides, model=controllers_spec())
    return lines(caught.value.findings)


def test_the_listing_of_ros_1_loads_as_it_is() -> None:
    located = load_controllers_text(PAPER, "c.yaml", model=controllers_spec())
    arm = located.spec.controllers["arm_controller"]
    assert isinstance(arm, JointTrajectorySpec)
    assert (arm.joints, arm.interfaces) == (("joint1",), ("effort",))
    assert arm.constraints.goal_time == 5.0
    assert arm.constraints.joints["joint1"].goal == 0.05
    assert [finding.code for finding in located.findings] == ["CTRL218"]  # other defaults than ROS's
    place = located.place("controllers", "arm_controller", "constraints", "joints", "joint1", "goal")
    assert str(place) == "c.yaml:8:13"


def test_the_form_of_ros_2_loads_and_names_what_is_not_served() -> None:
    located = load_controllers_text(ROS2, "c.yaml", model=controllers_spec())
    arm = located.spec.controllers["arm"]
    assert isinstance(arm, JointTrajectorySpec)
    assert (arm.joints, arm.interfaces) == (("a", "b"), ("effort",))
    assert (arm.gains["a"].p, arm.gains["a"].i_clamp_min, arm.gains["a"].i_clamp_max) == (3.0, -1.0, 1.0)
    assert (arm.constraints.joints["a"].goal, arm.constraints.joints["a"].trajectory) == (None, 0.1)
    assert list(located.spec.controllers) == ["joint_state_broadcaster", "arm"]
    assert lines(tuple(finding for finding in located.findings if finding.code != "CTRL218")) == [
        "c.yaml:3:5: note[CTRL214]: controller_manager: 'update_rate' has no effect: the task sets the control rate",
        "c.yaml:10:62: warning[CTRL214]: arm.gains.a: ROS parameter 'normalize_error' is not supported: left out",
    ]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (OWN.replace("{p: 3}", "{kp_: 3}"), "c.yaml:4:15: error[CTRL201]: controllers.arm.gains.a: unknown key 'kp_'"),
        (
            OWN.replace("joint_trajectory", "joint_trajectry"),
            "c.yaml:2:3: error[CTRL203]: controllers.arm: unknown type "
            "'joint_trajectry', expected one of joint_trajectory, gripper",
        ),
        (
            OWN.replace("p: 3", "p: -3"),
            "c.yaml:4:18: error[CTRL204]: controllers.arm.gains.a.p: must be at least 0, not -3",
        ),
        (
            OWN.replace("60 deg/s", "60 deg"),
            "c.yaml:5:43: error[CTRL207]: controllers.hand.speed: '60 deg' is an angle; expected an angular velocity",
        ),
        (
            OWN.replace("joints: [a]", "joints: a"),
            "c.yaml:3:11: error[CTRL205]: controllers.arm.joints: expected a list, not 'a'",
        ),
        (
            PAPER.replace("effort_controllers", "efort_controllers"),
            "c.yaml:2:9: error[CTRL203]: controller 'arm_controller': unknown type "
            "'efort_controllers/JointTrajectoryController'",
        ),
        ("", "c.yaml:1:1: error[CTRL200]: expected a mapping"),
        ("[1]", "c.yaml:1:1: error[CTRL200]: expected a mapping"),
        ("version: 9.0.0\nx: 1", "c.yaml:1:10: error[CTRL213]: version: this file needs manipcli >= 9.0.0"),
    ],
)
def test_a_mistake_in_a_controllers_file_is_told_at_its_place(text: str, expected: str) -> None:
    assert any(line.startswith(expected) for line in refused(text))


def test_overrides_reach_the_controllers_in_any_form_of_the_file() -> None:
    override = "controllers.arm.gains.a.p=7"
    for text in (OWN, ROS2):
        located = load_controllers_text(
            text, "c.yaml", overrides=[override, "scene.cup.mass=1"], model=controllers_spec()
        )
        assert located.spec.controllers["arm"].gains["a"].p == 7.0
    (line,) = refused(OWN, "controllers.amr.gains.a.p=7")
    assert line == "--set controllers.amr.gains.a.p=7: error[CTRL212]: there is no 'amr' in 'controllers'"


@pytest.mark.parametrize("text", [PAPER, ROS2, OWN])
def test_resolved_controllers_come_back_equal(text: str) -> None:
    spec = load_controllers_text(text, "c.yaml", model=controllers_spec()).spec
    assert load_controllers_text(resolved(spec), "resolved", model=controllers_spec()).spec == spec


ROBOT = """\
robot: arm
description: urdf/arm.urdf
groups: {arm: {chain: {base: b, tip: t}}}
poses:
  home: {arm: [0, 45 deg, 5 mm]}
  rest: {arm: {j: 0}}
  same: {arm: home}
limits: {j: {lower: -1, upper: 1, velocity: 2}}
"""


def test_a_robot_file_loads_and_comes_back_equal() -> None:
    located = load_robot_text(ROBOT, "r.yaml", overrides=["robot.limits.j.velocity=90 deg/s", "task=x"])
    assert located.spec.poses["home"]["arm"] == pytest.approx((0.0, 0.7853981633974483, 0.005))
    assert located.spec.limits["j"].velocity == pytest.approx(1.5707963267948966)
    assert str(located.place("poses", "home", "arm", 1)) == "r.yaml:5:19"
    assert str(located.place("limits", "j", "velocity")) == "--set robot.limits.j.velocity=90 deg/s"
    assert load_robot_text(resolved(located.spec), "resolved").spec == located.spec


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("45 deg", "45 dg", "r.yaml:5:19: error[ROBOT207]: poses.home.arm[1]: unknown unit 'dg'"),
        ("45 deg", "45 kg", "r.yaml:5:19: error[ROBOT207]: poses.home.arm[1]: '45 kg' is a mass"),
        (
            "45 deg",
            "true",
            "r.yaml:5:19: error[ROBOT205]: poses.home.arm[1]: expected an angle or a length: a number in rad or m",
        ),
        (
            "arm: home",
            "arm: 3",
            "r.yaml:7:15: error[ROBOT205]: poses.same.arm: expected a list, a mapping, or a string, not 3",
        ),
        ("lower: -1", "lower: 2", "r.yaml:8:21: error[ROBOT208]: limits.j.lower: lower (2) is above upper (1)"),
        ("velocity", "velocty", "r.yaml:8:35: error[ROBOT201]: limits.j: unknown key 'velocty'"),
        ("groups:", "grups:", "r.yaml:3:1: error[ROBOT201]: unknown key 'grups'"),
        (
            "robot: arm\n",
            "robot: arm\ncompat: ros3\n",
            "r.yaml:2:9: error[ROBOT203]: compat: expected one of 'ros1' or 'ros2', not 'ros3'",
        ),
        (
            "robot: arm\n",
            "robot: arm\nmount: {rpy: [0, 0, 0], quat_xyzw: [0, 0, 0, 1]}\n",
            "r.yaml:2:25: error[ROBOT208]: mount: the rotation is given twice",
        ),
    ],
)
def test_a_mistake_in_a_robot_file_is_told_at_its_place(old: str, new: str, expected: str) -> None:
    assert old in ROBOT
    with pytest.raises(InvalidInput) as caught:
        load_robot_text(ROBOT.replace(old, new, 1), "r.yaml")
    assert lines(caught.value.findings)[0].startswith(expected)


def test_a_quaternion_is_of_length_one_within_a_thousandth() -> None:
    load_robot_text(ROBOT + "mount: {quat_xyzw: [0, 0, 0.7071, 0.7071]}\n", "r.yaml")


def test_schemas_are_deterministic_and_say_limits_in_json_schema() -> None:
    assert robot_schema(robot_spec()) == robot_schema(robot_spec())
    schema = json.loads(controllers_schema(controllers_spec()))
    speed = schema["$defs"]["GripperSpec"]["properties"]["speed"]
    speed = speed["anyOf"][0]  # or null
    assert speed["exclusiveMinimum"] == 0
    assert speed["type"] == ["number", "string"]
    one_of = schema["properties"]["controllers"]["additionalProperties"]["oneOf"]
    assert {f"#/$defs/{name}Spec" for name in ("JointTrajectory", "Gripper", "Pid")} < {one["$ref"] for one in one_of}
    for words in (robot_schema(robot_spec()), controllers_schema(controllers_spec())):
        assert '"gt"' not in words
        assert '"ge"' not in words
