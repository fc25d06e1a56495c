"""Measurements of sensors in any ROS 2 log for display: pictures, taxels and rays, thinned to what a page can hold."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Hashable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np

from manipcli.core.geometry import Transform
from manipcli.core.text import listed
from manipcli.logs import sensed_messages as messages
from manipcli.logs.sensed_messages import Grid, Sweep
from manipcli.record import channels
from manipcli.record.cdr import NS_PER_S, CdrError, CdrReader
from manipcli.record.foreign.snapshot import transforms
from manipcli.record.foreign.topics import Topic, Topics, open_topics
from manipcli.record.read.chunk import Places, singly
from manipcli.render.drawing import WORLD, link_frame
from manipcli.replay.pixels import Small, Unshown
from manipcli.replay.sensed import CameraFeed, PictureStream, RayFeed, Sensed, TaxelFeed, counted
from manipcli.replay.thinning import Budget, Thinned

T = TypeVar("T")

PICTURE_INTERVAL, NUMBER_INTERVAL = 0.1, 0.02
"""Least time between two shown messages of a topic [s]."""
PICTURE_BYTES = 1_500_000
"""Of all pictures; 2 MB of a page."""
MOST_NUMBERS = 400_000
"""Of all taxels and rays."""
MOST_TOPICS = 16
"""Of pictures, of taxels, of rays."""
BEFORE = 1.0
"""Messages up to this time before the start are shown [s]."""
NEARBY = 10.0
"""A stamp that is farther from the log time is of another clock [s]."""
MOST_REASONS, MOST_NAMED = 64, 2
"""Of the reasons why messages of a topic are not shown: counted, and named."""


@dataclass(slots=True)
class _Series(Generic[T]):
    """A topic while the log is read; `read` returns the size of a message in its budget, and its content."""

    topic: Topic
    read: Callable[[CdrReader], tuple[int, T]]
    kept: Thinned[T]
    unread: dict[str, int] = field(default_factory=dict)

    def take(self, data: bytes, places: Places, begin: int, end: float) -> None:
        for k, ns in enumerate(places.times.tolist()):
            time = (ns - begin) / NS_PER_S
            if not -BEFORE <= time <= end + 1e-9 or not self.kept.wants(time):
                continue
            try:
                ((_, reader),) = singly(data, places.at(np.array([k])))
                size, value = self.read(reader)
            except (CdrError, Unshown) as error:
                why = str(error) if isinstance(error, Unshown) else f"a message {error}"
                if why in self.unread or len(self.unread) < MOST_REASONS:
                    self.unread[why] = self.unread.get(why, 0) + 1
            else:
                self.kept.add(time, size, value)

    def note(self, shown: int, unit: str, *others: str) -> str:
        """How many of its messages are shown, and why others are not."""
        parts = [f"{shown} of {self.kept.seen} {unit}"] if shown < self.kept.seen else []
        return "; ".join([*parts, *(other for other in others if other), *self.failures])

    @property
    def failures(self) -> list[str]:
        """Why messages cannot be shown, the most frequent reasons."""
        often = sorted(self.unread.items(), key=lambda entry: -entry[1])
        return [f"{count} not shown: {why}" for why, count in often[:MOST_NAMED]]


def read_sensed(path: Path, frames: Collection[str], *, begin: int, end: float, with_pictures: bool = True) -> Sensed:
    """What the sensors of a log measured.

    Args:
        path: an MCAP file.
        frames: of the drawing: `world`, `robot/<link>` and bodies.
        begin: log time of t = 0 [ns].
        end: end of what is shown [s].
        with_pictures: read those of cameras, too.

    Raises:
        BadRecording: the file cannot be read.
    """
    topics = open_topics(path)
    notes: list[str] = []
    pictures, numbers = Budget(PICTURE_INTERVAL, PICTURE_BYTES), Budget(NUMBER_INTERVAL, MOST_NUMBERS)
    images = [
        _Series(topic, _pictures(topic), Thinned(pictures))
        for topic in (_images(topics, notes) if with_pictures else ())
    ]
    grids = [_Series(topic, _grid, Thinned[Grid](numbers)) for topic in _chosen(topics, (messages.TAXELS,), notes)]
    kinds = messages.SCAN, messages.RANGE
    sweeps = [_Series(topic, _sweeps(topic), Thinned(numbers)) for topic in _chosen(topics, kinds, notes)]
    every: dict[str, _Series[Small] | _Series[Grid] | _Series[Sweep]] = {
        one.topic.name: one for group in (images, grids, sweeps) for one in group
    }
    parents: dict[str, tuple[str, Transform]] = {}
    for name, data, places in topics.messages({*every, *([channels.TF_STATIC] if sweeps else [])}) if every else ():
        if name in every:
            every[name].take(data, places, begin, end)
        else:
            remember_frames(parents, data, places)
    return Sensed(
        cameras=tuple(_cameras(images, notes)),
        taxels=tuple(_taxels(grids, notes)),
        rays=tuple(_rays(sweeps, begin, parents, frames, notes)),
        notes=tuple(notes),
    )


def _chosen(topics: Topics, kinds: Collection[str], notes: list[str]) -> list[Topic]:
    """The topics of some types, by name; not more than `MOST_TOPICS`."""
    found = [topic for topic in topics.all.values() if topic.type in kinds and topic.encoding == "cdr" and topic.count]
    found.sort(key=lambda topic: topic.name)
    if len(found) > MOST_TOPICS:
        notes.append(f"not shown: {listed([topic.name for topic in found[MOST_TOPICS:]])}")
    return found[:MOST_TOPICS]


def _images(topics: Topics, notes: list[str]) -> list[Topic]:
    """Topics of pictures, without compressed copies of others."""
    found = _chosen(topics, (messages.IMAGE, messages.COMPRESSED), notes)
    names = {topic.name for topic in found}
    return [topic for topic in found if _plain(topic.name) == topic.name or _plain(topic.name) not in names]


def _plain(name: str) -> str:
    """The name of a topic without that of its image transport."""
    return name.removesuffix("/compressed").removesuffix("/compressedDepth")


def _short(name: str) -> str:
    return name.removeprefix(f"{channels.SENSORS}/").removeprefix("/")


def _pictures(topic: Topic) -> Callable[[CdrReader], tuple[int, Small]]:
    def read(reader: CdrReader) -> tuple[int, Small]:
        small = messages.read_picture(reader, topic.name, topic.type)
        return len(small.data), small

    return read


def _grid(reader: CdrReader) -> tuple[int, Grid]:
    found = messages.read_grid(reader)
    return len(found.force), found


def _sweeps(topic: Topic) -> Callable[[CdrReader], tuple[int, Sweep]]:
    def read(reader: CdrReader) -> tuple[int, Sweep]:
        found = messages.read_sweep(reader, topic.type)
        return len(found.distance), found

    return read


def _alike(series: _Series[T], key: Callable[[T], Hashable], notes: list[str]) -> list[tuple[float, T]]:
    """Times and contents; only those of the most frequent key, so that one scale and one size fit all."""
    found = list(series.kept)
    if not found:
        notes += [f"{series.topic.name}: {text}" for text in series.failures]
        return []
    ((usual, _),) = Counter(key(value) for _, value in found).most_common(1)
    same = [(time, value) for time, value in found if key(value) == usual]
    if len(same) < len(found):
        notes.append(f"{series.topic.name}: {len(found) - len(same)} messages of another size are not shown")
    return same


def _cameras(images: list[_Series[Small]], notes: list[str]) -> Iterator[CameraFeed]:
    cameras: dict[str, list[PictureStream]] = {}
    for series in images:
        found = _alike(series, lambda small: (small.kind, small.size), notes)
        if not found:
            continue
        group, _, name = _plain(series.topic.name).rpartition("/")
        first = found[0][1]
        stream = PictureStream(
            name=name,
            kind=first.kind,
            size=first.size,
            times=np.array([time for time, _ in found]),
            pictures=tuple(small.data for _, small in found),
            low=np.array([small.low for _, small in found]),
            high=np.array([small.high for _, small in found]),
            note=series.note(len(found), "pictures"),
        )
        cameras.setdefault(group, []).append(stream)
    order = {"colour": 0, "depth": 1, "labels": 2}
    for group, streams in cameras.items():
        yield CameraFeed(_short(group) or group, tuple(sorted(streams, key=lambda one: order[one.kind])))


def _taxels(grids: list[_Series[Grid]], notes: list[str]) -> Iterator[TaxelFeed]:
    for series in grids:
        found = _alike(series, lambda grid: (grid.rows, grid.columns, grid.cell), notes)
        if not found:
            continue
        counts, unit = counted(np.array([grid.force for _, grid in found]))
        first, times = found[0][1], np.array([time for time, _ in found])
        note = series.note(len(found), "measurements")
        name = _short(series.topic.name)
        yield TaxelFeed(name, first.rows, first.columns, first.cell, times, counts, unit, note)


def _rays(
    sweeps: list[_Series[Sweep]],
    begin: int,
    parents: Mapping[str, tuple[str, Transform]],
    frames: Collection[str],
    notes: list[str],
) -> Iterator[RayFeed]:
    for series in sweeps:
        found = _alike(series, lambda sweep: (sweep.frame, sweep.angles.tobytes()), notes)
        if not found:
            continue
        first = found[0][1]
        mount = placed(first.frame, parents, frames)
        if mount is None:
            notes.append(f"{series.topic.name}: frame '{first.frame}' is not in the log: its rays are not drawn")
            continue
        counts, unit = counted(np.array([sweep.distance for _, sweep in found]))
        times = np.array([time for time, _ in found])
        stamps = np.array([(sweep.stamp - begin) / NS_PER_S for _, sweep in found])
        yield RayFeed(
            name=_short(series.topic.name),
            parent=mount[0],
            X_PS=mount[1],
            angles=first.angles,
            times=times,
            taken=np.where(np.abs(stamps - times) < NEARBY, stamps, times),
            counts=counts,
            unit=unit,
            note=series.note(len(found), "scans"),
        )


def remember_frames(parents: dict[str, tuple[str, Transform]], data: bytes, places: Places) -> None:
    """Add the frames of /tf_static to `parents`."""
    try:
        for _, reader in singly(data, places):
            for parent, child, pose in transforms(reader):
                length = float(np.linalg.norm(pose[3:]))
                if np.isfinite(pose).all() and 0.0 < length < np.inf:
                    parents[child] = parent, Transform.of(xyz=pose[:3], quat_xyzw=np.array(pose[3:]) / length)
    except CdrError:
        return


def placed(
    frame: str, parents: Mapping[str, tuple[str, Transform]], frames: Collection[str]
) -> tuple[str, Transform] | None:
    """The nearest drawn frame above a frame, and the pose in it; None if there is none."""
    X = Transform.identity()
    seen: set[str] = set()
    while frame not in seen:
        seen.add(frame)
        for name in (link_frame(frame), frame):
            if name in frames and (name != WORLD or frame not in parents):
                return name, X
        if frame not in parents:
            return None
        frame, X_PF = parents[frame]
        X = X_PF @ X
    return None
