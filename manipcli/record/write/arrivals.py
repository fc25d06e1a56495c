"""Messages of sensors of numbers in a block: log time is that of arrival, the stamp that of the measurement."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from manipcli.core.geometry import Array
from manipcli.record.channels import MeasuredChannel
from manipcli.record.write.rows import RowBlock, Rows, Times, measured_template


class Arrivals:
    """Messages of sensors whose measurements arrive at the same ticks."""

    def __init__(self, sensors: Sequence[MeasuredChannel], ids: Mapping[str, int], capacity: int) -> None:
        self._sensors = sensors
        templates = [measured_template(ids[s.topic], s.message, s.filled, s.fixed, s.frame) for s in sensors]
        self._ends = [np.cumsum([count for _, count in template.runs])[:-1] for template in templates]
        self._rows = RowBlock(templates, capacity)
        self._written = 0

    def fill(self, ticks: Times, times: Times, numbers: Array, period: float) -> Iterator[Rows]:
        """Encode its messages of a block; `numbers` (T, width of all sensors)."""
        first = self._sensors[0]
        picked = np.flatnonzero(numbers[:, first.arrived])
        if not len(picked):
            return
        values: list[Array] = []
        for sensor, ends in zip(self._sensors, self._ends, strict=True):
            measured = numbers[picked, sensor.first : sensor.first + sensor.width]
            values += np.split(measured if sensor.derive is None else sensor.derive(measured), ends, axis=1)
        order = self._written + np.arange(1, len(picked) + 1)
        self._written += len(picked)
        stamps = nanoseconds(ticks[picked] - first.delay, period)
        every = range(len(self._sensors))
        self._rows.fill(times[picked], np.tile(order, (len(every), 1)), values, stamps_ns=stamps)
        yield Rows(picked, *self._rows.part(0, len(picked), every))


def nanoseconds(ticks: Times, period: float) -> Times:
    """Simulated time of ticks."""
    found: Times = np.rint(ticks * period * 1e9).astype(np.int64)
    return found


def together(sensors: Sequence[MeasuredChannel], ids: Mapping[str, int]) -> list[list[MeasuredChannel]]:
    """The recorded sensors of numbers, those that always arrive at the same ticks together."""
    groups: dict[tuple[int, int, str], list[MeasuredChannel]] = {}
    for sensor in sensors:
        if sensor.filled and sensor.topic in ids:
            key = sensor.every, sensor.delay, "" if sensor.complete else sensor.topic
            groups.setdefault(key, []).append(sensor)
    return list(groups.values())
