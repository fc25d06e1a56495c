"""Controllers files as ROS users have them: repeated nodes, substitutions, and the meaning of defaults.

Oracles: what PyYAML and rclcpp read from the same text.
"""

from __future__ import annotations

from typing import Any

import pytest
import yaml

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.spec.controllers import ConstraintsSpec
from manipcli.spec.load import load_controllers_text
from manipcli.spec.resolved import resolved
from manipcli.spec.ros.tables import DEFAULTS
from manipcli.spec.source.tree import plain
from manipcli.spec.source.yaml import parse
from manipcli.task.vocabulary import controllers_spec

ARM = """\
controller_manager:
  ros__parameters:
    arm: {type: joint_trajectory_controller/JointTrajectoryController}
arm: {ros__parameters: {joints: [a], command_interfaces: [position]%s}}
"""


def loaded(text: str, **args: bool | float | str) -> tuple[dict[str, dict[str, Any]], tuple[Diagnostic, ...]]:
    located = load_controllers_text(text, "c.yaml", model=controllers_spec(), args=args)
    return {name: one.model_dump(exclude_unset=True) for name, one in located.spec.controllers.items()}, (
        located.findings
    )


def codes(findings: tuple[Diagnostic, ...]) -> list[tuple[str, str]]:
    return [(finding.code, finding.severity) for finding in findings if finding.code != "CTRL218"]


def test_a_node_that_occurs_twice_is_merged_and_of_a_parameter_the_last_counts() -> None:
    before = "/**: {ros__parameters: {gains: {a: {p: 1, d: 2}}}}\n"
    after = "/**: {ros__parameters: {gains: {a: {p: 3}}, cmd_timeout: 4.0}}\n"
    controllers, findings = loaded(before + ARM % "" + after)
    assert controllers["arm"]["gains"] == {"a": {"p": 3.0, "d": 2.0}}
    assert controllers["arm"]["cmd_timeout"] == 4.0
    assert [(f.severity, f.message, f.place and f.place.line) for f in findings if f.code == "YAML106"] == [
        ("note", "'/**' occurs at lines 1 and 6: merged", 6),
        ("warning", "'ros__parameters.gains.a.p' is given at lines 1 and 6: the last one counts", 6),
    ]
    with pytest.raises(InvalidInput):  # without parameters it is no node of ROS 2
        loaded("arm: {joints: [a]}\narm: {joints: [b]}")


def test_plugins_of_simulators_are_no_controllers() -> None:
    for name in ("gazebo_ros2_control", "gz_ros_control"):
        controllers, findings = loaded(f"{ARM % ''}{name}: {{ros__parameters: {{hold_joints: false}}}}\n")
        assert list(controllers) == ["arm"]
        assert codes(findings) == [("CTRL214", "note")]


def test_a_node_that_the_manager_does_not_declare_is_left_out() -> None:
    controllers, findings = loaded(f"{ARM % ''}camera: {{ros__parameters: {{rate: 30}}}}\n")
    assert (list(controllers), codes(findings)) == (["arm"], [("CTRL203", "warning")])


def test_substitutions_have_the_values_of_the_robot_file() -> None:
    text = """\
"$(var prefix)arm":
  type: position_controllers/JointTrajectoryController
  joints: ["$(var prefix)a", $(arg other)]
  update_rate: $(var rate)
  constraints: {"$(var prefix)a": {goal: 0.1}}
"""
    controllers, _ = loaded(text, prefix="left_", other="b", rate=250)
    assert controllers["left_arm"]["joints"] == ("left_a", "b")
    assert controllers["left_arm"]["update_rate"] == 250.0
    assert controllers["left_arm"]["constraints"]["joints"] == {"left_a": {"goal": 0.1}}
    with pytest.raises(InvalidInput) as caught:
        loaded(text, prefix="", rate=250)
    (finding,) = [finding for finding in caught.value.findings if finding.severity == "error"]
    assert finding.hint == "give its value in the robot file: `args: {other: ...}` ('' if it is empty)"
    alone = load_controllers_text(ARM % ", cmd_timeout: 1.0" + "#", "c", model=controllers_spec())
    assert "CTRL217" not in [finding.code for finding in alone.findings]


def test_a_goal_time_of_0_means_in_a_file_of_ros_2_what_it_means_there() -> None:
    located = load_controllers_text(ARM % ", constraints: {goal_time: 0.0}", "c.yaml", model=controllers_spec())
    assert located.spec.compat == "ros2"
    assert load_controllers_text(resolved(located.spec), "r", model=controllers_spec()).spec == located.spec
    assert ("CTRL219", "note") in codes(located.findings)
    assert "CTRL219" not in [code for code, _ in codes(loaded(ARM % "")[1])]
    for own in ("arm: {type: joint_trajectory, joints: [a]}", "arm: {type: x_controllers/JointTrajectoryController}"):
        assert load_controllers_text(own, "c.yaml", model=controllers_spec()).spec.compat is None


def test_defaults_that_differ_are_told_once_and_are_those_of_the_spec() -> None:
    text = ARM.replace(
        "arm: {type", "two: {type: joint_trajectory_controller/JointTrajectoryController}\n    arm: {type"
    )
    text = text % ", constraints: {goal_time: 1.0}" + "two: {ros__parameters: {joints: [b]}}\n"
    (note,) = [finding for finding in loaded(text)[1] if finding.code == "CTRL218"]
    assert note.message.count("goal_time 2 s (ROS: 0, no time limit)") == 1
    assert note.message.count("stopped_velocity_tolerance") == 1
    types = controllers_spec().types
    texts = {key: text["ros2"].split(" ")[0] for key, text in DEFAULTS["joint_trajectory"].items()}
    mine = ConstraintsSpec()
    assert float(texts["constraints.goal_time"]) == mine.goal_time
    assert float(texts["constraints.stopped_velocity_tolerance"]) == mine.stopped_velocity_tolerance
    assert texts["constraints.decelerate_on_cancel"] == str(mine.decelerate_on_cancel).lower()
    own = types["joint_trajectory"].model_fields["interpolate_from_desired_state"].default
    assert texts["interpolate_from_desired_state"] == str(own).lower()
    assert DEFAULTS["gripper"]["stall_time"]["ros2"].startswith(
        f"{types['gripper'].model_fields['stall_time'].default}"
    )


@pytest.mark.parametrize(
    "text",
    ["{joint_names:['a'], x: 1}", "{a:[1, 2], b: {c:[d]}}", '{a:"b", c: 1}', "{a: {b:{c: 1}}}", "a: [{b:['c']}]"],
)
def test_a_missing_blank_is_read_as_pyyaml_reads_it(text: str) -> None:
    node = parse(text, "t.yaml")
    assert node is not None
    assert plain(node) == yaml.load(text, yaml.SafeLoader)


CHAIN = """\
controller_manager:
  ros__parameters:
    arm: {type: joint_trajectory_controller/JointTrajectoryController}
    inner: {type: pid_controller/PidController}
arm: {ros__parameters: {joints: [a, b], command_joints: [inner/a, inner/b], command_interfaces: [position]}}
inner:
  ros__parameters:
    dof_names: [a, b]
    command_interface: effort
    reference_and_state_interfaces: [position]
    gains: {a: {p: 10.0}, b: {p: 5.0}}
"""


def test_command_joints_of_a_controller_are_a_chain_and_both_start_active() -> None:
    controllers, findings = loaded(CHAIN)
    assert controllers["arm"]["joints"] == controllers["inner"]["joints"] == ("a", "b")
    assert controllers["arm"]["chained_to"] == "inner"
    assert "active" not in controllers["arm"] | controllers["inner"]
    assert codes(findings) == []
    controllers, _ = loaded(CHAIN.replace("[inner/a, inner/b]", "[a, b]"))
    assert "chained_to" not in controllers["arm"]


def test_a_pid_commands_references_of_another_by_its_dof_names() -> None:
    text = (
        CHAIN
        + """\
outer:
  ros__parameters:
    type: pid_controller/PidController
    dof_names: [inner/a, inner/b]
    reference_and_state_dof_names: [a, b]
    command_interface: position
    reference_and_state_interfaces: [position]
    gains: {inner/a: {p: 10.0}, inner/b: {p: 5.0}}
"""
    )
    controllers, _ = loaded(text)
    outer = controllers["outer"]
    assert (outer["joints"], outer["chained_to"], set(outer["gains"])) == (("a", "b"), "inner", {"a", "b"})
    assert (outer["active"], controllers["arm"].get("active", True)) == (False, True)  # 'arm' has the references


@pytest.mark.parametrize("wrong", ["[a]", "[inner/b, inner/a]", "[inner/a, other/b]", "[inner/a, b]"])
def test_what_cannot_be_chained_is_refused_and_commands_nothing_else(wrong: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        loaded(CHAIN.replace("[inner/a, inner/b]", wrong))
    (finding,) = [finding for finding in caught.value.findings if finding.severity == "error"]
    assert (finding.code, finding.place and finding.place.line) == ("CTRL220", 5)
