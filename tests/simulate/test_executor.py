"""Motions to goals: when a motion is done, what fails it, what `until` and the timeout mean."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from manipcli.core.errors import InvalidArgument
from manipcli.model.state import Contact
from manipcli.plan.motion import GoalTolerances, Grip, JointTolerance, Motion
from manipcli.plan.trajectory import JointTrajectory
from manipcli.simulate import executor as executor_module
from manipcli.simulate.executor import REST, UNTIL_TICKS, Alarmed, Executor
from manipcli.simulate.session import Session

SessionOf = Callable[..., Session]


def move(to: float = 0.5, duration: float = 0.5, **changes: Any) -> Motion:
    """The slide from 0 to `to` [m]: one cubic, at rest at both ends."""
    trajectory = JointTrajectory.of_arrays(("slide",), np.array([duration]), np.array([[to]]), np.array([[0.0]]), None)
    return Motion("go", trajectory, None, duration, **changes)


def close(target: float = 0.4, *, force: float | None = 5.0, must_hold: bool = True) -> Motion:
    return Motion("close", None, Grip(("knuckle", "tip"), np.full(2, target), force, must_hold), 0.2)


def wait(duration: float, *, awaits: bool = True) -> Motion:
    return Motion("wait", None, None, duration, awaits=awaits)


def test_a_motion_is_done_when_its_trajectory_is_and_not_before(session_of: SessionOf) -> None:
    session = session_of()
    end = Executor(session).run(move(), until=None, deadline=None)
    assert end.outcome == "done"
    assert session.time == pytest.approx(0.5, abs=0.002)
    assert session.engine.read().position[0] == pytest.approx(0.5)


def test_a_motion_that_commands_nothing_lasts_its_duration(session_of: SessionOf) -> None:
    session = session_of()
    assert Executor(session).run(wait(0.25), until=None, deadline=None).outcome == "done"
    assert session.ticks == 250


def test_until_is_waited_for_after_the_motion_and_looked_at_every_tenth_tick(session_of: SessionOf) -> None:
    session = session_of()
    asked: list[float] = []

    def until(state: Any) -> bool:
        asked.append(session.time)
        return session.ticks >= 400

    assert Executor(session).run(wait(0.25), until=until, deadline=None).outcome == "done"
    assert session.ticks == 400
    assert asked[0] == pytest.approx(0.25)
    assert len(asked) == (400 - 250) // UNTIL_TICKS + 1


def test_a_motion_that_does_not_await_is_not_asked_until(session_of: SessionOf) -> None:
    def until(state: Any) -> bool:
        raise AssertionError

    assert Executor(session_of()).run(wait(0.1, awaits=False), until=until, deadline=None).outcome == "done"


def test_a_guarded_motion_whose_time_is_over_is_told_so(session_of: SessionOf) -> None:
    """Its references are at their end, and a goal is still waited for."""
    executor, motion = Executor(session_of()), move(awaits=True, guarded=True)
    end = executor.run(replace(motion, duration=0.1), until=lambda state: state.time >= 0.2, deadline=None)
    assert end.text == "stopped after its planned end: `until` held"


def test_a_guarded_motion_stops_within_its_limits_where_until_holds(session_of: SessionOf) -> None:
    session = session_of()
    way: list[float] = []

    def until(state: Any) -> bool:
        return float(state.position[0]) >= 0.25

    executor = Executor(session, alarm=lambda state: way.append(float(state.position[0])) or "")  # type: ignore[func-returns-value]
    end = executor.run(move(awaits=True, guarded=True), until=until, deadline=None)
    assert end.outcome == "done"
    assert end.text == "stopped 0.24 s before its end: `until` held"
    speed = np.diff(way) / session.period
    assert speed.max() == pytest.approx(1.5, rel=0.01)  # of a cubic over 0.5 m in 0.5 s, at its middle, where it stops
    assert np.diff(speed).min() / session.period >= -100.0 * 1.001  # the limit
    rest = float(session.engine.read().position[0])
    assert rest == pytest.approx(0.25 + 1.5 * UNTIL_TICKS * session.period + 1.5**2 / (2 * 100.0), abs=0.016)
    executor.hold(0.1)
    assert float(session.engine.read().position[0]) == rest


def test_a_controller_that_fails_while_a_guarded_motion_slows_down_ends_it(
    session_of: SessionOf, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = session_of()
    (slide, *_) = session.manager.controllers

    def spoilt(*_: Any, **__: Any) -> None:
        raise RuntimeError("spoilt")

    def until(state: Any) -> bool:
        if state.position[0] >= 0.25:
            monkeypatch.setattr(slide, "update", spoilt)
        return bool(state.position[0] >= 0.25)

    executor = Executor(session, alarm=lambda _: "" if session.time < 1.0 else "it goes on")
    end = executor.run(move(awaits=True, guarded=True), until=until, deadline=None)
    assert (end.outcome, "spoilt" in end.text) == ("failed", True)


def test_a_guarded_motion_waits_at_its_end_for_what_did_not_hold_on_its_way(session_of: SessionOf) -> None:
    session = session_of()
    end = Executor(session).run(move(awaits=True, guarded=True), until=lambda _: session.ticks >= 700, deadline=2.0)
    assert (end.outcome, end.text, session.ticks) == ("done", "", 700)
    end = Executor(session).run(move(0.0, awaits=True, guarded=True), until=lambda _: False, deadline=2.0)
    assert (end.outcome, end.awaited, session.ticks) == ("timeout", True, 2000)


def test_a_guarded_motion_that_need_not_begin_stays(session_of: SessionOf) -> None:
    session = session_of()
    end = Executor(session).run(move(awaits=True, guarded=True), until=lambda _: True, deadline=None)
    assert "`until` held" in end.text
    assert session.time < 0.1
    assert float(session.engine.read().position[0]) < 0.005


def test_the_timeout_comes_at_its_time_and_says_what_was_on(session_of: SessionOf) -> None:
    session = session_of()
    end = Executor(session).run(wait(0.1), until=lambda _: False, deadline=0.3)
    assert (end.outcome, session.ticks) == ("timeout", 300)
    assert re.fullmatch(r"limit reached at t = [\d.]+ s, before the condition under `until` held", end.text)

    session = session_of()
    end = Executor(session).run(move(), until=None, deadline=0.3)
    assert (end.outcome, session.ticks) == ("timeout", 300)
    assert re.fullmatch(r"limit reached at t = [\d.]+ s, before this motion ended", end.text)


def test_after_a_timeout_the_joints_stop_where_they_are(session_of: SessionOf) -> None:
    session = session_of()
    executor = Executor(session)
    executor.run(move(), until=None, deadline=0.25)
    executor.hold(0.5)
    state = session.engine.read()
    assert state.velocity[0] == 0.0
    assert 0.2 < state.position[0] < 0.4


def test_wait_holds_until_the_condition_or_the_deadline(session_of: SessionOf) -> None:
    session = session_of()
    assert Executor(session).wait(lambda _: session.ticks >= 70, deadline=1.0).outcome == "done"
    assert session.ticks == 70
    end = Executor(session).wait(lambda _: False, deadline=0.2)
    assert (end.outcome, session.ticks) == ("timeout", 200)
    assert "did not hold by t = 0.200 s" in end.text


def test_a_joint_that_does_not_follow_fails_the_motion_with_joint_value_limit_and_time(
    session_of: SessionOf, scripted: Any
) -> None:
    """The engine stands still: the reference is 0.1 m away, the tolerance on the way, after a while."""
    session = session_of(scripted())
    end = Executor(session).run(move(), until=None, deadline=None)
    assert end.outcome == "failed"
    # s(t) = 0.5 (3 u^2 - 2 u^3) with u = t / 0.5 passes 0.1 at u = 0.287.
    assert session.time == pytest.approx(0.287 * 0.5, abs=0.003)
    for word in ("'slide'", "0.1 m", f"{session.time - session.period:.3f} s"):
        assert word in end.text, end.text


def test_a_goal_that_is_not_reached_in_its_grace_fails_the_motion(session_of: SessionOf, scripted: Any) -> None:
    """0.05 m stay: within the tolerance on the way (0.1 m), not within that at the end (0.01 m)."""
    session = session_of(scripted())
    end = Executor(session).run(move(0.05), until=None, deadline=None)
    assert end.outcome == "failed"
    assert session.time == pytest.approx(0.5 + 0.2, abs=0.01)
    assert "'slide'" in end.text


@pytest.mark.parametrize(
    ("to", "share", "arrives"),
    [
        (0.004, 0.0, False),  # far less than the 5 mm of a long motion
        (-0.004, 0.0, False),
        (0.004, 0.4, False),
        (0.004, 0.6, True),
        (0.004, -0.2, False),
        (0.0004, 0.0, True),  # a controller leaves so much
    ],
)
def test_a_joint_that_makes_less_than_half_of_a_short_motion_has_not_arrived(
    session_of: SessionOf, scripted: Any, to: float, share: float, arrives: bool
) -> None:
    """Its controller has no goal tolerance; with one, the controller decides."""

    def creep(engine: Any) -> None:
        engine.state.position[0] = share * to * min(1.0, engine.tick / 400)

    session = session_of(scripted(creep))
    free = GoalTolerances((), (JointTolerance("slide", -1.0),), 0.0)
    end = Executor(session).run(move(to, tolerances=free), until=None, deadline=None)
    assert (end.outcome == "done") == arrives, end.text
    assert arrives or re.search(r"joint 'slide' moved -?[\d.e-]+ of 0.004 m", end.text), end.text
    lenient = Executor(session_of(scripted(creep))).run(move(to), until=None, deadline=None)
    assert lenient.outcome == "done"


def test_a_hand_that_closes_on_nothing_fails_where_it_must_hold(session_of: SessionOf) -> None:
    end = Executor(session_of()).run(close(), until=None, deadline=None)
    assert end.outcome == "failed"
    assert end.text.startswith("the hand closed on nothing: finger of 'knuckle': reached its target")
    assert Executor(session_of()).run(close(must_hold=False), until=None, deadline=None).outcome == "done"
    assert Executor(session_of(), touch=False).run(close(), until=None, deadline=None).outcome == "done"


def test_a_hand_that_something_stops_has_not_opened(session_of: SessionOf, scripted: Any) -> None:
    def stuck(engine: Any) -> None:
        engine.state.position[1:] = 0.4

    opening = Grip(("knuckle", "tip"), np.zeros(2), None, must_hold=False, must_arrive=True)
    end = Executor(session_of(scripted(stuck))).run(Motion("open", None, opening, 0.2), until=None, deadline=None)
    assert end.outcome == "failed"
    assert end.text.startswith("the hand did not open: finger of 'knuckle': stalled 0.4 rad before the target")
    assert Executor(session_of()).run(Motion("open", None, opening, 0.2), until=None, deadline=None).outcome == "done"
    moving = Motion("move", None, replace(opening, must_arrive=False), 0.2)
    assert Executor(session_of(scripted(stuck))).run(moving, until=None, deadline=None).outcome == "done"


@pytest.mark.parametrize(("periods", "ticks"), [(1.0, 1), (2.4, 3), (2.6, 3), (3.0 + 1e-9, 3), (600.0, 600)])
def test_a_wait_is_never_shorter_than_it_was_asked_for(session_of: SessionOf, periods: float, ticks: int) -> None:
    session = session_of()
    wait = Motion("wait", None, None, periods * session.period)
    assert Executor(session).run(wait, until=None, deadline=None).outcome == "done"
    assert session.ticks == ticks
    Executor(session).hold(periods * session.period)
    assert session.ticks == 2 * ticks


def test_a_hand_that_meets_something_holds(session_of: SessionOf, scripted: Any) -> None:
    def touch(engine: Any) -> None:
        engine.state.position[1:] = min(0.002 * engine.tick, 0.2)
        engine.state.velocity[1:] = 2.0 if engine.tick < 100 else 0.0
        engine.touching = (Contact("block", "robot/pad", 8.0, 0.0),) if engine.tick >= 100 else ()

    end = Executor(session_of(scripted(touch))).run(close(), until=None, deadline=None)
    assert end.outcome == "done"
    assert "contact at" in end.text
    assert not end.weak
    end = Executor(session_of(scripted(touch))).run(close(force=9.0), until=None, deadline=None)
    assert (end.outcome, end.weak) == ("done", True)
    assert "with 8 N of the requested 9 N" in end.text


def test_a_hand_that_never_comes_to_an_end_is_given_up(
    session_of: SessionOf, scripted: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It swings for ever: neither there, nor still, nor in contact."""
    monkeypatch.setattr(executor_module, "PATIENCE", 2.0)

    def swing(engine: Any) -> None:
        engine.state.position[1:] = -0.5
        engine.state.velocity[1:] = 1.0 if engine.tick % 40 < 20 else -1.0

    session = session_of(scripted(swing))
    handles: list[Any] = []
    end = Executor(session, on_goal=lambda _, one: handles.append(one)).run(close(), until=None, deadline=None)
    assert end.outcome == "timeout"
    assert [handle.status for handle in handles] == ["canceled"]
    assert session.time == pytest.approx(0.2 + 2.0, abs=0.002)
    furthest = r"; joint '(knuckle|tip)' is 0\.9\d* rad from its reference, the largest error$"
    assert re.search(furthest, end.text)
    end = Executor(session_of(scripted(swing))).run(close(), until=None, deadline=1.5)
    assert re.fullmatch(r"limit reached at t = \d+\.\d+ s, before this motion ended" + furthest, end.text)


def test_an_alarm_ends_a_motion_a_wait_and_a_hold_in_the_tick_that_sets_it_off(session_of: SessionOf) -> None:
    for act in (
        lambda one: one.run(move(), until=None, deadline=None),
        lambda one: one.wait(lambda _: False, deadline=9.0),
        lambda one: one.hold(9.0),
    ):
        session = session_of()
        executor = Executor(session, alarm=lambda state: "too late" if state.time >= 0.1 else "")
        with pytest.raises(Alarmed, match="too late"):
            act(executor)
        assert session.ticks == 101


def test_a_stop_cancels_what_is_on_and_holds_still_deaf_to_alarms(session_of: SessionOf) -> None:
    session = session_of()
    handles: list[Any] = []
    executor = Executor(
        session, on_goal=lambda _, one: handles.append(one), alarm=lambda s: "!" if s.time >= 0.25 else ""
    )
    with pytest.raises(Alarmed):
        executor.run(move(), until=None, deadline=None)
    assert [handle.status for handle in handles] == ["active"]
    start = session.ticks
    executor.stop()
    assert [handle.status for handle in handles] == ["canceled"]
    assert session.ticks - start == round(REST / session.period)
    state = session.engine.read()
    assert state.velocity[0] == 0.0
    assert 0.24 < state.position[0] < 0.3  # half way, and a way to slow down


def test_a_joint_that_fails_takes_the_rest_of_the_motion_with_it(session_of: SessionOf, scripted: Any) -> None:
    """The slide does not follow; the hand, which would go on closing, is canceled."""

    def swing(engine: Any) -> None:
        engine.state.position[1:] = -0.5
        engine.state.velocity[1:] = 1.0 if engine.tick % 40 < 20 else -1.0

    handles: list[Any] = []
    executor = Executor(session_of(scripted(swing)), on_goal=lambda _, handle: handles.append(handle))
    both = Motion("both", move().trajectory, close().grip, 0.5)
    assert executor.run(both, until=None, deadline=None).outcome == "failed"
    assert [handle.status for handle in handles] == ["aborted", "canceled"]


def test_a_controller_that_fails_stops_the_motions_of_the_others(session_of: SessionOf) -> None:
    """The hand has no goal; the arm, which would go on moving, is canceled and comes to rest."""
    session = session_of()
    hand = session.manager.serving(("knuckle", "tip"))
    update = hand.update

    def broken(time: float, *measured: Any, **more: Any) -> Any:
        if time >= 0.25:
            raise ZeroDivisionError
        return update(time, *measured, **more)

    hand.update = broken  # type: ignore[method-assign]
    handles: list[Any] = []
    executor = Executor(session, on_goal=lambda _, handle: handles.append(handle))
    end = executor.run(move(), until=None, deadline=None)
    assert end.outcome == "failed"
    assert "controller 'hand' failed" in end.text
    assert [handle.status for handle in handles] == ["canceled"]
    executor.hold(0.2)
    assert session.engine.read().velocity[0] == 0.0
    assert session.engine.read().position[0] < 0.4


def test_a_motion_for_which_there_is_no_controller_is_refused(session_of: SessionOf) -> None:
    both = Motion("both", None, Grip(("slide",), np.zeros(1), None, False), 0.1)
    with pytest.raises(InvalidArgument, match="'arm' is not a gripper"):
        Executor(session_of()).run(both, until=None, deadline=None)
    trajectory = JointTrajectory.of_arrays(("tip",), np.array([1.0]), np.zeros((1, 1)), None, None)
    with pytest.raises(InvalidArgument, match="'hand' does not follow trajectories"):
        Executor(session_of()).run(Motion("x", trajectory, None, 1.0), until=None, deadline=None)
