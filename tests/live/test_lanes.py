"""Who only reads costs the control loop little, whoever it is: laws of its parts, without a network."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import Any, cast

from manipcli.live.command import CALL_SERVICE, Command
from manipcli.live.link import SENSED, WANTED
from manipcli.live.loop import Outside, _Turn
from manipcli.live.network import Hub
from manipcli.live.pace import Share
from manipcli.live.server import MAX_CLIENTS, MAX_READERS, LiveServer
from tests.live.test_client import Peer

READ = Command(CALL_SERVICE, "/read")


def test_one_command_that_only_reads_is_carried_out_per_tick() -> None:
    obeyed: list[Command] = []
    robot = SimpleNamespace(play=SimpleNamespace(ticked=lambda: None))
    executor = SimpleNamespace(after_tick=lambda: None, obey=obeyed.append)
    source = SimpleNamespace(read=lambda: READ)
    pace = SimpleNamespace(ahead=True, wait=lambda: None)
    turn = _Turn(cast(Any, robot), cast(Any, executor), Outside(cast(Any, source), cast(Any, None), cast(Any, pace)))
    for tick in range(1, 5):
        turn.after_tick()
        assert obeyed == [READ] * tick


def test_a_share_of_time_is_free_again_after_its_multiple() -> None:
    now = 0.0
    share = Share(0.1, lambda: now)
    assert share.free()
    with share:
        now = 2.0
    for now, free in ((2.0, False), (19.9, False), (20.1, True)):  # noqa: B007 (read by the clock)
        assert share.free() is free


def test_readers_leave_places_for_those_who_command() -> None:
    server = LiveServer(cast(Any, None), cast(Any, None))
    for number in range(MAX_READERS):
        assert server._full(may=False) == ""
        server._clients[number] = cast(Any, None)
        server._readers.add(number)
    assert "without the token" in server._full(may=False)
    assert server._full(may=True) == ""
    server._clients.update(dict.fromkeys(range(MAX_CLIENTS), cast(Any, None)))
    assert server._full(may=True) != ""


def test_samples_are_wanted_for_topics_of_ticks_alone() -> None:
    numbers = memoryview(bytearray(64)).cast("q")
    wanted: set[str] = set()
    sensed = SimpleNamespace(topics=frozenset({"/sensors/wrist"}))
    publisher = SimpleNamespace(
        latched={}, sampled=frozenset({"/clock", "/joint_states", *sensed.topics}), sensed=sensed
    )
    hub = Hub(cast(Any, publisher), cast(Any, None), numbers, cast(Any, SimpleNamespace(want=lambda topics: None)))
    hub.outlets = [cast(Any, SimpleNamespace(notice="", wanted=lambda: wanted, watches=lambda: False))]
    for topics, sampled, measured in (
        ({"/rosout", "/task/events"}, 0, 0),
        ({"/rosout", "/clock"}, 1, 0),
        ({"/sensors/wrist"}, 1, 1),
        (set(), 0, 0),
    ):
        wanted = topics
        hub.subscribed()
        assert (numbers[WANTED], numbers[SENSED]) == (sampled, measured)


def test_a_new_subscription_keeps_the_count_of_dropped_messages() -> None:
    peer = Peer()
    peer.send(op="subscribe", topic="/joint_states", id="a", queue_length=2)
    for _ in range(5):
        text = json.dumps({"op": "publish", "topic": "/joint_states"})
        peer.client.outbox.publish("/joint_states", text, 100.0)
    peer.send(op="subscribe", topic="/joint_states", id="b", queue_length=9)
    assert "/joint_states: 3 messages were dropped" in peer.client.report_drops()[0]
