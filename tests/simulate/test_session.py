"""One tick: its order, its clock, who feels which contact, and the states that stop a run."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from manipcli.control.controller import ControllerOutput
from manipcli.control.manager import ControllerManager
from manipcli.core.errors import SimulationFailed
from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Inertial, Mimic, TransmissionTag
from manipcli.model.robot import Actuator
from manipcli.model.state import Contact
from manipcli.plan.trajectory import JointTrajectory, TrajectoryPoint
from manipcli.simulate.session import BODY_SPEED, FALLEN, RUNAWAY_SPEED, SLOW, Session
from manipcli.spec.controllers import ConstraintsSpec, JointConstraintSpec

SessionOf = Callable[..., Session]


class Seen:
    """Keeps what an observer is told."""

    def __init__(self) -> None:
        self.ticks: list[tuple[int, float, list[float]]] = []
        self.touching: list[tuple[int, tuple[Contact, ...]]] = []

    def tick(self, tick: int, state: Any, outputs: Any) -> None:
        self.ticks.append((tick, float(state.time), [float(output.position[0]) for output in outputs]))

    def contacts(self, tick: int, contacts: tuple[Contact, ...]) -> None:
        self.touching.append((tick, contacts))


def ticks(session: Session, count: int) -> None:
    for _ in range(count):
        session.tick()


def test_the_clock_is_tick_times_period_and_starts_again(session_of: SessionOf) -> None:
    session, seen = session_of(), Seen()
    ticks(session, 700)
    assert session.time == 700 * session.period
    session.restart_clock(seen)
    ticks(session, 3001)
    assert [tick for tick, _, _ in seen.ticks] == list(range(3001))
    assert [time for _, time, _ in seen.ticks] == [k * session.period for k in range(3001)]


def test_a_tick_reads_commands_tells_and_advances_in_this_order(session_of: SessionOf, scripted: Any) -> None:
    order: list[str] = []

    class Engine(scripted):  # type: ignore[misc]
        def read(self, *, velocities: bool = True) -> Any:
            order.append("read")
            return super().read(velocities=velocities)

        def write(self, *command: Any) -> None:
            order.append("write")

        def advance(self) -> None:
            order.append("advance")

    class Observer(Seen):
        def tick(self, *seen: Any) -> None:
            order.append("observe")

    session = session_of(Engine())
    session.restart_clock(Observer())
    order.clear()
    ticks(session, 2)
    assert order == ["read", "write", "observe", "advance"] * 2


def test_commands_are_cut_at_the_limits_and_counted(session_of: SessionOf, scripted: Any) -> None:
    """100 N/m times 1.5 m of error ask 150 N of a joint that has 100 N."""

    def pull_away(engine: Any) -> None:
        engine.state.position[0] = -1.5 if engine.tick > 0 else 0.0

    engine = scripted(pull_away)
    session = session_of(engine)
    ticks(session, 10)
    assert engine.written[-1][0] == 100.0
    assert session.saturations[0] == 9


def test_cuts_before_the_start_are_not_counted(session_of: SessionOf, scripted: Any) -> None:
    def pull_away(engine: Any) -> None:
        engine.state.position[0] = -1.5 if 0 < engine.tick < 10 else 0.0

    session = session_of(scripted(pull_away))
    ticks(session, 10)
    assert session.saturations[0] == 9
    session.restart_clock(Seen())
    assert not session.saturations.any()
    ticks(session, 1)
    assert not session.saturations.any()


@pytest.mark.parametrize(("ideal", "counted"), [(False, [9, 0, 0]), (True, [0, 0, 0])])
def test_cuts_of_hands_and_of_engines_without_efforts_are_not_counted(
    session_of: SessionOf, scripted: Any, ideal: bool, counted: list[int]
) -> None:
    """All are so far from where they are held that each command is cut; the finger presses by intent."""

    def pull_away(engine: Any) -> None:
        engine.state.position[:] = -150.0 if engine.tick > 0 else 0.0

    engine = scripted(pull_away, ideal=ideal)
    session = session_of(engine)
    ticks(session, 10)
    assert np.all(engine.written[-1] == 100.0)
    assert session.saturations.tolist() == counted


def test_a_slow_controller_drives_geared_joints_alike_at_every_tick(session_of: SessionOf, scripted: Any) -> None:
    """100 Hz in a loop of 1 kHz: what the gear takes is taken off what it wrote once, not off what is left of it."""

    class Pushes:
        name, joints, interfaces, role = "push", ("slide",), ("effort",), None
        feed_forward, senses_contact, sensors = "none", False, ()
        output = ControllerOutput.of(1, 1)

        def update(self, time: float, period: float, measured: Any, *, contact_force: Any = None) -> Any:
            self.output.command[:] = 10.0 + round(time / period)
            return self.output

        def deactivate(self, time: float, reason: str = "") -> None: ...

    other, engine = session_of(), scripted()
    engine.state.velocity[0] = 1.0  # fast enough for all of the friction
    inertial = Inertial(1.0, Transform.identity(), frozen(np.eye(3)))
    motor = Actuator("m", efficiency=0.8, coulomb_friction=0.05)
    geared = TransmissionTag("t", "SimpleTransmission", ("slide",), (1.0,), (0.0,), ("m",), (10.0,))
    manager = ControllerManager(joints=other.robot.joint_names, period=other.period)
    manager.load(Pushes(), update_rate=100.0)  # type: ignore[arg-type]
    manager.configure("push")
    assert manager.switch(["push"]).ok
    session = Session(
        robot=replace(
            other.robot, actuators=(motor,), transmissions=(geared,),
            links=tuple(replace(link, inertial=inertial) for link in other.robot.links),
        ),
        scene=other.scene, engine=engine, manager=manager, period=other.period,
    )  # fmt: skip
    ticks(session, 30)
    wanted = np.repeat([10.0, 11.0, 12.0], 10)
    np.testing.assert_allclose([effort[0] for effort in engine.written], wanted * 0.8 - 0.5)


@pytest.mark.parametrize(
    ("joint", "name", "limit"), [(0, "slide", 6.0), (1, "knuckle", 9.0), (2, "tip", RUNAWAY_SPEED)]
)
def test_a_runaway_is_named_with_its_speed_and_time(
    session_of: SessionOf, scripted: Any, joint: int, name: str, limit: float
) -> None:
    """Three times the velocity limit; where there is none, what Bullet lets through at most."""

    def run_away(engine: Any) -> None:
        engine.state.velocity[joint] = -(0.99 if engine.tick < 50 else 1.01) * limit

    session = session_of(scripted(run_away))
    with pytest.raises(SimulationFailed, match=rf"joint '{name}' diverges at -{1.01 * limit:.3g}") as caught:
        ticks(session, 100)
    assert 0.050 <= caught.value.time < 0.050 + SLOW * session.period
    assert f"t = {caught.value.time:.3f} s" in str(caught.value)


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_joint_that_is_not_finite_stops_the_run(session_of: SessionOf, scripted: Any, value: float) -> None:
    def spoil(engine: Any) -> None:
        engine.state.velocity[1] = value

    with pytest.raises(SimulationFailed, match="'knuckle'"):
        ticks(session_of(scripted(spoil)), SLOW)


def change(attribute: str, value: float) -> Callable[[Any], None]:
    def script(engine: Any) -> None:
        if engine.tick >= 20:
            getattr(engine.state, attribute)[0, 2] = value

    return script


@pytest.mark.parametrize(
    ("script", "told"),
    [
        (change("body_linear", BODY_SPEED * 1.01), "'block' flies off at 50.5 m/s"),
        (change("body_linear", math.nan), "'block' flies off at nan m/s"),
        (change("body_position", FALLEN - 0.01), "'block' has fallen out of the scene"),
        (change("body_position", math.nan), "'block' has fallen out of the scene"),
    ],
)
def test_a_body_that_leaves_the_plausible_is_named(
    session_of: SessionOf, scripted: Any, script: Callable[[Any], None], told: str
) -> None:
    with pytest.raises(SimulationFailed, match=told) as caught:
        ticks(session_of(scripted(script)), 100)
    assert caught.value.time == pytest.approx(0.02)


def listened(session: Session) -> list[list[float]]:
    """The contact forces that its manager is told from now on, tick by tick."""
    told: list[list[float]] = []
    update = session.manager.update

    def listening(time: float, state: Any, contact_force: Any) -> Any:
        told.append(contact_force.tolist())
        return update(time, state, contact_force)

    session.manager.update = listening  # type: ignore[method-assign]
    return told


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_joint_feels_what_touches_the_links_that_it_moves_last(
    session_of: SessionOf, scripted: Any, mirrored: bool
) -> None:
    """A fixed link counts for the joint before it; a touch between two links of the robot is no touch.

    Which body of a contact is told first makes no difference.
    """
    engine = scripted()
    engine.touching = (
        Contact("block", "robot/pad", 2.0, 0.0),
        Contact("block", "robot/far", 1.0, 0.0),
        Contact("block", "robot/near", 0.5, 0.0),
        Contact("robot/carriage", "robot/pad", 9.0, 0.0),
        Contact("robot/base", "robot/pad", 9.0, 0.0),
        Contact("block", "robot/base", 4.0, 0.0),
        Contact("block", "floor", 7.0, 0.0),
    )
    if mirrored:
        engine.touching = tuple(one._replace(a=one.b, b=one.a) for one in engine.touching)
    session = session_of(engine)
    felt = listened(session)
    ticks(session, 3)
    assert felt == [[0.0, 0.5, 3.0]] * 3
    engine.touching = ()
    ticks(session, 1)
    assert felt[-1] == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(("parent", "felt"), [("carriage", [4.5, 0.0, 0.0]), ("base", [2.5, 2.5, 0.0])])
def test_a_joint_feels_what_those_that_mimic_it_do(
    session_of: SessionOf, scripted: Any, parent: str, felt: list[float]
) -> None:
    """Slide, knuckle and tip have one motor; the two with the pad hang below its carriage, or are the other jaw."""
    other = session_of()
    slide, knuckle, tip, glue = other.robot.joints
    mimic = Mimic("slide")
    joints = (slide, replace(knuckle, parent=parent, mimic=mimic), replace(tip, mimic=mimic), glue)
    engine = scripted()
    engine.touching = tuple(
        Contact("block", f"robot/{link}", force, 0.0)
        for link, force in (("carriage", 2.0), ("near", 1.0), ("pad", 1.5))
    )
    session = Session(
        robot=replace(other.robot, joints=joints), scene=other.scene, engine=engine, manager=other.manager,
        period=other.period,
    )  # fmt: skip
    told = listened(session)
    ticks(session, 1)
    assert told == [felt]


def test_a_short_touch_of_the_robot_is_told_with_its_end(session_of: SessionOf, scripted: Any) -> None:
    touch = (Contact("block", "robot/pad", 2.0, 0.0),)

    def script(engine: Any) -> None:
        engine.touching = touch if engine.tick in (13, 14) else ()

    session, seen = session_of(scripted(script)), Seen()
    session.restart_clock(seen)
    ticks(session, 20)
    assert [(tick, told) for tick, told in seen.touching if tick % SLOW] == [(13, touch), (14, touch), (15, ())]


def test_nothing_moves_without_goals(session_of: SessionOf) -> None:
    session = session_of()
    ticks(session, 500)
    state = session.engine.read()
    np.testing.assert_array_equal(state.position, np.zeros(3))


def test_on_the_ideal_engine_a_path_tolerance_is_left_by_the_curvature_of_the_path_at_most(
    session_of: SessionOf,
) -> None:
    """A controller at up to 2 m/s sees a T^2 / 2 <= 3.9e-6 m, not v T = 2e-3."""
    session = session_of()
    tight = ConstraintsSpec(joints={"slide": JointConstraintSpec(trajectory=4e-6, goal=1e-9)})
    way = JointTrajectory(["slide"], [TrajectoryPoint([1.3], 1.0, [0.0])])
    goal = session.manager.serving(("slide",)).send_goal(way, constraints=tight)  # type: ignore[attr-defined]
    ticks(session, 1100)
    assert goal.status == "succeeded"
