"""Services of the controller manager, parameters and speed scaling of a live robot, and what its log then shows."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from manipcli import pipeline
from manipcli.live.command import CALL_SERVICE, END, PUBLISH, Answer, Command
from manipcli.live.interface import endpoints_of
from manipcli.live.offer import request_type
from manipcli.record.foreign.topics import open_topics
from manipcli.record.json_message import definition, from_json, to_json
from manipcli.run.execute import build_manager
from tests.live.sessions import HOME, ROOT, SMALL, opened, serving, simulated, trajectory

ARM = [f"joint_{k}" for k in range(1, 8)]
STATE = "/arm_controller/controller_state"
MOVED = [value + 0.1 for value in HOME]


def call(service: str, kind: str, **request: Any) -> Command:
    """A call of a service of this type."""
    message = from_json(definition(request_type(kind)), request)
    return Command(CALL_SERVICE, service, json=json.dumps(message))


def publish(topic: str, kind: str, message: dict[str, Any]) -> Command:
    return Command(PUBLISH, topic, json=json.dumps(from_json(definition(kind), message)))


def move(seconds: float) -> Command:
    message = trajectory(ARM, MOVED, seconds)
    return publish("/arm_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory", message)


def set_gain(joint: str, gain: str, value: object, controller: str = "arm_controller") -> Command:
    name = f"/{controller}:gains.{joint}.{gain}"
    return call("/rosapi/set_param", "rosapi_msgs/srv/SetParam", name=name, value=json.dumps(value))


def manage(verb: str, name: str = "arm_controller") -> Command:
    kind = f"controller_manager_msgs/srv/{verb.title()}Controller"
    return call(f"/controller_manager/{verb}_controller", kind, name=name)


def switch(**request: Any) -> Command:
    kind = "controller_manager_msgs/srv/SwitchController"
    return call("/controller_manager/switch_controller", kind, strictness=2, **request)


def messages(log: Path, topic: str) -> list[tuple[int, dict[str, Any]]]:
    """The messages of a topic with their control tick (1 ms)."""
    content = open_topics(log)
    kind = definition(content.all[topic].type)
    found = []
    for _, data, places in content.messages([topic]):
        for time, start, length in zip(places.times, places.starts, places.lengths, strict=True):
            found.append((round(time / 1e6), to_json(kind, data[start : start + length])))
    return found


def session(folder: Path, commands: dict[int, list[Command]], end: int, name: str = "session") -> Path:
    file, log = folder / "small.yaml", folder / f"{name}.mcap"
    file.write_text(SMALL)
    simulated(file, commands | {end: [Command(END, "")]}, log)
    return log


def test_a_changed_gain_is_in_the_next_command_and_in_the_tracking_error_after_it(tmp_path: Path) -> None:
    """Up to the tick of the change the session is the one without it; its command differs by (p' - p) e."""
    changed = session(tmp_path, {5: [move(0.2)], 100: [set_gain("joint_2", "p", 90.0)]}, 120, "changed")
    plain = session(tmp_path, {5: [move(0.2)]}, 120, "plain")
    states, same = messages(changed, STATE), messages(plain, STATE)
    for (tick, own), (_, other) in zip(states, same, strict=True):
        assert (own["error"] != other["error"]) == (tick > 100), tick
        assert (own["output"] != other["output"]) == (tick >= 100), tick
    difference = np.subtract(*(each[100][1]["output"]["effort"] for each in (states, same)))
    error = states[100][1]["error"]["positions"][1]
    assert abs(error) > 1e-4
    np.testing.assert_allclose(
        difference, [0.0, (90.0 - 800.0) * error, 0.0, 0.0, 0.0, 0.0, 0.0], rtol=1e-6, atol=1e-12
    )
    assert pipeline.verify_log(changed).identical


def test_a_controller_is_unloaded_loaded_and_paused_and_the_log_simulates_the_same(tmp_path: Path) -> None:
    pause, resume = (call(f"/arm_controller/{word}", "std_srvs/srv/Trigger") for word in ("pause", "resume"))
    answers: list[Answer] = []
    asked = {"name": "/arm_controller:gains.joint_1.p"}
    get = replace(call("/rosapi/get_param", "rosapi_msgs/srv/GetParam", **asked), answer=answers.append)
    slower = publish("/arm_controller/speed_scaling", "std_msgs/msg/Float64", {"data": 0.5})
    log = session(
        tmp_path,
        {
            5: [set_gain("joint_1", "p", 111.0), manage("unload"), get],  # refused: it is active
            20: [switch(deactivate_controllers=["arm_controller"]), manage("unload")],
            60: [manage("load"), switch(activate_controllers=["arm_controller"])],  # refused: it is unconfigured
            80: [manage("configure"), switch(activate_controllers=["arm_controller"]), move(0.4)],
            200: [pause],
            600: [resume, slower, get],
        },
        1300,
    )
    states = messages(log, STATE)
    ticks = [tick for tick, _ in states]
    assert ticks == [*range(20), *range(80, 1300)]
    hand = messages(log, "/hand_controller/controller_state")
    assert [tick for tick, _ in hand] == [*range(1300)]
    assert {len(state["output"]["effort"]) for _, state in hand} == {6}
    assert [answer.values["value"] for answer in answers] == ["111.0", "300.0"], (
        "a loaded one has the gains of its file"
    )
    factor = {tick: state["speed_scaling_factor"] for tick, state in states}
    assert (factor[150], factor[590], factor[1200]) == (1.0, 0.0, 0.5)
    paused = {tuple(state["reference"]["positions"]) for tick, state in states if 580 <= tick <= 600}
    assert len(paused) == 1
    (rest,) = paused
    shares = (np.array(rest) - HOME) / (np.array(MOVED) - HOME)
    np.testing.assert_allclose(shares, shares[0], atol=2e-3)  # on the straight path of the trajectory
    assert 0.1 < shares[0] < 0.9
    assert states[-1][1]["reference"]["positions"] == pytest.approx(MOVED)
    refused = [event["text"] for _, event in messages(log, "/task/events") if event["kind"] == "refused"]
    assert len(refused) == 1
    assert "active; deactivate it before unloading" in refused[0]
    assert pipeline.verify_log(log).identical


CONTROLLERS = """\
controllers:
  arm_controller:
    type: forward_command
    joints: [joint_1, joint_2, joint_3, joint_4, joint_5, joint_6]
    command_interface: position
  wrist_controller:
    type: pid
    joints: [joint_7]
    reference_and_state_interfaces: [position, velocity]
    gains: {joint_7: {p: 30, d: 0.4}}
"""


def test_commands_and_references_by_topic(tmp_path: Path) -> None:
    """A position is the command of the next tick; a wrong number of values changes nothing."""
    (tmp_path / "controllers.yaml").write_text(CONTROLLERS)
    file, log = tmp_path / "task.yaml", tmp_path / "session.mcap"
    file.write_text(SMALL.replace(f"{ROOT}/controllers/arm7_hand3.yaml", str(tmp_path / "controllers.yaml")))
    there = [value + 0.001 for value in HOME[:6]]
    kind, reference = "std_msgs/msg/Float64MultiArray", "control_msgs/msg/MultiDOFCommand"
    commands = {
        10: [publish("/arm_controller/commands", kind, {"data": there})],
        12: [publish("/arm_controller/commands", kind, {"data": there[:5]})],
        14: [publish("/wrist_controller/reference", reference, {"dof_names": ["joint_7"], "values": [0.02]})],
        16: [publish("/wrist_controller/reference", reference, {"dof_names": ["joint_1"], "values": [0.5]})],
        18: [set_gain("joint_7", "ff_velocity_scale", 1.0, "wrist_controller")],
        40: [Command(END, "")],
    }
    simulated(file, commands, log)
    positions = [state["output"]["positions"] for _, state in messages(log, STATE)]
    assert positions[9] != there
    assert all(found == there for found in positions[10:])
    wrist = messages(log, "/wrist_controller/controller_state")
    assert [state["reference"]["positions"][0] for _, state in wrist][14:] == [0.02] * 26
    refused = [event["text"] for _, event in messages(log, "/task/events") if event["kind"] == "refused"]
    words = ("expected 6", "each joint of controller 'wrist_controller' once", "no effect in a `pid` controller")
    assert [word in text for word, text in zip(words, refused, strict=True)] == [True] * 3


def test_all_services_have_a_definition_of_their_request_and_response(tmp_path: Path) -> None:
    file = tmp_path / "small.yaml"
    file.write_text(SMALL)
    task = pipeline.load_task(file)
    for endpoint in endpoints_of(task, build_manager(task).controllers):
        if endpoint.kind == "service":
            definition(request_type(endpoint.type))
            definition(endpoint.type.replace("/srv/", "/") + "_Response")
        elif endpoint.kind == "topic":
            definition(endpoint.type)


def test_parameters_are_read_and_set_and_wrong_values_refused(tmp_path: Path) -> None:
    async def use(url: str) -> None:
        owner = await opened(url)
        name, kind = "/arm_controller:gains.joint_2.p", "joint_trajectory_controller/JointTrajectoryController"
        assert name in (await owner.call("/rosapi/get_param_names"))["values"]["names"]
        assert (await owner.call("/rosapi/get_param", name=name))["values"]["value"] == "800.0"
        assert (await owner.call("/rosapi/set_param", name=name, value="640"))["result"]
        assert (await owner.call("/rosapi/get_param", name=name))["values"]["value"] == "640.0"
        misspelt = await owner.call("/rosapi/set_param", name="/arm_controller:gains.joint_2.q", value="1")
        assert "did you mean 'gains.joint_2.p'" in misspelt["values"]
        for wrong in ("-1", '"stiff"', "NaN"):
            assert (await owner.call("/rosapi/set_param", name=name, value=wrong))["result"] is False, wrong
        urdf = await owner.call("/rosapi/get_param", name="robot_description")
        assert json.loads(urdf["values"]["value"]).lstrip().startswith("<")
        (arm, _) = (await owner.call("/controller_manager/list_controllers"))["values"]["controller"]
        assert (arm["name"], arm["type"], arm["state"]) == ("arm_controller", kind, "active")
        asked = [
            {"name": "gains.joint_2.p", "value": {"type": number, field: 700}}
            for number, field in ((2, "integer_value"), (3, "double_value"))
        ]
        results = (await owner.call("/arm_controller/set_parameters", parameters=asked))["values"]["results"]
        assert [each["successful"] for each in results] == [False, True]
        reader = await opened(url.partition("/?")[0])  # without the token
        refused = await reader.call("/rosapi/set_param", name=name, value="1")
        assert refused["result"] is False
        assert "may only read" in refused["values"]
        read = await reader.call("/rosapi/get_param", name=name)
        assert read["values"]["value"] == "700.0"
        for long, value in (("x" * 10**5, "1"), (name, "[" * 10**5)):
            hostile = await owner.call("/rosapi/set_param", name=long, value=value)
            assert hostile["result"] is False
            assert len(hostile["values"]) < 400

    log = serving(tmp_path, use)
    assert pipeline.verify_log(log).identical
