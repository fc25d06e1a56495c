"""A scene written to text comes back the same, without its files."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from manipcli.core.geometry import Transform
from manipcli.scene.build_scene import build_scene
from manipcli.scene.scene import Scene
from manipcli.scene.scene_file import scene_from_json, scene_to_json
from manipcli.shapes.primitives import Geometry, Mesh
from manipcli.spec.scene import BodySpec, FrameSpec
from manipcli.spec.task import TaskSpec

BODIES: dict[str, Any] = {
    "desk": {"box": {"size": [0.6, 1.0, 0.4]}, "pose": {"xyz": [0.85, 0, 0.2], "rpy": [0, 0, 0.3]}, "fixed": True},
    "cup": {
        "cup": {"radius": 0.036, "height": 0.11},
        "mass": 0.15,
        "rests_on": "desk",
        "at": [0.75, 0],
        "friction": 1.0,
    },
    "ball": {"sphere": {"radius": 0.014}, "mass": 0.01, "inside": "cup", "rolling_friction": 1e-4},
    "tray": {"tray": {"size": [0.2, 0.2, 0.05]}, "rests_on": "floor", "at": [0, 1], "fixed": True},
    "lid": {
        "box": {"size": [0.1, 0.1, 0.01]},
        "mass": 0.1,
        "rests_on": "desk",
        "at": [0.7, 0.2],
        "parts": {"knob": {"pose": {"xyz": [0, 0, 0.02]}, "size": [0.02, 0.02, 0.02]}, "edge": {}},
    },
    "can": {"cylinder": {"radius": 0.03, "height": 0.1}, "mass": 0.1, "pose": {"rpy": [1, 2, 3], "xyz": [0, 0, 1]}},
}


def scene() -> Scene:
    return build_scene(
        TaskSpec.model_construct(
            task="t",
            scene={name: BodySpec.model_validate(body) for name, body in BODIES.items()},
            frames={"rim": FrameSpec.model_validate({"parent": "cup", "pose": {"xyz": [0, 0, 0.11]}})},
        )
    )


def same(a: object, b: object) -> bool:
    if isinstance(a, np.ndarray):
        return bool(np.array_equal(a, b))
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(map(same, a, b))
    if dataclasses.is_dataclass(a) and type(a) is type(b):
        return all(same(getattr(a, f.name), getattr(b, f.name)) for f in dataclasses.fields(a))
    return bool(a == b)


def test_what_is_written_reads_back_to_the_last_bit() -> None:
    written = scene_to_json(scene())
    again = scene_from_json(written)
    assert same(again, scene())
    assert scene_to_json(again) == written


def test_a_mesh_is_read_back_by_its_name_and_no_path_of_this_machine_is_written() -> None:
    made = scene()
    mesh = Geometry(X_LS=Transform.identity(), shape=Mesh("parts/gear.stl", Path("/somewhere/private/gear.stl")))
    body = dataclasses.replace(made.body("ball"), geometries=(mesh,))
    written = scene_to_json(dataclasses.replace(made, bodies=(body,)))
    assert b"private" not in written
    (shape,) = (geometry.shape for geometry in scene_from_json(written).bodies[0].geometries)
    assert shape == Mesh("parts/gear.stl", Path("parts/gear.stl"))


@pytest.mark.parametrize("text", [b"", b"{}", b"[1]", b'{"bodies": [{}], "frames": [], "gravity": [0, 0, -9.81]}'])
def test_what_is_no_scene_is_refused(text: bytes) -> None:
    with pytest.raises(ValueError, match=r"validation error|Invalid JSON"):
        scene_from_json(text)
