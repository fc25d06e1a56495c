"""Between the control loop and the process of the network: nothing is lost but what may be, and nobody waits."""

from __future__ import annotations

import asyncio
import os
import pickle
import signal
import socket
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest

from manipcli.live import link as ends
from manipcli.live.command import CALL_SERVICE, END, PUBLISH, RELEASE, SEND_GOAL, STOP, Answer, Command
from manipcli.live.link import EVENT, SAMPLE, TAKEN, WAITING, Link, complete
from manipcli.live.pending import READS, Pending
from manipcli.live.source import recorded_commands
from manipcli.record.foreign.topics import open_topics
from tests.live.sessions import opened, serving


@dataclass
class Ends:
    """Both ends in one process."""

    link: Link
    pending: Pending
    far: socket.socket
    received: bytearray = field(default_factory=bytearray)

    def arrived(self) -> list[tuple[object, ...]]:
        """What the network has received."""
        try:
            while data := self.far.recv(1 << 20):
                self.received += data
        except BlockingIOError:
            pass
        return [pickle.loads(body) for body in complete(self.received)]


@pytest.fixture
def both() -> Iterator[Ends]:
    near, far = socket.socketpair()
    far.setblocking(False)
    numbers = memoryview(bytearray(64)).cast("q")
    with near, far:
        yield Ends(Link(near, numbers), Pending(numbers, far.sendall), far)


def test_commands_arrive_in_order_after_those_given_back(both: Ends) -> None:
    first, second, third = (Command(PUBLISH, name, json='{"a": "\\ud800"}') for name in "abc")
    both.pending.put(third)
    both.link.give_back([first, second])
    assert both.link.wait(0.0)
    assert [command.name for command in both.link.take(0)] == ["a", "b", "c"]
    assert [*both.link.take(1)] == []


def test_no_more_commands_wait_than_may() -> None:
    numbers = memoryview(bytearray(64)).cast("q")
    pending = Pending(numbers, lambda data: None)
    assert [pending.put(Command(PUBLISH, "a")) for _ in range(WAITING + 5)] == [True] * WAITING + [False] * 5
    numbers[TAKEN] = 1
    assert [pending.put(Command(PUBLISH, "a")) for _ in range(2)] == [True, False]


STOPPING, RELEASING, RESET = (Command(CALL_SERVICE, name) for name in (STOP, RELEASE, "/reset"))
X, Y = Command(PUBLISH, "x"), Command(PUBLISH, "y")


@pytest.mark.parametrize(
    ("batch", "order"),
    [
        ((X, STOPPING, Y), (STOPPING, X, Y)),
        ((X, RELEASING, Y), (X, RELEASING, Y)),  # what was sent while the robot was stopped is refused
        ((X, RELEASING, STOPPING, Y), (RELEASING, STOPPING, X, Y)),
        ((X, STOPPING, RELEASING), (STOPPING, X, RELEASING)),
    ],
)
def test_a_stop_is_first_and_the_last_of_stop_and_release_wins(
    both: Ends, batch: tuple[Command, ...], order: tuple[Command, ...]
) -> None:
    for command in batch:
        both.pending.put(command)
    assert [command.name for command in both.link.take(0)] == [command.name for command in order]


def test_a_stop_that_overtook_a_reset_also_stops_the_next_session(both: Ends) -> None:
    answers: list[Answer] = []
    for command in (X, RESET, Y, replace(STOPPING, answer=answers.append)):
        both.pending.put(command)
    taken = both.link.take(0)
    assert [command.name for command in taken] == [STOP, "x", "/reset", "y"]
    both.link.end(taken[2])
    again = both.link.take(1)
    assert [command.name for command in again] == [STOP, "y"]
    again[0].answer(Answer(True, {}))  # it was answered before the reset
    assert both.arrived() == []


def test_an_emergency_stop_is_never_refused_and_guests_who_read_take_no_places(
    both: Ends, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("manipcli.live.pending.WAITING", 30)
    pending = Pending(both.link.numbers, both.far.sendall, {"/read"})
    read = Command(CALL_SERVICE, "/read")
    guest = replace(read, guest=True)
    assert [pending.put(guest) for _ in range(READS + 5)] == [True] * READS + [False] * 5
    assert pending.put(read)
    others = 30 - READS - 1
    assert [pending.put(X) for _ in range(others + 1)] == [True] * others + [False]
    assert [pending.put(RELEASING), pending.put(STOPPING)] == [True, True]
    assert [command.name for command in both.link.take(0)] == [RELEASE, STOP, *["x"] * others]
    assert not pending.put(guest)
    for _ in range(2):
        one = both.link.read()
        assert one is not None
        one.answer(Answer(True, {}))
    for _, number, found in both.arrived():
        pending.answer(number, found)  # type: ignore[arg-type]
    assert [pending.put(guest), pending.put(guest)] == [True, False]


def test_a_command_that_another_thread_could_not_put_is_refused_later() -> None:
    pending = Pending(memoryview(bytearray(64)).cast("q"), lambda data: None)
    soon: list[Callable[[], object]] = []
    answers: list[Answer] = []
    command = Command(PUBLISH, "a", answer=answers.append)
    assert [pending.put_soon(command, soon.append) for _ in range(WAITING + 3)] == [True] * (WAITING + 3)
    for call in soon:
        call()
    assert [found.ok for found in answers] == [False] * 3
    assert not pending.put_soon(command, soon.append)


def test_answers_reach_who_asked_and_a_goal_is_answered_until_its_result(both: Ends) -> None:
    got: list[tuple[str, Answer]] = []
    for op in (PUBLISH, CALL_SERVICE, SEND_GOAL):
        both.pending.put(Command(op, "a", answer=lambda found, op=op: got.append((op, found))))  # type: ignore[misc]
    for command in both.link.take(0):
        for found in (Answer(True, {"x": 1.0}), Answer(False, {}, "no", status=6), Answer(True, {})):
            command.answer(found)
    for _, number, found in both.arrived():
        both.pending.answer(number, found)  # type: ignore[arg-type]
    assert [op for op, _ in got] == [PUBLISH, CALL_SERVICE, SEND_GOAL, SEND_GOAL]
    assert got[0][1] == Answer(True, {"x": 1.0})


def test_a_network_that_takes_nothing_loses_the_oldest_samples_but_no_answer(both: Ends) -> None:
    both.pending.put(Command(CALL_SERVICE, "a", answer=print))
    (command,) = both.link.take(0)
    for tick in range(2000):
        both.link.sample(tick, np.zeros(200), [None])
    command.answer(Answer(True, {}))
    both.link.event("/a", 7, b"x" * (1 << 20))
    found = []
    for _ in range(100):
        found += both.arrived()
        both.link.take(1)  # sends what waits
    ticks = [values[1] for values in found if values[0] == SAMPLE]
    assert ticks == sorted(ticks)
    assert ticks[-ends.KEPT_SAMPLES :] == [*range(2000 - ends.KEPT_SAMPLES, 2000)]
    assert both.link.dropped == 2000 - len(ticks) > 0
    assert [values[0] for values in found if values[0] != SAMPLE] == [ends.ANSWER, ends.DROPPED, EVENT]
    (reported,) = (values[1] for values in found if values[0] == ends.DROPPED)
    assert 0 < cast("int", reported) <= both.link.dropped


def test_a_session_whose_network_is_killed_ends_and_its_log_is_complete(tmp_path: Path) -> None:
    async def use(url: str) -> None:
        client = await opened(url)
        await client.send(op="subscribe", topic="/joint_states")
        await client.until(op="publish", topic="/joint_states")
        tasks = Path("/proc/self/task").iterdir()
        (network,) = {word for task in tasks for word in (task / "children").read_text().split()}
        os.kill(int(network), signal.SIGKILL)
        await client.socket.wait_closed()
        await asyncio.sleep(1.0)  # the control loop notices it, too

    with pytest.raises(AssertionError, match="ended by signal 9"):
        serving(tmp_path, use)
    log = tmp_path / "session.mcap"
    assert not open_topics(log).faults
    last = recorded_commands(log, 0.001, failed=True)
    assert any(command.op == END for tick in range(10**6) for command in last.take(tick))
