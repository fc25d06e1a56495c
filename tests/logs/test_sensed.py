"""What a page shows of sensors in a log: the right messages at the right times, and nothing that crashes it.

Messages are serialised by rosbags.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.writer import Writer
from PIL import Image
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from manipcli.logs import sensed
from manipcli.logs.sensed import read_sensed
from manipcli.record.schemas import DEFINITIONS, schema_text
from manipcli.replay.sensed import UNKNOWN, counted

TYPES = get_typestore(Stores.ROS2_HUMBLE)
TYPES.register(get_types_from_msg(DEFINITIONS["manipcli_msgs/Taxels"], "manipcli_msgs/msg/Taxels"))
FRAMES = ("world", "robot/palm")
BEGIN = 1_700_000_000_000_000_000


def make(kind: str, **fields: object) -> Any:
    return TYPES.types[kind](**fields)


def header(time: float, frame: str) -> Any:
    ns = BEGIN + round(time * 1e9)
    stamp = make("builtin_interfaces/msg/Time", sec=ns // 10**9, nanosec=ns % 10**9)
    return make("std_msgs/msg/Header", stamp=stamp, frame_id=frame)


def write(path: Path, messages: list[tuple[str, float, str, object]]) -> Path:
    """A log of (topic, log time [s], type, message or bytes)."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="test")
        channels: dict[str, int] = {}
        for topic, time, kind, message in messages:
            if topic not in channels:
                schema = writer.register_schema(kind, "ros2msg", schema_text(kind).encode())
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            data = message if isinstance(message, bytes) else bytes(TYPES.serialize_cdr(message, kind))
            ns = BEGIN + round(time * 1e9)
            writer.add_message(channels[topic], ns, data, ns)
        writer.finish()
    return path


def picture(
    gray: int, time: float, *, size: tuple[int, int] = (16, 12), missing: int = 0, encoding: str = "rgb8"
) -> Any:
    width, height = size
    data = np.full(width * height * 3 - missing, gray, dtype=np.uint8)
    fields = {"height": height, "width": width, "encoding": encoding, "is_bigendian": 0, "step": 3 * width}
    return make("sensor_msgs/msg/Image", header=header(time, "eye"), **fields, data=data)


IMAGE = "sensor_msgs/msg/Image"


def test_a_picture_is_shown_from_its_arrival_on(tmp_path: Path) -> None:
    """25 Hz with a delay of 50 ms: the first one that arrives in each tenth of a second."""
    taken = np.arange(50) * 0.04
    log = write(
        tmp_path / "a.mcap",
        [("/sensors/eye/image_raw", t + 0.05, IMAGE, picture(4 * k, t)) for k, t in enumerate(taken)],
    )
    (camera,) = read_sensed(log, FRAMES, begin=BEGIN, end=2.0).cameras
    (stream,) = camera.streams
    assert (camera.name, stream.name, stream.kind, stream.size) == ("eye", "image_raw", "colour", (16, 12))
    arrivals = taken + 0.05
    tenth = np.floor(10.0 * arrivals + 1e-6)
    first = [k for k in range(50) if arrivals[k] <= 2.0 and (k == 0 or tenth[k] > tenth[k - 1])]
    assert stream.times == pytest.approx(arrivals[first])
    grays = [np.asarray(Image.open(io.BytesIO(data))).mean() for data in stream.pictures]
    assert grays == pytest.approx([4 * k for k in first], abs=3.0)
    assert stream.note == f"{len(first)} of 49 pictures"


def test_pictures_that_cannot_be_shown_are_counted_with_the_reason(tmp_path: Path) -> None:
    messages = [("/cam/image", 0.5 * k, IMAGE, picture(9, 0.5 * k, missing=k % 2)) for k in range(6)]
    messages += [("/bad/image", 0.5 * k, IMAGE, picture(9, 0.0, encoding="yuv422")) for k in range(6)]
    messages += [("/cut/image", 0.5, IMAGE, bytes(TYPES.serialize_cdr(picture(9, 0.0), IMAGE))[:40])]
    messages += [("/cut/image", 1.0, IMAGE, b""), ("/other/image", 0.0, IMAGE, picture(9, 0.0, size=(0, 0)))]
    messages += [("/big/image", 0.1 * k, IMAGE, picture(9, 0.0, size=(16, 12 + k % 2))) for k in range(4)]
    found = read_sensed(write(tmp_path / "a.mcap", messages), FRAMES, begin=BEGIN, end=9.0)
    shown = {camera.name: camera.streams[0] for camera in found.cameras}
    assert sorted(shown) == ["big", "cam"]
    assert shown["cam"].times == pytest.approx([0.0, 1.0, 2.0])
    assert "3 not shown: 16 x 12 rgb8" in shown["cam"].note
    told = "\n".join(found.notes)
    assert "/bad/image: 6 not shown: encoding 'yuv422' is not shown" in told
    assert "/cut/image: 1 not shown: a message ends too early" in told
    assert "/big/image: 2 messages of another size are not shown" in told


def test_all_pictures_together_keep_within_the_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sensed, "PICTURE_BYTES", 4000)
    noise = np.random.default_rng(0).integers(0, 256, (40, 12 * 16 * 3)).astype(np.uint8)
    messages = []
    for k in range(40):
        message = picture(0, 0.1 * k)
        message.data = noise[k]
        messages += [(f"/cam_{side}/image", 0.1 * k, IMAGE, message) for side in "ab"]
    found = read_sensed(write(tmp_path / "a.mcap", messages), FRAMES, begin=BEGIN, end=9.0)
    streams = [camera.streams[0] for camera in found.cameras]
    total = sum(len(data) for stream in streams for data in stream.pictures)
    assert 1500 < total <= 4000
    assert len(streams[0].times) == len(streams[1].times)
    assert all(f"{len(stream.times)} of 40 pictures" in stream.note for stream in streams)
    assert np.ptp(np.diff(streams[0].times)) < 0.1 + 1e-9


def test_a_compressed_copy_is_not_shown_twice(tmp_path: Path) -> None:
    stream = io.BytesIO()
    Image.new("RGB", (8, 8), (200, 10, 10)).save(stream, "JPEG")
    kind, data = "sensor_msgs/msg/CompressedImage", np.frombuffer(stream.getvalue(), np.uint8)
    small = make(kind, header=header(0.0, "eye"), format="rgb8; jpeg compressed bgr8", data=data)
    messages = [("/a/image/compressed", 0.0, kind, small), ("/b/image/compressed", 0.0, kind, small)]
    messages.append(("/a/image", 0.0, IMAGE, picture(1, 0.0)))
    found = read_sensed(write(tmp_path / "a.mcap", messages), FRAMES, begin=BEGIN, end=1.0)
    assert [(camera.name, camera.streams[0].size) for camera in found.cameras] == [("a", (16, 12)), ("b", (8, 8))]


def test_taxels_keep_their_forces_and_wrong_grids_are_told(tmp_path: Path) -> None:
    kind = "manipcli_msgs/msg/Taxels"
    force = np.array([[0.0, 1.5, 0.25], [3.0, -0.1, np.nan]])

    def grid(rows: int, columns: int, values: np.ndarray) -> Any:
        cell = {"width": 4e-3, "height": 2e-3}
        return make(kind, header=header(0.0, "tip"), rows=rows, columns=columns, **cell, force=values.reshape(-1))

    messages = [("/sensors/tip", 0.02 * k, kind, grid(2, 3, k * force)) for k in range(1, 11)]
    messages += [("/wrong", 0.0, kind, grid(2, 4, force)), ("/huge", 0.0, kind, grid(2**32 - 1, 2**32 - 1, force))]
    found = read_sensed(write(tmp_path / "a.mcap", messages), FRAMES, begin=BEGIN, end=1.0)
    (feed,) = found.taxels
    assert (feed.name, feed.rows, feed.columns, feed.cell) == ("tip", 2, 3, (4e-3, 2e-3))
    assert feed.times == pytest.approx(0.02 * np.arange(1, 11))
    assert feed.counts[3][:5] * feed.unit == pytest.approx(4.0 * np.array([0.0, 1.5, 0.25, 3.0, 0.0]), abs=1e-3)
    assert (feed.counts[:, 5] == UNKNOWN).all()
    assert any(note.startswith("/wrong: 1 not shown: 2 x 4 cells do not fit 6 forces") for note in found.notes)
    assert any(note.startswith("/huge: 1 not shown") for note in found.notes)


def test_rays_begin_at_the_frame_of_the_range_finder(tmp_path: Path) -> None:
    """A chain of two fixed frames below a link; oracle: the sum of their translations."""

    def fixed(parent: str, child: str, z: float) -> Any:
        vector = make("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=z)
        turned = make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=2.0)
        pose = make("geometry_msgs/msg/Transform", translation=vector, rotation=turned)
        return make(
            "geometry_msgs/msg/TransformStamped", header=header(0.0, parent), child_frame_id=child, transform=pose
        )

    tree = [fixed("palm", "mount", 0.1), fixed("mount", "scanner", 0.02), fixed("x", "y", 1.0), fixed("y", "x", 1.0)]
    kind, count = "sensor_msgs/msg/LaserScan", 1500

    def scan(time: float, frame: str, first: float = -1.0) -> Any:
        ranges = np.linspace(0.5, 3.0, count).astype(np.float32)
        ranges[:3] = np.inf, np.nan, 0.01
        limits = {"range_min": 0.1, "range_max": 4.0, "scan_time": 0.1, "time_increment": 0.0}
        angles = {"angle_min": first, "angle_max": 1.0, "angle_increment": 2.0 / count}
        rays = {"ranges": ranges, "intensities": np.zeros(0, dtype=np.float32)}
        return make(kind, header=header(time, frame), **angles, **limits, **rays)

    messages = [("/tf_static", 0.0, "tf2_msgs/msg/TFMessage", make("tf2_msgs/msg/TFMessage", transforms=tree))]
    messages += [("/scan", 0.5, kind, scan(0.4, "scanner")), ("/nowhere", 0.5, kind, scan(0.4, "x"))]
    messages += [("/mad", 0.5, kind, scan(0.4, "scanner", np.nan))]
    found = read_sensed(write(tmp_path / "a.mcap", messages), FRAMES, begin=BEGIN, end=1.0)
    (feed,) = found.rays
    assert (feed.parent, feed.X_PS.p.tolist()) == ("robot/palm", pytest.approx([0.0, 0.0, 0.12]))
    assert (feed.times.tolist(), feed.taken.tolist()) == (pytest.approx([0.5]), pytest.approx([0.4]))
    every = 3  # of 1500 rays, so that at most 720 are left
    assert len(feed.angles) == 500
    assert feed.angles == pytest.approx(-1.0 + 2.0 / count * every * np.arange(500), abs=1e-6)
    assert feed.counts[0, 0] == UNKNOWN
    assert feed.counts[0, 1:] * feed.unit == pytest.approx(np.linspace(0.5, 3.0, count)[3::3], abs=1e-4)
    assert "/nowhere: frame 'x' is not in the log: its rays are not drawn" in found.notes
    assert any(note.startswith("/mad: 1 not shown") for note in found.notes)


def test_a_log_without_sensors_has_nothing_to_show(tmp_path: Path) -> None:
    text = make("std_msgs/msg/String", data="x")
    log = write(tmp_path / "a.mcap", [("/chatter", 0.0, "std_msgs/msg/String", text)])
    assert not read_sensed(log, FRAMES, begin=BEGIN, end=1.0)


@pytest.mark.filterwarnings("error")
def test_numbers_too_small_for_a_unit_are_shown_as_nothing() -> None:
    counts, unit = counted(np.array([5e-324, 0.0, -1.0, np.nan]))
    assert unit > 0.0
    assert counts.tolist() == [0, 0, 0, UNKNOWN]
