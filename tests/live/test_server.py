"""Clients of raw WebSockets: goals, topics, rights, limits, and malformed frames beside a good client."""

from __future__ import annotations

import asyncio
import json
import random
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from benchmarks.malformed_frames import malformed
from manipcli import pipeline
from manipcli.live.access import Access
from manipcli.live.connection import Services
from manipcli.live.offer import Offer
from manipcli.live.opening import MAX_OPENING
from manipcli.live.rosapi import Rosapi
from manipcli.live.server import LiveServer
from manipcli.live.source import recorded_commands
from manipcli.record.foreign.topics import open_topics
from tests.live.sessions import HOME, opened, serving, trajectory

ARM = [f"joint_{k}" for k in range(1, 8)]
GOAL = "/arm_controller/follow_joint_trajectory"


def recorded_ops(log: Path) -> list[str]:
    """The ops of the commands in a log."""
    schedule = recorded_commands(log, 0.001, failed=True)
    return [command.op for tick in range(10**6) for command in schedule.take(tick)]


def test_goals_have_feedback_results_and_codes_and_the_log_simulates_the_same(tmp_path: Path) -> None:
    async def use(url: str) -> None:
        client = await opened(url)

        async def goal(id_: str, joints: list[str], positions: list[float], seconds: float) -> None:
            args = {"trajectory": trajectory(joints, positions, seconds)}
            kind = "control_msgs/action/FollowJointTrajectory"
            await client.send(op="send_action_goal", id=id_, action=GOAL, action_type=kind, args=args, feedback=True)

        near = [value + 0.05 for value in HOME]
        await goal("a", ARM, near, 0.4)
        done = await client.until(op="action_result", id="a")
        assert (done["status"], done["result"], done["values"]["error_code"]) == (4, True, 0)
        feedback = [message for message in client.others if message["op"] == "action_feedback"]
        assert len(feedback) >= 5
        assert feedback[0]["values"]["joint_names"] == ARM

        await goal("b", ARM, [*HOME], 5.0)
        await goal("c", ARM, near, 5.0)
        preempted = await client.until(op="action_result", id="b")
        assert (preempted["status"], preempted["values"]["error_string"]) == (6, "preempted by a new goal")
        await client.send(op="cancel_action_goal", id="c", action=GOAL)
        assert (await client.until(op="action_result", id="c"))["status"] == 5

        await goal("d", ["elbow", *ARM[1:]], near, 1.0)
        unknown = await client.until(op="action_result", id="d")
        assert (unknown["result"], unknown["status"], unknown["error_code"]) == (False, 0, -2)
        assert unknown["values"].startswith("INVALID_JOINTS (-2): ")
        await goal("e", ARM, [9.0] * 7, 1.0)
        assert (await client.until(op="action_result", id="e"))["error_code"] == -1

        switched = await client.call(
            "/controller_manager/switch_controller", deactivate_controllers=["arm_controller"], strictness=2
        )
        assert switched["values"] == {"ok": True, "message": ""}
        listed = await client.call("/controller_manager/list_controllers")
        states = {each["name"]: each["state"] for each in listed["values"]["controller"]}
        assert states == {"arm_controller": "inactive", "hand_controller": "active"}
        await client.socket.close()

    log = serving(tmp_path, use)
    sent = ["send_action_goal"] * 5
    assert recorded_ops(log) == [*sent[:3], "cancel_action_goal", *sent[3:], "call_service", "end"]
    package = Path(__file__).parents[2] / "robots"
    assert pipeline.verify_log(log, package_path=[package]).identical


def test_topics_have_the_messages_of_the_log(tmp_path: Path) -> None:
    seen: list[dict[str, Any]] = []

    async def use(url: str) -> None:
        client = await opened(url)
        names = (await client.call("/rosapi/topics"))["values"]
        types = dict(zip(names["topics"], names["types"], strict=True))
        assert types["/joint_states"] == "sensor_msgs/msg/JointState"
        assert types["/arm_controller/joint_trajectory"] == "trajectory_msgs/msg/JointTrajectory"
        await client.send(op="subscribe", topic="/robot_description")
        assert "<robot" in (await client.until(topic="/robot_description"))["msg"]["data"]
        await client.send(op="subscribe", topic="/nothing", id="s")
        assert "not published" in (await client.until(op="status", id="s"))["msg"]
        states = ("/joint_states", "/tf", "/clock", "/arm_controller/controller_state")
        for topic in ("/tf_static", "/markers", *states):
            await client.send(op="subscribe", topic=topic, type=types[topic])
            seen.append(await client.until(op="publish", topic=topic))
        await client.send(op="subscribe", topic="/rosout")
        await client.send(op="call_service", service="/emergency_stop")
        seen.append(await client.until(op="publish", topic="/rosout"))
        assert "emergency stop" in seen[-1]["msg"]["msg"]
        await client.socket.close()

    log = serving(tmp_path, use)
    content = open_topics(log)
    for message in seen:
        if message["topic"] == "/clock":
            continue
        from manipcli.record.json_message import definition, to_json

        kind = definition(content.all[message["topic"]].type)
        recorded = [
            to_json(kind, data[start : start + length])
            for _, data, places in content.messages([message["topic"]])
            for start, length in zip(places.starts.tolist(), places.lengths.tolist(), strict=True)
        ]
        assert message["msg"] in recorded


def test_without_the_token_a_client_only_reads(tmp_path: Path) -> None:
    async def use(url: str) -> None:
        plain = url.partition("?")[0]
        reader = await opened(plain)
        await reader.send(op="subscribe", topic="/joint_states")
        await reader.until(op="publish", topic="/joint_states")
        msg = trajectory(ARM, HOME, 1.0)
        await reader.send(op="publish", topic="/arm_controller/joint_trajectory", msg=msg, id="p")
        assert "may only read" in (await reader.until(op="status", id="p"))["msg"]
        switched = await reader.call("/controller_manager/switch_controller", deactivate_controllers=["arm_controller"])
        assert switched["result"] is False
        for options in ({"origin": "http://evil.example"}, {"additional_headers": {"Host": "evil.example"}}):
            with pytest.raises(InvalidStatus, match=r"HTTP 40[03]"):
                await connect(plain, **options)  # type: ignore[arg-type]
        with pytest.raises(InvalidStatus, match="401"):
            await connect(f"{plain}?token=wrong")
        await reader.socket.close()

    assert recorded_ops(serving(tmp_path, use)) == ["end"]


class Broken:
    """An outlet that takes messages, and raises at the third; as options it opens itself."""

    notice = "broken: nowhere"

    def __init__(self) -> None:
        self.messages = 0

    def open(self, network: object) -> Broken:
        return self

    def wanted(self) -> tuple[str, ...]:
        return ("/joint_states",)

    def message(self, topic: str, ns: int, data: bytes) -> None:
        self.messages += 1
        if self.messages > 2:
            raise KeyError("lost")

    def watches(self) -> bool:
        return True

    def state(self, tick: int, state: object) -> None: ...

    def close(self) -> None:
        raise OSError("cannot close")


def test_malformed_frames_and_a_broken_outlet_disturb_no_other_client_and_are_no_commands(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    async def attack(url: str, seed: int, frames: int) -> None:
        draw = random.Random(seed)
        socket = await connect(url)
        reading = asyncio.create_task(read(socket))
        for _ in range(frames):
            try:
                await socket.send(malformed(draw, trajectory(ARM, HOME, 1.0)))
            except ConnectionClosed:
                socket = await connect(url)
                reading = asyncio.create_task(read(socket))
        await socket.close()
        await reading

    async def read(socket: Any) -> None:
        try:
            async for text in socket:
                assert "Traceback" not in text
        except ConnectionClosed as closed:
            assert closed.rcvd is None or closed.rcvd.code in (1000, 1007, 1008, 1009)

    async def use(url: str) -> None:
        good = await opened(url)
        await good.send(op="subscribe", topic="/joint_states", throttle_rate=5, queue_length=100)
        attackers = asyncio.gather(*(attack(url, seed, 250) for seed in range(4)))
        count = 0
        while not attackers.done():
            await good.until(op="publish", topic="/joint_states")
            count += 1
        await attackers
        assert count > 10
        assert [message for message in good.others if "dropped" not in message.get("msg", "")] == []
        assert (await good.call("/rosapi/nodes"))["values"] == {"nodes": ["/manipcli"]}
        await good.socket.close()

    assert recorded_ops(serving(tmp_path, use, outlets=[Broken()], speed=1.0)) == ["end"]
    assert [line for line in capfd.readouterr().err.splitlines() if line.startswith("manipcli:")] == [
        "manipcli: broken: nowhere is closed: KeyError: 'lost'",
        "manipcli: an outlet was not closed properly: OSError: cannot close",
    ]


def test_a_large_frame_closes_the_connection(tmp_path: Path) -> None:
    async def use(url: str) -> None:
        client = await opened(url)
        with pytest.raises(ConnectionClosed, match="1009"):
            await client.socket.send(" " * (2 << 20))
            await client.socket.recv()

    serving(tmp_path, use)


def test_the_hand_closes_by_its_action(tmp_path: Path) -> None:
    async def use(url: str) -> None:
        client = await opened(url)
        action = "/hand_controller/gripper_cmd"
        for id_, name, expected in (("a", [], 4), ("b", ["thumb"], 0)):
            args = {"command": {"name": name, "position": [0.3]}}
            await client.send(op="send_action_goal", id=id_, action=action, args=args)
            result = await client.until(op="action_result", id=id_)
            assert result["status"] == expected
            if expected == 4:
                assert result["values"]["reached_goal"] is True
                assert result["values"]["state"]["position"] == pytest.approx([0.3] * 6, abs=0.05)
            else:
                assert result["error_code"] == -2

    serving(tmp_path, use)


def large() -> Services:
    """A topic with a large text, and nothing else."""
    offer = Offer({"/large": "std_msgs/msg/String"}, frozenset({"/large"}), {}, {}, {}, frozenset())
    text = json.dumps({"op": "publish", "topic": "/large", "msg": {"data": "x" * 100_000}})
    return Services(
        offer, lambda topic: text, Rosapi(offer, dict), lambda command: False, lambda call: call(), lambda: None
    )


def test_many_refused_frames_and_handshakes_that_do_not_end_are_closed() -> None:
    async def use() -> None:
        async with LiveServer(large(), Access(None)).listening(0) as port:
            idle = [await asyncio.open_connection("127.0.0.1", port) for _ in range(MAX_OPENING + 9)]
            good = await opened(f"ws://127.0.0.1:{port}")
            for reader, _ in idle[:10]:  # the oldest have made room
                assert await reader.read() == b""
            assert not idle[10][0].at_eof()
            bad = await connect(f"ws://127.0.0.1:{port}")
            with pytest.raises(ConnectionClosed) as closed:
                for k in range(2000):
                    await bad.send("[" * (1_000_000 if k < 4 else 1))  # a long one counts as 245 short ones
                    assert "Traceback" not in str(await bad.recv())
            assert k < 100
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 1008
            assert "too many refused operations; the last: invalid JSON" in closed.value.rcvd.reason
            assert (await good.call("/rosapi/nodes"))["result"] is True
            await good.socket.close()
            for _, writer in idle:
                writer.close()

    asyncio.run(asyncio.wait_for(use(), 60.0))


def test_a_client_that_never_reads_is_disconnected() -> None:

    async def use() -> None:
        async with LiveServer(large(), Access(None), unread=0.1).listening(0) as port:
            deaf = await connect(f"ws://127.0.0.1:{port}", max_queue=1)
            with pytest.raises(ConnectionClosed):
                while True:  # each is answered with the whole text
                    await deaf.send(json.dumps({"op": "subscribe", "topic": "/large"}))
                    await asyncio.sleep(0.002)
            good = await opened(f"ws://127.0.0.1:{port}")
            assert (await good.call("/rosapi/nodes"))["result"] is True
            await good.socket.close()

    asyncio.run(asyncio.wait_for(use(), 60.0))
