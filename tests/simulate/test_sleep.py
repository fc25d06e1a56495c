"""Resting bodies sleep in both engines: nothing that a task sees differs from the same bodies awake."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from manipcli.control.command import JointCommand, Mode
from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Inertial, Joint, JointLimits, Link
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Box, Geometry, Shape, Sphere
from manipcli.simulate.engine import Engine, EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.simulate.engines.resting import AWAKE, FIXED, LOOK, LOOKS, Resting

STEP = 1e-3
G = 9.81
SIDE = 0.04
both = pytest.mark.parametrize("name", ["pybullet", "mujoco"])


def body(name: str, shape: Shape, at: tuple[float, float, float], *, fixed: bool = False) -> Body:
    size = shape.size if isinstance(shape, Box) else (SIDE,) * 3
    return Body(
        name=name, kind="box", geometries=(Geometry(Transform.identity(), shape),), mass=0.0 if fixed else 0.1,
        X_OI=Transform.identity(), inertia=frozen(np.diag([2.7e-5] * 3)), friction=0.6, rolling_friction=0.0,
        spinning_friction=0.0, restitution=0.0, fixed=fixed, X_WO=Transform.of(xyz=at), interior=None,
        size=frozen(size), centre=frozen([0.0] * 3),
    )  # fmt: skip


FLOOR = body("floor", Box((2.0, 2.0, 0.1)), (0.0, 0.0, -0.05), fixed=True)
CUBE = Box((SIDE,) * 3)
LOW, HIGH = body("low", CUBE, (0.0, 0.0, SIDE / 2)), body("high", CUBE, (0.0, 0.0, 1.5 * SIDE))
FAR = body("far", CUBE, (0.5, 0.0, SIDE / 2))
BALL = body("ball", Sphere(SIDE / 2), (0.3, 0.3, SIDE / 2))
WORLD = Scene((FLOOR, LOW, HIGH, FAR, BALL), (), frozen([0.0, 0.0, -G]))

SLIDE = Joint(
    "slide", "prismatic", "base", "pusher", Transform.of(xyz=(-0.3, 0.0, SIDE / 2)), frozen([1.0, 0.0, 0.0]),
    JointLimits(-1.0, 1.0, 2.0, 50.0),
)  # fmt: skip
INERTIAL = Inertial(1.0, Transform.identity(), frozen(np.diag([0.01] * 3)))
PUSHER = RobotModel(
    name="testbot", root="base", joints=(SLIDE,), groups=(), poses=(), transmissions=(), X_WB=Transform.identity(),
    urdf="", links=(
        Link("base", INERTIAL, (), ()), Link("pusher", INERTIAL, (), (Geometry(Transform.identity(), CUBE),)),
    ),
)  # fmt: skip


@contextmanager
def world(
    name: str, *, sleep: bool = True, mode: Mode = "effort", scene: Scene = WORLD
) -> Iterator[tuple[Engine, JointCommand]]:
    pytest.importorskip("mujoco" if name == "mujoco" else "numpy")
    engine = ENGINES[name].open(PUSHER, scene, EngineSettings(STEP, 1, np.zeros(1), sleep=sleep))
    command = JointCommand(1)
    command.obey([mode])
    try:
        yield engine, command
    finally:
        engine.close()


def ticks(engine: Engine, command: JointCommand, count: int) -> WorldState:
    for _ in range(count):
        engine.write(command)
        engine.advance()
        engine.read()
    return engine.read().map(np.copy)


SOON = round((LOOKS + 3) * LOOK / STEP)


@both
def test_bodies_that_rest_stop_entirely_and_keep_their_contacts(name: str) -> None:
    with world(name) as (engine, command):
        before = ticks(engine, command, SOON)
        after = ticks(engine, command, 100)
        assert np.array_equal(before.body_position, after.body_position)
        assert not after.body_linear.any()
        forces = {(c.a, c.b): c.force for c in engine.contacts()}
        weight = 0.1 * G
        assert forces["floor", "low"] == pytest.approx(2 * weight, rel=0.02)
        assert forces["high", "low"] == pytest.approx(weight, rel=0.02)
        assert forces["ball", "floor"] == pytest.approx(weight, rel=0.02)
        assert not engine.touches_changed()


@both
def test_a_sleeping_stack_is_pushed_like_one_that_is_awake(name: str) -> None:
    ends = []
    for sleep in (False, True):
        with world(name, sleep=sleep) as (engine, command):
            ticks(engine, command, SOON)
            command.effort[0] = 2.0
            ticks(engine, command, 600)
            command.effort[0] = -5.0
            ends.append(ticks(engine, command, 400))
    awake, slept = ends
    assert awake.body_position[0, 0] > 0.05  # it was pushed
    np.testing.assert_allclose(slept.body_position, awake.body_position, atol=3e-3)
    np.testing.assert_allclose(slept.position, awake.position, atol=3e-3)


@both
def test_a_body_without_its_support_falls(name: str) -> None:
    with world(name) as (engine, command):
        ticks(engine, command, SOON)
        engine.place("low", Transform.of(xyz=(0.0, 0.6, SIDE / 2)), np.zeros(6))
        state = ticks(engine, command, 300)
        assert state.body_position[1, 2] == pytest.approx(SIDE / 2, abs=1e-3)


@both
def test_what_falls_on_a_sleeping_body_wakes_it(name: str) -> None:
    with world(name) as (engine, command):
        ticks(engine, command, SOON)
        engine.place("ball", Transform.of(xyz=(0.5 + 0.3 * SIDE, 0.0, 0.3)), np.zeros(6))
        ticks(engine, command, 200)  # it falls 0.24 m in 0.22 s, while the rest falls asleep
        ticks(engine, command, 200)
        assert {(c.a, c.b) for c in engine.contacts()} >= {("floor", "low"), ("high", "low"), ("far", "floor")}
        state = ticks(engine, command, 600)
        assert state.body_position[3, 2] < 0.2


def test_a_brake_creeps_alike_with_and_without_sleep() -> None:
    """MuJoCo's solver takes islands one by one only where bodies sleep; the compliance of motors is then copied."""
    slope = replace(WORLD, gravity=frozen([2.0, 0.0, -G]))
    found = []
    for sleep in (False, True):
        with world("mujoco", sleep=sleep, mode="brake", scene=slope) as (engine, command):
            found.append(ticks(engine, command, 300).position[0])
    assert found[0] > 1e-9
    assert found[1] == pytest.approx(found[0], rel=0.01)


def state_of(positions: list[tuple[float, float, float]], quat: tuple[float, float, float, float]) -> WorldState:
    state = WorldState.room(1, len(positions))
    state.body_position[:] = positions
    state.body_quat_xyzw[:] = quat
    return state


def looked(resting: Resting, *, moving: int | None = None, spin: float = 0.0) -> bool:
    """Looks at the bodies of WORLD for long enough, one of them moving by 1 mm from look to look, or all spinning."""
    ready = False
    for k in range(LOOKS + 1):
        at = [tuple(b.X_WO.p.tolist()) for b in WORLD.movable]
        if moving is not None:
            at[moving] = (k * 1e-3, 0.0, 0.0)
        ready = resting.look(state_of(at, (0.0, 0.0, np.sin(k * spin / 2), np.cos(k * spin / 2))))
    return ready


def test_an_island_rests_only_as_a_whole() -> None:
    low, high, far, ball = range(4)
    stack = [(low, FIXED), (low, high), (far, FIXED), (ball, FIXED)]
    for moving, expected in ((None, [low, high, far, ball]), (high, [far, ball]), (ball, [low, high, far])):
        resting = Resting(WORLD, STEP)
        assert looked(resting, moving=moving)
        assert resting.islands(stack) == expected
        assert not resting.islands(stack)  # they are asleep
    resting = Resting(WORLD, STEP)
    looked(resting)
    assert resting.islands([*stack, (AWAKE, high)]) == [far, ball]


def test_a_spinning_sphere_rests_and_a_spinning_cube_does_not() -> None:
    resting = Resting(WORLD, STEP)
    assert looked(resting, spin=0.05)
    assert resting.islands([]) == [3]


def test_a_thing_with_joints_never_rests() -> None:
    class _Joint:
        parent, child = "low", "high"

    resting = Resting(replace(WORLD, joints=(_Joint(),)), STEP)  # type: ignore[arg-type]
    looked(resting)
    assert resting.islands([(0, FIXED), (1, 2)]) == [3]
