"""Parameters that a file of ROS 2 gives to all nodes, below `/**`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.spec.load import kind_of, load_controllers_text
from manipcli.task.vocabulary import controllers_spec

JTC = "type: joint_trajectory_controller/JointTrajectoryController"
STATES = "type: joint_state_broadcaster/JointStateBroadcaster"
POSITION = {"type": "joint_trajectory", "command_interfaces": ("position",)}


def loaded(text: str) -> tuple[dict[str, dict[str, Any]], tuple[Diagnostic, ...]]:
    located = load_controllers_text(text, "c.yaml", model=controllers_spec())
    findings = tuple(finding for finding in located.findings if finding.code != "CTRL218")  # other defaults than ROS's
    return {name: one.model_dump(exclude_unset=True) for name, one in located.spec.controllers.items()}, findings


def refused(text: str) -> list[str]:
    with pytest.raises(InvalidInput) as caught:
        load_controllers_text(text, "c.yaml", model=controllers_spec())
    return [f"{finding} | {finding.hint}" for finding in caught.value.findings if finding.severity == "error"]


def all_and(parameters: str, *nodes: str, wildcard: str = "/**") -> str:
    return "\n".join([f"{wildcard}: {{ros__parameters: {{{parameters}}}}}", *nodes])


def node(name: str, parameters: str) -> str:
    return f"{name}: {{ros__parameters: {{{parameters}}}}}"


@pytest.mark.parametrize("wildcard", ["/**", "/*", "'**'"])
def test_controllers_named_by_their_own_blocks_have_type_and_interfaces_from_all(wildcard: str, tmp_path: Path) -> None:
    shared = f"{JTC}, command_interfaces: [position]"
    text = all_and(shared, node("one", "joints: [a]"), node("/ns/two", "joints: [b]"), wildcard=wildcard)
    assert loaded(text) == ({"one": POSITION | {"joints": ("a",)}, "two": POSITION | {"joints": ("b",)}}, ())
    (tmp_path / "c.yaml").write_text(text)
    assert kind_of(tmp_path / "c.yaml", types=controllers_spec().types) == "controllers"


def test_what_a_controller_says_itself_wins_to_the_depth_of_blocks() -> None:
    shared = f"{JTC}, command_interfaces: [effort], gains.a: {{p: 1.0, d: 2.0}}, constraints.goal_time: 3.0"
    own = "joints: [a], command_interfaces: [velocity], gains.a.p: 5.0, constraints.a.goal: 0.1"
    controllers, findings = loaded(all_and(shared, node("one", own)))
    assert findings == ()
    assert controllers["one"] == {
        "type": "joint_trajectory", "joints": ("a",), "command_interfaces": ("velocity",),
        "gains": {"a": {"p": 5.0, "d": 2.0}}, "constraints": {"goal_time": 3.0, "joints": {"a": {"goal": 0.1}}},
    }  # fmt: skip


def test_each_controller_takes_what_it_knows_and_of_the_joints_its_own() -> None:
    gains = "gains: {a: {p: 1.0}, b: {p: 2.0}}, constraints: {a: {goal: 0.1}, goal_time: 1.0}"
    manager = f"controller_manager: {{ros__parameters: {{one: {{{JTC}}}, two: {{{JTC}}}, states: {{{STATES}}}}}}}"
    controllers, findings = loaded(
        all_and(f"{gains}, use_sim_time: true", manager, node("one", "joints: [a]"), node("two", "joints: [b]"))
    )
    assert [(one.severity, one.message) for one in findings] == [
        ("note", "controller_manager: ROS parameter 'use_sim_time' is not supported: left out")
    ]
    assert {name: one.get("gains") for name, one in controllers.items()} == {
        "one": {"a": {"p": 1.0}}, "two": {"b": {"p": 2.0}}, "states": None,
    }  # fmt: skip
    assert controllers["one"]["constraints"] == {"goal_time": 1.0, "joints": {"a": {"goal": 0.1}}}
    assert controllers["two"]["constraints"] == {"goal_time": 1.0}


def test_a_wildcard_of_a_namespace_holds_there() -> None:
    text = all_and(JTC, node("/left/arm", "joints: [a]"), node("/right/arm", "joints: [b]"), wildcard="/left/**")
    controllers, (finding,) = loaded(text)
    assert controllers == {"arm": {"type": "joint_trajectory", "joints": ("a",)}}
    assert str(finding).startswith("c.yaml:3:1: warning[CTRL203]: the controller_manager does not declare controller")
    controllers, _ = loaded("\n".join(text.splitlines()[:2]))
    assert controllers == {"arm": {"type": "joint_trajectory", "joints": ("a",)}}


def test_what_no_controller_takes_is_told() -> None:
    shared = f"{JTC}, command_interfaces: [position]"
    one = node("one", "joints: [a]")
    _, findings = loaded(all_and(f"{shared}, max_effort: 3.0", one))
    assert [(f.severity, f.message) for f in findings] == [
        ("warning", "/**: no controller here uses 'max_effort': left out")
    ]
    _, (finding,) = loaded(all_and(f"{shared}, comand_interfaces: [effort]", one))
    assert (finding.severity, finding.hint) == ("warning", "did you mean 'command_interfaces'?")
    assert finding.message == "/**: unknown key 'comand_interfaces': left out, as in ROS"
    (line, *_) = refused(all_and(shared))
    assert line.startswith("c.yaml:1:25: error[CTRL203]: /**: no controller block uses this type | add `NAME: ")
    assert loaded(all_and("anything: 3", node("io", "type: ur_controllers/GPIOController")))[0] == {}


def test_a_node_that_is_no_controller_does_not_become_one() -> None:
    controllers, findings = loaded(all_and(JTC, node("one", "joints: [a]"), node("robot_state_publisher", "rate: 3")))
    assert list(controllers) == ["one"]
    assert [f.message for f in findings] == ["'robot_state_publisher' is not a controller: left out"]
