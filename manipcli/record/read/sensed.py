"""Readings of a sensor from its messages in a log; pictures are reduced to the number of pixels of each part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial, reduce
from typing import Final

import numpy as np

from manipcli.conditions.sensed import Readings, Sensed, pixels_of_parts
from manipcli.core.geometry import Array
from manipcli.record.cdr import CdrError, CdrReader
from manipcli.record.channels import SENSORS
from manipcli.record.decode import Int, Run
from manipcli.record.read.chunk import Places, singly
from manipcli.record.read.columns import Columns, NamedRuns

ENCODINGS: Final[Mapping[str, int]] = {"8UC1": 1, "16UC1": 2}
"""Bytes of a pixel of part numbers."""


def reading_topics(name: str, sensed: Sensed) -> tuple[str, ...]:
    """The topics of the messages with the readings of a sensor."""
    root = sensed.topic or f"{SENSORS}/{name}"
    return tuple(root + suffix for suffix in sensed.suffixes)


class SensedTopics:
    """Collects the readings of one sensor from chunks.

    Args:
        name, sensed: the sensor.
    """

    def __init__(self, name: str, sensed: Sensed) -> None:
        topics = zip(reading_topics(name, sensed), sensed.suffixes, strict=True)
        self._topics: dict[str, Columns | _Pixels] = {
            topic: _Pixels(topic, sensed) if sensed.parts else _columns(topic, sensed, suffix)
            for topic, suffix in topics
        }

    def add(self, topic: str, data: bytes, places: Places) -> None:
        """Add the messages of one chunk.

        Raises:
            CdrError: a message is not of the type that the task declares, or older than the one before.
        """
        self._topics[topic].add(data, places)

    def until(self, ns: float) -> Readings:
        """The readings that arrived up to this time [ns] on all topics; they are removed."""
        taken = [each.take(int(np.searchsorted(each.times, ns, side="right"))) for each in self._topics.values()]
        common = reduce(partial(np.intersect1d, assume_unique=True), [times for times, _ in taken])
        rows = [run[np.isin(times, common, assume_unique=True)] for times, runs in taken for run in runs]
        return Readings(common / 1e9, np.concatenate(rows, axis=1))


class _Pixels:
    """The number of pixels of each part in the pictures of one camera, as `Columns`."""

    def __init__(self, topic: str, sensed: Sensed) -> None:
        self._topic, self._parts = topic, len(sensed.parts)
        self.times: Int = np.zeros(0, dtype=np.int64)
        self._counts = np.zeros((0, self._parts))

    def add(self, data: bytes, places: Places) -> None:
        counts = [self._of(reader) for _, reader in singly(data, places)]
        self.times = np.concatenate([self.times, places.times])
        self._counts = np.concatenate([self._counts, np.array(counts).reshape(-1, self._parts)])
        if (np.diff(self.times) <= 0).any():
            raise CdrError(f"time runs backwards in {self._topic}")

    def take(self, count: int) -> tuple[Int, list[Array]]:
        times, counts = self.times[:count], self._counts[:count]
        self.times, self._counts = self.times[count:], self._counts[count:]
        return times, [counts]

    def _of(self, reader: CdrReader) -> Array:
        """Of a sensor_msgs/Image of part numbers."""
        reader.header()
        height, width, encoding = reader.u32(), reader.u32(), reader.text()
        reader.skip(1, 1)
        reader.u32()
        data = reader.take(reader.count(1), 1)
        if encoding not in ENCODINGS or len(data) != height * width * ENCODINGS[encoding]:
            raise CdrError(f"{self._topic} has a picture of the encoding '{encoding}' and a wrong size")
        return pixels_of_parts(data, encoding, self._parts)


def _columns(topic: str, sensed: Sensed, suffix: str) -> Columns:
    """The columns of the fields of a reading in one of its topics, a run of doubles each."""
    fields = [(name, count) for own, name, count in sensed.fields if own == suffix]

    def choose(found: Sequence[Run], data: memoryview) -> NamedRuns:
        return NamedRuns((), tuple(_run(found, name, topic) for name, _ in fields))

    return Columns(topic, sensed.messages[suffix], choose, (), tuple(count for _, count in fields))


def _run(found: Sequence[Run], name: str, topic: str) -> tuple[int, int]:
    """Offset and count of the numbers of a field, which follow each other without a gap."""
    runs = [run for run in found if run.fields[:1] == (name,) and run.code != "#"]
    count = sum(run.count for run in runs)
    if any(run.code != "<f8" for run in runs) or (runs and runs[-1].end - runs[0].offset != 8 * count):
        raise CdrError(f"{topic}: '{name}' does not hold doubles")
    return (runs[0].offset, count) if runs else (0, 0)
