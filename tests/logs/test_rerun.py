"""Sensors in a Rerun recording: pictures, lenses, points and distances are those of the log."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rerun", reason="needs the extra 'rerun'")

from mcap.reader import make_reader
from rerun.chunk import RrdReader
from rosbags.typesys import Stores, get_typestore

from manipcli.cli.app import main
from manipcli.logs.replay import open_playback
from manipcli.logs.rerun import write_rerun
from manipcli.pipeline import run_task

ROOT = Path(__file__).parents[2]
TYPES = get_typestore(Stores.ROS2_HUMBLE)
TASK = f"""task: seen
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
simulation: {{engine: kinematic}}
scene:
  block: {{box: {{size: [0.1, 0.1, 0.1]}}, fixed: true, pose: {{xyz: [0.7, 0, 0.05]}}}}
  wall: {{box: {{size: [0.1, 2, 1]}}, fixed: true, pose: {{xyz: [1.6, 0, 0.5]}}}}
sensors:
  eye:
    type: camera
    at: {{xyz: [1.2, 0, 0.6], rpy: [0, 40 deg, 180 deg]}}
    resolution: [64, 48]
    rate: 10 Hz
    cloud: true
  scanner: {{type: range, frame: block, at: {{xyz: [0.2, 0, 0]}}, rays: 5, angle: 40 deg, rate: 10 Hz}}
steps:
  - wait: 0.3 s
"""
Rows = dict[str, list[object]]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rerun")
    task = folder / "task.yaml"
    task.write_text(TASK)
    run_task(task, log=folder / "run.mcap")
    return folder / "run.mcap"


@pytest.fixture(scope="module")
def entities(log: Path) -> dict[str, Rows]:
    path = log.parent / "run.rrd"
    assert (
        main(["export", str(log), "--rerun", str(path), "--rate", "inf", "--package-path", str(ROOT / "robots")]) == 0
    )
    return _read(path)


def _read(path: Path) -> dict[str, Rows]:
    found: dict[str, Rows] = {}
    for chunk in RrdReader(str(path)).stream():
        rows = found.setdefault(chunk.entity_path, {})
        for name, values in chunk.to_record_batch().to_pydict().items():
            rows.setdefault(name, []).extend(values)
    return found


def _messages(log: Path, topic: str) -> list[object]:
    """Read by other libraries."""
    with log.open("rb") as file:
        return [
            TYPES.deserialize_cdr(message.data, schema.name)
            for schema, _, message in make_reader(file).iter_messages(topics=[topic])
        ]


def _entity(entities: dict[str, Rows], ending: str) -> Rows:
    (found,) = (rows for path, rows in entities.items() if path.endswith(ending))
    return found


def test_depths_are_those_of_the_log(log: Path, entities: dict[str, Rows]) -> None:
    rows = _entity(entities, "/eye/depth")
    messages = _messages(log, "/sensors/eye/depth")
    assert len(rows["DepthImage:buffer"]) == len(messages) > 1
    for (buffer,), message in zip(rows["DepthImage:buffer"], messages, strict=True):  # type: ignore[misc]
        np.testing.assert_array_equal(np.asarray(buffer, dtype=np.uint8), message.data)  # type: ignore[attr-defined]
    assert rows["DepthImage:meter"][0] == [1000.0]


def test_the_lens_is_that_of_the_camera_info(log: Path, entities: dict[str, Rows]) -> None:
    rows = _entity(entities, "/eye")
    k = np.array(_messages(log, "/sensors/eye/camera_info")[0].k).reshape(3, 3)  # type: ignore[attr-defined]
    k[:2, 2] += 0.5  # the centre of a pixel is at (0.5, 0.5) in Rerun
    ((columns),) = rows["Pinhole:image_from_camera"][0]  # type: ignore[misc]
    np.testing.assert_allclose(np.reshape(columns, (3, 3)).T, k, rtol=1e-6)
    assert rows["Pinhole:resolution"][0] == [[64.0, 48.0]]


def test_points_and_colours_are_those_of_the_log(log: Path, entities: dict[str, Rows]) -> None:
    (path,) = (path for path in entities if path.endswith("/points"))
    cloud = _messages(log, "/sensors/eye/points")[0]
    offsets = {field.name: field.offset for field in cloud.fields}  # type: ignore[attr-defined]
    data = bytes(cloud.data)  # type: ignore[attr-defined]
    count = cloud.width * cloud.height  # type: ignore[attr-defined]
    starts = [k * cloud.point_step for k in range(count)]  # type: ignore[attr-defined]
    every = np.array([struct.unpack_from("<fff", data, start + offsets["x"]) for start in starts])
    known = np.isfinite(every).all(axis=1)
    np.testing.assert_allclose(entities[path]["Points3D:positions"][0], every[known], rtol=1e-6)
    words = np.array([struct.unpack_from("<I", data, start + offsets["rgb"])[0] for start in starts])[known]
    # Rerun packs red, green, blue and alpha, the alpha lowest.
    np.testing.assert_array_equal(np.array(entities[path]["Points3D:colors"][0]) >> 8, words & 0xFFFFFF)


def test_rays_end_where_they_meet_something(log: Path, entities: dict[str, Rows]) -> None:
    scan = _messages(log, "/sensors/scanner")[0]
    rows = _entity(entities, "/scanner")
    angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))  # type: ignore[attr-defined]
    hit = np.isfinite(scan.ranges) & (scan.ranges <= scan.range_max)  # type: ignore[attr-defined]
    reach = np.asarray(scan.ranges)[hit]  # type: ignore[attr-defined]
    points = np.stack([reach * np.cos(angles[hit]), reach * np.sin(angles[hit]), np.zeros(len(reach))], axis=1)
    first = rows["Points3D:positions"][0]
    assert len(first) == len(points) > 0  # type: ignore[arg-type]
    np.testing.assert_allclose(np.array(first) - [0.2, 0.0, 0.0], points, atol=1e-3)


def test_pictures_are_fewer_at_a_lower_rate(log: Path, tmp_path: Path) -> None:
    playback = open_playback(log, rate=20.0, package_path=[ROOT / "robots"])
    write_rerun(tmp_path / "few.rrd", log, playback, rate=20.0)
    few = len(_entity(_read(tmp_path / "few.rrd"), "/eye/image_raw")["EncodedImage:blob"])
    assert 1 <= few < len(_messages(log, "/sensors/eye/image_raw"))
