"""An inactive controller writes no messages, and readers of a recording see NaN, as if it had written that."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader

from manipcli.model.state import WorldState
from manipcli.record.contents import contents
from manipcli.record.faults import BadRecording, Thinned
from manipcli.record.read.reading import open_recording, read_recording
from manipcli.record.write import recorder as recorder_module

T = 95
OFF = {"arm": [(0, 7), (30, 41)], "hand": [(35, 60), (88, T)]}
"""Ticks at which a controller is inactive: within a block, over its end, at the start and at the end."""


def off(name: str) -> Any:
    """(T,) whether a controller is inactive."""
    found = np.zeros(T, dtype=bool)
    for start, end in OFF[name]:
        found[start:end] = True
    return found


@pytest.fixture
def log(tmp_path: Path, make_run: Callable[[int], Any], monkeypatch: pytest.MonkeyPatch) -> tuple[Any, Path]:
    """A log in blocks of ten ticks; the plots are recorded at every tenth tick."""
    monkeypatch.setattr(recorder_module, "BLOCK_SECONDS", 0.01)
    run = make_run(T)
    recorder = run.recorder(tmp_path / "log.mcap")
    s = run.states
    for k in range(T):
        one = [a[k] for a in (s.time, s.position, s.velocity, s.effort, s.body_position, s.body_quat_xyzw)]
        pairs = zip(("arm", "hand"), run.outputs_at(k), strict=True)
        outputs = [None if off(name)[k] else output for name, output in pairs]
        recorder.tick(k, WorldState(*one, np.zeros((2, 3)), np.zeros((2, 3))), outputs)
        if k % 10 == 0:
            recorder.contacts(k, run.contacts if k % 20 else ())
    recorder.finish({})
    return run, tmp_path / "log.mcap"


@pytest.mark.parametrize("name", ["arm", "hand"])
def test_its_topics_have_messages_only_while_it_is_active(log: tuple[Any, Path], name: str) -> None:
    """Read by the mcap library; sequence numbers of a topic have no gaps."""
    for topic, stride in (("controller_state", 1), ("reference", 10), ("error", 10)):
        with log[1].open("rb") as file:
            found = [m for _, _, m in make_reader(file, validate_crcs=True).iter_messages([f"/{name}/{topic}"])]
        ticks = [k for k in range(0, T, stride) if not off(name)[k]]
        assert [m.log_time for m in found] == [k * 1_000_000 for k in ticks]
        assert [m.sequence for m in found] == list(range(1, len(ticks) + 1))


def test_the_reader_fills_nan(log: tuple[Any, Path]) -> None:
    run, path = log
    recording = read_recording(path)
    assert len(recording.states.time) == T
    assert len(list(open_recording(path).spans)) == 10
    assert recording.silent == ("/task/events",)
    for trace, output, columns in zip(recording.controllers, run.outputs, ([0, 1], [2]), strict=True):
        nan = np.where(off(trace.name)[:, None], np.nan, 0.0)
        np.testing.assert_array_equal(trace.reference_position, output[0] + nan)
        np.testing.assert_array_equal(trace.reference_velocity, output[1] + nan)
        np.testing.assert_array_equal(trace.output, output[3] + nan)
        np.testing.assert_array_equal(trace.position, run.states.position[:, columns])
        np.testing.assert_array_equal(trace.times, recording.states.time)


def test_the_recording_states_when(log: tuple[Any, Path]) -> None:
    found = contents(read_recording(log[1]).metadata["recording"])
    assert found.inactive == {
        "arm": ((0.0, 0.007), (0.03, 0.041)),
        "hand": ((0.035, 0.06), (0.088, None)),
    }


def test_a_message_that_another_program_removed_is_no_pause(
    log: tuple[Any, Path], rewrite_log: Any, tmp_path: Path
) -> None:
    for removed in (20_000_000, 6_000_000 * 14):
        rewrite_log(
            log[1],
            tmp_path / "less.mcap",
            message=lambda topic, m, at=removed: (
                None if topic == "/arm/controller_state" and m.log_time == at else bytes(m.data)
            ),
        )
        with pytest.raises(Thinned):
            read_recording(tmp_path / "less.mcap")


@pytest.mark.parametrize(
    "value", ["[]", '{"arm": 1}', '{"arm": [[0]]}', '{"arm": [[0, "x"]]}', '{"arm": [[1e300, 2]]}']
)
def test_a_damaged_entry_is_refused(log: tuple[Any, Path], value: str) -> None:
    metadata = read_recording(log[1]).metadata["recording"]
    with pytest.raises(ValueError, match="damaged"):
        contents({**metadata, "inactive": value})
    with pytest.raises(ValueError, match="damaged"):
        contents({**metadata, "joints": '["other"]'})


def test_a_killed_run_can_be_read(log: tuple[Any, Path], tmp_path: Path) -> None:
    """Cut at any byte, each tick that is left is read as in the whole log."""
    whole = read_recording(log[1])
    data = log[1].read_bytes()
    for size in range(len(data) // 2, len(data), 997):
        cut = tmp_path / "cut.mcap.partial"
        cut.write_bytes(data[:size])
        try:
            part = read_recording(cut)
        except BadRecording as error:
            assert "no metadata" in str(error)
            continue
        for ours, theirs in zip(part.controllers, whole.controllers, strict=True):
            for mine, full in zip(ours.arrays, theirs.arrays, strict=True):
                np.testing.assert_array_equal(mine, full[: len(mine)])
