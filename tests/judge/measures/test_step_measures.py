"""What a step took, against closed forms: an arm of one joint on a circle, a slide, a contact that comes and goes."""

from __future__ import annotations

import numpy as np
import pytest

from manipcli.core.geometry import Array, Transform
from manipcli.description.elements import Joint, JointLimits, Link
from manipcli.judge.measures.step_measures import step_measures
from manipcli.judge.verdict import StepOutcome
from manipcli.model.robot import RobotModel, Tool
from manipcli.model.state import Contact, WorldState
from manipcli.record.recording import ContactSnapshot, Recording, Span

PERIOD = 0.001
RADIUS = 0.5


def _robot() -> RobotModel:
    links = tuple(Link(name, None, (), ()) for name in ("base", "arm", "slider"))
    z, limits = np.array([0.0, 0.0, 1.0]), JointLimits()
    joints = (
        Joint("turn", "continuous", "base", "arm", Transform.identity(), z, limits),
        Joint("slide", "prismatic", "arm", "slider", Transform.identity(), z, limits),
    )
    tool = Tool("slider", Transform.of(xyz=(RADIUS, 0.0, 0.0)))
    return RobotModel("r", "base", links, joints, (), (), (), Transform.identity(), "", tool=tool)


def _recording(time: Array, q: Array, effort: Array, contacts: tuple[ContactSnapshot, ...], cut: int) -> Recording:
    """In two spans, as from a file; the columns in another order than the robot's joints."""
    velocity = np.gradient(q, PERIOD, axis=0)
    none = np.zeros((len(time), 0, 3))
    states = WorldState(time, q, velocity, effort, none, np.zeros((len(time), 0, 4)), none, none)
    states = states.map(lambda a: a[:, ::-1] if a.ndim == 2 else a)
    spans = [
        Span(
            states.map(lambda a, part=part: a[part]),
            (),
            tuple(c for c in contacts if time[part][0] <= c.time <= time[part][-1]),
        )
        for part in (slice(None, cut), slice(cut, None))
    ]
    return Recording(("slide", "turn"), (), spans, (), {}, {}, None, PERIOD)


def _step(name: str, started: float | None, ended: float | None) -> StepOutcome:
    return StepOutcome(name, "move", "done", started, ended, 0.0)


@pytest.mark.parametrize("cut", [1, 400, 777, 1999])
def test_path_work_and_force_of_a_circle(cut: int) -> None:
    time = np.arange(2000) * PERIOD
    # There and back on the circle: 2 * sweep in each period; the slide rises meanwhile in the second step.
    sweep, rise = 0.8, 0.3
    angle = sweep / 2.0 * (1.0 - np.cos(2.0 * np.pi * time))
    height = np.where(time < 1.0, 0.0, rise * (time - 1.0))
    effort = np.stack([np.full(2000, 3.0), np.full(2000, -2.0)], axis=1)
    touch = (Contact("cup", "robot/arm", 7.0, 0.0), Contact("a", "b", 2.0, 0.0))
    contacts = (ContactSnapshot(0.3, touch), ContactSnapshot(0.5, touch[1:]))
    recording = _recording(time, np.stack([angle, height], axis=1), effort, contacts, cut)
    steps = [_step("one", 0.0, 1.0), _step("two", 1.0, time[-1]), _step("never", None, None)]
    one, two, never = step_measures(recording, _robot(), steps)
    assert one.turned == pytest.approx(2.0 * sweep, abs=1e-5)
    assert one.slid == pytest.approx(0.0, abs=1e-12)
    assert one.tool == pytest.approx(2.0 * sweep * RADIUS, rel=1e-5)
    # A constant effort works on the way there only: tau times the sweep. The slide's is against its way.
    assert one.work == pytest.approx(3.0 * sweep, rel=1e-4)
    assert (one.force, one.touching) == (7.0, "cup, robot/arm")
    assert two.slid == pytest.approx(rise * (time[-1] - 1.0), rel=1e-9)
    assert two.work == pytest.approx(3.0 * sweep, rel=1e-3)
    speed = np.hypot(RADIUS * sweep * np.pi * np.sin(2.0 * np.pi * time[1000:]), rise)
    assert two.tool == pytest.approx(np.trapezoid(speed, dx=PERIOD), rel=1e-4)
    assert (two.force, two.touching) == (2.0, "a, b"), "what touched before and never let go holds on"
    assert (never.duration, never.turned, never.tool, never.work, never.force) == (None,) * 5


def test_a_step_that_never_ended_is_measured_to_the_end() -> None:
    time = np.arange(500) * PERIOD
    q = np.stack([time, time], axis=1)
    (one,) = step_measures(_recording(time, q, np.ones_like(q), (), 100), _robot(), [_step("one", 0.1, None)])
    assert one.duration == pytest.approx(0.399)
    assert one.turned == pytest.approx(0.399)
