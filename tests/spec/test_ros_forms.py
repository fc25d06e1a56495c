"""Controllers files as ROS users have them: every served type, namespaces, wildcards, and what is told of the rest."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.spec.load import kind_of, load_controllers_text
from manipcli.spec.resolved import resolved
from manipcli.spec.ros.table import Block, Table
from manipcli.spec.ros.tables import TABLES, UNSERVED_TYPES
from manipcli.task.vocabulary import controllers_spec

DEFAULTS_NOTE = "CTRL218"
"""The note on other defaults than ROS's, which nearly every file gets; it has a test of its own."""


def loaded(text: str) -> tuple[dict[str, dict[str, Any]], tuple[Diagnostic, ...]]:
    """What was said of each controller, and what was told."""
    located = load_controllers_text(text, "c.yaml", model=controllers_spec())
    spec = located.spec
    assert load_controllers_text(resolved(spec), "resolved", model=controllers_spec()).spec == spec
    findings = tuple(finding for finding in located.findings if finding.code != DEFAULTS_NOTE)
    return {name: one.model_dump(exclude_unset=True) for name, one in spec.controllers.items()}, findings


def refused(text: str) -> list[str]:
    with pytest.raises(InvalidInput) as caught:
        load_controllers_text(text, "c.yaml", model=controllers_spec(), args={})
    return [f"{finding} | {finding.hint}" for finding in caught.value.findings if finding.severity == "error"]


def unread(text: str) -> list[str]:
    """The warnings on unknown keys, which a ROS node does not read."""
    located = load_controllers_text(text, "c.yaml", model=controllers_spec())
    return [f"{finding} | {finding.hint}" for finding in located.findings if finding.code in ("CTRL201", "CTRL203")]


def told(findings: tuple[Diagnostic, ...]) -> list[str]:
    return [str(finding) for finding in findings]


ARM = {"type": "joint_trajectory", "joints": ("a",), "command_interfaces": ("effort",)}


@pytest.mark.parametrize(
    ("block", "expected"),
    [
        ("type: effort_controllers/JointTrajectoryController, joints: [a]", ARM),
        (
            "type: position_controllers/JointTrajectoryController, joints: [a]",
            ARM | {"command_interfaces": ("position",)},
        ),
        (
            "type: velocity_controllers/JointTrajectoryController, joints: [a]",
            ARM | {"command_interfaces": ("velocity",)},
        ),
        (
            "type: pos_vel_controllers/JointTrajectoryController, joints: [a]",
            ARM | {"command_interfaces": ("position", "velocity")},
        ),
        (
            "type: pos_vel_acc_controllers/JointTrajectoryController, joints: [a]",
            ARM | {"command_interfaces": ("position", "velocity", "acceleration")},
        ),
        (
            "type: joint_trajectory_controller/JointTrajectoryController, joints: [a], "
            "command_interfaces: [position, effort]",
            ARM | {"command_interfaces": ("position", "effort")},
        ),
        (
            "type: effort_controllers/GripperActionController, joint: f, goal_tolerance: 0.01, max_effort: 2.0, "
            "stall_velocity_threshold: 0.002, stall_timeout: 0.3, gains: {f: {p: 5}}",
            {
                "type": "gripper", "joints": ("f",), "command_interface": "effort", "goal_tolerance": 0.01,
                "max_effort": 2.0, "stall_velocity": 0.002, "stall_time": 0.3, "gains": {"f": {"p": 5.0}},
            },
        ),
        (
            "type: parallel_gripper_action_controller/GripperActionController, joint: f, max_velocity: 0.1",
            {"type": "gripper", "joints": ("f",), "command_interface": "position", "speed": 0.1},
        ),
        (
            "type: position_controllers/GripperActionController, joint: f, max_effort: 0.0",
            {"type": "gripper", "joints": ("f",), "command_interface": "position"},
        ),
        (
            "type: forward_command_controller/ForwardCommandController, joints: [a, b], interface_name: velocity",
            {"type": "forward_command", "joints": ("a", "b"), "command_interface": "velocity"},
        ),
        *(
            (
                f"type: {family}_controllers/JointGroup{family.capitalize()}Controller, joints: [a, b]",
                {"type": "forward_command", "joints": ("a", "b"), "command_interface": family},
            )
            for family in ("position", "velocity")
        ),
        (
            "type: effort_controllers/JointEffortController, joint: a",
            {"type": "forward_command", "joints": ("a",), "command_interface": "effort"},
        ),
        (
            "type: position_controllers/JointPositionController, joint: a",
            {"type": "forward_command", "joints": ("a",), "command_interface": "position"},
        ),
        (
            "type: effort_controllers/JointPositionController, joint: a, pid: {p: 10, i: 1, d: 2, i_clamp: 3}",
            {
                "type": "pid", "joints": ("a",), "command_interface": "effort",
                "gains": {"a": {"p": 10.0, "i": 1.0, "d": 2.0, "i_clamp": 3.0}},
            },
        ),
        (
            "type: effort_controllers/JointGroupPositionController, joints: [a, b], a: {pid: {p: 1}}, b: {pid: {p: 2}}",
            {
                "type": "pid", "joints": ("a", "b"), "command_interface": "effort",
                "gains": {"a": {"p": 1.0}, "b": {"p": 2.0}},
            },
        ),
        (
            "type: effort_controllers/JointVelocityController, joint: a, pid: {p: 10}",
            {
                "type": "pid", "joints": ("a",), "command_interface": "effort",
                "reference_and_state_interfaces": ("velocity",), "gains": {"a": {"p": 10.0}},
            },
        ),
        (
            "type: velocity_controllers/JointPositionController, joint: a, pid: {p: 10}",
            {"type": "pid", "joints": ("a",), "command_interface": "velocity", "gains": {"a": {"p": 10.0}}},
        ),
        (
            "type: pid_controller/PidController, dof_names: [a], command_interface: effort, "
            "reference_and_state_interfaces: [position, velocity], set_current_state_as_first_setpoint: false, "
            "gains: {a: {p: 1, feedforward_gain: 0.5, angle_wraparound: true, save_i_term: false}}",
            {
                "type": "pid", "joints": ("a",), "command_interface": "effort",
                "reference_and_state_interfaces": ("position", "velocity"),
                "set_current_state_as_first_setpoint": False,
                "gains": {"a": {"p": 1.0, "feedforward_gain": 0.5, "angle_wraparound": True, "save_i_term": False}},
            },
        ),
        ("type: joint_state_controller/JointStateController", {"type": "joint_state_broadcaster"}),
        (
            "type: joint_state_broadcaster/JointStateBroadcaster, joints: [a], interfaces: [position]",
            {"type": "joint_state_broadcaster", "joints": ("a",), "state_interfaces": ("position",)},
        ),
        (
            "type: force_torque_sensor_broadcaster/ForceTorqueSensorBroadcaster, sensor_name: ft, frame_id: wrist",
            {"type": "force_torque_broadcaster", "frame_id": "wrist"},
        ),
    ],
)  # fmt: skip
def test_every_served_type_of_ros_becomes_one_of_ours(block: str, expected: dict[str, Any]) -> None:
    own, word = block.split(", ", 1) if ", " in block else (block, "")
    for text in (
        f"x: {{{block}}}",
        f"controllers: {{x: {{{block}}}}}",
        f"controller_manager: {{ros__parameters: {{x: {{{own}}}}}}}\nx: {{ros__parameters: {{{word}}}}}",
    ):
        controllers, findings = loaded(text)
        assert controllers == {"x": expected}
        assert not [f for f in findings if f.severity == "error"]


JTC = "type: joint_trajectory_controller/JointTrajectoryController"
PARAMETERS = """\
  joints: [a]
  command_interfaces: [effort]
  state_interfaces: [position, velocity]
  allow_partial_joints_goal: true
  allow_nonzero_velocity_at_trajectory_end: true
  allow_integration_in_goal_trajectories: true
  allow_trajectory_replacement: false
  interpolation_method: none
  interpolate_from_desired_state: false
  cmd_timeout: 3.0
  update_rate: 500
  gains:
    a: {p: 3, i: 1, d: 0.1, i_clamp_max: 1, i_clamp_min: -1, u_clamp_max: 2, u_clamp_min: -2, ff_velocity_scale: 1,
      antiwindup_strategy: back_calculation, tracking_time_constant: 0.5, error_deadband: 0.01}
  constraints:
    goal_time: 0.5
    stopped_velocity_tolerance: 0.02
    decelerate_on_cancel: true
    a: {goal: 0.05, trajectory: 0.1, max_deceleration_on_cancel: 2.0}
  speed_scaling: {initial_scaling_factor: 0.5}
  positions_upsampling: {enable: true}
"""


def test_every_parameter_of_a_trajectory_controller_that_is_served_is_passed_on() -> None:
    body = "\n".join("  " + line for line in PARAMETERS.splitlines())
    text = f"controller_manager:\n  ros__parameters:\n    x: {{{JTC}}}\nx:\n  ros__parameters:\n{body}"
    controllers, findings = loaded(text)
    assert findings == ()
    said = controllers["x"]
    gains, constraints = said.pop("gains"), said.pop("constraints")
    assert gains["a"] == {
        "p": 3.0, "i": 1.0, "d": 0.1, "i_clamp_max": 1.0, "i_clamp_min": -1.0, "u_clamp_max": 2.0, "u_clamp_min": -2.0,
        "ff_velocity_scale": 1.0, "antiwindup_strategy": "back_calculation", "tracking_time_constant": 0.5,
        "error_deadband": 0.01,
    }  # fmt: skip
    assert constraints == {
        "goal_time": 0.5, "stopped_velocity_tolerance": 0.02, "decelerate_on_cancel": True,
        "joints": {"a": {"goal": 0.05, "trajectory": 0.1, "max_deceleration_on_cancel": 2.0}},
    }  # fmt: skip
    assert said == {
        "type": "joint_trajectory", "joints": ("a",), "command_interfaces": ("effort",),
        "state_interfaces": ("position", "velocity"), "allow_partial_joints_goal": True,
        "allow_nonzero_velocity_at_trajectory_end": True, "allow_integration_in_goal_trajectories": True,
        "allow_trajectory_replacement": False, "interpolation_method": "none", "interpolate_from_desired_state": False,
        "cmd_timeout": 3.0, "update_rate": 500.0, "speed_scaling": {"initial_scaling_factor": 0.5},
        "positions_upsampling": {"enable": True},
    }  # fmt: skip


ROS_1 = """\
robot:
  arm:
    type: effort_controllers/JointTrajectoryController
    joints: [a, b]
    stop_trajectory_duration: 0.5
    velocity_ff: {a: 1.0, b: 2.0}
    gains:
      a: {p: 100, i: 2, d: 1, i_clamp: 1, antiwindup: true}
    constraints: {goal_time: 0.6, a: {trajectory: 0.1, goal: 0}}
"""


def test_the_form_of_ros_1_with_a_namespace_feed_forward_and_antiwindup(tmp_path: Path) -> None:
    file = tmp_path / "c.yaml"
    file.write_text(ROS_1)
    assert kind_of(file) == "controllers"
    controllers, findings = loaded(ROS_1)
    assert findings == ()
    assert controllers["arm"]["gains"] == {
        "a": {"p": 100.0, "i": 2.0, "d": 1.0, "i_clamp": 1.0, "antiwindup": True, "ff_velocity_scale": 1.0},
        "b": {"ff_velocity_scale": 2.0},
    }
    assert controllers["arm"]["constraints"] == {"goal_time": 0.6, "joints": {"a": {"trajectory": 0.1}}}
    assert controllers["arm"]["stop_trajectory_duration"] == 0.5


def test_our_words_may_stand_beside_those_of_ros() -> None:
    word = "effort_controllers/JointTrajectoryController"
    text = f"x: {{type: {word}, joints: [a], command_interface: velocity, active: false}}"
    controllers, findings = loaded(text)
    assert findings == ()
    assert controllers["x"] == {
        "type": "joint_trajectory", "joints": ("a",), "command_interface": "velocity", "active": False,
    }  # fmt: skip


def test_an_integral_that_ros_1_would_not_let_act_is_told() -> None:
    _, findings = loaded(ROS_1.replace(", i_clamp: 1", ""))
    assert told(findings) == [
        "c.yaml:8:19: warning[CTRL216]: arm.gains.a: in ROS 1 an 'i' without 'i_clamp' has no effect; "
        "here it acts unclamped"
    ]


def test_a_tolerance_that_no_joint_can_miss_is_not_enforced_and_told() -> None:
    controllers, findings = loaded(ROS_1.replace("{trajectory: 0.1, goal: 0}", "{trajectory: 15, goal: 3.1}"))
    assert controllers["arm"]["constraints"]["joints"] == {"a": {"goal": 3.1}}
    assert told(findings) == [
        "c.yaml:9:39: warning[CTRL214]: arm.constraints.a: 'trajectory: 15' (rad or m) is above 3.1416: not enforced"
    ]
    assert findings[0].hint == "in degrees? write radians"


OWN = "{ros__parameters: {joints: [a], command_interfaces: [effort]}}"


@pytest.mark.parametrize(
    "text",
    [
        f"controller_manager: {{ros__parameters: {{x: {{{JTC}}}}}}}\nx: {OWN}",
        f"/controller_manager: {{ros__parameters: {{x: {{{JTC}}}}}}}\n/x: {OWN}",
        f"/ns/controller_manager: {{ros__parameters: {{x: {{{JTC}}}}}}}\n/ns/x: {OWN}",
        f"ns:\n  controller_manager: {{ros__parameters: {{x: {{{JTC}}}}}}}\n  x: {OWN}",
        f"/ns:\n  deeper:\n    controller_manager: {{ros__parameters: {{x: {{{JTC}}}}}}}\n    x: {OWN}",
        f"/**:\n  controller_manager: {{ros__parameters: {{x: {{{JTC}}}}}}}\n  x: {OWN}",
        f"/**/controller_manager: {{ros__parameters: {{x: {{{JTC}}}}}}}\n/**/x: {OWN}",
        f"/**: {{ros__parameters: {{x: {{{JTC}}}}}}}\nx: {OWN}",
        f"/*/controller_manager: {{ros__parameters: {{x.type: {JTC[6:]}}}}}\n/ns/x: {OWN}",
        f"x: {{ros__parameters: {{{JTC}, joints: [a], command_interfaces: [effort]}}}}",
        f"controller_manager: {{ros__parameters: {{x: {{{JTC}, joints: [a], command_interfaces: [effort]}}}}}}",
    ],
)
def test_the_form_of_ros_2_wherever_its_nodes_stand(text: str) -> None:
    assert loaded(text) == ({"x": ARM}, ())


def test_dots_in_names_are_blocks() -> None:
    text = f"""\
controller_manager: {{ros__parameters: {{x: {{{JTC}}}}}}}
x:
  ros__parameters:
    joints: [a]
    command_interfaces: [effort]
    gains.a.p: 3.0
    gains: {{a.d: 0.5}}
    constraints.goal_time: 0.4
    constraints.a.goal: 0.01
    constraints.a.trajectory: 0.0
"""
    controllers, findings = loaded(text)
    assert controllers["x"]["gains"] == {"a": {"p": 3.0, "d": 0.5}}
    assert controllers["x"]["constraints"] == {"goal_time": 0.4, "joints": {"a": {"goal": 0.01}}}
    assert findings == ()
    wrong = refused(text.replace("0.01", "soon"))
    assert wrong[0].startswith("c.yaml:9:25: error[CTRL207]: controllers.x.constraints.joints.a.goal: 'soon'")


def test_controllers_of_one_name_in_two_namespaces_keep_their_namespaces() -> None:
    text = (
        f"left: {{arm: {{{JTC}, joints: [a]}}}}\nright: {{arm: {{{JTC}, joints: [b]}}, hand: {{{JTC}, joints: [c]}}}}"
    )
    controllers, _ = loaded(text)
    assert {name: one["joints"] for name, one in controllers.items()} == {
        "left/arm": ("a",), "right/arm": ("b",), "hand": ("c",),
    }  # fmt: skip


def test_of_several_controllers_of_a_joint_the_one_that_steps_can_use_is_started() -> None:
    forward = "type: position_controllers/JointGroupPositionController, joints: [a, b]"
    text = f"direct: {{{forward}}}\n"
    for name, joint in (("arm", "a"), ("other", "a"), ("free", "c")):
        text += f"{name}: {{{JTC}, joints: [{joint}]}}\n"
    controllers, findings = loaded(text)
    assert {name: one.get("active", True) for name, one in controllers.items()} == {
        "direct": False, "arm": True, "other": False, "free": True,
    }  # fmt: skip
    assert told(findings) == [
        "c.yaml:1:1: note[CTRL215]: controller 'direct' starts inactive: 'arm' commands 'a'",
        "c.yaml:3:1: note[CTRL215]: controller 'other' starts inactive: 'arm' commands 'a'",
    ]
    stated, findings = loaded(text.replace("[a, b]", "[a, b], active: true"))
    assert stated["direct"]["active"] is True, "who says it is asked no further"


def _unserved(block: Block, fields: set[str]) -> list[str]:
    return sorted(name for name in (*block.known, *block.quiet) if name not in fields)


def _text(table: Table) -> str:
    return {
        "joint_trajectory": "joints: [a]",
        "gripper": "joint: a",
        "forward_command": "joints: [a], interface_name: effort",
        "pid": "dof_names: [a], command_interface: effort, gains: {a: {p: 1}}",
        "joint_state_broadcaster": "joints: [a]",
        "force_torque_broadcaster": "frame_id: wrist",
    }[table.own]


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table.own)
def test_what_ros_knows_and_manipcli_does_not_serve_is_named_and_left_out(table: Table) -> None:
    word = next(reversed(table.types))
    plain, before = loaded(f"x: {{type: {word}, {_text(table)}}}")
    for name in _unserved(table.parameters, set(controllers_spec().types[table.own].model_fields)):
        controllers, findings = loaded(f"x: {{type: {word}, {_text(table)}, {name}: 17}}")
        assert controllers == plain, name
        (finding,) = [one for one in findings if one not in before and f"'{name}'" in one.message]
        assert finding.code == "CTRL214"
        assert finding.severity == ("note" if name in table.parameters.quiet else "warning")


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table.own)
def test_what_nobody_knows_is_left_out_with_the_nearest_name_as_a_ros_node_does(table: Table) -> None:
    for word in table.types:
        block = f"x: {{type: {word}, {_text(table)}, update_rat: 17}}"
        (line,) = unread(block)
        assert (
            "warning[CTRL201]: x: unknown key 'update_rat': left out, as in ROS | did you mean 'update_rate'?" in line
        )
        (line,) = refused(f"controllers: {{{block}}}")[:1]
        assert "error[CTRL201]: x: unknown key 'update_rat' | did you mean 'update_rate'?" in line


@pytest.mark.parametrize(
    ("block", "name"),
    [
        (f"{JTC}, joints: [a]", "interface_name: position"),
        (f"{JTC}, joints: [a]", "sensor_name: ft"),
        (f"{JTC}, joints: [a]", "state_interface_names: [position]"),
        ("type: position_controllers/JointGroupPositionController, joints: [a]", "constraints: {goal_time: 1.0}"),
        ("type: joint_state_broadcaster/JointStateBroadcaster", "command_interfaces: [position]"),
        (
            "type: force_torque_sensor_broadcaster/ForceTorqueSensorBroadcaster, frame_id: b",
            "interpolation_method: none",
        ),
    ],
)
def test_a_parameter_that_ros_knows_of_other_controllers_is_ignored_as_ros_does(block: str, name: str) -> None:
    plain, before = loaded(f"x: {{{block}}}")
    controllers, findings = loaded(f"x: {{{block}, {name}}}")
    assert controllers == plain
    (line,) = [str(one) for one in findings if one not in before]
    key = name.partition(":")[0]
    assert f"warning[CTRL214]: x: '{key}' is a parameter of other ROS controllers: left out" in line


def test_our_own_words_are_not_ignored_where_they_do_not_belong() -> None:
    (line,) = refused("x: {type: joint_state_broadcaster/JointStateBroadcaster, inverse_dynamics: true}")
    assert "error[CTRL201]: x: unknown key 'inverse_dynamics'" in line


@pytest.mark.parametrize(
    ("given", "message", "near"),
    [
        ("interpolaton_method: none", "x: unknown key 'interpolaton_method'", "interpolation_method"),
        ("action_monitor_rat: 3", "x: unknown key 'action_monitor_rat'", "action_monitor_rate"),
        ("gains: {a: {pp: 3}}", "x.gains.a: unknown key 'pp'", "p"),
        ("gains: {a: {normalise_error: 3}}", "x.gains.a: unknown key 'normalise_error'", "normalize_error"),
        ("constraints: {a: {gaol: 3}}", "x.constraints.a: unknown key 'gaol'", "goal"),
        ("constraints: {goaltime: 3}", "x.constraints: unknown key 'goaltime'", "goal_time"),
        ("my_own: 3", "x: unknown key 'my_own'", None),
    ],
)
def test_a_slip_in_a_parameter_is_a_warning_at_its_place(given: str, message: str, near: str | None) -> None:
    first = f"controller_manager: {{ros__parameters: {{x: {{{JTC}}}}}}}"
    (line,) = unread(f"{first}\nx: {{ros__parameters: {{joints: [a], {given}}}}}")
    assert line.startswith("c.yaml:2:")
    hint = None if near is None else f"did you mean '{near}'?"
    assert line.endswith(f"warning[CTRL201]: {message}: left out, as in ROS | {hint}")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("gains: {a: 3}", "controllers.x.gains.a: expected a mapping"),
        ("gains: [3]", "controllers.x.gains: expected a mapping"),
        ("gains: {a: {p: strong}}", "controllers.x.gains.a.p: expected a number"),
        ("gains: {a: {p: -1}}", "controllers.x.gains.a.p: must be at least 0"),
        ("gains: {a: {p: .inf}}", "controllers.x.gains.a.p: "),
        ("gains: {a: {p: .nan}}", "'.nan' is not a finite number"),
        ("gains: {a: {antiwindup_strategy: legcy}}", "controllers.x.gains.a.antiwindup_strategy: expected one of"),
        ("constraints: {goal_time: soon}", "controllers.x.constraints.goal_time: "),
        ("joints: a", "controllers.x.joints: expected a list, not 'a'"),
        ("command_interfaces: [efort]", "controllers.x.command_interfaces[0]: expected one of"),
    ],
)
def test_a_mistake_is_told_at_its_place(given: str, message: str) -> None:
    joints = "" if given.startswith("joints") else "joints: [a], "
    first = f"controller_manager: {{ros__parameters: {{x: {{{JTC}}}}}}}"
    lines = refused(f"{first}\nx: {{ros__parameters: {{{joints}{given}}}}}")
    assert len(lines) == 1, lines
    assert lines[0].startswith("c.yaml:2:")
    assert message in lines[0]


@pytest.mark.parametrize(
    "given",
    [
        "command_joints: []",
        "is_async: false",
        "update_rate: 0",
        "gains: {a: {p: 1, i_clamp_max: .inf, i_clamp_min: -.inf, u_clamp_max: .inf, u_clamp_min: -.inf}}",
        "gains: {a: {p: 1, angle_wraparound: false}}",
        'speed_scaling: {state_interface: "", command_interface: ""}',
        "positions_upsampling: {enable: true, policy_frequency: 0.0}",
    ],
)
def test_values_that_say_no_more_than_nothing_are_not_told(given: str) -> None:
    """As `ros2 param dump` writes them."""
    controllers, findings = loaded(f"x: {{{JTC}, joints: [a], {given}}}")
    assert findings == ()
    assert controllers["x"].get("gains", {"a": {"p": 1.0}}) == {"a": {"p": 1.0}}


def test_a_value_that_ros_knows_and_manipcli_does_not_is_a_warning() -> None:
    _, findings = loaded(f"x: {{{JTC}, joints: [a], gains: {{a: {{p: 1, antiwindup_strategy: legacy}}}}}}")
    (line,) = told(findings)
    assert "x.gains.a: ROS parameter 'antiwindup_strategy: legacy' is not supported" in line
    _, findings = loaded(f"x: {{{JTC}, joints: [a], positions_upsampling: {{enable: true, policy_frequency: 30.0}}}}")
    (line,) = told(findings)
    assert "x.positions_upsampling: ROS parameter 'policy_frequency' is not supported" in line


def test_types_that_manipcli_does_not_serve_are_left_out_and_unknown_ones_are_errors() -> None:
    for word in sorted(UNSERVED_TYPES):
        controllers, findings = loaded(f"base: {{type: {word}, wheels: 4}}\nx: {{{JTC}, joints: [a]}}")
        assert list(controllers) == ["x"]
        (line,) = told(findings)
        assert f"warning[CTRL214]: controller 'base': ROS type '{word}'" in line
    (line,) = refused("x: {type: joint_trajectry_controller/JointTrajectoryController, joints: [a]}")
    assert "did you mean 'joint_trajectory_controller/JointTrajectoryController'?" in line


@pytest.mark.parametrize(
    "word",
    [
        "ur_controllers/GPIOController",
        "ur_controllers/PassthroughTrajectoryController",
        "robotiq_controllers/RobotiqActivationController",
        "franka_example_controllers/JointImpedanceExampleController",
        "pr2_controllers/Mover",
        "robotiq_joint_trajectory_controller/JointTrajectoryController",
    ],
)
def test_the_type_of_a_vendor_is_left_out_with_a_warning_and_its_parameters_are_not_read(word: str) -> None:
    manager = f"controller_manager: {{ros__parameters: {{io: {{type: {word}}}, x: {{{JTC}}}}}}}\n"
    controllers, findings = loaded(f"{manager}x: {OWN}\nio: {{ros__parameters: {{inputs: 3, gains: [1]}}}}\n")
    assert controllers == {"x": ARM}
    (line,) = told(findings)
    assert (
        f"c.yaml:1:51: warning[CTRL214]: controller 'io': type '{word}' of package '{word.partition('/')[0]}'" in line
    )
    assert (findings[0].hint or "").startswith("did you mean 'joint_traj") == word.endswith(
        "r/JointTrajectoryController"
    )


@pytest.mark.parametrize(
    ("word", "near"),
    [
        (
            "joint_trajectory_controllers/JointTrajectoryController",
            "joint_trajectory_controller/JointTrajectoryController",
        ),
        ("position_controler/JointTrajectoryController", "position_controllers/JointTrajectoryController"),
        ("effort_controllers/JointTrajectryController", "effort_controllers/JointTrajectoryController"),
        ("Effort_Controllers/JointTrajectoryController", "effort_controllers/JointTrajectoryController"),
        ("effort_controllers/GripperController", "effort_controllers/GripperActionController"),
        ("joint_state_braodcaster/JointStateBroadcaster", "joint_state_broadcaster/JointStateBroadcaster"),
        ("diff_drive_controller/DifDriveController", "diff_drive_controller/DiffDriveController"),
    ],
)
def test_a_slip_in_a_type_of_ros_is_an_error_with_the_right_name(word: str, near: str) -> None:
    (line,) = refused(f"x: {{type: {word}, joints: [a]}}")
    assert line.endswith(f"error[CTRL203]: controller 'x': unknown type '{word}' | did you mean '{near}'?")


@pytest.mark.parametrize(
    ("word", "plain"),
    [
        ("ur_controllers/ScaledJointTrajectoryController", "joint_trajectory_controller/JointTrajectoryController"),
        ("position_controllers/ScaledJointTrajectoryController", "position_controllers/JointTrajectoryController"),
        ("velocity_controllers/ScaledJointTrajectoryController", "velocity_controllers/JointTrajectoryController"),
    ],
)
def test_a_trajectory_controller_with_a_speed_slider_is_one_at_full_speed(word: str, plain: str) -> None:
    form = "x: {{type: {}, joints: [a], gains: {{a: {{p: 1}}}}, constraints: {{goal_time: 0.5}}{}}}"
    scaled, findings = loaded(form.format(word, ", speed_scaling_interface_name: speed_scaling/speed_scaling_factor"))
    wanted, others = loaded(form.format(plain, ""))
    assert scaled == wanted
    assert others == ()
    (line,) = told(findings)
    assert "note[CTRL214]: x: ROS parameter 'speed_scaling_interface_name' is not supported" in line


def test_what_else_stands_in_such_files_is_left_out() -> None:
    text = f"joint_limits: {{a: {{max_velocity: 1}}}}\ncontroller_list: [{{name: x}}]\nx: {{{JTC}, joints: [a]}}\n"
    controllers, findings = loaded(text)
    assert list(controllers) == ["x"]
    assert told(findings) == [
        "c.yaml:1:1: warning[CTRL214]: 'joint_limits' is not a controller: left out",
        "c.yaml:2:1: warning[CTRL214]: 'controller_list' is not a controller: left out",
    ]


def test_the_parameters_of_the_manager() -> None:
    text = f"""\
controller_manager:
  ros__parameters:
    update_rate: 500
    lock_memory: true
    enforce_command_limits: true
    defaults: {{switch_controller: {{strictness: strict}}}}
    x: {{{JTC}, joints: [a]}}
"""
    _, findings = loaded(text)
    assert [(f.severity, f.place.line if f.place else 0, f.hint) for f in findings] == [
        ("note", 3, "write `simulation: {control_period: 0.002 s}` in the task"),
        ("note", 4, None),
        ("warning", 6, None),
    ]
    (line,) = unread(text.replace("update_rate", "updaterate"))
    assert line == (
        "c.yaml:3:5: warning[CTRL201]: controller_manager: unknown key 'updaterate': left out, as in ROS"
        " | did you mean 'update_rate'?"
    )


def test_what_does_nothing_on_the_positions_of_a_hand_is_told() -> None:
    hand = "type: position_controllers/GripperActionController, joint: f"
    controllers, findings = loaded(f"x: {{{hand}, max_effort: 50.0, gains: {{f: {{p: 5}}}}}}")
    assert controllers == {"x": {"type": "gripper", "joints": ("f",), "command_interface": "position"}}
    assert [one.partition("warning[CTRL214]: ")[2] for one in told(findings)] == [
        "x: 'max_effort' has no effect on the position interface: left out",
        "x: 'gains' has no effect on the position interface: left out",
    ]
    controllers, findings = loaded(f"x: {{{hand}, max_effort: 2, command_interface: effort, gains: {{f: {{p: 5}}}}}}")
    assert (controllers["x"]["max_effort"], controllers["x"]["gains"], findings) == (2.0, {"f": {"p": 5.0}}, ())


def test_a_wrench_of_no_link_is_left_out() -> None:
    text = f"ft: {{type: force_torque_sensor_controller/ForceTorqueSensorController}}\nx: {{{JTC}, joints: [a]}}\n"
    controllers, findings = loaded(text)
    assert list(controllers) == ["x"]
    assert [(f.severity, f.hint) for f in findings] == [("warning", "add `link: ...`")]


@pytest.mark.parametrize("word", ["acceleration", "pid_gain", "kp"])
def test_a_forward_controller_of_another_hardware_s_interface_is_left_out(word: str) -> None:
    forward = f"y: {{type: forward_command_controller/ForwardCommandController, joints: [a], interface_name: {word}}}"
    controllers, findings = loaded(f"x: {{{JTC}, joints: [a]}}\n{forward}\n")
    assert list(controllers) == ["x"]
    (line,) = told(findings)
    assert line.partition("warning[CTRL214]: ")[2] == (
        f"controller 'y': joints have no interface '{word}' (interface_name): left out"
    )


def test_a_slip_in_the_interface_of_a_forward_controller_is_an_error_under_its_own_key() -> None:
    forward = "type: forward_command_controller/ForwardCommandController, joints: [a], interface_name: Velocty"
    (line,) = refused(f"x: {{{forward}}}")
    assert line.endswith("error[CTRL203]: controller 'x': unknown interface_name 'Velocty' | did you mean 'velocity'?")


def test_what_a_launch_file_would_fill_in_is_one_error_beside_all_else_that_is_told() -> None:
    joint = '"$(var tf_prefix)a"'
    text = f"""\
io: {{type: ur_controllers/GPIOController, tf_prefix: "$(var tf_prefix)"}}
"$(var tf_prefix)x": {{{JTC}, joints: [{joint}], constraints: {{{joint}: {{goal: 0.1}}}}}}
"""
    with pytest.raises(InvalidInput) as caught:
        load_controllers_text(text, "c.yaml", model=controllers_spec(), args={})
    found = [(f.code, f.severity) for f in caught.value.findings if f.code != DEFAULTS_NOTE]
    assert found == [("CTRL214", "warning"), ("CTRL217", "error")]
    (line,) = refused(text)
    assert line.startswith("c.yaml:2:") and "unresolved launch substitution '$(var tf_prefix)'" in line
    assert " in 2 places" in line
    controllers, _ = loaded(text.replace(joint, "a"))
    assert list(controllers) == ["$(var tf_prefix)x"]


def test_the_settings_of_a_simulated_hardware_are_no_controller() -> None:
    """As the Setup Assistant of MoveIt 1 writes them."""
    text = (
        f"moveit_sim_hw_interface: {{joint_model_group: arm, joint_model_group_pose: home}}\nx: {{{JTC}, joints: [a]}}"
    )
    controllers, findings = loaded(text)
    assert (list(controllers), [f.code for f in findings]) == (["x"], ["CTRL214"])
