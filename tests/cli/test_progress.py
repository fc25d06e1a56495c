"""The progress of a run: drawn at most ten times a second, and nothing is left on the line."""

from __future__ import annotations

import io
from dataclasses import replace

import pytest

from manipcli.cli.progress import PlanningProgress, StepProgress
from manipcli.judge.verdict import StepOutcome

STEP = StepOutcome("lift_1", "lift", "done", 1.0, 2.0, 0.9)


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_second_of_ticks_is_drawn_at_most_eleven_times(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = Terminal()
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr("sys.stderr", terminal)
    with StepProgress() as progress:
        progress.step_started(STEP, 0, 4)
        for k in range(1000):
            progress.tick(8e-3 * k, 1e-3 * k)
        drawings = terminal.getvalue().count("[1/4] lift_1")
        progress.step_ended(STEP)
    assert 9 <= drawings <= 11
    assert "8.0 x real time" in terminal.getvalue()
    assert terminal.getvalue().endswith("\r\x1b[K")


def test_an_interrupted_run_leaves_no_half_line(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = Terminal()
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr("sys.stderr", terminal)
    with pytest.raises(KeyboardInterrupt), StepProgress() as progress:
        progress.step_started(STEP, 0, 4)
        progress.tick(0.1, 0.1)
        raise KeyboardInterrupt
    assert terminal.getvalue().endswith("\r\x1b[K")


def test_quiet_is_silent(capsys: pytest.CaptureFixture[str]) -> None:
    with StepProgress(quiet=True, verbose=True) as progress:
        progress.step_started(STEP, 0, 1)
        progress.tick(0.1, 0.1)
        progress.step_ended(STEP)
    assert capsys.readouterr().err == ""


def test_a_planned_step_is_one_whole_line_in_each_branch(capsys: pytest.CaptureFixture[str]) -> None:
    then, other = (f"planning step 2 of 2, 'sort[0]/place_1' (sort[0]/if_1: {word})" for word in ("then", "else"))
    with PlanningProgress() as progress:
        for line in ("planning step 1 of 2, 'pick_1'", then, f"{then}: candidate 2, path search", other, "judging: 3"):
            progress.activity(line)
    assert capsys.readouterr().err.splitlines() == ["planning step 1 of 2, 'pick_1'", then, other]


def test_lines_between_steps_have_no_number_and_each_of_a_pair_has_its_own(capsys: pytest.CaptureFixture[str]) -> None:
    pair = [replace(STEP, id=f"parallel_1/{name}") for name in ("move_1", "grasp_1")]
    with StepProgress() as progress:
        progress.step_started(STEP, 0, 3)
        progress.message("failed: slipped; retrying", detail=False)
        progress.step_ended(STEP)
        progress.message("if_1: then: it holds by 3 mm", detail=False)
        for k, step in enumerate(pair):
            progress.step_started(step, 1 + k, 3)
        for step in pair:
            progress.step_ended(step)
    done = "done (1.00 s to 2.00 s)"
    assert capsys.readouterr().err.splitlines() == [
        "[1/3] lift_1: failed: slipped; retrying",
        f"[1/3] lift_1: {done}",
        "if_1: then: it holds by 3 mm",
        f"[2/3] parallel_1/move_1: {done}",
        f"[3/3] parallel_1/grasp_1: {done}",
    ]
