"""The plot of a page: margins at its times, limits of joints, marks."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from manipcli.core.geometry import Transform
from manipcli.description.elements import Joint, JointLimits
from manipcli.judge.margin_curves import MarginCurve
from manipcli.judge.verdict import ExpectationOutcome
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact
from manipcli.record.recording import TaskEvent
from manipcli.replay.cause import Cause
from manipcli.replay.curves_json import limits, sampled
from manipcli.replay.marks import marks
from manipcli.replay.playback import Phase, Playback, PlaybackStep, PlotTable

DISPLAY = np.arange(0, 51) * 0.02


def _curve(times: np.ndarray, margins: np.ndarray) -> MarginCurve:
    return MarginCurve(ExpectationOutcome("x", "passed", 0.0, "m", 0.0), "m", times, margins, 10.0 * margins)


def test_no_violation_is_lost_between_two_times() -> None:
    """Oracle: the least of all margins nearest to each display time."""
    times = np.sort(np.random.default_rng(1).uniform(0.0, 1.0, 300))
    margins = np.random.default_rng(2).normal(size=300)
    shown, relative = sampled(_curve(times, margins), DISPLAY)
    nearest = np.abs(DISPLAY[:, None] - times).argmin(axis=0)
    for k in range(len(DISPLAY)):
        if (nearest == k).any():
            assert shown[k] == margins[nearest == k].min()
    assert np.nanmin(shown) == margins.min()
    np.testing.assert_allclose(relative, 10.0 * shown)


def test_a_short_gap_is_a_line_and_a_long_one_is_a_gap() -> None:
    times = np.array([0.2, 0.24, 0.6])
    shown, _ = sampled(_curve(times, np.array([1.0, 3.0, 5.0])), DISPLAY)
    known = np.flatnonzero(np.isfinite(shown)).tolist()
    assert known == [10, 11, 12, 30]
    assert shown[11] == 2.0


def _robot() -> RobotModel:
    def joint(name: str, ends: JointLimits) -> Joint:
        return Joint(name, "revolute", "a", name, Transform.of(), np.array([0.0, 0.0, 1.0]), ends)

    joints = (joint("j", JointLimits(-1.0, 2.0, velocity=3.0, effort=4.0)), joint("free", JointLimits()))
    return SimpleNamespace(joints=joints)  # type: ignore[return-value]


def test_limits_are_those_of_the_description() -> None:
    def of(name: str) -> object:
        return limits(PlotTable(name, ("j", "free"), ("", ""), DISPLAY, np.zeros((51, 2))), _robot())

    assert of("joint position") == [(-1.0, 2.0), None]
    assert of("joint velocity") == [(-3.0, 3.0), None]
    assert of("joint effort") == [(-4.0, 4.0), None]
    assert of("joint error") == [None, None]
    assert limits(PlotTable("joint position", ("j",), ("",), DISPLAY, np.zeros((51, 1))), None) == [None]


def test_marks_are_contacts_grasps_what_was_lost_and_failures() -> None:
    touching = (Contact("cup", "robot/finger", 2.0, 0.0), Contact("cup", "table", 1.0, 0.0))
    contacts = tuple(touching if 0.2 <= t <= 0.5 or 0.7 <= t <= 0.9 else () for t in DISPLAY)
    phases = (Phase("close", 0.1, 0.3), Phase("lift", 0.3, 0.6), Phase("close", 0.6, 0.75), Phase("open", 0.88, 1.0))
    nothing = np.zeros((51, 0))
    playback = Playback(
        name="x", robot=None, scene=None, joint_names=(), times=DISPLAY, position=nothing, velocity=nothing,
        effort=nothing, reference=nothing, body_position=np.zeros((51, 0, 3)), body_quat_xyzw=np.zeros((51, 0, 4)),
        contacts=contacts, contact_times=((),) * 51,
        steps=(PlaybackStep("pick", "pick", "pick", 0.0, 1.0, "failed", phases=phases),),
        causes=(Cause("step 'pick' failed", "", 0.55), Cause("no time", "")),
        events=(TaskEvent(0.4, "replanned", "pick", "pick", "", "moved by 3 mm", ""),),
    )  # fmt: skip
    found = [(round(mark.time, 2), mark.kind) for mark in marks(playback)]
    assert found == [
        (0.2, "contact"), (0.3, "grasp"), (0.4, "replan"), (0.5, "lost"), (0.55, "failure"),
        (0.7, "contact"), (0.75, "grasp"), (0.9, "release"),
    ]  # fmt: skip
    assert {"'cup'" in mark.text for mark in marks(playback) if mark.kind in ("contact", "grasp", "lost")} == {True}
