"""Readings of a sensor from its messages in a log; pictures are reduced to the number of pixels of each part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from manipcli.conditions.sensed import Readings, Sensed, pixels_of_parts
from manipcli.core.geometry import Array
from manipcli.record.cdr import CdrError, CdrReader
from manipcli.record.channels import SENSORS
from manipcli.record.decode import Run
from manipcli.record.read.chunk import Places, singly
from manipcli.record.read.columns import Columns, NamedRuns

ENCODINGS: Final[Mapping[str, int]] = {"8UC1": 1, "16UC1": 2}
"""Bytes of a pixel of part numbers."""


def reading_topic(name: str, sensed: Sensed) -> str:
    """The topic of the messages with the readings of a sensor."""
    return f"{SENSORS}/{name}{sensed.suffix}"


class SensedTopic:
    """Collects the readings of one sensor from chunks.

    Args:
        topic: the topic.
        sensed: the sensor.
    """

    def __init__(self, topic: str, sensed: Sensed) -> None:
        self._topic = topic
        self._sensed = sensed
        self._columns = None if sensed.parts else _columns(self._topic, sensed)
        self._times = np.zeros(0, dtype=np.int64)
        self._counts = np.zeros((0, sensed.width))

    def add(self, data: bytes, places: Places) -> None:
        """Add the messages of one chunk.

        Raises:
            CdrError: a message is not of the type that the task declares, or older than the one before.
        """
        if self._columns is not None:
            self._columns.add(data, places)
            return
        counts = [_pixels(reader, self._topic, self._sensed) for _, reader in singly(data, places)]
        self._times = np.concatenate([self._times, places.times])
        self._counts = np.concatenate([self._counts, np.array(counts).reshape(-1, self._sensed.width)])
        if (np.diff(self._times) <= 0).any():
            raise CdrError(f"time runs backwards in {self._topic}")

    def until(self, ns: float) -> Readings:
        """The readings that arrived up to this time [ns]; they are removed."""
        if self._columns is not None:
            count = int(np.searchsorted(self._columns.times, ns, side="right"))
            times, runs = self._columns.take(count)
            return Readings(times / 1e9, np.concatenate(runs, axis=1))
        count = int(np.searchsorted(self._times, ns, side="right"))
        times, values = self._times[:count], self._counts[:count]
        self._times, self._counts = self._times[count:], self._counts[count:]
        return Readings(times / 1e9, values)


def _columns(topic: str, sensed: Sensed) -> Columns:
    """The columns of the fields of a reading, a run of doubles each."""

    def choose(found: Sequence[Run], data: memoryview) -> NamedRuns:
        return NamedRuns((), tuple(_run(found, name, topic) for name, _ in sensed.fields))

    return Columns(topic, sensed.message, choose, (), tuple(count for _, count in sensed.fields))


def _run(found: Sequence[Run], name: str, topic: str) -> tuple[int, int]:
    """Offset and count of the numbers of a field, which follow each other without a gap."""
    runs = [run for run in found if run.fields[:1] == (name,) and run.code != "#"]
    count = sum(run.count for run in runs)
    if any(run.code != "<f8" for run in runs) or (runs and runs[-1].end - runs[0].offset != 8 * count):
        raise CdrError(f"{topic}: '{name}' does not hold doubles")
    return (runs[0].offset, count) if runs else (0, 0)


def _pixels(reader: CdrReader, topic: str, sensed: Sensed) -> Array:
    """The pixels of each part in a sensor_msgs/Image of part numbers."""
    reader.header()
    height, width, encoding = reader.u32(), reader.u32(), reader.text()
    reader.skip(1, 1)
    reader.u32()
    data = reader.take(reader.count(1), 1)
    if len(data) != height * width * ENCODINGS.get(encoding, 0):
        raise CdrError(f"{topic} has a picture of '{encoding}' with a wrong size")
    return pixels_of_parts(data, encoding, len(sensed.parts))
