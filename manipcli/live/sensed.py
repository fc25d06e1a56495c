"""Measurements of sensors of numbers for clients: the last one of each, with the samples of the state."""

from __future__ import annotations

from collections.abc import Container, Sequence

import numpy as np

from manipcli.core.geometry import Array
from manipcli.record.channels import MeasuredChannel
from manipcli.record.records import PAYLOAD
from manipcli.record.write.arrivals import Arrivals, nanoseconds


class Sensed:
    """What the control loop keeps of the sensors while somebody wants it.

    Args:
        sensors: channels of the session.
        numbers: of its `SensorBank`.

    Attributes:
        last: these numbers; the column `arrived` of each sensor has the tick of its last arrival + 1, 0 before one.
    """

    def __init__(self, sensors: Sequence[MeasuredChannel], numbers: Array) -> None:
        self.last = numbers.copy()
        self._numbers = numbers
        self._arrived = np.array(sorted({sensor.arrived for sensor in sensors if sensor.filled}), dtype=np.intp)
        self._ticks = np.zeros(len(self._arrived))
        self._seen = -1

    def tick(self, tick: int) -> None:
        """See what arrives at a tick. What arrived while nobody looked does not count."""
        if tick != self._seen + 1:
            self._ticks[:] = 0.0
        self._seen = tick
        self._ticks[self._numbers[self._arrived] != 0.0] = tick + 1

    def read(self) -> Array:
        """`last`, now."""
        self.last[:] = self._numbers
        self.last[self._arrived] = self._ticks
        return self.last


class SensedMessages:
    """Their messages, made in the process of the network.

    Args:
        sensors: channels of the session.
        period: [s] of its control loop.
    """

    def __init__(self, sensors: Sequence[MeasuredChannel], period: float) -> None:
        self._encoders = {s.topic: (s.arrived, Arrivals([s], {s.topic: 1}, 1)) for s in sensors if s.filled}
        self._period = period
        self._made: dict[str, int] = {}
        self.topics = frozenset(self._encoders)

    def new(self, sensed: Array, wanted: Container[str]) -> dict[str, bytes]:
        """The messages in CDR of the wanted topics that have a measurement since the last call."""
        found: dict[str, bytes] = {}
        for topic, (arrived, encoder) in self._encoders.items():
            tick = int(sensed[arrived]) - 1
            if topic not in wanted or tick < 0 or self._made.get(topic) == tick:
                continue
            self._made[topic] = tick
            ticks = np.array([tick])
            (rows,) = encoder.fill(ticks, nanoseconds(ticks, self._period), sensed[None], self._period)
            found[topic] = rows.bytes[0, PAYLOAD:].tobytes()
        return found
