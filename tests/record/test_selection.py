"""What a task chooses of its log is there, at its rate; what is read back is where everything meets."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader

from manipcli.control.action import ErrorCode, GoalResult
from manipcli.record.channels import ControllerChannel
from manipcli.record.read.reading import open_recording, read_recording
from manipcli.record.selection import Selection
from manipcli.record.write import recorder as recorder_module

MakeRun = Callable[[int], Any]


def written(make_run: MakeRun, path: Path, selection: Selection, ticks: int = 130) -> Any:
    """The run, recorded so."""
    run = make_run(ticks)
    recorder = run.recorder(path, selection=selection)
    run.feed(recorder)
    recorder.finish({})
    return run


def messages(path: Path) -> dict[str, list[int]]:
    """topic -> log times [ms], by the mcap library with all checksums on."""
    found: dict[str, list[int]] = {}
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        found = {channel.topic: [] for channel in summary.channels.values()}
        order = 0
        for _, channel, message in reader.iter_messages(log_time_order=False):
            assert message.log_time >= order, "in the order of time"
            order = message.log_time
            found[channel.topic].append(message.log_time // 1_000_000)
            assert message.sequence == len(found[channel.topic])
        assert summary.statistics is not None
        counts = Counter({summary.channels[k].topic: n for k, n in summary.statistics.channel_message_counts.items()})
        assert counts == Counter({topic: len(times) for topic, times in found.items()})
    return found


def test_each_topic_is_at_its_rate(make_run: MakeRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorder_module, "BLOCK_SECONDS", 0.033)
    strides = {"tf": 10, "controller_state": 4, "error": 1, "actuator_states": 25}
    written(make_run, tmp_path / "log.mcap", Selection(strides))
    times = messages(tmp_path / "log.mcap")
    for topic, stride in (
        ("/joint_states", 1), ("/tf", 10), ("/arm/controller_state", 4), ("/hand/controller_state", 4),
        ("/arm/error", 1), ("/arm/reference", 10), ("/actuator_states", 25),
    ):  # fmt: skip
        assert times[topic] == list(range(0, 130, stride)), topic
    assert times["/contacts"]
    assert times["/task/events"] == [0]


def test_what_is_read_is_where_joints_bodies_and_controllers_meet(
    make_run: MakeRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder_module, "BLOCK_SECONDS", 0.033)
    run = written(make_run, tmp_path / "log.mcap", Selection({"tf": 10, "controller_state": 4}))
    recording = read_recording(tmp_path / "log.mcap")
    assert recording.lost is None
    np.testing.assert_allclose(recording.states.time, np.arange(0, 130, 20) / 1000, atol=1e-12)
    np.testing.assert_array_equal(recording.states.position, run.states.position[::20])
    np.testing.assert_array_equal(recording.states.body_position, run.states.body_position[::20])
    for trace, outputs in zip(recording.controllers, run.outputs, strict=True):
        np.testing.assert_array_equal(trace.reference_position, np.asarray(outputs)[0][::20])
        np.testing.assert_array_equal(trace.times, recording.states.time)
    assert read_recording(tmp_path / "log.mcap").contacts


def test_what_is_left_out_is_not_there_and_known_to_be_absent(make_run: MakeRun, tmp_path: Path) -> None:
    run = make_run(30)
    left_out = frozenset({"tf", "controller_state", "contacts", "error", "goals"})
    arm = ControllerChannel("arm", ("shoulder", "slide"), action="follow_joint_trajectory")
    hand = ControllerChannel("hand", ("spin",), ("position",))
    recorder = run.recorder(tmp_path / "log.mcap", controllers=(arm, hand), selection=Selection({}, left_out))
    number = recorder.goal_sent(0, "arm")
    run.feed(recorder)
    feedback: Any = None
    recorder.goal_ended(30, "arm", number, GoalResult("succeeded", ErrorCode.SUCCESSFUL, "", 0.03), feedback)
    recorder.finish({})
    times = messages(tmp_path / "log.mcap")
    assert {"/joint_states", "/arm/reference", "/actuator_states", "/robot_description"} <= times.keys()
    assert not [topic for topic in times if topic.endswith(("/tf", "state", "contacts", "error", "status"))]
    recording = open_recording(tmp_path / "log.mcap")
    assert set(recording.absent) == {
        "/tf", "/contacts", "/arm/controller_state", "/hand/controller_state", "/arm/error", "/hand/error",
        *(f"/arm/follow_joint_trajectory/{topic}" for topic in ("feedback", "status", "result")),
    }  # fmt: skip
    assert recording.controllers == ()
    assert recording.contacts == ()
    assert np.isnan(recording.states.body_position).all()
    assert recording.states.body_position.shape == (30, 2, 3)
    np.testing.assert_array_equal(recording.states.position, run.states.position)


def test_the_usual_selection_says_nothing_of_itself(make_run: MakeRun, tmp_path: Path) -> None:
    written(make_run, tmp_path / "log.mcap", Selection(), ticks=20)
    values = open_recording(tmp_path / "log.mcap").metadata["recording"]
    assert "strides" not in values
    assert "absent" not in values
