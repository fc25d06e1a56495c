"""The log of a pick, message for message by a reader that is not ours, against what ours makes of it."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from manipcli.pipeline import run_task
from manipcli.record.read.reading import read_recording
from manipcli.record.recording import Recording

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.slow
Messages = dict[str, list[tuple[int, Any]]]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of the pour, as far as the cup is lifted: arm and hand have moved, and something is held."""
    folder = tmp_path_factory.mktemp("log")
    pour = (ROOT / "tasks" / "pour.yaml").read_text(encoding="utf-8").replace("../", f"{ROOT}/")
    (folder / "lift.yaml").write_text(f"{pour.partition('  - pour:')[0]}expect: [{{duration: {{below: 60 s}}}}]\n")
    assert run_task(folder / "lift.yaml", log=folder / "lift.mcap").verdict.verdict == "passed"
    return folder / "lift.mcap"


@pytest.fixture(scope="module")
def ours(log: Path) -> Recording:
    return read_recording(log)


@pytest.fixture(scope="module")
def theirs(log: Path) -> Messages:
    """topic -> (log time [ns], message), by the definitions in the file; written again they are the same bytes."""
    store = get_typestore(Stores.EMPTY)
    reader = McapReader(log)
    reader.open()
    for connection in reader.connections:
        store.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
    found: Messages = defaultdict(list)
    for k, (connection, time, raw) in enumerate(reader.messages(reader.connections)):
        message = store.deserialize_cdr(raw, connection.msgtype)
        if k % 11 == 0 or len(found[connection.topic]) < 100:  # of every one it takes twice as long
            assert bytes(store.serialize_cdr(message, connection.msgtype)) == bytes(raw)
        found[connection.topic].append((time, message))
    assert found.keys() == {connection.topic for connection in reader.connections}, "no topic is empty"
    reader.close()
    return found


def test_every_topic_is_there_and_stamped_with_its_time(theirs: Messages) -> None:
    controllers = {"arm_controller": "follow_joint_trajectory", "hand_controller": "gripper_cmd"}
    expected = {"/robot_description", "/tf_static", "/tf", "/markers", "/joint_states", "/actuator_states"}
    expected |= {"/contacts", "/task/events", "/rosout"}
    for name, action in controllers.items():
        expected |= {f"/{name}/{topic}" for topic in ("controller_state", "reference", "error")}
        expected |= {f"/{name}/{action}/{topic}" for topic in ("feedback", "status", "result")}
    assert theirs.keys() >= expected - {"/actuator_states"}
    assert theirs.keys() <= expected
    for topic, messages in theirs.items():
        times = [time for time, _ in messages]
        assert times == sorted(times), topic
        for time, message in messages:
            inner = getattr(message, "feedback", message)
            header = getattr(getattr(inner, "state", inner), "header", None)
            if header is not None:
                assert header.stamp.sec * 10**9 + header.stamp.nanosec == time, topic


def test_joints_bodies_and_controllers_are_what_ours_reads(ours: Recording, theirs: Messages) -> None:
    states = ours.states
    joints = [message for _, message in theirs["/joint_states"]]
    assert tuple(joints[0].name) == ours.joint_names
    for mine, name in ((states.position, "position"), (states.velocity, "velocity"), (states.effort, "effort")):
        np.testing.assert_array_equal(mine, np.array([getattr(message, name) for message in joints]))
    np.testing.assert_array_equal(states.time, np.array([time for time, _ in theirs["/joint_states"]]) / 1e9)
    for k, body in enumerate(ours.body_names):
        poses = []
        for _, message in theirs["/tf"]:
            (one,) = [each.transform for each in message.transforms if each.child_frame_id == body]
            p, q = one.translation, one.rotation
            poses.append([p.x, p.y, p.z, q.x, q.y, q.z, q.w])
        np.testing.assert_array_equal(
            np.concatenate((states.body_position[:, k], states.body_quat_xyzw[:, k]), axis=1), np.array(poses)
        )
    for trace in ours.controllers:
        messages = [message for _, message in theirs[f"/{trace.name}/controller_state"]]
        np.testing.assert_array_equal(trace.reference_position, [message.reference.positions for message in messages])
        np.testing.assert_array_equal(trace.position, [message.feedback.positions for message in messages])


def test_contacts_and_events_are_what_ours_reads(ours: Recording, theirs: Messages) -> None:
    assert [(time / 1e9, [(c.a, c.b, c.force) for c in message.contacts]) for time, message in theirs["/contacts"]] == [
        (one.time, [(c.a, c.b, c.force) for c in one.contacts]) for one in ours.contacts
    ]
    assert [(time / 1e9, m.kind, m.step, m.outcome, m.text) for time, m in theirs["/task/events"]] == [
        (one.time, one.kind, one.step, one.outcome, one.text) for one in ours.events
    ]


def test_goals_begin_with_phases_and_all_succeed(ours: Recording, theirs: Messages) -> None:
    phases = {round(1e9 * event.time) for event in ours.events if event.kind == "phase_started"}
    sent = set()
    for topic in ("/arm_controller/follow_joint_trajectory", "/hand_controller/gripper_cmd"):
        statuses = theirs[f"{topic}/status"]
        last: dict[bytes, int] = {}
        for time, message in statuses:
            for one in message.status_list:
                key = bytes(one.goal_info.goal_id.uuid)
                if key not in last:
                    assert one.goal_info.stamp.sec * 10**9 + one.goal_info.stamp.nanosec == time
                    sent.add(time)
                last[key] = one.status
        assert set(last.values()) == {4}
        results = theirs[f"{topic}/result"]
        assert len(results) == len(last)
        assert {message.status for _, message in results} == {4}
        ids = {bytes(message.goal_id.uuid) for _, message in theirs[f"{topic}/feedback"]}
        assert ids <= last.keys()
        # 20 times a second, on the beat, while a goal is on.
        assert {time % 50_000_000 for time, _ in theirs[f"{topic}/feedback"]} == {0}
    assert sent <= phases
