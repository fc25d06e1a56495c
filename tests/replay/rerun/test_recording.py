"""A Rerun recording holds what the log holds: read with the reader of Rerun, compared with the log and Pinocchio."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import trimesh

pytest.importorskip("rerun", reason="needs the extra 'rerun'")

from rerun.chunk import RrdReader

from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array, frozen
from manipcli.logs.replay import open_playback
from manipcli.pipeline import run_task
from manipcli.record.read.reading import open_recording
from manipcli.record.recording import Span
from manipcli.replay.forces import LONGEST
from manipcli.replay.playback import Playback
from manipcli.replay.rerun.viewer import show
from manipcli.replay.rerun.write_recording import write_recording
from manipcli.shapes.primitives import Box, Mesh, Shape

ROOT = Path(__file__).parents[3]
MASS, GRAVITY = 0.4, 9.81
TASK = f"""task: rest
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
scene:
  desk: {{box: {{size: [0.4, 0.4, 0.1]}}, fixed: true, pose: {{xyz: [0.7, 0, 0.05]}}}}
  block: {{box: {{size: [0.04, 0.05, 0.06]}}, mass: {MASS}, pose: {{xyz: [0.7, 0.1, 0.13]}}}}
steps:
  - move: {{to: {{joint_1: 0.2, joint_4: -1.4}}}}
  - wait: 0.3 s
expect:
  - duration: {{below: 60 s}}
  - always: {{near: {{object: block, to: start, within: 5 cm}}}}
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
def playback(log: Path) -> Playback:
    return open_playback(log, package_path=[ROOT / "robots"])


@pytest.fixture(scope="module")
def written(playback: Playback, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("written") / "run.rrd"
    assert write_recording(path, playback) == ()
    return path


def _read(path: Path) -> dict[str, Rows]:
    """The columns of each entity; of several chunks in their order."""
    found: dict[str, Rows] = {}
    for chunk in RrdReader(str(path)).stream():
        rows = found.setdefault(chunk.entity_path, {})
        for name, values in chunk.to_record_batch().to_pydict().items():
            rows.setdefault(name, []).extend(values)
    return found


@pytest.fixture(scope="module")
def entities(written: Path) -> dict[str, Rows]:
    return _read(written)


def _at(rows: Rows, time: float) -> int:
    """The row that Rerun shows at a time: the last one that is not after it."""
    return int(np.searchsorted([step.total_seconds() for step in rows["time"]], time + 1e-6, side="right")) - 1  # type: ignore[attr-defined]


def _spans(log: Path) -> Iterator[Span]:
    return iter(open_recording(log).spans)


def test_links_are_where_pinocchio_puts_them(log: Path, playback: Playback, entities: dict[str, Rows]) -> None:
    urdf = open_recording(log).attachments["robot.urdf"].decode()
    model = pin.buildModelFromXML(urdf)
    data, q = model.createData(), pin.neutral(model)
    compared = 0
    for k in range(0, len(playback.times), 7):
        for name, value in zip(playback.joint_names, playback.position[k], strict=True):
            q[model.joints[model.getJointId(name)].idx_q] = value
        pin.framesForwardKinematics(model, data, q)
        X_WB = playback.robot.X_WB  # type: ignore[union-attr]
        for link in playback.robot.links:  # type: ignore[union-attr]
            rows = entities[f"/world/robot/{link.name}"]
            row = 0 if "time" not in rows else _at(rows, float(playback.times[k]))
            (translation,), (quat,) = rows["Transform3D:translation"][row], rows["Transform3D:quaternion"][row]  # type: ignore[index, misc]
            X_BL = data.oMf[model.getFrameId(link.name)]
            np.testing.assert_allclose(translation, X_WB.R @ X_BL.translation + X_WB.p, atol=3e-6)
            R = pin.Quaternion(np.array(quat)).normalized().matrix()
            np.testing.assert_allclose(R, X_WB.R @ X_BL.rotation, atol=1e-5)
            compared += 1
    assert compared > 100


def test_ticks_and_times_agree(log: Path, entities: dict[str, Rows]) -> None:
    rows = entities["/world/robot/link_7"]
    period = open_recording(log).period
    for tick, time in zip(rows["tick"], rows["time"], strict=True):
        assert tick * period == pytest.approx(time.total_seconds(), abs=1e-9)  # type: ignore[operator, attr-defined]
    assert len(set(rows["tick"])) == len(rows["tick"]) > 10


def _points(shape: Shape) -> Array:
    """The vertices of a mesh file, read by trimesh, or the corners of a box."""
    if isinstance(shape, Mesh):
        points: Array = trimesh.load_mesh(shape.path).vertices * shape.scale
        return points
    assert isinstance(shape, Box)
    return np.array(list(product(*((-edge / 2.0, edge / 2.0) for edge in shape.size))))


def test_meshes_have_the_size_of_what_they_draw(playback: Playback, entities: dict[str, Rows]) -> None:
    (vertices,) = entities["/world/scene/block/visual_0"]["Mesh3D:vertex_positions"]
    np.testing.assert_allclose(np.ptp(np.array(vertices), axis=0), [0.04, 0.05, 0.06], atol=1e-6)
    link = next(link for link in playback.robot.links if link.name == "palm")  # type: ignore[union-attr]
    for layer, shapes in (("world", link.visuals), ("collision", link.collisions)):
        drawn = [
            np.array(rows["Mesh3D:vertex_positions"][0])
            for path, rows in entities.items()
            if path.startswith(f"/{layer}/robot/palm/") and "Mesh3D:vertex_positions" in rows
        ]
        placed = [_points(shape.shape) @ shape.X_LS.R.T + shape.X_LS.p for shape in shapes]
        for bound in (np.min, np.max):
            expected = bound(np.concatenate(placed), axis=0)
            np.testing.assert_allclose(bound(np.concatenate(drawn), axis=0), expected, atol=1e-5)


def test_arrows_of_a_resting_body_add_up_to_its_weight(entities: dict[str, Rows]) -> None:
    (scale,) = entities["/world/contacts"]["metres_per_newton"][0]  # type: ignore[misc]
    sums = entities["/world/contacts/block/desk/sum"]
    points = entities["/world/contacts/block/desk/points"]
    for rows in (sums, points):
        force = np.sum(rows["Arrows3D:vectors"][-1], axis=0) / scale
        np.testing.assert_allclose(force, [0.0, 0.0, MASS * GRAVITY], atol=0.01 * MASS * GRAVITY)
    assert sums["Arrows3D:labels"][-1] == [f"{MASS * GRAVITY:.2f} N"]
    lengths = np.linalg.norm(points["Arrows3D:vectors"][-1], axis=1)
    assert 0.0 < lengths.max() < 2.0 * LONGEST


def test_curves_are_the_recorded_ones(log: Path, playback: Playback, entities: dict[str, Rows]) -> None:
    recorded = {
        round(t, 6): q for one in _spans(log) for t, q in zip(one.states.time, one.states.position, strict=True)
    }
    k = playback.joint_names.index("joint_4")
    rows = entities["/joints/joint_4/position"]
    for time, (value,) in zip(rows["time"], rows["Scalars:scalars"], strict=True):  # type: ignore[misc]
        assert value == recorded[round(time.total_seconds(), 6)][k]  # type: ignore[attr-defined]
    limits = next(joint.limits for joint in playback.robot.joints if joint.name == "joint_4")  # type: ignore[union-attr]
    lines = entities["/joints/joint_4/position_limits"]
    assert lines["Scalars:scalars"] == [[limits.lower, limits.upper]] * 2
    assert [_seconds(time) for time in lines["time"]] == pytest.approx([playback.start, playback.end])


def _seconds(time: object) -> float:
    return time.total_seconds()  # type: ignore[attr-defined, no-any-return]


def test_steps_and_verdict_can_be_read(playback: Playback, entities: dict[str, Rows]) -> None:
    steps = [state for (state,) in entities["/steps"]["StateChange:state"]]  # type: ignore[misc]
    assert [state for state in steps if state] == [step.label for step in playback.steps]
    (page,) = entities["/verdict"]["TextDocument:text"][0]  # type: ignore[misc]
    assert "passed" in page and "duration" in page
    texts = [text for (text,) in entities["/events"]["TextLog:text"]]  # type: ignore[misc]
    assert f"{playback.steps[0].label}: started" in texts


def test_the_file_is_sound_and_says_nothing_of_the_machine(written: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "rerun", "rrd", "verify", str(written)], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0 and "warn" not in done.stderr.lower(), done.stderr
    reader = RrdReader(str(written))
    assert len(reader.recordings()) == 1 and len(reader.blueprints()) == 1
    assert str(Path.home()).encode() not in written.read_bytes()


def test_texts_of_a_log_are_shown_as_they_are(playback: Playback, tmp_path: Path) -> None:
    evil = "![x](http://example.com/a.png) <b> | `\n# head"
    steps = (replace(playback.steps[0], id=evil, label=evil, text=evil),)
    path = tmp_path / "evil.rrd"
    write_recording(path, replace(playback, name=evil, steps=steps, notes=(evil,)))
    (page,) = _read(path)["/verdict"]["TextDocument:text"][0]  # type: ignore[misc]
    assert "![" not in page and "\n# head" not in page and "<b>" not in page.replace("\\<b", "")


def test_a_margin_is_smallest_where_the_verdict_says(playback: Playback, entities: dict[str, Rows]) -> None:
    (margin,) = (one for one in playback.margins if one.outcome.name == "near")
    rows = entities["/curves/margins/near"]
    values = [value for (value,) in rows["Scalars:scalars"]]  # type: ignore[misc]
    assert min(values) == pytest.approx(margin.outcome.relative)
    assert _seconds(rows["time"][int(np.argmin(values))]) == pytest.approx(margin.outcome.at, abs=0.02)


def test_a_second_run_is_another_recording(playback: Playback, written: Path, tmp_path: Path) -> None:
    moved: Array = frozen(playback.position + 1e-3)
    write_recording(tmp_path / "other.rrd", replace(playback, position=moved))
    write_recording(tmp_path / "same.rrd", playback)
    ids = [
        RrdReader(str(path)).recordings()[0].recording_id
        for path in (written, tmp_path / "other.rrd", tmp_path / "same.rrd")
    ]
    assert ids[0] == ids[2] != ids[1]


@pytest.mark.skipif(sys.platform != "linux", reason="a screen that does not exist, for X")
def test_a_viewer_that_fails_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", ":9999")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(InvalidArgument, match="ended with code"):
        show(tmp_path / "missing.rrd")
