"""Pause, steps, reset and entities: the clock moves by the steps alone, and each log simulates the same again."""

from __future__ import annotations

import socket
from array import array
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from manipcli import pipeline
from manipcli.live.command import END, PUBLISH, Command
from manipcli.live.link import Link
from manipcli.live.pace import Pace
from manipcli.live.placing import misplaced
from manipcli.live.source import Schedule, recorded_commands
from manipcli.record.read.reading import read_recording
from tests.live.sessions import ROOT, Raw, opened, serving, trajectory

TASK = f"""\
task: small
robot: {ROOT}/robots/differential_wrist/robot.yaml
controllers: {ROOT}/controllers/differential_wrist.yaml
floor: true
scene:
  ball: {{sphere: {{radius: 5 cm}}, mass: 100 g, pose: {{xyz: [2, 1, 0.05]}}}}
  block: {{box: {{size: [0.2, 0.2, 0.2]}}, pose: {{xyz: [2, 2, 0.1]}}, fixed: true}}
simulation: {{settle: 0.1 s}}
steps: [wait: 0.1 s]
expect: [near: {{object: ball, to: start, within: 1 cm}}]
"""
OK, UNSUPPORTED, NOT_FOUND, FAILED, ALREADY, INCORRECT = 1, 0, 2, 4, 101, 103
STOPPED, PLAYING, PAUSED, QUITTING = 0, 1, 2, 3
PERIOD = 0.001


async def asked(client: Raw, service: str, **request: Any) -> dict[str, Any]:
    """The values of a response."""
    answer = await client.call(service, **request)
    assert answer["result"], answer
    values: dict[str, Any] = answer["values"]
    return values


async def code(client: Raw, service: str, **request: Any) -> int:
    return int((await asked(client, service, **request))["result"]["result"])


async def state(client: Raw, number: int) -> int:
    return await code(client, "/set_simulation_state", state={"state": number})


async def ball(client: Raw) -> tuple[float, np.ndarray]:
    """The time [s] and height and velocity (z) of the ball."""
    found = (await asked(client, "/get_entity_state", entity="ball"))["state"]
    stamp = found["header"]["stamp"]
    here, speed = found["pose"]["position"], found["twist"]["linear"]
    return stamp["sec"] + 1e-9 * stamp["nanosec"], np.array([here["x"], here["y"], here["z"], speed["z"]])


def pose(x: float, y: float, z: float, w: float = 1.0) -> dict[str, Any]:
    return {"pose": {"position": {"x": x, "y": y, "z": z}, "orientation": {"w": w}}}


async def entities(client: Raw) -> None:
    """Names, filters and infos of entities, also for clients that only read."""
    features = (await asked(client, "/get_simulator_features"))["features"]
    assert not {0, 1} & set(features["features"])
    assert "No spawning" in features["custom_info"]

    async def names(**filters: Any) -> list[str]:
        return [*(await asked(client, "/get_entities", filters=filters))["entities"]]

    assert await names() == ["floor", "ball", "block", "robot"]
    assert await names(filter="b.*") == ["ball", "block"]
    assert await names(filter="b.*", categories=[{"category": 5}]) == ["block"]
    assert await names(tags={"tags": ["box", "movable"]}) == ["ball", "block"]
    assert await names(tags={"tags": ["sphere", "movable"], "filter_mode": 1}) == ["ball"]
    assert await code(client, "/get_entities", filters={"bounds": {"type": 3}}) == UNSUPPORTED
    assert await code(client, "/get_entities", filters={"filter": "(b+)+"}) == FAILED
    assert await code(client, "/get_entity_info", entity="bal") == NOT_FOUND
    info = (await asked(client, "/get_entity_info", entity="robot"))["info"]
    assert info["category"]["category"] == 1
    moving = await asked(client, "/get_entities_states", filters={"filter": "robot"})
    assert moving["states"][0]["twist"]["linear"] == {"x": 0.0, "y": 0.0, "z": 0.0}


async def refused_places(client: Raw) -> None:
    before = await ball(client)
    for entity, where in (
        ("block", pose(2, 2, 1)),
        ("robot", pose(2, 2, 1)),
        ("ball", pose(2, 2, 0.1)),
        ("ball", pose(0, 0, 0.02)),
        ("ball", pose(2, 1, 1e9)),
        ("ball", pose(2, 1, 1, w=0.5)),
        ("ball", {**pose(2, 1, 1), "twist": {"linear": {"x": 1e3}}}),
    ):
        assert await code(client, "/set_entity_state", entity=entity, state=where) == FAILED, (entity, where)
    away = {**pose(2, 1, 1), "header": {"frame_id": "block"}}
    assert await code(client, "/set_entity_state", entity="ball", state=away) == UNSUPPORTED
    assert await code(client, "/set_entity_state", entity="boll", state=pose(2, 1, 1)) == NOT_FOUND
    np.testing.assert_array_equal((await ball(client))[1], before[1])


async def paused(client: Raw) -> None:
    """The clock stands but for steps; a placed ball flies as in closed form."""
    assert await code(client, "/step_simulation") == FAILED
    assert [await state(client, PAUSED) for _ in range(2)] == [OK, ALREADY]
    assert await state(client, 9) == INCORRECT
    await refused_places(client)
    began, _ = await ball(client)
    assert (await ball(client))[0] == began
    await client.send(
        op="publish", topic="/wrist_controller/joint_trajectory", msg=trajectory(["pitch", "roll"], [0.1, 0.1], 0.05)
    )
    thrown = {**pose(2, 1, 1), "twist": {"linear": {"z": 0.5}}}
    assert await code(client, "/set_entity_state", entity="ball", state=thrown) == OK
    time, there = await ball(client)
    assert time == began
    np.testing.assert_allclose(there, [2, 1, 1, 0.5], atol=1e-12)

    assert await code(client, "/step_simulation") == OK
    assert await code(client, "/step_simulation", steps=49) == OK
    await client.send(
        op="send_action_goal", id="s", action="/simulate_steps", args={"steps": 50}, feedback=True,
        action_type="simulation_interfaces/action/SimulateSteps",
    )  # fmt: skip
    done = await client.until(op="action_result", id="s")
    assert (done["status"], done["values"]["result"]["result"]) == (4, OK)
    told = [each["values"]["completed_steps"] for each in client.others if each["op"] == "action_feedback"]
    assert told == list(range(1, 50))
    time, there = await ball(client)
    assert time == pytest.approx(began + 100 * PERIOD, abs=1e-9)
    passed = 100 * PERIOD
    height = 1 + 0.5 * passed - 9.81 * passed * (passed + PERIOD) / 2
    np.testing.assert_allclose(there, [2, 1, height, 0.5 - 9.81 * passed], atol=1e-9)


async def reset(client: Raw) -> None:
    """The connection and its subscriptions stay; goals end; the clock begins again."""
    assert await state(client, PLAYING) == OK
    for topic in ("/tf_static", "/clock"):
        await client.send(op="subscribe", topic=topic)
        await client.until(op="publish", topic=topic)
    args = {"trajectory": trajectory(["pitch", "roll"], [0.2, 0.2], 200.0)}
    await client.send(
        op="send_action_goal", id="far", action="/wrist_controller/follow_joint_trajectory", args=args,
        action_type="control_msgs/action/FollowJointTrajectory",
    )  # fmt: skip
    assert await code(client, "/reset_simulation", scope=1) == UNSUPPORTED
    client.others.clear()
    assert await code(client, "/reset_simulation") == OK
    (ended,) = [each for each in client.others if each["op"] == "action_result"]
    assert (ended["status"], ended["values"]["error_string"]) == (6, "the simulation was reset")
    assert any(each.get("topic") == "/tf_static" for each in client.others)
    assert await state(client, PAUSED) == OK
    _, there = await ball(client)
    np.testing.assert_allclose(there, [2, 1, 0.05, 0], atol=1e-3)
    client.others.clear()
    assert await state(client, STOPPED) == OK
    assert await ball(client) == (0.0, pytest.approx(there, abs=1e-3))
    clocks = [each["msg"]["clock"] for each in client.others if each.get("topic") == "/clock"]
    assert (clocks[-1]["sec"], clocks[-1]["nanosec"]) == (0, 0)
    assert await code(client, "/step_simulation", steps=3) == OK
    assert (await asked(client, "/get_simulation_state"))["state"]["state"] == PAUSED
    assert (await asked(client, "/rosapi/get_time"))["time"]["nanosec"] == 2_000_000
    await client.send(op="call_service", id="r", service="/reset_simulation")
    await client.send(op="call_service", id="s", service="/step_simulation")
    assert (await client.until(op="service_response", id="s"))["values"]["result"]["result"] == OK  # it is paused still
    assert await state(client, QUITTING) == OK


def test_a_session_is_paused_stepped_and_reset_and_its_logs_simulate_the_same(tmp_path: Path) -> None:
    async def use(url: str) -> None:
        await entities(await opened(url.partition("?")[0]))
        client = await opened(url)
        await paused(client)
        await reset(client)

    log = serving(tmp_path, use, task=TASK)
    logs = [log, *(log.with_name(f"session-{k}.mcap") for k in (2, 3, 4))]
    assert sorted(tmp_path.glob("*.mcap")) == sorted(logs)
    for each in logs:
        assert pipeline.verify_log(each, package_path=[ROOT / "robots"]).identical
    first, _, last, _ = (read_recording(each) for each in logs)
    np.testing.assert_allclose(np.diff(first.states.time), PERIOD, atol=1e-9)  # no tick is left out
    assert len(last.states.time) == 3
    commands = recorded_commands(log, PERIOD, failed=True)
    ticks = {k for k in range(len(first.states.time) + 1) for _ in commands.take(k)}
    assert any({k, k + 1, k + 50, k + 100} <= ticks for k in ticks)  # pause, 1 step, 49 steps, 50 steps


def test_a_recorded_session_that_waits_for_nobody_goes_on() -> None:
    schedule = Schedule({3: [Command(END, "")]})
    assert [len(schedule.take(tick)) for tick in (2, 3, 3)] == [0, 1, 0]
    assert not schedule.wait(10.0)


def test_the_first_command_after_a_reset_is_before_those_that_came_after_it() -> None:
    ends = socket.socketpair()
    link = Link(ends[0], memoryview(array("q", [0] * 8)))
    first, second, third = (Command(PUBLISH, name) for name in "abc")
    link.give_back([second, third])
    link.give_back([first])
    assert [*link.take(0)] == [first, second, third]
    for end in ends:
        end.close()


def test_a_pause_is_not_made_up_for(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    slept: list[float] = []
    monkeypatch.setattr("time.perf_counter", lambda: now[0])
    monkeypatch.setattr("time.sleep", slept.append)
    late: list[str] = []
    pace = Pace(0.1, lasting=60.0, late=late.append)
    pace.start()
    now[0] = 50.0
    pace.start()
    pace.wait()
    assert (slept, late, pace.over) == ([pytest.approx(0.1)], [], False)
    now[0] = 60.0
    assert pace.over


def test_what_the_robot_holds_is_not_put_elsewhere() -> None:
    held = SimpleNamespace(name="cup")
    session = SimpleNamespace(scene=SimpleNamespace(movable=(held,)), holder=SimpleNamespace(attached="cup"))
    why = misplaced(
        cast(Any, SimpleNamespace(session=session)), "cup", np.zeros(3), np.array([0, 0, 0, 1.0]), np.zeros(6)
    )
    assert "the robot holds it" in why
