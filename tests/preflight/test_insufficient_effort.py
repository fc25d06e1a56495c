"""Gains that cannot hold a pendulum's weight: m g l sin q / p, against what the engine does."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import Diagnostic
from manipcli.pipeline import run_task
from manipcli.preflight.findings import preflight_findings
from manipcli.record.read.reading import read_recording
from manipcli.task.load_task import load_task

POSES = "poses: {down: {all: [0]}, up: {all: [1.2]}, back: {all: [-1.2]}}"
WEIGHT = 1.0 * 9.80665 * 0.25 * math.sin(1.2)
"""[N m]"""
Written = Callable[..., Path]


@pytest.fixture
def written(pendulum: Written) -> Written:
    def of(gains: str, *, more: str = "", start: str = "up", steps: str = "{wait: 1 s}") -> Path:
        folder = pendulum(POSES)
        head = "controllers:\n  c: {type: joint_trajectory, joints: [hinge], command_interface: effort"
        (folder / "c.yaml").write_text(f"{head}, gains: {{hinge: {{{gains}}}}}{more}}}\n")
        task = folder / "task.yaml"
        task.write_text(f"task: t\nrobot: robot.yaml\ncontrollers: c.yaml\nstart: {start}\nsteps: [{steps}]\n")
        return task

    return of


def told(task: Path) -> list[Diagnostic]:
    return list(preflight_findings(load_task(task)))


@pytest.mark.parametrize(
    ("gains", "code", "message"),
    [
        ("p: 20, d: 2", "CTRL156", f"p 20 sags {WEIGHT / 20:.2g} rad under its gravity load of {WEIGHT:.3g} N m"),
        ("p: 1, d: 0.1", "CTRL156", f"p 1 sags {WEIGHT:.2g} rad under"),
        ("d: 12", "CTRL156", f"p 0 sinks under its gravity load of {WEIGHT:.3g} N m"),
        (
            "p: 80, d: 6, u_clamp_max: 1, u_clamp_min: -9",
            "CTRL159",
            f"up to {WEIGHT:.3g} N m, its u_clamp_max is 1",
        ),
        (
            "p: 5, d: 1, i: 20, i_clamp: 1",
            "CTRL156",
            f"p 5 with its integral clamped to -1 ... 1 sags {(WEIGHT - 1) / 5:.2g} rad under",
        ),
        (
            "p: 20, d: 2, i: 4, i_clamp: 10",
            "CTRL156",
            f"p 20 sags {WEIGHT / 20:.2g} rad under its gravity load of {WEIGHT:.3g} N m for about 5 s, "
            "until its integral (i 4) carries it",
        ),
        ("p: 20, d: 2, i: 16, i_clamp: 10", "CTRL156", "for about 1.2 s, until its integral (i 16) carries it"),
    ],
)
def test_gains_too_weak_for_the_weight_are_told(written: Written, gains: str, code: str, message: str) -> None:
    (one,) = told(written(gains))
    assert (one.code, one.severity) == (code, "warning")
    assert one.message.startswith("hinge: ")
    assert message in one.message
    assert told(written(gains, start="down")) == [], "nothing to hold there"
    assert told(written(gains, more=", gravity_compensation: true")) == []


@pytest.mark.parametrize(
    "gains",
    [
        "p: 80, d: 6",
        "p: 20, d: 2, i: 40",
        "p: 20, d: 2, i: 40, i_clamp: 2",
        "p: 80, d: 6, u_clamp_max: 2.5, u_clamp_min: -1",
        "p: 80, d: 6, u_clamp_max: 9, u_clamp_min: -9",
    ],
)
def test_gains_that_hold_it_are_not(written: Written, gains: str) -> None:
    assert told(written(gains)) == []


def test_a_clamp_on_the_other_side_is_told_on_the_other_side(written: Written) -> None:
    gains = "p: 80, d: 6, u_clamp_max: 2.5, u_clamp_min: -1"
    (one,) = told(written(gains, start="back"))
    assert f"needs up to {-WEIGHT:.3g} N m, its u_clamp_min is -1" in one.message


def test_an_integral_without_kp_is_unstable_and_nothing_else(written: Written) -> None:
    (one,) = told(written("d: 2, i: 4, i_clamp: 1"))
    assert one.code == "CTRL150"


def test_a_wide_tolerance_is_no_leave_to_sink_until_the_integral_carries_it(written: Written) -> None:
    (one,) = told(written("p: 20, d: 2, i: 4", more=", constraints: {joints: {hinge: {goal: 0.5}}}"))
    assert "until its integral (i 4) carries it" in one.message
    assert told(written("p: 20, d: 2", more=", constraints: {joints: {hinge: {goal: 0.5}}}")) == []


def test_what_the_effort_limit_cuts_off_is_not_told_of_the_gains_too(written: Written, pendulum: Written) -> None:
    """It sinks for want of effort; under what effort there is, 1 N m, it gives way by 0.05 rad, half of `SAG`."""
    task = written("p: 20, d: 2")
    pendulum(f"{POSES}\nlimits: {{hinge: {{effort: 1}}}}")
    assert [one.code for one in told(task)] == ["CTRL155"]


@pytest.mark.slow
@pytest.mark.parametrize("gains", ["p: 8, d: 2", "p: 5, d: 1, i: 20, i_clamp: 1"])
def test_what_is_told_is_what_the_engine_does(written: Written, gains: str, tmp_path: Path) -> None:
    """It hangs where p (q_r - q) + I = m g l sin q: less than from the weight at the reference, which is told."""
    task = written(gains, steps="{wait: 6 s}")
    run_task(task, log=tmp_path / "t.mcap")
    recording = read_recording(tmp_path / "t.mcap")
    q = float(np.asarray(recording.states.position).ravel()[-1])
    p, carried = (8.0, 0.0) if "i" not in gains else (5.0, 1.0)
    assert p * (1.2 - q) + carried == pytest.approx(9.80665 * 0.25 * math.sin(q), rel=0.01)
    (one,) = told(task)
    assert 1.2 - q > 0.1
    assert one.code == "CTRL156"
