"""Goals, as the messages that ROS's action servers send: seen by rosbags through the definitions in the file."""

from __future__ import annotations

import threading
import uuid
from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from manipcli.control.action import ErrorCode, Feedback, GoalResult
from manipcli.record import messages
from manipcli.record.channels import ControllerChannel
from manipcli.record.read.reading import read_recording

MakeRun = Callable[[int], Any]
MS = 1_000_000
CONTROLLERS = (
    ControllerChannel("arm", ("shoulder", "slide"), action="follow_joint_trajectory"),
    ControllerChannel("hand", ("spin",), ("position",), action="gripper_cmd"),
)
FEEDBACK = Feedback(
    elapsed=1.25,
    desired=np.array([0.5, 0.25]),
    actual=np.array([0.4, 0.3]),
    desired_velocity=np.array([2.0, 3.0]),
    actual_velocity=np.array([1.0, 5.0]),
)


def decoded(path: Path) -> dict[str, list[tuple[int, Any]]]:
    """topic -> (log time [ns], message) of all action topics."""
    store = get_typestore(Stores.EMPTY)
    reader = McapReader(path)
    reader.open()
    for connection in reader.connections:
        store.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
    found: dict[str, list[tuple[int, Any]]] = defaultdict(list)
    for connection, time, raw in reader.messages(reader.connections):
        message = store.deserialize_cdr(raw, connection.msgtype)
        assert bytes(store.serialize_cdr(message, connection.msgtype)) == bytes(raw)
        found[connection.topic].append((time, message))
    reader.close()
    return found


@pytest.fixture
def topics(make_run: MakeRun, tmp_path: Path) -> dict[str, list[tuple[int, Any]]]:
    """A goal of the arm is preempted by another, which succeeds; the hand closes on something."""
    run = make_run(40)
    recorder = run.recorder(tmp_path / "run.mcap", controllers=CONTROLLERS)
    run.feed(recorder, 0, 10)
    first = recorder.goal_sent(10, "arm")
    hand = recorder.goal_sent(10, "hand")
    run.feed(recorder, 10, 20)
    recorder.goal_feedback(15, "arm", first, FEEDBACK)
    closing = replace(FEEDBACK, desired=np.array([1.0]), actual=np.array([0.75]), actual_velocity=np.zeros(0))
    recorder.goal_feedback(15, "hand", hand, closing)
    second = recorder.goal_sent(20, "arm")
    aborted = GoalResult("aborted", ErrorCode.INVALID_GOAL, "preempted by a new goal", 0.02)
    recorder.goal_ended(20, "arm", first, aborted, FEEDBACK)
    run.feed(recorder, 20, 40)
    recorder.goal_ended(30, "arm", second, GoalResult("succeeded", ErrorCode.SUCCESSFUL, "", 0.03), FEEDBACK)
    held = GoalResult("succeeded", ErrorCode.SUCCESSFUL, "", 0.03, ("contact", "reached"))
    recorder.goal_ended(30, "hand", hand, held, closing)
    recorder.finish({})
    assert read_recording(tmp_path / "run.mcap").lost is None
    return decoded(tmp_path / "run.mcap")


def test_each_change_of_a_goal_is_a_status_with_ids_of_their_own(topics: dict[str, list[tuple[int, Any]]]) -> None:
    changes = [
        (time // MS, [(bytes(one.goal_info.goal_id.uuid), one.status) for one in message.status_list])
        for time, message in topics["/arm/follow_joint_trajectory/status"]
    ]
    first, second = changes[1][1][0][0], changes[1][1][1][0]
    assert first != second
    assert uuid.UUID(bytes=first).version == 5
    assert changes == [
        (10, [(first, 2)]),
        (20, [(first, 2), (second, 2)]),
        (20, [(first, 6), (second, 2)]),
        (30, [(first, 6), (second, 4)]),
    ]
    _, message = topics["/arm/follow_joint_trajectory/status"][-1]
    assert [one.goal_info.stamp.nanosec for one in message.status_list] == [10 * MS, 20 * MS]
    hand = topics["/hand/gripper_cmd/status"]
    assert [[one.status for one in message.status_list] for _, message in hand] == [[2], [4]]
    assert bytes(hand[0][1].status_list[0].goal_info.goal_id.uuid) not in (first, second)


def test_feedback_tells_wanted_measured_and_their_difference(topics: dict[str, list[tuple[int, Any]]]) -> None:
    ((time, message),) = topics["/arm/follow_joint_trajectory/feedback"]
    feedback = message.feedback
    assert time == 15 * MS == feedback.header.stamp.nanosec
    assert list(feedback.joint_names) == ["shoulder", "slide"]
    for name, position, velocity in (
        ("desired", [0.5, 0.25], [2.0, 3.0]),
        ("actual", [0.4, 0.3], [1.0, 5.0]),
        ("error", [0.1, -0.05], [1.0, -2.0]),
    ):
        point = getattr(feedback, name)
        np.testing.assert_allclose(point.positions, position, atol=1e-15)
        np.testing.assert_array_equal(point.velocities, velocity)
        assert (point.time_from_start.sec, point.time_from_start.nanosec) == (1, 250 * MS)
    _, status = topics["/arm/follow_joint_trajectory/status"][0]
    assert bytes(message.goal_id.uuid) == bytes(status.status_list[0].goal_info.goal_id.uuid)
    ((_, closing),) = topics["/hand/gripper_cmd/feedback"]
    assert (list(closing.feedback.state.name), list(closing.feedback.state.position)) == (["spin"], [0.75])


def test_results_tell_how_goals_ended(topics: dict[str, list[tuple[int, Any]]]) -> None:
    results = [
        (time // MS, message.status, message.result.error_code, message.result.error_string)
        for time, message in topics["/arm/follow_joint_trajectory/result"]
    ]
    assert results == [(20, 6, -1, "preempted by a new goal"), (30, 4, 0, "")]
    ((_, held),) = topics["/hand/gripper_cmd/result"]
    assert (held.status, held.result.stalled, held.result.reached_goal) == (4, True, False)
    assert list(held.result.state.position) == [0.75]


def test_a_recorder_that_cannot_be_made_leaves_nothing_open(
    make_run: MakeRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> bytes:
        raise ZeroDivisionError

    monkeypatch.setattr(messages, "marker_message", fail)
    threads = threading.active_count()
    for _ in range(3):
        before = len(list(Path("/proc/self/fd").iterdir()))
        with pytest.raises(ZeroDivisionError):
            make_run(1).recorder(tmp_path / "run.mcap", overwrite=True)
        assert len(list(Path("/proc/self/fd").iterdir())) == before
    assert threading.active_count() == threads
