"""The folder for Foxglove: shapes in the frames of `/tf`, a layout that names what the log has, the log unchanged."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from manipcli.logs.foxglove.folder import write_folder
from manipcli.logs.foxglove.layout import _view
from manipcli.logs.replay import open_playback
from manipcli.record.foreign.topics import open_topics
from manipcli.render.drawing import draw, floors_of
from manipcli.replay.camera import Camera
from manipcli.replay.playback import Playback
from tests.conftest import PourRun

pytest.importorskip("foxglove", reason="needs manipcli[live]")
TO_ROS = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
"""What Foxglove does with every glTF model: z forward and y up become x forward and z up."""


@pytest.fixture(scope="module")
def playback(pour_run: PourRun) -> Playback:
    return open_playback(pour_run.log, rate=1.0)


@pytest.fixture(scope="module")
def folder(pour_run: PourRun, playback: Playback, tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("foxglove") / "pour"
    write_folder(made, pour_run.log, playback)
    return made


def _messages(log: Path) -> Iterator[tuple[str, Any]]:
    """The messages of the first 10 ms, with their topics."""
    with AnyReader([log], default_typestore=get_typestore(Stores.EMPTY)) as reader:
        for channel, _, data in reader.messages(None, None, 10_000_000):
            yield channel.topic, reader.deserialize(data, channel.msgtype)


def test_every_shape_is_in_a_frame_of_the_log_where_it_is_drawn(folder: Path, playback: Playback) -> None:
    frames = {"world"}
    first = dict(_messages(folder / "pour.mcap"))
    for topic in ("/tf", "/tf_static"):
        frames |= {one.child_frame_id for one in first[topic].transforms}
    scene = first["/scene"]
    assert playback.scene is not None
    drawing = draw(playback.robot, playback.scene)
    drawn = {shape.frame for shape in drawing.layer("visual")} - floors_of(playback.scene)
    assert {entity.id for entity in scene.entities} == {frame.removeprefix("robot/") for frame in drawn}
    for entity in scene.entities:
        assert entity.frame_id in frames and entity.frame_locked
        (model,) = entity.models
        assert model.media_type == "model/gltf-binary" and not model.url
        read = trimesh.load_scene(BytesIO(model.data.tobytes()), file_type="glb").to_geometry()
        shapes = [one for one in drawing.layer("visual") if one.frame.removeprefix("robot/") == entity.id]
        corners = np.concatenate([shape.surface.vertices for shape in shapes])
        shown = read.vertices @ TO_ROS.T  # in the frame of the entity: bodies that are fixed have a pose in it
        np.testing.assert_allclose([shown.min(axis=0), shown.max(axis=0)], [corners.min(axis=0), corners.max(axis=0)],
                                   atol=1e-6)  # fmt: skip
        body = next((one for one in playback.scene.bodies if one.name == entity.id and one.fixed), None)
        place = [model.pose.position.x, model.pose.position.y, model.pose.position.z]
        np.testing.assert_allclose(place, [0, 0, 0] if body is None else body.X_WO.p)


def _values(layout: object, key: str) -> Iterator[str]:
    if isinstance(layout, dict):
        yield from ([layout[key]] if isinstance(layout.get(key), str) else [])
        for value in layout.values():
            yield from _values(value, key)
    elif isinstance(layout, list):
        for value in layout:
            yield from _values(value, key)


def test_the_layout_shows_scene_steps_curves_cause_and_events(folder: Path) -> None:
    layout = json.loads((folder / "layout.json").read_text())
    assert [*_values(layout, "panelType")] == ["ThreeDee", "StateTransitions", "Markdown", *["Plot"] * 5, "Log"]
    assert "all 6 steps done" in next(_values(layout, "markdown"))


def test_every_path_of_the_layout_is_in_the_log(folder: Path, playback: Playback) -> None:
    topics = open_topics(folder / "pour.mcap").all
    paths = [*_values(json.loads((folder / "layout.json").read_text()), "value")]
    assert len(paths) > 3 * len(playback.joint_names)
    first = dict[str, Any]()
    for topic, message in _messages(folder / "pour.mcap"):
        first.setdefault(topic, message)
    for path in paths:
        found = re.fullmatch(r'(/[^.{]+)(?:\{kind=="(\w+)"\})?\.(\w+)(?:\[(\d+|:)\])?(?:\.(\w+))?', path)
        assert found is not None, path
        topic, _, field, index, _ = found.groups()
        assert re.search(rf"\b{field}$", topics[topic].definition, re.MULTILINE), path
        if index not in (None, ":"):
            assert int(index) < len(getattr(first[topic], field)), path


def test_the_log_is_otherwise_that_of_the_run(folder: Path, pour_run: PourRun) -> None:
    ours, theirs = open_topics(folder / "pour.mcap"), open_topics(pour_run.log)
    assert {name: topic.count for name, topic in ours.all.items()} == {
        **{name: topic.count for name, topic in theirs.all.items()}, "/scene": 1
    }  # fmt: skip
    assert ours.attachments == theirs.attachments
    assert ours.metadata == theirs.metadata


@pytest.mark.parametrize("eye", [(1.0, 0.75, 0.55), (-1.0, 0.2, 3.0), (0.1, -2.0, -0.5)])
def test_the_camera_is_where_the_page_has_it(eye: tuple[float, float, float]) -> None:
    camera = Camera(eye, (0.3, -0.1, 0.4))
    state = _view(camera)
    assert state.phi is not None and state.theta_offset is not None and state.distance is not None
    phi, theta = math.radians(state.phi), math.radians(state.theta_offset)
    # Foxglove turns spherical coordinates about y (three.js) by 90 deg about x.
    seen = state.distance * np.array(
        [-math.sin(phi) * math.sin(theta), -math.sin(phi) * math.cos(theta), math.cos(phi)]
    )
    np.testing.assert_allclose(seen + camera.target, eye, atol=1e-12)
