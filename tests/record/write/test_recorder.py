"""What is written, seen by readers that are not ours: rosbags and the mcap library."""

from __future__ import annotations

import gc
import hashlib
import os
import tracemalloc
from collections import Counter, defaultdict
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Chunk, Message, MessageIndex
from mcap.stream_reader import StreamReader, breakup_chunk
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from manipcli.core.geometry import Transform, matrix_from_axis_angle, quat_from_matrix
from manipcli.model.state import Contact, ContactPoint
from manipcli.record.faults import RecordingFailed, RecordingRefused
from manipcli.record.read.reading import read_recording
from manipcli.record.write import recorder as recorder_module

MakeRun = Callable[[int], Any]
T = 1203  # two full blocks and a part of a third


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("log") / "run.mcap"


@pytest.fixture
def log(written: Path, make_run: MakeRun) -> tuple[Any, Path]:
    """One run, written once for the module."""
    run = make_run(T)
    return run, written if written.exists() else run.write(written)


@lru_cache(maxsize=1)
def decoded(path: Path) -> dict[str, list[tuple[int, Any]]]:
    """topic -> (log time [ns], message) as rosbags sees them, by nothing but the schemas in the file."""
    store = get_typestore(Stores.EMPTY)
    found: dict[str, list[tuple[int, Any]]] = defaultdict(list)
    reader = McapReader(path)
    reader.open()
    types: dict[str, Any] = {}
    for connection in reader.connections:
        types.update(get_types_from_msg(connection.msgdef.data, connection.msgtype))
    store.register(types)
    for connection, time, raw in reader.messages(reader.connections):
        message = store.deserialize_cdr(raw, connection.msgtype)
        assert bytes(store.serialize_cdr(message, connection.msgtype)) == bytes(raw)
        found[connection.topic].append((time, message))
    reader.close()
    return found


def stamp(message: Any) -> int:
    header = message.header if hasattr(message, "header") else message
    return int(header.stamp.sec) * 10**9 + int(header.stamp.nanosec)


@pytest.mark.slow
def test_every_message_decodes_to_what_was_put_in(log: tuple[Any, Path]) -> None:
    run, path = log
    topics = decoded(path)
    states = topics["/joint_states"]
    assert [time for time, _ in states] == [k * 1_000_000 for k in range(T)]
    assert states[0][1].name == list(run.robot.joint_names)
    for field, values in (
        ("position", run.states.position),
        ("velocity", run.states.velocity),
        ("effort", run.states.effort),
    ):
        np.testing.assert_array_equal([getattr(message, field) for _, message in states], values)

    arm = [message for _, message in topics["/arm/controller_state"]]
    hand = [message for _, message in topics["/hand/controller_state"]]
    (p, v, a, command), (p2, _, _, command2) = run.outputs
    columns = [0, 1]
    for get, values in (
        (lambda m: m.reference.positions, p),
        (lambda m: m.reference.velocities, v),
        (lambda m: m.reference.accelerations, a),
        (lambda m: m.feedback.positions, run.states.position[:, columns]),
        (lambda m: m.feedback.velocities, run.states.velocity[:, columns]),
        (lambda m: m.feedback.effort, run.states.effort[:, columns]),
        (lambda m: m.error.positions, p - run.states.position[:, columns]),
        (lambda m: m.error.velocities, v - run.states.velocity[:, columns]),
        (lambda m: m.output.effort, command),
    ):
        np.testing.assert_array_equal([get(message) for message in arm], values)
    np.testing.assert_array_equal([message.output.positions for message in hand], command2)
    assert arm[0].joint_names == ["shoulder", "slide"]
    assert arm[0].speed_scaling_factor == 1.0

    # A joint without limits: the error is the short way round.
    turns = np.array([message.error.positions[0] for message in hand]) - (p2[:, 0] - run.states.position[:, 2])
    np.testing.assert_allclose(turns / (2 * np.pi), np.round(turns / (2 * np.pi)), atol=1e-12)
    assert max(abs(message.error.positions[0]) for message in hand) <= np.pi

    every_tenth = topics["/arm/reference"]
    assert [time for time, _ in every_tenth] == [k * 10_000_000 for k in range(-(-T // 10))]
    np.testing.assert_array_equal([message.position for _, message in every_tenth], p[::10])
    np.testing.assert_array_equal(
        [message.velocity for _, message in topics["/arm/error"]], (v - run.states.velocity[:, columns])[::10]
    )


@pytest.mark.slow
def test_actuators_stand_on_the_other_side_of_their_transmissions(log: tuple[Any, Path]) -> None:
    """Position and velocity grow by the reduction (-50 at the joint times 2 at the actuator), power is kept."""
    run, path = log
    states = decoded(path)["/actuator_states"]
    assert [time for time, _ in states] == [k * 10_000_000 for k in range(-(-T // 10))]
    # A transmission of an unknown type is left out.
    assert states[0][1].name == ["slide_motor", "turn"]
    position, velocity, effort = (
        np.array([getattr(message, field) for _, message in states]) for field in ("position", "velocity", "effort")
    )
    s, joints = run.states, [1, 0]
    np.testing.assert_allclose(position, (s.position[::10, joints] - (0.2, 0.0)) * (-100.0, 3.0), rtol=1e-14)
    np.testing.assert_allclose(velocity, s.velocity[::10, joints] * (-100.0, 3.0), rtol=1e-14)
    np.testing.assert_allclose(velocity * effort, (s.velocity * s.effort)[::10, joints], rtol=1e-14)


def test_tf_holds_moving_links_by_forward_kinematics_and_bodies_as_given(log: tuple[Any, Path]) -> None:
    run, path = log
    topics = decoded(path)
    joints = run.robot.moving_joints
    for k in (0, 499, 500, T - 1):
        time, message = topics["/tf"][k]
        frames = [(t.header.frame_id, t.child_frame_id) for t in message.transforms]
        assert frames == [*((j.parent, j.child) for j in joints), ("world", "cup"), ("world", "ball")]
        assert all(stamp(t) == time for t in message.transforms)
        for joint, q, t in zip(joints, run.states.position[k], message.transforms, strict=False):
            # The oracle: Rodrigues' matrix, composed as matrices.
            R = matrix_from_axis_angle(joint.axis, q) if joint.type != "prismatic" else np.eye(3)
            slide = joint.axis * q if joint.type == "prismatic" else np.zeros(3)
            X = joint.X_PJ @ Transform.of(R=R, xyz=slide)
            xyz, quat = t.transform.translation, t.transform.rotation
            np.testing.assert_allclose((xyz.x, xyz.y, xyz.z), X.p, atol=1e-14)
            expected = quat_from_matrix(X.R)
            assert abs(np.dot((quat.x, quat.y, quat.z, quat.w), expected)) == pytest.approx(1.0, abs=1e-14)
        ball = message.transforms[-1].transform
        np.testing.assert_array_equal(
            (ball.translation.x, ball.translation.y, ball.translation.z), run.states.body_position[k, 1]
        )
        np.testing.assert_array_equal(
            (ball.rotation.x, ball.rotation.y, ball.rotation.z, ball.rotation.w), run.states.body_quat_xyzw[k, 1]
        )


def test_what_never_moves_is_written_once_and_offered_to_late_subscribers(log: tuple[Any, Path]) -> None:
    run, path = log
    topics = decoded(path)
    assert [message.data for _, message in topics["/robot_description"]] == [run.robot.urdf]
    ((time, static),) = topics["/tf_static"]
    assert time == 0
    assert [(t.header.frame_id, t.child_frame_id) for t in static.transforms] == [
        ("world", "base"), ("upper", "bracket"), ("world", "desk"), ("cup", "spout"),
    ]  # fmt: skip
    ((_, markers),) = topics["/markers"]
    assert [(m.header.frame_id, m.id, m.type) for m in markers.markers] == [
        ("desk", 0, 1), ("cup", 0, 3), ("cup", 1, 10), ("ball", 0, 2),
    ]  # fmt: skip
    cup = markers.markers[1]
    assert (cup.scale.x, cup.scale.y, cup.scale.z) == (0.08, 0.08, 0.1)
    assert (cup.color.r, cup.color.a) == (np.float32(0.1), 1.0)
    assert b"someone" not in b"".join(m.mesh_resource.encode() for m in markers.markers)
    reader = McapReader(path)
    reader.open()
    latched = {
        c.topic
        for c in reader.connections
        if any(q.durability.name == "TRANSIENT_LOCAL" for q in c.ext.offered_qos_profiles)
    }
    reader.close()
    assert latched == {"/robot_description", "/tf_static", "/markers"}


def test_events_and_contacts_stand_at_their_time(log: tuple[Any, Path]) -> None:
    run, path = log
    topics = decoded(path)
    assert [(time, e.step, e.place, e.text) for time, e in topics["/task/events"]] == [
        (k * 1_000_000, f"step_{k}", "t.yaml:12:3", "é ok") for k in range(0, T, 250)
    ]
    _, line = topics["/rosout"][0]
    assert (line.level, line.name, line.file, line.line) == (20, "manipcli", "t.yaml", 12)
    assert line.msg == "step started 'step_0' (move): é ok"
    times = [(time, [_contact(contact) for contact in message.contacts]) for time, message in topics["/contacts"]]
    assert times == [(k * 1_000_000, list(run.contacts) if (k // 100) % 2 else []) for k in range(0, T, 100)]


def _contact(message: Any) -> Contact:
    def xyz(vector: Any) -> tuple[float, float, float]:
        return vector.x, vector.y, vector.z

    points = tuple(ContactPoint(xyz(p.position), xyz(p.normal), p.force, xyz(p.friction)) for p in message.points)
    return Contact(message.a, message.b, message.force, message.distance, points)


@pytest.mark.slow
def test_mcap_readers_accept_checksums_indexes_statistics_and_order(log: tuple[Any, Path]) -> None:
    _, path = log
    with path.open("rb") as file:
        streamed = [r for r in StreamReader(file, validate_crcs=True).records if isinstance(r, Message)]
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        indexed = [(channel.topic, message) for _, channel, message in reader.iter_messages()]
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        assert reader.get_header().profile == "ros2"
        assert reader.get_header().library == "manipcli"
        assert {a.name: a.data for a in reader.iter_attachments()} == {"task.yaml": b"task: test\n", "plan.json": b""}
        assert [m.name for m in reader.iter_metadata()] == ["recording", "run", "verdict"]
    key = attrgetter("channel_id", "sequence", "log_time", "publish_time", "data")
    assert sorted(map(key, streamed)) == sorted(key(m) for _, m in indexed)
    # In the file itself messages already stand in the order of time.
    assert [m.log_time for m in streamed] == sorted(m.log_time for m in streamed)
    assert all(m.log_time == m.publish_time for m in streamed)
    counts = Counter(m.channel_id for m in streamed)
    assert {k: v for k, v in summary.statistics.channel_message_counts.items() if v} == counts
    assert summary.statistics.message_count == len(streamed)
    assert (summary.statistics.message_start_time, summary.statistics.message_end_time) == (0, (T - 1) * 1_000_000)
    by_channel: dict[int, list[int]] = defaultdict(list)
    for message in streamed:
        by_channel[message.channel_id].append(message.sequence)
    assert all(sequence == list(range(1, len(sequence) + 1)) for sequence in by_channel.values())


def test_each_message_index_points_at_its_message(log: tuple[Any, Path]) -> None:
    _, path = log
    chunk: Chunk | None = None
    with path.open("rb") as file:
        for record in StreamReader(file, emit_chunks=True).records:
            if isinstance(record, Chunk):
                chunk, offset, where = record, 0, {}
                for message in breakup_chunk(record, validate_crc=True):
                    assert isinstance(message, Message)
                    where.setdefault(message.channel_id, []).append((message.log_time, offset))
                    offset += 9 + 22 + len(message.data)
                left = dict(where)
            elif isinstance(record, MessageIndex):
                assert record.records == left.pop(record.channel_id)
            elif chunk is not None:
                assert left == {}


def test_equal_runs_give_equal_bytes(tmp_path: Path, make_run: MakeRun) -> None:
    digests = set()
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        digests.add(hashlib.sha256(make_run(620).write(tmp_path / name / "run.mcap").read_bytes()).hexdigest())
    assert len(digests) == 1


def test_the_caller_may_reuse_its_arrays(tmp_path: Path, make_run: MakeRun) -> None:
    run = make_run(20)
    recorder = run.recorder(tmp_path / "run.mcap")
    run.feed(recorder)
    for array in (run.states.position, run.states.body_position, *run.outputs[0]):
        array[:] = np.nan
    recorder.finish({})
    assert np.isfinite([m.position for _, m in decoded(tmp_path / "run.mcap")["/joint_states"]]).all()


@pytest.mark.slow
def test_memory_does_not_grow_with_the_length_of_the_run(tmp_path: Path, make_run: MakeRun) -> None:
    run = make_run(500)
    recorder = run.recorder(tmp_path / "run.mcap", period=0.0005)
    held = []
    tracemalloc.start()
    for _ in range(7):
        run.feed(recorder)
        recorder.flush()
        gc.collect()
        held.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    recorder.close_partial()
    # A chunk of 500 ticks holds a megabyte; its entry in the summary takes about 1 kB.
    assert held[-1] - held[1] < 5 * 4000


def test_no_bodies_and_no_controllers(tmp_path: Path, make_run: MakeRun) -> None:
    run = make_run(30)
    run = replace(
        run,
        scene=replace(run.scene, bodies=(), frames=()),
        states=replace(run.states, body_position=np.zeros((30, 0, 3)), body_quat_xyzw=np.zeros((30, 0, 4))),
        outputs=(),
    )
    recorder = run.recorder(tmp_path / "run.mcap", controllers=[])
    run.feed(recorder)
    recorder.finish({})
    topics = decoded(tmp_path / "run.mcap")
    assert len(topics["/tf"]) == 30
    assert "/arm/controller_state" not in topics


class TestRefusedBeforeAnythingIsWritten:
    def test_existing_file(self, tmp_path: Path, make_run: MakeRun) -> None:
        (tmp_path / "run.mcap").write_text("mine")
        with pytest.raises(RecordingRefused, match=r"exists"):
            make_run(1).recorder(tmp_path / "run.mcap")
        assert [p.name for p in tmp_path.iterdir()] == ["run.mcap"]
        assert (tmp_path / "run.mcap").read_text() == "mine"

    @pytest.mark.parametrize("overwrite", [True, False])
    @pytest.mark.parametrize("left", ["device", "pipe"])
    def test_only_files_are_replaced(self, tmp_path: Path, make_run: MakeRun, left: str, overwrite: bool) -> None:
        path = tmp_path / "run.mcap"
        if left == "pipe":
            os.mkfifo(path)
        else:
            path.symlink_to("/dev/null")
        before = path.lstat()
        with pytest.raises(RecordingRefused, match=r"not a regular file"):
            make_run(1).recorder(path, overwrite=overwrite)
        assert path.lstat() == before
        assert [p.name for p in tmp_path.iterdir()] == ["run.mcap"]

    def test_directory_and_file_instead_of_one(self, tmp_path: Path, make_run: MakeRun) -> None:
        with pytest.raises(RecordingRefused, match=r"directory"):
            make_run(1).recorder(tmp_path)
        (tmp_path / "file").touch()
        with pytest.raises(RecordingRefused, match=r"folder .*Not a directory"):
            make_run(1).recorder(tmp_path / "file" / "no" / "run.mcap")
        assert [path.name for path in tmp_path.iterdir()] == ["file"]

    def test_missing_folders_are_made(self, tmp_path: Path, make_run: MakeRun) -> None:
        path = tmp_path / "a" / "b" / "run.mcap"
        make_run(1).recorder(path).finish({})
        assert path.is_file()

    def test_directory_that_may_not_be_written(
        self, tmp_path: Path, make_run: MakeRun, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def refuse(*_: object, **__: object) -> int:
            raise PermissionError(13, "Permission denied")

        monkeypatch.setattr(os, "open", refuse)
        with pytest.raises(RecordingRefused, match=r"Permission denied"):
            make_run(1).recorder(tmp_path / "run.mcap")

    def test_second_run_on_the_same_file(self, tmp_path: Path, make_run: MakeRun) -> None:
        first = make_run(1).recorder(tmp_path / "run.mcap")
        for overwrite in (False, True):
            with pytest.raises(RecordingRefused, match=r"another run is writing"):
                make_run(1).recorder(tmp_path / "run.mcap", overwrite=overwrite)
        first.finish({})

    def test_overwriting_replaces_what_a_killed_run_left(self, tmp_path: Path, make_run: MakeRun) -> None:
        path = tmp_path / "run.mcap"
        run = make_run(40)
        run.write(path)
        before = path.read_bytes()
        run.recorder(path, overwrite=True).close_partial()
        with pytest.raises(RecordingRefused, match=r"was killed"):
            path.unlink()
            run.recorder(path)
        recorder = run.recorder(path, overwrite=True)
        run.feed(recorder)
        recorder.finish({"verdict": {"verdict": "passed"}})
        assert path.read_bytes() == before
        assert [p.name for p in tmp_path.iterdir()] == ["run.mcap"]

    def test_one_name_for_two_frames(self, tmp_path: Path, make_run: MakeRun) -> None:
        run = make_run(1)
        bodies = (*run.scene.bodies, replace(run.scene.bodies[0], name="wheel"))
        with pytest.raises(RecordingRefused, match=r"duplicate frame name 'wheel'"):
            run.recorder(tmp_path / "run.mcap", scene=replace(run.scene, bodies=bodies))

    @pytest.mark.parametrize("name", ["../task.yaml", "a/b", ""])
    def test_attachment_names_are_plain(self, tmp_path: Path, make_run: MakeRun, name: str) -> None:
        with pytest.raises(RecordingRefused, match=r"plain file name"):
            make_run(1).recorder(tmp_path / "run.mcap", attachments=[(name, "text/plain", b"")])
        assert list(tmp_path.iterdir()) == []


def test_failing_disk_leaves_what_was_flushed(
    tmp_path: Path, make_run: MakeRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Fail the N-th write for N = 1, 2, ...: the error says where the run is, and the file ends with a whole part."""
    run = make_run(130)
    monkeypatch.setattr(recorder_module, "BLOCK_SECONDS", 0.05)
    real = os.write
    for fail_at in range(1, 40):
        path = tmp_path / f"{fail_at}.mcap"
        count = 0

        def write(fd: int, data: bytes) -> int:
            nonlocal count
            count += 1
            if count == fail_at:  # noqa: B023
                real(fd, bytes(data)[: len(data) // 2])
                raise OSError(28, "No space left on device")
            return real(fd, data)

        with monkeypatch.context() as patch:
            patch.setattr(os, "write", write)
            try:
                recorder = run.recorder(path)
                run.feed(recorder)
                recorder.finish({})
            except RecordingFailed as error:
                failed = error
            else:
                break
        assert not path.exists()
        partial = path.with_name(path.name + ".partial")
        assert f"No space left on device; data until then is in {partial.name}" in str(failed)
        if count >= 7:  # everything before the first chunk was written
            recording = read_recording(partial)
            assert recording.lost is not None
            times = recording.states.time
            assert len(times) % 50 == 0 or len(times) == 130
            assert failed.time == (times[-1] if len(times) else 0.0)
            np.testing.assert_array_equal(recording.states.position, run.states.position[: len(times)])
    assert fail_at > 8
    assert path.exists()


def test_a_recorder_that_failed_stays_failed(
    tmp_path: Path, make_run: MakeRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorder = make_run(20).recorder(tmp_path / "run.mcap")
    make_run(20).feed(recorder)
    with monkeypatch.context() as patch:

        def fail(*_: object) -> int:
            raise OSError(5, "Input/output error")

        patch.setattr(os, "write", fail)
        with pytest.raises(RecordingFailed, match=r"t = 0\.000 s: Input/output error"):
            recorder.flush()
    make_run(20).feed(recorder)
    with pytest.raises(RecordingFailed):
        recorder.finish({})
    recorder.close_partial()
    assert (tmp_path / "run.mcap.partial").exists()


def test_closing_a_finished_recording_leaves_it_alone(tmp_path: Path, make_run: MakeRun) -> None:
    run = make_run(20)
    path = run.write(tmp_path / "once.mcap")
    recorder = run.recorder(tmp_path / "twice.mcap")
    run.feed(recorder)
    recorder.finish({"verdict": {"verdict": "passed"}})
    recorder.close_partial()
    assert (tmp_path / "twice.mcap").read_bytes() == path.read_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["once.mcap", "twice.mcap"]
