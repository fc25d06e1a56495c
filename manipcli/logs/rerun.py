"""A log as a recording of Rerun: the playback with all that its sensors measured."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from manipcli.core.errors import InvalidInput
from manipcli.core.geometry import Array, Transform
from manipcli.logs.camera_messages import CAMERA_INFO, POINTS, read_camera_info, read_cloud, read_rows
from manipcli.logs.plot import field_lines, open_chart
from manipcli.logs.sensed import placed, read_sensed, remember_frames
from manipcli.logs.sensed_messages import COMPRESSED, IMAGE, SEGMENTATION
from manipcli.record import channels
from manipcli.record.cdr import NS_PER_S, CdrError, CdrReader
from manipcli.record.foreign.topics import Topic, Topics, open_topics
from manipcli.record.read.chunk import singly
from manipcli.render.drawing import frame_names
from manipcli.render.lens import Lens
from manipcli.replay.pixels import PictureFile, Pixels, Unshown
from manipcli.replay.playback import Playback, PlotTable
from manipcli.replay.rerun.measured import Cloud, Measured, Measurement, Mount
from manipcli.replay.rerun.write_recording import write_recording

FEWER = 5.0
"""Samples of numbers for each picture."""
MOST_BYTES = 2_000_000_000
"""Of all pictures as they are in the log."""
MOST_TOPICS = 16
"""Of pictures and points; of numbers."""
FIELDS: Mapping[str, tuple[tuple[str, str], ...]] = {
    "geometry_msgs/msg/WrenchStamped": (("force", "wrench.force"), ("torque", "wrench.torque")),
    "sensor_msgs/msg/Imu": (
        ("angular velocity", "angular_velocity"),
        ("linear acceleration", "linear_acceleration"),
    ),
    "manipcli_msgs/msg/ContactSwitch": (("force", "force"), ("closed", "closed")),
    "sensor_msgs/msg/Range": (("range", "range"),),
}
"""Quantities of the types of sensors that are shown as curves, and their fields."""


def write_rerun(path: Path, log: Path, playback: Playback, *, rate: float) -> tuple[str, ...]:
    """Writes a log as a `.rrd` file.

    Args:
        path: the file, replaced when it is complete.
        log: the log.
        playback: of the log, at `rate`.
        rate: samples of numbers per second; of pictures a fifth [Hz].

    Returns:
        What is not shown, one sentence each.

    Raises:
        InvalidInput: the log changed while it was read.
        OSError: the file cannot be written.
    """
    notes: list[str] = []
    topics = open_topics(log)
    frames = frame_names(playback.robot, playback.scene)
    sensed = read_sensed(log, frames, begin=playback.begin, end=playback.end, with_pictures=False)
    measured = Measured(
        pictures=_pictures(topics, playback, frames, rate / FEWER, notes),
        taxels=sensed.taxels,
        rays=sensed.rays,
        numbers=_numbers(log, topics, playback, rate),
    )
    missing = write_recording(path, playback, measured)
    return (*missing, *sensed.notes, *notes)


def _pictures(
    topics: Topics, playback: Playback, frames: tuple[str, ...], rate: float, notes: list[str]
) -> Iterator[Measurement]:
    """Pictures and points, at most `rate` per second of each topic [Hz]; adds to `notes` what is left out."""
    wanted = [
        topic.name
        for topic in topics.all.values()
        if topic.type in (IMAGE, COMPRESSED, POINTS) and topic.encoding == "cdr" and topic.count
    ]
    if len(wanted) > MOST_TOPICS:
        notes.append(f"{len(wanted) - MOST_TOPICS} more topics of pictures are not shown")
    wanted = sorted(wanted)[:MOST_TOPICS]
    if not wanted:
        return
    parents, lenses = _mounts_and_lenses(topics)
    last: dict[str, int] = {}
    unread: dict[str, str] = {}
    size = 0
    for name, data, places in topics.messages(set(wanted)):
        for k, ns in enumerate(places.times.tolist()):
            time = (ns - playback.begin) / NS_PER_S
            number = math.floor(time * rate + 1e-6)
            if not playback.start - 1e-9 <= time <= playback.end + 1e-9 or last.get(name) == number:
                continue
            try:
                ((_, reader),) = singly(data, places.at(np.array([k])))
                shot = _shot(topics.all[name], reader, time, parents, lenses, frames)
            except (CdrError, Unshown) as error:
                unread.setdefault(name, str(error))
                continue
            last[name] = number
            size += int(places.lengths[k])
            if size > MOST_BYTES:
                notes.append(f"pictures after {time:.2f} s are not shown: they are more than {MOST_BYTES / 1e9:g} GB")
                return
            yield shot
    notes += (f"{name}: messages not shown: {why}" for name, why in unread.items())


def _mounts_and_lenses(topics: Topics) -> tuple[dict[str, tuple[str, Transform]], dict[str, tuple[str, Lens]]]:
    """The frames of /tf_static, and the first lens of each topic of CameraInfo with its frame."""
    infos = {topic.name for topic in topics.all.values() if topic.type == CAMERA_INFO and topic.encoding == "cdr"}
    parents: dict[str, tuple[str, Transform]] = {}
    lenses: dict[str, tuple[str, Lens]] = {}
    for name, data, places in topics.messages({*infos, channels.TF_STATIC}):
        if name == channels.TF_STATIC:
            remember_frames(parents, data, places)
        elif name not in lenses:
            try:
                ((_, reader),) = singly(data, places.at(np.array([0])))
                lenses[name] = read_camera_info(reader)
            except (CdrError, Unshown):
                continue
    return parents, lenses


def _shot(
    topic: Topic,
    reader: CdrReader,
    time: float,
    parents: Mapping[str, tuple[str, Transform]],
    lenses: Mapping[str, tuple[str, Lens]],
    frames: tuple[str, ...],
) -> Measurement:
    """
    Raises:
        CdrError, Unshown: a message that cannot be shown.
    """
    content: Pixels | PictureFile | Cloud
    if topic.type == POINTS:
        frame, content = read_cloud(reader)
    else:
        frame, content = read_rows(reader, topic.type, labels=topic.name.endswith(SEGMENTATION))
    base = topic.name.removesuffix("/compressed").removesuffix("/compressedDepth")
    camera, _, stream = base.rpartition("/")
    found = lenses.get(f"{camera}/camera_info")
    at = placed(frame, parents, frames)
    # Points are in their own frame; beside a lens they would be taken for a picture.
    lens = None if topic.type == POINTS or found is None else found[1]
    name = camera.removeprefix(f"{channels.SENSORS}/").strip("/") or stream
    if topic.type == POINTS:
        name, stream = f"{name} {stream}", "points"
    return Measurement(name, stream, time, None if at is None else Mount(*at), lens, content)


def _numbers(log: Path, topics: Topics, playback: Playback, rate: float) -> tuple[PlotTable, ...]:
    """Curves of sensors, one table for each quantity, at `rate` [Hz]."""
    kinds = [(topic.name, topic.type) for topic in topics.all.values() if topic.type in FIELDS and topic.count]
    known = {line.name for line in field_lines(log)} if kinds else set()
    shift = (topics.start - playback.begin) / NS_PER_S
    tables: list[PlotTable] = []
    for name, kind in sorted(kinds)[:MOST_TOPICS]:
        for quantity, field in FIELDS[kind]:
            stem = f"{name.strip('/')}.{field}"
            words = [word for word in (stem, *(f"{stem}.{axis}" for axis in "xyz")) if word in known]
            title = f"{name.removeprefix(f'{channels.SENSORS}/').strip('/')} {quantity}"
            tables += _tables(log, title, words, shift, rate)
    return tuple(tables)


def _tables(log: Path, title: str, words: list[str], shift: float, rate: float) -> Iterator[PlotTable]:
    try:
        panels = open_chart([log], words).panels if words else ()
    except InvalidInput:  # no value
        return
    curves = [(panel.unit, curve) for panel in panels for curve in panel.curves]
    if not curves or any(len(curve.times) != len(curves[0][1].times) for _, curve in curves):
        return
    times = curves[0][1].times + shift
    kept = _sparse(times, rate)
    names = tuple(curve.name.rpartition(".")[2] for _, curve in curves)
    values = np.stack([np.asarray(curve.values, dtype=np.float64)[kept] for _, curve in curves], axis=1)
    yield PlotTable(title, names, tuple(unit for unit, _ in curves), times[kept], values)


def _sparse(times: Array, rate: float) -> np.ndarray:
    """Indices of the first time of each interval 1 / rate."""
    number = np.floor(times * rate + 1e-6)
    return np.flatnonzero(np.diff(number, prepend=-np.inf) > 0)
