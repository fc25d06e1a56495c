"""A run as an animated glTF file, read back by trimesh and by hand: the frames are those of `/tf` in the log."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation, Slerp

from manipcli.logs.replay import open_playback
from manipcli.replay.gltf.run import run_glb
from tests.conftest import PourRun

Array = np.ndarray[Any, np.dtype[np.float64]]
UP = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0], [0, -1.0, 0, 0], [0, 0, 0, 1.0]])
"""From z up to y up."""


@pytest.fixture(scope="module")
def glb(pour_run: PourRun, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("glb") / "pour.glb"
    path.write_bytes(run_glb(open_playback(pour_run.log, rate=100.0))[0])
    return path


def _matrix(p: Any, q: Any) -> Array:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_quat(np.asarray(q, dtype=float)).as_matrix()
    matrix[:3, 3] = p
    return matrix


def _recorded(log: Path, time: float) -> dict[str, Array]:
    """Pose of every frame in the world at a recorded time, composed from `/tf_static` and the nearest `/tf`."""
    edges: dict[str, tuple[str, Array]] = {}
    with AnyReader([log], default_typestore=get_typestore(Stores.EMPTY)) as reader:
        for topic, times in (("/tf_static", (0, 1)), ("/tf", (int(time * 1e9) - 1, int(time * 1e9) + 500_000))):
            channels = [one for one in reader.connections if one.topic == topic]
            for channel, _, data in reader.messages(channels, *times):
                message: Any = reader.deserialize(data, channel.msgtype)
                for one in message.transforms:
                    t, r = one.transform.translation, one.transform.rotation
                    edges[one.child_frame_id] = one.header.frame_id, _matrix((t.x, t.y, t.z), (r.x, r.y, r.z, r.w))
    found = {"world": np.eye(4)}

    def pose(frame: str) -> Array:
        if frame not in found:
            parent, X = edges[frame]
            found[frame] = pose(parent) @ X
        return found[frame]

    return {frame: pose(frame) for frame in edges}


def _document(path: Path) -> tuple[dict[str, Any], bytes]:
    data = path.read_bytes()
    assert struct.unpack_from("<4sII", data) == (b"glTF", 2, len(data))
    size = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def _played(path: Path, time: float) -> dict[str, Array]:
    """World poses of the nodes at a time: the animation replaces the parts of a node, as the specification says."""
    document, buffer = _document(path)

    def numbers(accessor: int) -> Array:
        one = document["accessors"][accessor]
        start = document["bufferViews"][one["bufferView"]]["byteOffset"]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[one["type"]]
        return np.frombuffer(buffer, "<f4", one["count"] * width, start).reshape(-1, width).astype(float)

    nodes = document["nodes"]
    parts = [{"translation": node.get("translation", [0, 0, 0]), "rotation": node.get("rotation", [0, 0, 0, 1])}
             for node in nodes]  # fmt: skip
    animation = document["animations"][0]
    for channel in animation["channels"]:
        sampler = animation["samplers"][channel["sampler"]]
        clock, values = numbers(sampler["input"])[:, 0], numbers(sampler["output"])
        target = channel["target"]
        if target["path"] == "rotation":
            value = Slerp(clock, Rotation.from_quat(values))(time).as_quat()
        else:
            value = np.array([np.interp(time, clock, column) for column in values.T])
        parts[target["node"]][target["path"]] = value
    found: dict[str, Array] = {}

    def place(number: int, above: Array) -> None:
        world = above @ _matrix(parts[number]["translation"], parts[number]["rotation"])
        found[nodes[number]["name"]] = world
        for child in nodes[number].get("children", []):
            place(child, world)

    place(document["scenes"][0]["nodes"][0], np.eye(4))
    return found


@pytest.mark.parametrize("time", [0.0, 4.0, 9.5])
def test_at_every_time_the_nodes_are_where_the_log_has_the_frames(glb: Path, pour_run: PourRun, time: float) -> None:
    played, recorded = _played(glb, time), _recorded(pour_run.log, time)
    assert {"cup", "ball"} <= recorded.keys() & played.keys()
    assert len(recorded.keys() & played.keys()) > 12
    for frame in recorded.keys() & played.keys():
        # float32 keys, composed over eight links
        np.testing.assert_allclose(played[frame], UP @ recorded[frame], atol=3e-6, err_msg=frame)


def test_another_reader_finds_the_shapes_where_the_run_begins(glb: Path, pour_run: PourRun) -> None:
    scene = trimesh.load_scene(glb)
    playback = open_playback(pour_run.log, rate=1.0)
    assert playback.scene is not None
    start = _recorded(pour_run.log, 0.0)
    desk = next(body for body in playback.scene.bodies if body.kind == "box" and body.fixed)
    X, mesh = scene.graph[desk.name]
    low, high = scene.geometry[mesh].bounds
    np.testing.assert_allclose(high - low, desk.size, atol=1e-6)
    np.testing.assert_allclose(X @ [*(low + high) / 2, 1.0], UP @ [*desk.X_WO.apply(desk.centre), 1.0], atol=1e-6)
    np.testing.assert_allclose(scene.graph["cup"][0], UP @ start["cup"], atol=1e-6)
    assert scene.graph.transforms.parents["cup"] != "cup"


def test_a_colour_is_that_of_the_description_in_linear_light(glb: Path, pour_run: PourRun) -> None:
    document, _ = _document(glb)
    names = {node["name"]: node for node in document["nodes"]}
    mesh = document["meshes"][names["ball"]["mesh"]]
    factor = document["materials"][mesh["primitives"][0]["material"]]["pbrMetallicRoughness"]["baseColorFactor"]
    playback = open_playback(pour_run.log, rate=1.0)
    assert playback.scene is not None
    rgba = playback.scene.body("ball").geometries[0].rgba
    assert rgba is not None
    # 2.2: the usual approximation of the curve of sRGB
    np.testing.assert_allclose(factor[:3], np.array(rgba[:3]) ** 2.2, atol=0.03)
