"""A snapshot from the chunks around its time is that of the whole log."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import InvalidInput
from manipcli.logs import snapshot
from manipcli.pipeline import run_task
from manipcli.record.read.excerpt import open_excerpt
from manipcli.record.read.scan import Scan
from manipcli.record.records import CHUNK
from manipcli.record.write import recorder
from manipcli.report.logs.snapshot import render_json

ROOT = Path(__file__).parents[2]
TASK = f"""task: waves
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
simulation: {{engine: pybullet}}
scene:
  block: {{box: {{size: [0.05, 0.05, 0.05]}}, mass: 0.1, rests_on: table, at: [0.6, 0.2]}}
  table: {{box: {{size: [0.2, 0.2, 0.1]}}, pose: {{xyz: [0.6, 0.2, 0.05]}}, fixed: true}}
steps:
  - move: {{to: {{joint_1: 0.2}}}}
  - wait: 0.3 s
  - move: {{to: {{joint_1: 0.0}}}}
"""


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """In chunks of 50 ms."""
    folder = tmp_path_factory.mktemp("log")
    (folder / "waves.yaml").write_text(TASK)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recorder, "BLOCK_SECONDS", 0.05)
        run_task(folder / "waves.yaml", log=folder / "waves.mcap", allow_outside=True)
    return folder / "waves.mcap"


def _whole(log: Path, time: float, monkeypatch: pytest.MonkeyPatch) -> str:
    with monkeypatch.context() as patch:
        patch.setattr(snapshot, "open_excerpt", lambda *_: None)
        return render_json(snapshot.moment(log, time))


def test_it_is_that_of_the_whole_log_at_any_time(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = open_excerpt(log, 0.1)
    assert found is not None
    times = [0.0, 1e-3, 0.05, 0.0501, *np.random.default_rng(5).uniform(0.0, found.end, 12).tolist(), found.end]
    for time in times:
        assert open_excerpt(log, time) is not None
        assert render_json(snapshot.moment(log, time)) == _whole(log, time, monkeypatch), time


def test_most_chunks_are_not_read(log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The chunks of the first step are overwritten, but the first ones, in which the contacts changed last."""
    found = open_excerpt(log, 0.1)
    assert found is not None
    time = found.end - 0.02
    wanted = render_json(snapshot.moment(log, time)).replace(str(log), "")
    chunks = [record for record in Scan(log) if getattr(record, "opcode", 0) == CHUNK]
    assert len(chunks) > 20
    data = bytearray(log.read_bytes())
    for chunk in chunks[3 : len(chunks) // 3]:
        data[chunk.offset + 60 : chunk.end] = bytes(chunk.end - chunk.offset - 60)
    (tmp_path / "spoilt.mcap").write_bytes(data)
    assert (
        render_json(snapshot.moment(tmp_path / "spoilt.mcap", time)).replace(str(tmp_path / "spoilt.mcap"), "")
        == wanted
    )


def test_a_file_without_its_end_is_read_whole(log: Path, tmp_path: Path) -> None:
    data = log.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) * 2 // 3])
    assert open_excerpt(tmp_path / "cut.mcap", 0.1) is None
    assert snapshot.moment(tmp_path / "cut.mcap", 0.1).time == pytest.approx(0.1, abs=2e-3)


@pytest.mark.parametrize("time", [-1.0, 1e6])
def test_a_time_outside_the_log_is_an_error(log: Path, time: float) -> None:
    with pytest.raises(InvalidInput, match="outside the log"):
        snapshot.moment(log, time)
