"""`topic`, `service`, `action` and `param` against a live session, and against a server that is not manipcli's."""

from __future__ import annotations

import asyncio
import csv
import json
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from websockets.sync.server import ServerConnection, serve

from manipcli.cli import console
from manipcli.cli.app import main
from manipcli.record.json_message import definition
from tests.live.sessions import HOME, serving

ARM = [f"joint_{k}" for k in range(1, 8)]
FOLLOW = ("/arm_controller/follow_joint_trajectory", "control_msgs/action/FollowJointTrajectory")
GRIP = "control_msgs/action/ParallelGripperCommand"
TOPIC = ("/arm_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory")

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs a command line; returns its exit code, stdout and stderr."""

    def ran(*words: str, url: str) -> tuple[int, str, str]:
        monkeypatch.setenv("MANIPCLI_URL", url)
        capsys.readouterr()
        code = main(words)
        out, err = capsys.readouterr()
        assert "Traceback" not in err
        return code, out, err

    return ran


def goal(seconds: int, joints: list[str] = ARM) -> str:
    """A goal near home, as YAML."""
    point = f"{{positions: {[value + 0.05 for value in HOME]}, time_from_start: {{sec: {seconds}}}}}"
    return f"{{trajectory: {{joint_names: [{', '.join(joints)}], points: [{point}]}}}}"


def topics(run: Run, url: str) -> None:
    code, out, _ = run("topic", "list", "-t", url=url)
    assert code == 0
    assert out.splitlines() == sorted(out.splitlines())
    assert "/joint_states [sensor_msgs/msg/JointState]" in out.splitlines()
    assert run("topic", "info", "/joint_states", url=url)[1].splitlines() == [
        "Type: sensor_msgs/msg/JointState", "Publisher count: 1 (/manipcli)", "Subscription count: 0",
    ]  # fmt: skip
    as_yaml, mark = run("topic", "echo", "--once", "joint_states", url=url)[1].rstrip().rsplit("\n", 1)
    assert (list(yaml.safe_load(as_yaml)), mark) == (["header", "name", "position", "velocity", "effort"], "---")
    for line in run("topic", "echo", "--json", "--times", "2", "--field", "name", "/joint_states", url=url)[1].split(
        "\n"
    )[:2]:
        assert json.loads(line)[:7] == ARM
    rows = [*csv.reader(run("topic", "echo", "--csv", "--times", "3", "/joint_states", url=url)[1].splitlines())]
    assert len(rows) == 4
    assert {len(row) for row in rows} == {len(rows[0])}
    assert rows[0][:4] == ["header.stamp.sec", "header.stamp.nanosec", "header.frame_id", "name[0]"]
    assert rows[1][rows[0].index("name[6]")] == "joint_7"
    hz = run("topic", "hz", "--once", "/clock", url=url)[1]
    assert float(hz.split()[2]) > 0.0
    assert "window: " in hz


def errors_of_names_and_messages(run: Run, url: str) -> None:
    for words, code, text in (
        (["topic", "echo", "/join_states"], "LIVE192", "did you mean '/joint_states'?"),
        (["topic", "echo", "/joint_states", "std_msgs/String"], "LIVE195", "sensor_msgs/msg/JointState, not"),
        (["topic", "echo", "--timeout", "0.2", TOPIC[0]], "LIVE191", "not published"),
        (["topic", "echo", "--timeout", "0.2", "/contacts"], "LIVE193", "no message within 0.2 s"),
        (["topic", "pub", "--once", *TOPIC, "{joint_namess: []}"], "LIVE191", "did you mean 'joint_names'?"),
        (["topic", "pub", "--once", *TOPIC, "{joint_names: [elbow]}"], "LIVE191", "no points"),
        (["topic", "pub", "--once", *TOPIC, "{joint_names: [a"], "YAML100", "MESSAGE:1:15"),
        (["topic", "echo", "/joint_states", "--once", "--field", "pose"], "USE161", "fields: header, name"),
        (["service", "call", "/controller_manager/list_controler"], "LIVE192", "list_controllers"),
        (["action", "send", *FOLLOW, goal(1, ["elbow", *ARM[1:]])], "LIVE191", "INVALID_JOINTS (-2)"),
        (["topic", "pub", "--once", *TOPIC, "- {joint_names: []}"], "USE159", "the message is a list"),
        (["service", "call", "/emergency_stop", "- {}"], "USE159", "the message is a list"),
        (["param", "set", "/arm_controller", "gains.joint_1.p", "[1]"], "LIVE191", "double"),
        (["param", "get", "/arm_controller", "no_such"], "LIVE192", "no parameter '/arm_controller:no_such'"),
    ):  # fmt: skip
        status, _, err = run(*words, url=url)
        assert (status, code in err, text in err) == (4 if code.startswith(("USE", "YAML")) else 1, True, True), err


def services_and_goals(run: Run, url: str) -> None:
    assert (
        run("service", "type", "/controller_manager/list_controllers", url=url)[1].strip().endswith("/ListControllers")
    )
    for line in run("service", "list", "-t", url=url)[1].splitlines():
        kind = line.partition(" [")[2].rstrip("]")
        assert definition(f"{kind}_Request").name, line
        assert definition(f"{kind}_Response").fields, line
    name = "/controller_manager/switch_controller"
    request = "{deactivate_controllers: [hand_controller], strictness: 2}"
    code, out, _ = run("service", "call", name, "controller_manager_msgs/srv/SwitchController", request, url=url)
    assert (code, yaml.safe_load(out)) == (0, {"ok": True, "message": ""})
    refused = run("action", "send", "/hand_controller/gripper_cmd", GRIP, "{command: {position: [0.1]}}", url=url)[2]
    assert "'hand_controller' is not active and accepts no goals" in refused
    assert name in refused
    code, out, _ = run("service", "call", name, "{activate_controllers: [hand_controller], strictness: 2}", url=url)
    assert (code, yaml.safe_load(out)) == (0, {"ok": True, "message": ""})
    assert f"{FOLLOW[0]} [{FOLLOW[1]}]" in run("action", "list", "-t", url=url)[1]
    code, out, _ = run("action", "send", *FOLLOW, goal(1), "--feedback", url=url)
    assert code == 0
    assert out.count("Feedback:") >= 5
    assert out.endswith("Goal finished with status: SUCCEEDED\n")
    assert run("action", "send", *FOLLOW, goal(50), "--timeout", "0.1", url=url)[0] == 1

    printed: list[str] = []

    def interrupted(text: str) -> None:
        printed.append(text)
        if len(printed) == 1:  # the first feedback
            raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(console, "result", interrupted)
        assert run("action", "send", *FOLLOW, goal(50), "-f", url=url)[0] == 2
    assert printed[-1] == "Goal finished with status: CANCELED"


def parameters(run: Run, url: str) -> None:
    assert "  gains.joint_1.p" in run("param", "list", "/arm_controller", url=url)[1].splitlines()
    words = ("/arm_controller", "gains.joint_1.p")
    before = yaml.safe_load(run("param", "get", *words, url=url)[1])
    assert run("param", "set", *words, str(before + 1.0), url=url)[0] == 0
    assert yaml.safe_load(run("param", "get", ":".join(words), url=url)[1]) == before + 1.0
    for value in ("-30", "-1.5e1"):
        assert run("param", "set", "/arm_controller:gains.joint_1.u_clamp_min", value, url=url)[0] == 0
        out = run("param", "get", "/arm_controller:gains.joint_1.u_clamp_min", url=url)[1]
        assert yaml.safe_load(out) == float(value)
    assert "--url" in run("param", "set", *words, "--ulr", url=url)[2]
    assert run("param", "get", "robot_description", url=url)[1].startswith("<?xml")


def published(run: Run, url: str) -> None:
    message = goal(1).removeprefix("{trajectory: ")[:-1]
    code, _, err = run("topic", "pub", "--times", "3", "--rate", "100", *TOPIC, message, url=url)
    assert (code, err.splitlines()) == (0, ["published #1", "published #2", "published #3"])
    reader = url.partition("?")[0]
    assert "may only read" in run("topic", "pub", "--once", *TOPIC, message, url=reader)[2]
    assert "LIVE190" in run("topic", "list", url=f"{reader}?token=wrong")[2]


def test_the_commands_of_a_session(run: Run, tmp_path: Path) -> None:
    async def use(url: str) -> None:
        for laws in (topics, errors_of_names_and_messages, services_and_goals, parameters, published):
            await asyncio.to_thread(laws, run, url)

    serving(tmp_path, use, speed=4.0)


class Bridge:
    """A server with the manners of rosbridge for ROS 1: types without /msg/, statuses and texts of its own."""

    def __init__(self, *, rosapi: bool) -> None:
        self._rosapi = rosapi
        self.published: list[dict[str, Any]] = []

    def __call__(self, socket: ServerConnection) -> None:
        for text in socket:
            frame = json.loads(text)
            for answer in self._answers(frame):
                socket.send(json.dumps(answer))

    def _answers(self, frame: dict[str, Any]) -> Iterator[dict[str, Any]]:
        name = frame.get("service", "")
        response = {"op": "service_response", "id": frame.get("id"), "service": name}
        if frame["op"] == "call_service" and self._rosapi and name == "/rosapi/topics":
            yield {**response, "result": True, "values": {"topics": ["/chatter"], "types": ["std_msgs/String"]}}
        elif frame["op"] == "call_service":
            text = f"Service {name} does not exist"
            yield {"op": "status", "level": "error", "id": frame["id"], "msg": f"call_service: {text}"}
            yield {**response, "result": False, "values": text}
        elif frame["op"] == "subscribe":
            yield {
                "op": "publish",
                "topic": frame["topic"],
                "msg": {"data": "hello\x1b[31m", "type": frame.get("type")},
            }
        elif frame["op"] == "publish":
            self.published.append(frame["msg"])
            if "data" not in frame["msg"]:
                yield {"op": "status", "level": "error", "id": frame["id"], "msg": "NonexistentFieldException"}


@pytest.mark.parametrize("rosapi", [True, False])
def test_a_server_of_ros_1_is_understood_also_without_rosapi(run: Run, rosapi: bool) -> None:
    bridge = Bridge(rosapi=rosapi)
    with serve(bridge, "127.0.0.1", 0) as server:
        threading.Thread(target=server.serve_forever).start()
        url = f"ws://127.0.0.1:{server.socket.getsockname()[1]}"
        try:
            code, out, _ = run("topic", "echo", "/chatter", "std_msgs/msg/String", "--once", url=url)
            kind = "std_msgs/String" if rosapi else "std_msgs/msg/String"
            assert (code, yaml.safe_load(out.rstrip("\n-"))["type"]) == (0, kind)
            assert "\x1b" not in out
            assert run("topic", "pub", "--once", "/chatter", "std_msgs/msg/String", "{data: x}", url=url)[0] == 0
            code, _, err = run("topic", "pub", "--once", "/chatter", "std_msgs/String", "{}", url=url)
            assert (code, "NonexistentFieldException" in err) == (1, True)
            assert bridge.published == [{"data": "x"}, {}]
            assert "LIVE191" in run("service", "call", "/nothing", "std_srvs/srv/Trigger", url=url)[2]
        finally:
            server.shutdown()


def test_without_a_server_it_is_said_where_none_answers(run: Run) -> None:
    code, _, err = run("topic", "list", url="ws://127.0.0.1:1/?token=secret")
    assert (code, "no server answers at ws://127.0.0.1:1: " in err, "secret" in err) == (1, True, False)
