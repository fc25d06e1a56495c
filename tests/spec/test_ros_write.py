"""Writing of controllers in the form of ROS 2: reading the file gives the same controllers."""

from __future__ import annotations

import math
from typing import Any

import pytest
import yaml

from manipcli.spec.load import load_controllers_text
from manipcli.spec.ros.tables import TABLES
from manipcli.spec.ros.write import written
from manipcli.task.vocabulary import controllers_spec

CONTROLLERS: dict[str, dict[str, Any]] = {
    "effort": {
        "type": "joint_trajectory", "joints": ["a", "b"], "gains": {"a": {"p": 3, "i": 2}, "b": {"d": 1, "i_clamp": 4}},
        "inverse_dynamics": True, "allow_partial_joints_goal": True, "update_rate": 500,
        "constraints": {"goal_time": 0.5, "joints": {"a": {"trajectory": 0.1, "goal": 0.02}, "b": {"goal": 0.2}}},
    },
    "position": {
        "type": "joint_trajectory", "joints": ["c"], "command_interface": "position", "state_interfaces": ["position"],
        "interpolate_from_desired_state": False, "active": False,
        "constraints": {"stopped_velocity_tolerance": 0, "decelerate_on_cancel": False},
    },
    "hand": {
        "type": "gripper", "joints": ["d"], "gains": {"d": {"p": 5}}, "speed": 0.1, "max_effort": 3,
        "stall_velocity": 0.01, "stall_time": 0.3, "goal_tolerance": 0.04, "allow_stalling": False,
    },
    "finger": {
        "type": "gripper", "joints": ["e"], "command_interface": "position", "stall_velocity": 0.01,
        "goal_tolerance": 0.04,
    },
    "forward": {"type": "forward_command", "joints": ["f"], "command_interface": "velocity"},
    "outer": {"type": "joint_trajectory", "joints": ["g"], "chained_to": "inner", "command_interface": "position"},
    "inner": {"type": "pid", "joints": ["g"], "gains": {"g": {"p": 1, "feedforward_gain": 2}}},
    "states": {"type": "joint_state_broadcaster", "joints": ["a"], "state_interfaces": ["position"]},
    "wrench": {"type": "force_torque_broadcaster", "link": "l"},
}  # fmt: skip


def ros2(controllers: dict[str, dict[str, Any]]) -> str:
    spec = load_controllers_text(yaml.safe_dump({"controllers": controllers}), "c.yaml", model=controllers_spec()).spec
    made = {name: written(own) for name, own in spec.controllers.items()}
    data: dict[str, Any] = {
        "controller_manager": {"ros__parameters": {n: {"type": m.type} for n, m in made.items() if m is not None}}
    }
    data |= {n: {"ros__parameters": m.parameters} for n, m in made.items() if m is not None}
    return yaml.safe_dump(data)


@pytest.mark.parametrize("name", [name for name in CONTROLLERS if name != "outer"])
def test_what_is_written_in_the_form_of_ros_2_reads_back_as_the_same_controller(name: str) -> None:
    both = {"inner": CONTROLLERS["inner"], "outer": CONTROLLERS["outer"]}
    given = both if name == "inner" else {name: CONTROLLERS[name]}
    model = controllers_spec()
    before = load_controllers_text(yaml.safe_dump({"controllers": given}), "c.yaml", model=model).spec
    after = load_controllers_text(ros2(given), "ros.yaml", model=model)
    assert after.spec.compat == "ros2"
    assert not [finding for finding in after.findings if finding.severity != "note"]
    for own, found in after.spec.controllers.items():
        one, other = before.controllers[own], found
        assert one.interfaces == other.interfaces
        different = {"command_interface", "command_interfaces", "frame_id"}  # two spellings; the frame that ROS needs
        assert one.model_dump(exclude=different) == other.model_dump(exclude=different)


def test_numbers_keep_the_type_that_ros_declares() -> None:
    """rclcpp refuses an integer for a parameter that is a double."""
    parameters = yaml.safe_load(ros2({"effort": CONTROLLERS["effort"]}))["effort"]["ros__parameters"]
    assert all(isinstance(value, float) for gains in parameters["gains"].values() for value in gains.values())
    assert parameters["gains"]["a"]["i_clamp"] == math.inf  # the default of ROS is 0: no integral


def test_no_extra_time_is_not_no_time_limit() -> None:
    """A goal_time of 0 has the other meaning in ROS 2."""
    own = CONTROLLERS["effort"] | {"constraints": {"goal_time": 0}}
    parameters = yaml.safe_load(ros2({"effort": own}))["effort"]["ros__parameters"]
    assert 0.0 < parameters["constraints"]["goal_time"] < 1e-6


def test_each_table_writes_a_type_that_it_reads() -> None:
    for table in TABLES:
        assert {*table.ros2.values()} <= table.types.keys()
