"""A log of which another program left messages out: what is left is shown, and what needs the rest says so."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from manipcli.logs.log_info import log_info
from manipcli.logs.replay import open_playback
from manipcli.logs.snapshot import moment
from manipcli.pipeline import judge_log, run_task
from manipcli.record.faults import Thinned

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("log")
    task = folder / "still.yaml"
    task.write_text(
        f"task: still\nrobot: {ROOT}/robots/arm7_hand3/robot.yaml\n"
        f"controllers: {ROOT}/controllers/arm7_hand3.yaml\nstart: home\nsteps: [{{wait: 0.2 s}}]\n"
    )
    run_task(task, log=folder / "still.mcap", force=True)
    return folder / "still.mcap"


@pytest.mark.parametrize("topic", ["/joint_states", "/tf", "/arm_controller/controller_state"])
@pytest.mark.parametrize("every", [0, 10])
def test_what_another_program_left_is_shown(
    log: Path, rewrite_log: Any, tmp_path: Path, topic: str, every: int
) -> None:
    """`every`: which of the messages of the topic stay; 0: none."""
    count = 0

    def message(name: str, one: Any) -> bytes | None:
        nonlocal count
        if name != topic:
            return bytes(one.data)
        count += 1
        return bytes(one.data) if every and count % every == 0 else None

    thinned = tmp_path / "thinned.mcap"
    rewrite_log(log, thinned, message=message)
    with pytest.raises(Thinned, match="filtered by another program"):
        judge_log(thinned)
    shown = open_playback(thinned)
    assert shown.verdict is None
    assert any("filtered by another program" in note for note in shown.notes)
    assert shown.times[-1] > 0.15
    assert any("filtered by another program" in one for one in moment(thinned, 0.1).missing)


def test_a_log_whose_ticks_are_thinned_alike_is_not_judged(log: Path, rewrite_log: Any, tmp_path: Path) -> None:
    """Joints, bodies and controllers at the same tenth of the ticks: less than the log says that it holds."""
    ticks = ("/joint_states", "/tf", "/arm_controller/controller_state", "/hand_controller/controller_state")
    for name, kept in (
        ("tenth", lambda ns: ns % 10_000_000 == 0),
        ("late", lambda ns: ns >= 100_000_000),
        ("gap", lambda ns: not 100_000_000 <= ns < 150_000_000),
    ):
        thinned = tmp_path / f"{name}.mcap"
        rewrite_log(
            log,
            thinned,
            message=lambda topic, one, kept=kept: one.data if topic not in ticks or kept(one.log_time) else None,
        )
        with pytest.raises(Thinned, match="filtered by another program"):
            judge_log(thinned)
        assert any("filtered by another program" in note for note in open_playback(thinned).notes)


@pytest.mark.parametrize("topic", ["/contacts", "/task/events"])
def test_a_topic_without_any_message_is_told(log: Path, rewrite_log: Any, tmp_path: Path, topic: str) -> None:
    emptied = tmp_path / "emptied.mcap"
    rewrite_log(log, emptied, message=lambda name, one: None if name == topic else one.data)
    told = f"the log has no message of {topic}"
    assert told in moment(emptied, 0.1).missing
    assert told in log_info(emptied).missing
    assert told in open_playback(emptied).notes
    assert log_info(log).missing == ()
