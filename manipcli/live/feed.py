"""What leaves the control loop: copies of its state at 100 Hz, and the messages that the log gets at events.

The loop only copies numbers, and only while somebody subscribes to them; the process of the network encodes.
"""

from __future__ import annotations

import time
from collections.abc import Container, Sequence
from typing import Final

from manipcli.control.controller import ControllerOutput
from manipcli.core.geometry import Array
from manipcli.live.link import SENSED, TICK, WANTED, Link
from manipcli.live.offer import RESET, SESSION_ENDED
from manipcli.live.sensed import Sensed
from manipcli.model.state import Contact, WorldState
from manipcli.record.channels import EVENTS, ROSOUT, MeasuredChannel
from manipcli.record.messages import event_message, log_message
from manipcli.record.recording import TaskEvent
from manipcli.simulate.session import Observer

SAMPLE_PERIOD: Final = 0.01
"""[s] Simulated time between two samples."""
FAST_PERIOD: Final = 1.0 / 60.0
"""[s] Least wall time between two samples of a simulation that is as fast as possible: faster than clients can read."""


class Feed:
    """An observer of the session that also serves the network. It can outlive a session.

    Args:
        period: [s] of the control loop.
        link: to the network; None: there is none.
        topics: of the messages of events that the network publishes.
        sensors: channels of the session.
        again: topics and messages that are sent again when a session begins after a reset.
        least: [s] least wall time between two samples.

    Attributes:
        observer: the observer that sees each tick first.
    """

    def __init__(
        self,
        period: float,
        link: Link | None = None,
        *,
        topics: Container[str] = (),
        sensors: Sequence[MeasuredChannel] = (),
        again: Sequence[tuple[str, bytes]] = (),
        least: float = 0.0,
    ) -> None:
        self.observer: Observer | None = None
        self._link, self._topics, self._again = link, topics, again
        self._numbers: memoryview | list[int] = [0] * 8 if link is None else link.numbers
        self._every = max(1, round(SAMPLE_PERIOD / period))
        self._least, self._next = least, 0.0
        self._sensors = sensors
        self._pictures = frozenset(sensor.topic for sensor in sensors if not sensor.filled)
        self._sensed: Sensed | None = None

    def restart(self) -> None:
        """The next session begins, with tick 0."""
        self.observer, self._numbers[TICK] = None, 0
        for topic, data in self._again:
            self.message(topic, 0, data)

    def attach(self, numbers: Array) -> None:
        """The session that begins has these numbers of sensors; see `SensorBank`."""
        if any(sensor.filled for sensor in self._sensors):
            self._sensed = Sensed(self._sensors, numbers)

    def over(self, time: float, *, resets: bool) -> None:
        """Report that the session ended at a simulated time [s]; its log is closed and judged, which can take long."""
        event = TaskEvent(time, RESET if resets else SESSION_ENDED, "", "", "", "", "")
        ns = round(time * 1e9)
        self.message(EVENTS, ns, event_message(ns, event))
        self.message(ROSOUT, ns, log_message(ns, event))

    def tick(self, tick: int, state: WorldState, outputs: Sequence[ControllerOutput | None]) -> None:
        if self.observer is not None:
            self.observer.tick(tick, state, outputs)
        self._numbers[TICK] = tick
        sensed = self._sensed
        if sensed is not None and self._numbers[SENSED]:
            sensed.tick(tick)
        if tick % self._every or self._link is None or not self._numbers[WANTED]:
            return
        if self._least:
            now = time.perf_counter()
            if now < self._next:
                return
            self._next = now + self._least
        rows = [None if output is None else (output.rows, output.speed) for output in outputs]
        measured = sensed.read() if sensed is not None and self._numbers[SENSED] else None
        self._link.sample(tick, state.numbers, rows, measured)

    def contacts(self, tick: int, contacts: tuple[Contact, ...]) -> None:
        if self.observer is not None:
            self.observer.contacts(tick, contacts)

    def message(self, topic: str, ns: int, data: bytes) -> None:
        """Takes each message that the recorder writes at an event, and those of cameras."""
        if self._link is None:
            return
        if topic in self._pictures:
            self._link.picture(topic, ns, data)
        elif topic in self._topics:
            self._link.event(topic, ns, data)
