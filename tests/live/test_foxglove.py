"""A client of raw WebSockets that speaks `foxglove.sdk.v1`: topics, schemas, assets, and nothing that commands."""

from __future__ import annotations

import json
import re
import socket
import struct
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from websockets.asyncio.client import ClientConnection, connect

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.live import foxglove
from manipcli.live.foxglove import FoxgloveOptions
from manipcli.live.offer import Offer
from manipcli.live.outlet import Network, Outlet
from manipcli.live.publisher import Publisher
from manipcli.live.source import recorded_commands
from manipcli.record.definition import read_definition
from manipcli.record.foreign.topics import open_topics
from manipcli.record.json_message import to_json
from manipcli.run.observer import SILENT
from tests.live.sessions import ROOT, serving

SAMPLED = ("/joint_states", "/tf", "/arm_controller/controller_state", "/arm_controller/error")
LATCHED = ("/robot_description", "/tf_static", "/markers")
NOTHING = Offer({"/clock": "rosgraph_msgs/msg/Clock"}, frozenset(), {}, {}, {}, frozenset())


class Told:
    """A display that keeps the messages."""

    def __init__(self) -> None:
        self.messages: list[str] = []

    def __getattr__(self, name: str) -> Any:
        return getattr(SILENT, name)

    def message(self, text: str, *, detail: bool) -> None:
        self.messages.append(text)


class Foxglove:
    """One client: the answers that are texts, by op; the values that it has seen, by topic."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection
        self.channels: dict[str, dict[str, Any]] = {}
        self.topics: dict[int, str] = {}
        self.seen: dict[str, list[bytes]] = {}
        self.times: list[int] = []
        self.assets: dict[int, bytes | None] = {}
        self.texts: list[dict[str, Any]] = []

    async def send(self, **frame: Any) -> None:
        await self.connection.send(json.dumps(frame))

    async def subscribe(self, *topics: str) -> None:
        asked = [{"id": self.channels[topic]["id"], "channelId": self.channels[topic]["id"]} for topic in topics]
        await self.send(op="subscribe", subscriptions=asked)

    async def receive(self) -> None:
        frame = await self.connection.recv()
        if isinstance(frame, str):
            message = json.loads(frame)
            self.texts.append(message)
            for channel in message.get("channels", ()):
                self.channels[channel["topic"]] = channel
                self.topics[channel["id"]] = channel["topic"]
        elif frame[0] == 1:
            number, _ = struct.unpack_from("<IQ", frame, 1)
            self.seen.setdefault(self.topics[number], []).append(frame[13:])
        elif frame[0] == 2:
            self.times.append(struct.unpack_from("<Q", frame, 1)[0])
        elif frame[0] == 4:
            request, status, length = struct.unpack_from("<IBI", frame, 1)
            self.assets[request] = None if status else frame[10 + length :]

    def of(self, op: str) -> list[dict[str, Any]]:
        return [text for text in self.texts if text["op"] == op]


def test_foxglove_sees_the_log_and_its_meshes_and_commands_nothing(tmp_path: Path) -> None:
    told = Told()
    found: list[Foxglove] = []
    mesh: dict[str, bytes] = {}

    async def use(_: str) -> None:
        (line,) = [text for text in told.messages if "Foxglove" in text]
        match = re.search(r"ws://127\.0\.0\.1:(\d+)", line)
        assert match is not None, line
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(("127.0.0.2", int(match[1])), timeout=5)
        connection = await connect(match[0], subprotocols=["foxglove.sdk.v1"], max_size=None)  # type: ignore[list-item]
        client = Foxglove(connection)
        found.append(client)
        while "/clock" not in client.channels:
            await client.receive()
        capabilities = client.of("serverInfo")[0]["capabilities"]
        assert sorted(capabilities) == ["assets", "connectionGraph", "time"]

        await client.subscribe(*SAMPLED, *LATCHED, "/clock")
        await client.send(op="subscribeConnectionGraph")
        while not client.times or not {*SAMPLED, *LATCHED, "/clock"} <= client.seen.keys():
            await client.receive()
        urdf = decoded(client, "/robot_description")["data"]
        (uri, *_) = mesh_uris = re.findall(r'filename="(package://[^"]*)"', urdf)
        asked = [
            uri,
            "file:///etc/passwd",
            uri + "/../robot.yaml",
            uri.replace("package:/", "file:///" + str(tmp_path)),
        ]
        for number, each in enumerate(asked):
            await client.send(op="fetchAsset", uri=each, requestId=number)
        while len(client.assets) < len(asked):
            await client.receive()
        assert all(each.startswith("package://") for each in mesh_uris)
        mesh[uri] = client.assets[0] or b""
        assert [client.assets[k] for k in range(1, len(asked))] == [None] * (len(asked) - 1)

        topic = "/arm_controller/joint_trajectory"
        kind = "trajectory_msgs/msg/JointTrajectory"
        await client.send(op="advertise", channels=[{"id": 7, "topic": topic, "encoding": "cdr", "schemaName": kind}])
        await connection.send(struct.pack("<BI", 1, 7) + b"\0\1\0\0")
        await client.send(op="setParameters", parameters=[{"name": "gain", "value": 1}])
        await connection.send(struct.pack("<BIII", 2, 1, 1, 3) + b"cdr")
        while len(client.of("status")) < 3 or not client.of("serviceCallFailure"):
            await client.receive()
        assert {each["level"] for each in client.of("status")} == {2}
        await connection.close()

    log = serving(tmp_path, use, outlets=[FoxgloveOptions(0)], progress=told)
    client = found[0]
    content = open_topics(log)
    for topic in (*SAMPLED, *LATCHED):
        kind = content.all[topic].type
        assert (client.channels[topic]["schemaName"], client.channels[topic]["schemaEncoding"]) == (kind, "ros2msg")
        assert client.channels[topic]["schema"] == content.all[topic].definition
        recorded = {
            bytes(data[start : start + length])
            for _, data, places in content.messages([topic])
            for start, length in zip(places.starts.tolist(), places.lengths.tolist(), strict=True)
        }
        assert set(client.seen[topic]) <= recorded
        assert decoded(client, topic)
    assert client.channels.keys() >= content.all.keys() - {"/live/commands"}
    stamps = [decoded(client, "/clock", k)["clock"] for k in range(len(client.seen["/clock"]))]
    assert stamps == sorted(stamps, key=lambda stamp: (stamp["sec"], stamp["nanosec"]))
    assert client.times == sorted(client.times)

    graph = client.of("connectionGraphUpdate")[0]
    published = {each["name"]: each["publisherIds"] for each in graph["publishedTopics"]}
    assert published["/arm_controller/controller_state"] == ["/arm_controller"]
    assert {each["name"] for each in graph["subscribedTopics"]} >= {"/arm_controller/joint_trajectory"}

    ((uri, data),) = mesh.items()
    assert data == (ROOT / "robots" / uri.removeprefix("package://")).read_bytes()
    schedule = recorded_commands(log, 0.001, failed=True)
    assert [command.op for tick in range(10**6) for command in schedule.take(tick)] == ["end"]


def decoded(client: Foxglove, topic: str, k: int = 0) -> dict[str, Any]:
    """A message by the schema that the server sent."""
    channel = client.channels[topic]
    return to_json(read_definition(channel["schemaName"], channel["schema"]), client.seen[topic][k])


def finding(error: pytest.ExceptionInfo[InvalidInput]) -> Diagnostic:
    return error.value.findings[0]


def test_a_port_in_use_and_a_missing_library_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    robot: Any = SimpleNamespace(moving_joints=(), links=(), joints=(), root="world", urdf="<robot/>")
    scene: Any = SimpleNamespace(movable=(), bodies=(), frames=())
    network = Network(Publisher(NOTHING, robot, scene, (), 0.001), lambda _: True, lambda: None)

    def opened(port: int, *, needed: bool) -> Outlet:
        return FoxgloveOptions(port, needed=needed).open(network)

    first = opened(0, needed=True)
    port = int(first.notice.partition("127.0.0.1:")[2].partition(" ")[0])
    with pytest.raises(InvalidInput) as used:
        opened(port, needed=True)
    assert finding(used).code == "USE148"
    assert finding(used).message == f"port {port} for Foxglove is already in use"
    without = opened(port, needed=False)
    assert without.notice.startswith(finding(used).message)
    assert not without.wanted()
    first.close()
    monkeypatch.setitem(sys.modules, "foxglove", None)
    with pytest.raises(InvalidInput) as missing:
        opened(0, needed=True)
    assert finding(missing).code == "USE149"
    assert "not installed" in opened(0, needed=False).notice


def test_assets_are_the_listed_files_within_their_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "a.stl"
    file.write_bytes(b"12345")
    files = {"package://robot/a.stl": file, "package://robot/gone.stl": tmp_path / "gone.stl"}
    assert foxglove.asset(files, "package://robot/a.stl") == b"12345"
    for uri in (f"file://{file}", str(file), "package://robot/gone.stl"):
        assert foxglove.asset(files, uri) is None
    monkeypatch.setattr(foxglove, "MAX_ASSET", 4)
    assert foxglove.asset(files, "package://robot/a.stl") is None
