"""Pictures and distances of a run: what rosbags reads, against rays in closed form; refused cameras."""

from __future__ import annotations

from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from manipcli.core.geometry import Transform

TASK = """\
task: seen
robot: robot.yaml
controllers: controllers.yaml
simulation: {engine: kinematic, control_period: 10 ms, settle: 0 s}
scene:
  box: {box: {size: [0.4, 0.6, 0.3]}, pose: {xyz: [2, 0.1, 0.2], rpy: [0, 0, 20 deg]}, fixed: true}
sensors:
  eye:
    type: camera
    at: {xyz: [0.4, 0, 0.6], rpy: [0, 15 deg, 0]}
    resolution: [80, 60]
    fov: 50 deg
    delay: 30 ms
    segmentation: true
    cloud: true
    NOISE
  scanner: {type: range, at: {xyz: [0.4, 0, 0.15]}, rays: 181, angle: 90 deg, rate: 20 Hz, limits: {most: 5 m}}
  beam: {type: range, at: {xyz: [0.4, 0, 0.15]}, rate: 20 Hz, limits: {least: 3 cm, most: 1 m}}
steps: [wait: 0.1 s]
"""
CONTROLLERS = "controllers: {hinge: {type: joint_trajectory, joints: [hinge], command_interface: position}}"
NOISE = "noise: {depth: {white: 1 mm, quadratic: 2e-3, grazing: 1e-4, lateral: 0.5, bias: 1 mm}, dropout: 5 %}"
X_WB = Transform.of(xyz=(2.0, 0.1, 0.2), rpy=(0.0, 0.0, np.radians(20.0)))
SIZE = np.array([0.4, 0.6, 0.3])
Messages = dict[str, list[tuple[int, Any]]]


def messages(log: Path) -> Messages:
    """(log time [ns], message) of the topics of the sensors, and `/tf_static`, as rosbags reads them."""
    reader = McapReader(log)
    reader.open()
    store, types = get_typestore(Stores.EMPTY), {}
    for connection in reader.connections:
        types |= get_types_from_msg(connection.msgdef.data, connection.msgtype)
    store.register(types)
    found: Messages = {}
    for connection, time, raw in reader.messages(reader.connections):
        if connection.topic.startswith(("/sensors/", "/tf_static")):
            found.setdefault(connection.topic, []).append((time, store.deserialize_cdr(raw, connection.msgtype)))
    reader.close()
    return found


def on_box(origin: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Length along rays d, from `origin`, to the box of the task; infinite beside it."""
    start, along = X_WB.R.T @ (origin - X_WB.p), d @ X_WB.R
    with np.errstate(divide="ignore"):
        ends = np.stack([(side * SIZE / 2.0 - start) / along for side in (-1.0, 1.0)])
    enter, leave = ends.min(axis=0).max(axis=-1), ends.max(axis=0).min(axis=-1)
    return np.where((enter <= leave) & (enter > 0.0), enter, np.inf)


def write(folder: Path, text: str) -> None:
    (folder / "task.yaml").write_text(text)
    (folder / "controllers.yaml").write_text(CONTROLLERS)


def pixels(message: Any, kind: str, count: int = 1) -> np.ndarray:
    """(h, w[, count]) numbers of an image."""
    return np.frombuffer(message.data.tobytes(), kind).reshape(message.height, message.width, count).squeeze()


def test_what_rosbags_reads_is_what_rays_meet(pendulum: Callable[..., Path], call_cli: Callable[..., Any]) -> None:
    folder = pendulum("")
    write(folder, TASK.replace("NOISE", "noise: {}"))
    ran = call_cli("run", "task.yaml", "--log", "run.mcap", cwd=folder)
    assert ran.code == 0, ran.err
    found = messages(folder / "run.mcap")
    times = [time for time, _ in found["/sensors/eye/depth"]]
    assert times[:3] == [30_000_000, 70_000_000, 110_000_000], "25 Hz, from tick 0 on, 30 ms late"
    _, depth = found["/sensors/eye/depth"][1]
    assert (depth.header.stamp.nanosec, depth.header.frame_id) == (40_000_000, "eye_optical")

    info = found["/sensors/eye/camera_info"][0][1]
    u, v = np.meshgrid(np.arange(80), np.arange(60))
    rays = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(info.k.reshape(3, 3)).T
    X_WS = Transform.of(xyz=(0.4, 0.0, 0.6), rpy=(0.0, np.radians(15.0), 0.0))
    R_WC = X_WS.R @ np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])  # x of C is -y of S, y is -z
    expected = on_box(X_WS.p, rays @ R_WC.T)
    box = np.isfinite(expected)
    assert 300 < box.sum() < 3000
    metres = pixels(depth, "<u2") / 1000.0
    assert np.abs(metres - expected)[box].max() <= 0.5e-3 + 1e-6, "rounded to 1 mm"

    names = {each.class_id: each.class_name for each in found["/sensors/eye/labels"][0][1].class_map}
    part = pixels(found["/sensors/eye/segmentation"][1][1], "u1")
    assert {names[k] for k in np.unique(part[box])} == {"box"}
    assert "box" not in {names[k] for k in np.unique(part[~box])}

    image = pixels(found["/sensors/eye/image_raw"][1][1], "u1", 3)
    cloud = np.frombuffer(found["/sensors/eye/points"][1][1].data.tobytes(), "<f4").reshape(60, 80, 4)
    points = X_WS.p + cloud[..., :3] @ R_WC.T
    local = np.abs((points[box] - X_WB.p) @ X_WB.R) - SIZE / 2.0
    assert np.abs(local.max(axis=1)).max() < 1e-6, "points are on the surface of the box"
    packed = cloud[..., 3].copy().view(np.uint32)
    assert np.array_equal(np.stack([packed >> 16, packed >> 8 & 255, packed & 255], axis=-1), image)

    _, scan = found["/sensors/scanner"][1]
    angles = scan.angle_min + scan.angle_increment * np.arange(181)
    flat = np.stack([np.cos(angles), np.sin(angles), np.zeros(181)], axis=-1)
    on = on_box(np.array([0.4, 0.0, 0.15]), flat)
    hit = np.isfinite(on)
    assert hit.any()
    assert np.abs(scan.ranges[hit] - on[hit]).max() < 1e-5
    beam = found["/sensors/beam"][0][1]
    assert (beam.range, round(beam.max_range, 6)) == (np.inf, 1.0), "the box is farther than 1 m"
    moved = {each.child_frame_id: each for each in found["/tf_static"][0][1].transforms}
    q = moved["eye_optical"].transform.rotation
    assert np.allclose(np.abs([q.x, q.y, q.z, q.w]), 0.5)
    assert moved["eye_optical"].header.frame_id == "eye"


def test_noise_is_the_same_in_two_processes(
    pendulum: Callable[..., Path], call_cli: Callable[..., Any], run_cli: Callable[..., Any]
) -> None:
    folder = pendulum("")
    write(folder, TASK.replace("NOISE", NOISE))
    assert call_cli("run", "task.yaml", "--log", "one.mcap", cwd=folder).code == 0
    assert run_cli("run", "task.yaml", "--log", "two.mcap", cwd=folder).code == 0
    one, two = (sha256((folder / name).read_bytes()).hexdigest() for name in ("one.mcap", "two.mcap"))
    assert one == two
    depth = pixels(messages(folder / "one.mcap")["/sensors/eye/depth"][0][1], "<u2")
    assert (depth == 0).mean() > 0.05


@pytest.mark.parametrize(
    ("change", "code", "text"),
    [
        ({"fov: 50 deg": "fov: 200 deg"}, "SENS130", "200 deg is not between 0 and 180 deg"),
        ({"fov: 50 deg": "fov: 60"}, "SENS130", "write '60 deg'"),
        ({"[80, 60]": "[10000, 10000]"}, "SENS131", "100 million pixels"),
        ({"NOISE": "noise: {depth: {white: -1 mm}}"}, "", "white"),
        ({"least: 3 cm": "least: 3 m"}, "", "is not below 'most'"),
        ({"delay: 30 ms": "rate: 30 Hz"}, "SENS", "30 Hz"),
    ],
)
def test_impossible_cameras_are_refused_where_they_are_written(
    change: dict[str, str], code: str, text: str, pendulum: Callable[..., Path], call_cli: Callable[..., Any]
) -> None:
    folder, task = pendulum(""), TASK
    for old, new in change.items():
        assert old in task
        task = task.replace(old, new)
    write(folder, task.replace("NOISE", "noise: {}"))
    ran = call_cli("check", "task.yaml", cwd=folder)
    said = " ".join((ran.out + ran.err).split())
    assert ran.code != 0
    assert text in said
    assert code in said
    assert "task.yaml:" in said
