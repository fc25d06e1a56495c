"""Readings of sensors in a log: what arrived, when it arrived, whole or in spans; pictures as pixels of each part."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader

from manipcli.conditions.sensed import Sensed
from manipcli.core.geometry import Array
from manipcli.judge.state_windows import Order, WindowsOfSpans, unrecorded
from manipcli.record.channels import MeasuredChannel
from manipcli.record.faults import BadRecording, Thinned
from manipcli.record.read.reading import open_recording
from manipcli.record.read.spans import with_readings
from manipcli.record.selection import Selection

T, PERIOD = 1205, 0.001
GRID = {"rows": 1, "columns": 2, "width": 0.01, "height": 0.01}
NONE = np.zeros(2)
CHANNELS = (
    MeasuredChannel(
        "/sensors/tip",
        "manipcli_msgs/msg/ContactSwitch",
        "tip",
        ("closed", "force"),
        {"threshold": 1.0},
        arrived=0,
        first=1,
        width=1,
        complete=False,
        derive=lambda force: np.concatenate((force >= 1.0, force), axis=1),
    ),
    MeasuredChannel(
        "/sensors/pad",
        "manipcli_msgs/msg/Taxels",
        "pad",
        ("force",),
        {**GRID, "force": NONE},
        arrived=2,
        first=3,
        width=6,
        complete=False,
        derive=lambda reading: reading[:, :2],
    ),
    MeasuredChannel(
        "/sensors/pad/shear",
        "manipcli_msgs/msg/TaxelShear",
        "pad",
        ("x", "y"),
        {**GRID, "x": NONE, "y": NONE},
        arrived=2,
        first=3,
        width=6,
        complete=False,
        derive=lambda reading: reading[:, 2:],
    ),
    MeasuredChannel("/sensors/eye/segmentation", "sensor_msgs/msg/Image", "eye_optical"),
)
CELLS = (("", "force", 2), ("/shear", "x", 2), ("/shear", "y", 2))
SENSED = {
    "tip": Sensed("contact", (("", "force", 1),), messages={"": "manipcli_msgs/msg/ContactSwitch"}),
    "pad": Sensed(
        "tactile", CELLS, messages={"": "manipcli_msgs/msg/Taxels", "/shear": "manipcli_msgs/msg/TaxelShear"}
    ),
    "eye": Sensed("camera", picture="/segmentation", parts=("world", "cup", "desk")),
}


@dataclass
class Written:
    """A log, and when which numbers arrived in it."""

    path: Path
    times: dict[str, list[float]]
    values: dict[str, list[Array]]


def write(path: Path, run: Any, **changes: Any) -> Written:
    """Random measurements that arrive at random ticks, and pictures of random parts at every 60th tick."""
    rng = np.random.default_rng(2)
    recorder = run.recorder(path, sensors=CHANNELS, **changes)
    numbers = np.zeros(9)
    recorder.attach(numbers)
    found = Written(path, {name: [] for name in SENSED}, {name: [] for name in SENSED})

    def arrives(name: str, tick: int, values: Array) -> None:
        found.times[name].append(tick / 1000)
        found.values[name].append(values)

    for k in range(T):
        for name, row in (("tip", numbers[:2]), ("pad", numbers[2:])):
            row[0] = k > 5 and rng.random() < 0.3
            if row[0]:
                row[1:] = rng.normal(size=len(row) - 1)
                arrives(name, k, row[1:].copy())
        if k % 60 == 40:
            parts = rng.integers(0, 3, (4, 5)).astype(np.uint8)
            image = {"height": 4, "width": 5, "encoding": "8UC1", "step": 5, "data": parts.tobytes()}
            recorder.measured(k, k - 7, "/sensors/eye/segmentation", image)
            arrives("eye", k, np.array([(parts == part).sum() for part in range(3)]))
        run.feed(recorder, k, k + 1)
    recorder.flush()
    recorder.finish({})
    return found


def test_what_is_read_is_what_arrived(tmp_path: Path, make_run: Callable[[int], Any]) -> None:
    run = make_run(T)
    log = write(tmp_path / "run.mcap", run)
    read = with_readings(open_recording(log.path), SENSED)
    assert read.sensors == ("tip", "pad", "eye")
    (whole,) = read.whole().spans
    for name in SENSED:
        np.testing.assert_array_equal(whole.readings[name].times, log.times[name])
        np.testing.assert_array_equal(whole.readings[name].values, log.values[name])
    assert not next(iter(open_recording(log.path).spans)).readings  # nobody asked

    order = Order.of(read, run.robot, run.scene)
    assert isinstance(order, Order)
    windows, spans, ticks = WindowsOfSpans(order, ()), 0, 0
    for span in read.spans:
        window = windows.next(span)
        spans, ticks = spans + 1, ticks + len(window.times)
        for name in SENSED:
            held, known = window.readings[name].at(window.times)
            for k, time in enumerate(window.times):
                before = [each for each, at in zip(log.values[name], log.times[name], strict=True) if at <= time]
                assert known[k] == bool(before)
                if before:
                    np.testing.assert_array_equal(window.readings[name].values[held[k]], before[-1])
    assert (spans, ticks) == (3, T)


def test_what_is_left_out_is_reported(tmp_path: Path, make_run: Callable[[int], Any]) -> None:
    log = write(tmp_path / "run.mcap", make_run(T), selection=Selection(left_out=frozenset({"sensors"})))
    read = with_readings(open_recording(log.path), SENSED)
    assert read.sensors == ()
    assert unrecorded(read) == {"sensors": "the log has no /sensors/tip: the task's `record:` excludes it"}


@pytest.mark.parametrize("topic", ["/sensors/tip", "/sensors/pad/shear", "/sensors/eye/segmentation"])
def test_a_lost_message_is_found(tmp_path: Path, make_run: Callable[[int], Any], rewrite_log: Any, topic: str) -> None:
    log, cut = write(tmp_path / "run.mcap", make_run(T)), tmp_path / "cut.mcap"

    def kept(where: str, message: Any) -> bytes | None:
        return None if where == topic and message.sequence == 5 else bytes(message.data)

    rewrite_log(log.path, cut, message=kept)
    list(open_recording(cut).spans)
    with pytest.raises(Thinned):
        list(with_readings(open_recording(cut), SENSED).spans)


def test_pictures_of_one_tick_can_be_in_different_chunks(
    tmp_path: Path, make_run: Callable[[int], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    depths = [MeasuredChannel(f"/sensors/{k}/depth", "sensor_msgs/msg/Image", "eye_optical") for k in range(2)]

    def record(path: Path) -> None:
        run = make_run(20)
        writing = run.recorder(path, sensors=(*CHANNELS, *depths))
        writing.attach(np.zeros(9))
        for k in range(20):
            for part in range(3 if k in (0, 7, 19) else 0):  # of a tick, as those of several cameras
                image = {"height": 4, "width": 5, "encoding": "8UC1", "step": 5, "data": bytes([part] * 20)}
                writing.measured(k, k, "/sensors/eye/segmentation" if part == 2 else f"/sensors/{part}/depth", image)
            run.feed(writing, k, k + 1)
        writing.finish({})

    record(tmp_path / "one.mcap")
    monkeypatch.setattr("manipcli.record.write.recorder.MOST_CHUNK", 100)  # [byte] one picture
    record(tmp_path / "many.mcap")
    one, many = (messages_and_chunks(tmp_path / name) for name in ("one.mcap", "many.mcap"))
    assert many[0] == one[0]
    assert many[1] == one[1] + 8, "all but the first of them, which nothing is before"
    readings = [
        next(iter(with_readings(open_recording(tmp_path / name), SENSED).whole().spans)).readings["eye"]
        for name in ("one.mcap", "many.mcap")
    ]
    np.testing.assert_array_equal(readings[0].times, readings[1].times)
    np.testing.assert_array_equal(readings[0].values, readings[1].values)


def messages_and_chunks(path: Path) -> tuple[dict[str, list[tuple[int, bytes]]], int]:
    found: dict[str, list[tuple[int, bytes]]] = {}
    with path.open("rb") as file:
        reader = make_reader(file)
        for _, channel, message in reader.iter_messages(log_time_order=False):
            found.setdefault(channel.topic, []).append((message.log_time, message.data))
        summary = reader.get_summary()
    assert summary is not None
    assert summary.statistics is not None
    return found, summary.statistics.chunk_count


def test_a_picture_of_a_wrong_size_is_refused(tmp_path: Path, make_run: Callable[[int], Any]) -> None:
    path, run = tmp_path / "run.mcap", make_run(20)
    recorder = run.recorder(path, sensors=CHANNELS)
    recorder.attach(np.zeros(9))
    image = {"height": 4, "width": 5, "encoding": "8UC1", "step": 5, "data": bytes(19)}
    recorder.measured(3, 3, "/sensors/eye/segmentation", image)
    run.feed(recorder)
    recorder.finish({})
    with pytest.raises(BadRecording, match="picture"):
        list(with_readings(open_recording(path), {"eye": SENSED["eye"]}).spans)
    wide = replace(SENSED["tip"], fields=(("", "force", 2),))
    with pytest.raises(BadRecording, match="numbers"):
        list(with_readings(open_recording(write(tmp_path / "b.mcap", make_run(T)).path), {"tip": wide}).spans)
