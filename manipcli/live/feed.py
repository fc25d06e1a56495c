"""What leaves the control loop: copies of its state at 100 Hz, and the messages that the log gets at events.

The loop only copies numbers, and only while somebody subscribes to them; the thread of the network encodes.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from manipcli.control.controller import ControllerOutput
from manipcli.core.geometry import Array
from manipcli.model.state import Contact, WorldState
from manipcli.simulate.session import Observer

SAMPLE_PERIOD: Final = 0.01
"""[s] Simulated time between two samples."""
KEPT_SAMPLES: Final = 50
KEPT_MESSAGES: Final = 1000
"""Samples and messages that wait for the thread of the network; the oldest are dropped."""


@dataclass(frozen=True, slots=True)
class Sample:
    """The state of one tick; `outputs`: rows and speed of each controller, None while it is inactive."""

    tick: int
    numbers: Array
    outputs: tuple[tuple[Array, Array] | None, ...]


@dataclass(frozen=True, slots=True)
class Event:
    """A message of the log in CDR."""

    topic: str
    data: bytes


class Feed:
    """An observer of the session that also serves the network.

    Args:
        period: [s] of the control loop.
        latched: topics and messages that are sent again when a session begins after a reset.

    Attributes:
        observer: the observer that sees each tick first.
        wanted: whether somebody subscribes to a topic of samples.
        tick_now: the last tick.
        dropped: samples and messages that nobody took in time.
        newest: the sample that was asked for last; None before the first.
        on_message: called with each message, in the thread of the control loop; it must not block.
    """

    def __init__(self, period: float, latched: Sequence[tuple[str, bytes]] = ()) -> None:
        self.period = period
        self._latched = latched
        self.observer: Observer | None = None
        self.wanted = False
        self.tick_now = 0
        self.dropped = 0
        self.newest: Sample | None = None
        self.on_message: Callable[[Event], object] = lambda _: None
        self._asked = False
        self._every = max(1, round(SAMPLE_PERIOD / period))
        self._samples: deque[Sample] = deque()
        self._events: deque[Event] = deque()
        self._wake: Callable[[], object] = threading.Event().set

    def listen(self, wake: Callable[[], object]) -> None:
        """Call `wake`, in the thread of the control loop, when there is something to take."""
        self._wake = wake

    def ask(self) -> None:
        """Sample the next tick for `newest`."""
        self._asked = True

    def restart(self) -> None:
        """The next session begins, with tick 0."""
        self.observer, self.tick_now = None, 0
        for topic, data in self._latched:
            self.message(topic, 0, data)

    def tick(self, tick: int, state: WorldState, outputs: Sequence[ControllerOutput | None]) -> None:
        if self.observer is not None:
            self.observer.tick(tick, state, outputs)
        self.tick_now = tick
        wanted = self.wanted and not tick % self._every
        if not wanted and not self._asked:
            return
        copies = tuple(None if output is None else (output.rows.copy(), output.speed.copy()) for output in outputs)
        sample = Sample(tick, state.numbers.copy(), copies)
        if self._asked:
            self._asked, self.newest = False, sample
        if wanted:
            self._put(self._samples, KEPT_SAMPLES, sample)

    def contacts(self, tick: int, contacts: tuple[Contact, ...]) -> None:
        if self.observer is not None:
            self.observer.contacts(tick, contacts)

    def message(self, topic: str, ns: int, data: bytes) -> None:
        """Takes each message that the recorder writes at an event."""
        event = Event(topic, data)
        self.on_message(event)
        self._put(self._events, KEPT_MESSAGES, event)

    def _put(self, queue: deque[Sample] | deque[Event], kept: int, item: Sample | Event) -> None:
        if len(queue) >= kept:
            queue.popleft()
            self.dropped += 1
        queue.append(item)  # type: ignore[arg-type]
        self._wake()

    def take(self) -> tuple[list[Event], list[Sample]]:
        """All that waits; called in the thread of the network."""
        found: tuple[list[Event], list[Sample]] = ([], [])
        for queue, items in ((self._events, found[0]), (self._samples, found[1])):
            try:
                while True:
                    items.append(queue.popleft())  # type: ignore[arg-type]
            except IndexError:
                pass
        return found
