"""The page over its WebSocket, with visitors that command, that may only read, and that are hostile."""

from __future__ import annotations

import http.client
import json
import socket
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from queue import SimpleQueue
from threading import Thread
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from manipcli import pipeline
from manipcli.core.errors import InvalidInput
from manipcli.live.command import Answer, Command
from manipcli.live.interface import endpoints_of, offer_of
from manipcli.live.outlet import Network
from manipcli.live.page import texts
from manipcli.live.page.options import PageOptions
from manipcli.live.page.page import LivePage
from manipcli.live.publisher import Publisher
from manipcli.record.channels import EVENTS, ROSOUT
from manipcli.record.messages import event_message, log_message
from manipcli.record.recording import TaskEvent
from manipcli.replay.view.viser_server import LocalServer
from manipcli.run.execute import build_manager
from manipcli.run.run_log import recorded
from tests.live.page.visitor import CAMERA, Visitor
from tests.live.sessions import SMALL, TOKEN

STOP = "EMERGENCY STOP"
LISTED = {"controller": [{"name": "arm_controller", "state": "active"}, {"name": "hand_controller", "state": "active"}]}


@dataclass
class Served:
    """A page whose session is this test: it gives states, and takes commands."""

    page: LivePage
    publisher: Publisher
    commands: SimpleQueue[Command]
    ticks: int = 0

    def tick(self) -> list[Command]:
        """One tick; what was commanded, without the questions of the page, which are answered."""
        self.ticks += 1
        if self.page.watches():
            self.page.state(self.ticks, self.publisher.state)
        found = [self.commands.get() for _ in range(self.commands.qsize())]
        for command in found:
            if command.name.endswith("list_controllers"):
                command.answer(Answer(True, dict(LISTED)))
        return [command for command in found if command.name not in self.publisher.offer.readers]

    def live(self, visitor: Visitor, condition: Callable[[], object]) -> list[Command]:
        """Tick until something is true for a visitor; all that was commanded."""
        found: list[Command] = []

        def reached() -> object:
            found.extend(self.tick())
            return condition()

        visitor.until(reached)
        return found


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    path = tmp_path_factory.mktemp("page") / "small.yaml"
    path.write_text(SMALL)
    task = pipeline.load_task(path)
    manager = build_manager(task, pipeline.plan_task(task).planner.kinematics)
    channels = [recorded(controller) for controller in manager.controllers]
    offer = offer_of(endpoints_of(task, manager.controllers), channels)
    publisher = Publisher(offer, task.robot, task.true.scene, channels, 0.001)
    commands: SimpleQueue[Command] = SimpleQueue()
    network = Network(publisher, lambda command: not commands.put(command), lambda: None)
    page = PageOptions(TOKEN, 0).open(network)
    assert isinstance(page, LivePage)
    try:
        yield Served(page, publisher, commands)
    finally:
        page.close()


def test_a_slider_commands_and_follows_the_robot(served: Served) -> None:
    with Visitor(served.page.port, TOKEN) as visitor:
        served.live(visitor, lambda: "arm_controller" in visitor.labels("Checkbox"))
        slider = visitor.labels("Slider")["joint_2"]
        visitor.set(slider, 28.6)  # degrees
        sent: list[Command] = []
        visitor.until(lambda: sent.extend(served.tick()) or sent)
        assert [command.name for command in sent] == ["/arm_controller/joint_trajectory"]
        assert json.loads(sent[0].json)["points"][0]["positions"][1] == pytest.approx(np.radians(28.6))

        served.publisher.state.position[0] = -0.25  # another client moves the robot, after this motion
        served.ticks += 10_000
        first = visitor.labels("Slider")["joint_1"]
        served.live(visitor, lambda: visitor.inputs[first]["value"] == pytest.approx(np.degrees(-0.25), abs=0.051))

        sent.clear()
        visitor.set(visitor.labels("Checkbox")["hand_controller"], value=False)
        visitor.until(lambda: sent.extend(served.tick()) or sent)
    (switched,) = sent
    assert json.loads(switched.json)["deactivate_controllers"] == ["hand_controller"]


def test_without_the_token_there_is_nothing_to_command_with(served: Served) -> None:
    with Visitor(served.page.port, TOKEN) as visitor, Visitor(served.page.port) as reader:
        served.live(visitor, lambda: "joint_1" in visitor.labels("Slider"))
        served.live(reader, lambda: "arm_controller" in reader.text and "t = " in reader.text)
        assert "Read only" in reader.text
        for kind in ("Slider", "Button", "ButtonGroup", "Checkbox"):
            assert reader.labels(kind) == {}
        for uuid, one in visitor.inputs.items():  # forged: the elements of the other visitor
            if "value" in one:
                reader.set(uuid, value=0.1)
        reader.send(type="GuiFormDirtyMessage", uuid="x")
        reader.socket.send("not of the protocol")
        with pytest.raises(ConnectionClosed):  # all that was sent before it has been read
            reader.until(lambda: False)
        served.ticks += 100_000
        assert served.live(visitor, lambda: f"t = {served.ticks // 1000}." in visitor.text) == []


def test_who_may_enter(served: Served) -> None:
    port = served.page.port
    with pytest.raises(InvalidStatus, match="403"):
        connect(f"ws://127.0.0.1:{port}", origin=Origin("http://evil.example"))
    with pytest.raises(InvalidStatus, match="401"):
        connect(f"ws://127.0.0.1:{port}/?token=wrong")
    asking = http.client.HTTPConnection("127.0.0.1", port)
    assert served.page.notice == f"page: http://127.0.0.1:{port}/?token={TOKEN}"
    asking.request("GET", f"/?token={TOKEN}")
    answer = asking.getresponse()
    answer.read()
    (address,) = parse_qs(urlsplit(answer.headers["Location"]).query)["websocket"]
    assert address == f"ws://127.0.0.1:{port}/?token={TOKEN}"
    for path, host, status in (("/?token=wrong", f"127.0.0.1:{port}", 401), ("/", "evil.example", 403)):
        asking = http.client.HTTPConnection("127.0.0.1", port)
        asking.request("GET", path, headers={"Host": host})
        assert asking.getresponse().status == status
    with pytest.raises(InvalidInput) as refused:
        LocalServer("robot", port=port, option="--page-port")
    assert "--page-port" in str(refused.value.findings[0].hint)


def test_messages_are_text_and_not_html(served: Served) -> None:
    event = TaskEvent(1.0, "refused", "", "", "error", "<script>alert(1)</script>", "")
    with Visitor(served.page.port) as reader:
        served.page.message(ROSOUT, 1, log_message(10**9, event))
        served.live(reader, lambda: "alert(1)" in reader.text)
        assert "&lt;script&gt;" in reader.text
        assert "<script" not in reader.text


def test_an_error_of_the_page_is_shown_and_the_page_goes_on(served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> str:
        raise RuntimeError("<odd>")

    with Visitor(served.page.port) as reader:
        with monkeypatch.context() as patched:
            patched.setattr(texts, "status", fail)
            served.live(reader, lambda: "error of the page: RuntimeError(&#x27;&lt;odd&gt;&#x27;)" in reader.text)
        now = f"t = {served.ticks * 0.001 + 50:.2f}"
        served.ticks += 50_000
        served.live(reader, lambda: now[:-3] in reader.text)


def test_no_state_is_wanted_while_no_browser_is_connected(served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    for interval in ("IDLE", "ASKING"):
        monkeypatch.setattr(f"manipcli.live.page.page.{interval}", 0.005)
    with Visitor(served.page.port) as reader:
        served.live(reader, served.page.watches)
    end = time.monotonic() + 10.0
    while served.page.watches():
        assert time.monotonic() < end
        time.sleep(0.01)
    while not served.commands.empty():
        served.tick()
    time.sleep(0.05)  # ten passes of the page
    assert served.commands.empty(), "no questions either"


@pytest.mark.filterwarnings("ignore:.*does not match annotation")
def test_hostile_visitors_are_closed_and_nothing_is_printed(served: Served, capfd: pytest.CaptureFixture[str]) -> None:
    with Visitor(served.page.port) as good:
        for data in ("text", b"", b"\xff" * 50, b"\x81\xa4type\xa4None"):
            bad = Visitor(served.page.port)
            bad.socket.send(data)
            with pytest.raises(ConnectionClosed):
                bad.until(lambda: False)
        flood = Visitor(served.page.port)
        with pytest.raises(ConnectionClosed):
            for _ in range(100_000):
                flood.send(**{**CAMERA, "position": (1.0,)})
        with socket.create_connection(("127.0.0.1", served.page.port)) as raw:
            raw.sendall(b"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n")
            assert b"400" in raw.recv(100)
        good.inputs.clear()
        served.live(good, lambda: good.inputs or served.ticks % 2)
    assert capfd.readouterr().err == ""


def test_what_is_refused_anyway_is_disabled_also_after_the_end(served: Served) -> None:
    def happens(kind: str) -> None:
        served.page.message(EVENTS, 1, event_message(10**9, TaskEvent(1.0, kind, "", "", "", "", "")))

    with Visitor(served.page.port, TOKEN) as visitor:
        served.live(visitor, lambda: "joint_1" in visitor.labels("Slider"))
        slider, stop = (visitor.labels(kind)[name] for kind, name in (("Slider", "joint_1"), ("Button", STOP)))
        for kind, disabled, text in (
            ("emergency_stop", (True, False), "Release emergency stop"),
            ("session_started", (False, False), "real-time factor"),
            ("simulation_reset", (True, True), "resetting"),
            ("session_started", (False, False), "real-time factor"),
        ):
            happens(kind)
            served.live(
                visitor,
                lambda disabled=disabled, text=text: (
                    tuple(visitor.inputs[one]["disabled"] for one in (slider, stop)) == disabled
                    and text in visitor.text
                ),
            )
        ending = Thread(target=served.page.close)
        ending.start()
        visitor.until(lambda: "session ended" in visitor.text and visitor.inputs[stop]["disabled"])
        ending.join()
