"""What every engine promises, and what those with physics promise beyond that; laws with closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from weakref import WeakKeyDictionary

import numpy as np
import pytest

from manipcli.control.command import JointCommand, Mode
from manipcli.core.errors import InvalidInput
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.description.elements import Inertial, Joint, JointLimits, JointType, Link, Mimic
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Box, Geometry, Shape, Sphere
from manipcli.simulate.engine import Engine, EngineMember, EngineSettings
from manipcli.simulate.engines import ENGINES

STEP = 1e-3
G = 9.81

every_engine = pytest.mark.parametrize("member", list(ENGINES), ids=lambda member: member.name)
with_physics = pytest.mark.parametrize(
    "member", [member for member in ENGINES if member.physics == "full"], ids=lambda member: member.name
)
every_interface = pytest.mark.parametrize("interface", ["effort", "velocity", "position"])


def inertial(mass: float, com: Sequence[float] = (0.0, 0.0, 0.0), moments: Sequence[float] = (0.01,) * 3) -> Inertial:
    return Inertial(mass, Transform.of(xyz=com), frozen(np.diag(moments)))


def joint(
    name: str,
    child: str,
    *,
    parent: str = "base",
    kind: JointType = "revolute",
    axis: Sequence[float] = (0.0, 1.0, 0.0),
    at: Sequence[float] = (0.0, 0.0, 1.0),
    effort: float = 50.0,
    mimic: Mimic | None = None,
) -> Joint:
    limits = JointLimits(-4.0, 4.0, 5.0, effort)
    return Joint(name, kind, parent, child, Transform.of(xyz=at), frozen(axis), limits, mimic)


def robot(joints: Sequence[Joint], inertials: Sequence[Inertial | None]) -> RobotModel:
    links = (Link("base", inertial(1.0), (), ()),)
    links += tuple(Link(j.child, i, (), ()) for j, i in zip(joints, inertials, strict=True))
    return RobotModel("testbot", "base", links, tuple(joints), (), (), (), Transform.identity(), "")


def pendulum(**changes: object) -> RobotModel:
    """A point-like mass of 2 kg, 0.5 m from a horizontal axis; q = 0 is horizontal, along +x."""
    return robot([joint("swing", "bob", **changes)], [inertial(2.0, (0.5, 0.0, 0.0))])  # type: ignore[arg-type]


def arm() -> RobotModel:
    """Three joints, one of them sliding, and one that mimics."""
    return robot(
        [
            joint("a", "link_a", axis=(0.0, 0.0, 1.0), at=(0.0, 0.0, 0.5)),
            joint("b", "link_b", parent="link_a", at=(0.3, 0.0, 0.0)),
            joint("c", "link_c", parent="link_b", kind="prismatic", axis=(1.0, 0.0, 0.0), at=(0.3, 0.0, 0.0)),
            joint("d", "link_d", parent="link_a", at=(0.0, 0.3, 0.0), mimic=Mimic("b", -2.0, 0.1)),
        ],
        [inertial(1.0, (0.1, 0.0, 0.0)), inertial(0.8, (0.1, 0.02, 0.0)), inertial(0.3), inertial(0.2, (0.05, 0, 0))],
    )


def body(
    name: str,
    shape: Shape,
    at: Sequence[float],
    *,
    rpy: Sequence[float] = (0.0, 0.0, 0.0),
    mass: float = 1.0,
    fixed: bool = False,
    X_OI: Transform | None = None,
    moments: Sequence[float] = (0.01,) * 3,
    friction: float = 0.5,
) -> Body:
    return Body(
        name=name, kind="box", geometries=(Geometry(Transform.identity(), shape),), mass=0.0 if fixed else mass,
        X_OI=X_OI or Transform.identity(), inertia=frozen(np.diag(moments)), friction=friction, rolling_friction=0.0,
        spinning_friction=0.0, restitution=0.0, fixed=fixed, X_WO=Transform.of(xyz=at, rpy=rpy), interior=None,
        size=frozen([0.1, 0.1, 0.1]), centre=frozen([0.0, 0.0, 0.0]),
    )  # fmt: skip


def scene(*bodies: Body, gravity: float = G) -> Scene:
    return Scene(bodies, (), frozen([0.0, 0.0, -gravity]))


FALLING = scene(body("ball", Sphere(0.05), (2.0, 0.0, 1.0)), body("brick", Box((0.1, 0.2, 0.3)), (3.0, 0.0, 2.0)))

Opens = Callable[..., Engine]


COMMANDS: WeakKeyDictionary[Engine, JointCommand] = WeakKeyDictionary()
"""What an engine is told, in the modes that it was opened for."""


def write(engine: Engine, value: Array, position: Array | None = None, velocity: Array | None = None) -> None:
    """Commands `value` in the mode of each joint; the references are `position` and `velocity`."""
    command = COMMANDS[engine]
    for k, mode in enumerate(command.modes):
        if mode in ("position", "velocity", "effort"):
            getattr(command, mode)[k] = value[k]
    command.reference_position[:] = value if position is None else position
    command.reference_velocity[:] = 0.0 if velocity is None else velocity
    engine.write(command)


@pytest.fixture
def opens() -> Iterator[Opens]:
    """Opens engines that are closed after the test."""
    opened: list[Engine] = []

    def open_engine(
        member: EngineMember,
        model: RobotModel,
        world: Scene | None = None,
        *,
        modes: tuple[Mode, ...] | None = None,
        start: Sequence[float] | None = None,
        substeps: int = 1,
    ) -> Engine:
        n = len(model.joint_names)
        default: list[Mode] = ["free" if j.mimic is not None else "effort" for j in model.moving_joints]
        settings = EngineSettings(STEP, substeps, np.zeros(n) if start is None else frozen(start))
        engine = member.open(model, world or scene(), settings)
        opened.append(engine)
        COMMANDS[engine] = JointCommand(n)
        COMMANDS[engine].obey(modes or default)
        return engine

    yield open_engine
    for engine in opened:
        engine.close()


def copied(state: WorldState) -> list[Array]:
    return [
        np.array(a)
        for a in (
            state.position, state.velocity, state.effort, state.body_position, state.body_quat_xyzw, state.body_linear,
            state.body_angular,
        )
    ]  # fmt: skip


def run(engine: Engine, ticks: int, control: Callable[[int, WorldState], Array] | None = None) -> list[list[Array]]:
    """The states before each tick; `control` gives the command, which also stands for the reference."""
    states = []
    for k in range(ticks):
        state = engine.read()
        states.append(copied(state))
        command = np.zeros(len(state.position)) if control is None else control(k, state)
        write(engine, command)
        engine.advance()
    return states


# -- every engine


@every_engine
def test_what_is_read_first_is_the_start(member: EngineMember, opens: Opens) -> None:
    start = [0.3, -0.4, 0.05, 0.9]
    state = opens(member, arm(), FALLING, start=start).read()
    np.testing.assert_array_equal(state.position, start)
    assert not state.velocity.any()
    np.testing.assert_allclose(state.body_position, [b.X_WO.p for b in FALLING.movable], atol=1e-15)
    np.testing.assert_allclose(state.body_quat_xyzw, [b.X_WO.quat_xyzw for b in FALLING.movable], atol=1e-15)
    assert not state.body_linear.any()
    assert not state.body_angular.any()


def wave(k: int, state: WorldState) -> Array:
    return np.array([0.8 * math.sin(0.01 * k), -0.5, 0.3 * math.cos(0.02 * k), 0.0])


@every_engine
def test_the_same_inputs_give_the_same_states_to_the_last_bit(member: EngineMember, opens: Opens) -> None:
    one, two = (run(opens(member, arm(), FALLING), 200, wave) for _ in range(2))
    for a, b in zip(one, two, strict=True):
        for left, right in zip(a, b, strict=True):
            np.testing.assert_array_equal(left, right)


@every_engine
def test_two_engines_do_not_meet(member: EngineMember, opens: Opens) -> None:
    alone = run(opens(member, arm(), FALLING), 100, wave)
    first, other = opens(member, arm(), FALLING), opens(member, pendulum())
    together = []
    for k in range(100):
        together.append(run(first, 1, lambda _, state, k=k: wave(k, state))[0])  # type: ignore[misc]
        run(other, 1)
    for a, b in zip(alone, together, strict=True):
        for left, right in zip(a, b, strict=True):
            np.testing.assert_array_equal(left, right)


@every_engine
def test_closing_twice_is_fine_and_leaves_other_engines_alone(member: EngineMember, opens: Opens) -> None:
    kept, closed = opens(member, arm()), opens(member, arm())
    closed.close()
    closed.close()
    kept.advance()
    assert np.isfinite(kept.read().position).all()


@every_engine
def test_a_mimic_joint_follows_its_driver(member: EngineMember, opens: Opens) -> None:
    engine = opens(member, arm(), scene(gravity=0.0), start=[0.0, 0.2, 0.0, -0.3])

    def push(k: int, state: WorldState) -> Array:
        return np.array([0.0, 0.5 * math.sin(0.03 * k), 0.0, 0.0])

    for position, velocity, *_ in run(engine, 400, push):
        assert position[3] == pytest.approx(-2.0 * position[1] + 0.1, abs=1e-9)
        assert velocity[3] == pytest.approx(-2.0 * velocity[1], abs=1e-6)


# -- the ideal engine


@every_interface
def test_the_ideal_engine_makes_references_come_true_at_once(interface: Mode, opens: Opens) -> None:
    engine = opens(ENGINES["kinematic"], pendulum(), FALLING, modes=(interface,))
    before = copied(engine.read())
    write(engine, np.array([7.0]), np.array([0.4]), np.array([-1.5]))
    state = engine.read()
    assert (state.position[0], state.velocity[0]) == (0.4, -1.5)
    engine.advance()
    for _ in range(2):  # whoever commands velocities has said where they lead
        expected = 0.4 if interface == "velocity" else 0.4 - 1.5 * STEP
        assert engine.read().position[0] == pytest.approx(expected, abs=1e-15)
    for then, now in zip(before[3:], copied(state)[3:], strict=True):
        np.testing.assert_array_equal(then, now)
    assert engine.contacts() == ()


# -- engines with physics: joints


@with_physics
def test_a_body_falls_by_half_g_t_squared(member: EngineMember, opens: Opens) -> None:
    """Semi-implicit Euler falls g t (t + h) / 2: the closed form to the first order in the step h."""
    states = run(opens(member, pendulum(), FALLING), 401)
    t = 400 * STEP
    fallen = FALLING.movable[0].X_WO.p[2] - states[400][3][0, 2]
    assert fallen == pytest.approx(G * t * (t + STEP) / 2, rel=1e-9)
    assert fallen == pytest.approx(G * t * t / 2, rel=2 * STEP / t)
    assert states[400][5][0, 2] == pytest.approx(-G * t, rel=1e-9)


@with_physics
def test_a_pendulum_keeps_its_energy(member: EngineMember, opens: Opens) -> None:
    """Released at rest from the horizontal: E = (m l^2 + I) w^2 / 2 - m g l sin q stays 0, in units of m g l."""
    m, length, moment = 2.0, 0.5, 0.01
    states = run(opens(member, pendulum()), 3000)
    q = np.array([s[0][0] for s in states])
    w = np.array([s[1][0] for s in states])
    energy = (m * length**2 + moment) * w**2 / 2 - m * G * length * np.sin(q)
    assert q.max() > 3.0  # it swung through
    # Semi-implicit Euler wobbles by the order of w h; it must not drift.
    assert np.abs(energy).max() < 0.01 * m * G * length


@with_physics
def test_a_pendulum_swings_with_its_period(member: EngineMember, opens: Opens) -> None:
    """About the vertical with small amplitude A: T = 2 pi sqrt((m l^2 + I) / (m g l)) (1 + A^2 / 16)."""
    m, length, moment, amplitude = 2.0, 0.5, 0.01, 0.1
    engine = opens(member, pendulum(), start=[math.pi / 2 + amplitude])
    q = np.array([s[0][0] for s in run(engine, 6000)]) - math.pi / 2
    k = np.flatnonzero((q[:-1] < 0.0) & (q[1:] >= 0.0))
    crossings = (k - q[k] / (q[k + 1] - q[k])) * STEP
    period = 2 * math.pi * math.sqrt((m * length**2 + moment) / (m * G * length)) * (1 + amplitude**2 / 16)
    assert np.diff(crossings).mean() == pytest.approx(period, rel=1e-4)


@with_physics
def test_a_fixed_joint_adds_masses_and_inertias_however_they_are_shared(member: EngineMember, opens: Opens) -> None:
    """The mass on the moved link, on a link fixed to it below a massless frame, or half on each: the same pendulum."""

    def shared(own: float, tip: float) -> RobotModel:
        moments = (0.02, 0.03, 0.04)
        at = Transform.of(xyz=(0.2, 0.1, 0.0), rpy=(0.0, 0.0, 0.5))
        joints = [
            joint("swing", "bob", at=(0.0, 0.0, 1.0)),
            replace(joint("f", "frame", parent="bob"), type="fixed", X_PJ=at),
            replace(joint("g", "tip", parent="frame"), type="fixed", X_PJ=at.inverse()),
        ]

        def part(share: float) -> Inertial | None:
            return inertial(2.0 * share, (0.5, 0.0, 0.0), [share * each for each in moments]) if share else None

        return robot(joints, [part(own), None, part(tip)])

    def control(k: int, _: WorldState) -> Array:
        return np.array([3.0 * math.sin(0.01 * k)])

    runs = [run(opens(member, shared(*each)), 300, control) for each in ((1.0, 0.0), (0.0, 1.0), (0.5, 0.5))]
    for other in runs[1:]:
        assert abs(other[-1][0][0] - runs[0][-1][0][0]) < 1e-9
    assert abs(runs[0][-1][0][0]) > 0.3


@with_physics
@pytest.mark.parametrize("torque", [10.0, 50.0])
def test_effort_accelerates_by_the_inertia(member: EngineMember, opens: Opens, torque: float) -> None:
    """Without gravity and from rest: w = tau t / (m l^2 + I)."""
    engine = opens(member, pendulum(), scene(gravity=0.0))
    states = run(engine, 101, lambda *_: np.array([torque]))
    assert states[100][1][0] == pytest.approx(torque * 100 * STEP / (2.0 * 0.25 + 0.01), rel=1e-6)
    assert states[100][2][0] == torque  # the effort that is read is the effort that acts


@with_physics
@pytest.mark.parametrize("substeps", [2, 5])
def test_an_effort_acts_in_every_physics_step_of_a_control_tick(
    member: EngineMember, opens: Opens, substeps: int
) -> None:
    engine = opens(member, pendulum(), scene(gravity=0.0), substeps=substeps)
    states = run(engine, 21, lambda *_: np.array([10.0]))
    assert states[20][1][0] == pytest.approx(10.0 * 20 * substeps * STEP / (2.0 * 0.25 + 0.01), rel=1e-6)


@with_physics
@every_interface
def test_joints_do_not_jump(member: EngineMember, opens: Opens, interface: Mode) -> None:
    """Position changes are velocities times the step, whatever is commanded."""
    engine = opens(member, pendulum(), modes=(interface,))
    states = run(engine, 500, lambda k, _: np.array([(-1.0) ** (k // 100) * 2.0]))
    q = np.array([s[0][0] for s in states])
    w = np.array([s[1][0] for s in states])
    np.testing.assert_allclose(np.diff(q), w[1:] * STEP, atol=1e-9)
    assert np.abs(q).max() > 0.01


@with_physics
def test_a_velocity_interface_reaches_its_velocity_within_the_effort_limit(member: EngineMember, opens: Opens) -> None:
    engine = opens(member, pendulum(effort=4.0), scene(gravity=0.0), modes=("velocity",))
    states = run(engine, 1000, lambda *_: np.array([1.0]))
    w = np.array([s[1][0] for s in states])
    assert w[-1] == pytest.approx(1.0, abs=1e-3)
    # 4 N m on 0.51 kg m2 give no more than 7.84 rad/s2, so 1 rad/s takes 0.1275 s.
    assert np.diff(w).max() <= 4.0 / 0.51 * STEP * 1.001
    assert w[120] < 1.0
    assert max(abs(s[2][0]) for s in states) <= 4.0 * 1.001


@with_physics
def test_a_position_interface_reaches_its_position_within_velocity_and_effort(
    member: EngineMember, opens: Opens
) -> None:
    engine = opens(member, pendulum(), scene(gravity=0.0), modes=("position",))
    states = run(engine, 2000, lambda *_: np.array([1.2]))
    assert states[-1][0][0] == pytest.approx(1.2, abs=1e-3)
    assert max(abs(s[1][0]) for s in states) <= 5.0 * 1.05
    assert max(abs(s[2][0]) for s in states) <= 50.0 * 1.001


@with_physics
def test_a_joint_held_by_too_weak_a_motor_sinks(member: EngineMember, opens: Opens) -> None:
    """Gravity asks 2 kg * 9.81 * 0.5 m = 9.8 N m."""
    weak = run(opens(member, pendulum(effort=5.0), modes=("velocity",)), 300)
    strong = run(opens(member, pendulum(effort=20.0), modes=("velocity",)), 300)
    assert weak[-1][0][0] > 0.1
    assert abs(strong[-1][0][0]) < 1e-3


MIMICS = [
    ("revolute", (0.0, 1.0, 0.0), -2.0, 0.1),
    ("prismatic", (0.0, 0.0, 1.0), -2.0, 0.1),
    ("prismatic", (0.0, 0.0, 1.0), 0.5, -0.05),
    ("revolute", (0.0, 1.0, 0.0), 1.0, 0.0),
]


@with_physics
@pytest.mark.parametrize(("kind", "axis", "multiplier", "offset"), MIMICS)
def test_mimic_multiplier_and_offset_hold_under_load(
    member: EngineMember, opens: Opens, kind: JointType, axis: tuple[float, ...], multiplier: float, offset: float
) -> None:
    model = robot(
        [
            joint("drive", "link_a", kind=kind, axis=axis),
            joint("follow", "link_b", kind=kind, axis=axis, mimic=Mimic("drive", multiplier, offset)),
        ],
        [inertial(1.0, (0.1, 0.0, 0.0)), inertial(1.5, (0.2, 0.0, 0.0))],
    )
    engine = opens(member, model, start=[0.0, offset])

    def swing(k: int, state: WorldState) -> Array:
        error = 0.3 * math.sin(2 * math.pi * k * STEP) - state.position[0]
        return np.array([600.0 * error - 40.0 * state.velocity[0], 0.0])

    for position, velocity, *_ in run(engine, 1000, swing):
        assert position[1] == pytest.approx(multiplier * position[0] + offset, abs=1e-6)
        assert velocity[1] == pytest.approx(multiplier * velocity[0], abs=1e-6)


@with_physics
def test_a_mimic_joint_pulls_on_its_driver(member: EngineMember, opens: Opens) -> None:
    """Two weights on a rope with a pulley of ratio r: a = -g (m1 + r m2) / (m1 + r^2 m2)."""
    r, m1, m2 = -2.0, 1.0, 1.5
    up = (0.0, 0.0, 1.0)
    model = robot(
        [
            joint("drive", "link_a", kind="prismatic", axis=up),
            joint("follow", "link_b", kind="prismatic", axis=up, mimic=Mimic("drive", r)),
        ],
        [inertial(m1), inertial(m2)],
    )
    states = run(opens(member, model), 101)
    assert states[100][1][0] == pytest.approx(-G * (m1 + r * m2) / (m1 + r**2 * m2) * 100 * STEP, rel=1e-6)


# -- engines with physics: bodies


@with_physics
def test_the_origin_of_a_turning_body_circles_its_centre_of_mass(member: EngineMember, opens: Opens) -> None:
    """A ball sets a rod spinning; then, free of forces, p_WO = p_WI - R(t) p_OI with constant velocity and spin.

    The rod is symmetric about the axis that it turns about, so the spin is constant: the closed form of a free body.
    """
    offset = Transform.of(xyz=(0.2, 0.05, 0.0), rpy=(0.0, 0.0, 0.7))
    rod = body("rod", Box((0.6, 0.02, 0.02)), (2.0, 0.0, 1.0), mass=0.5, X_OI=offset, moments=(0.02, 0.02, 0.03))
    rod = replace(rod, geometries=(Geometry(offset, Box((0.6, 0.02, 0.02))),))
    # It starts inside the rod's far end, whose push sets the rod off.
    ball = body("ball", Sphere(0.05), (2.42, 0.16, 1.0), mass=0.5)
    engine = opens(member, pendulum(), scene(rod, ball, gravity=0.0))
    states = run(engine, 500)[200:]
    assert engine.contacts() == ()
    p = np.array([s[3][0] for s in states])
    quat = np.array([s[4][0] for s in states])
    linear = np.array([s[5][0] for s in states])
    spin = np.array([s[6][0] for s in states])
    assert abs(spin[0, 2]) > 0.2
    np.testing.assert_allclose(spin, np.broadcast_to(spin[0], spin.shape), atol=1e-3 * abs(spin[0, 2]))
    turned = 2.0 * np.unwrap(np.arctan2(quat[:, 2], quat[:, 3]), period=math.pi)
    t = np.arange(len(p)) * STEP
    np.testing.assert_allclose(turned, turned[0] + spin[0, 2] * t, atol=2e-3)
    arm_WO = -np.stack(
        [
            np.cos(turned) * 0.2 - np.sin(turned) * 0.05,
            np.sin(turned) * 0.2 + np.cos(turned) * 0.05,
            np.zeros(len(t)),
        ],
        axis=1,
    )
    centre = p - arm_WO
    drift = (centre[-1] - centre[0]) / t[-1]
    np.testing.assert_allclose(centre, centre[0] + t[:, None] * drift, atol=1e-5)
    np.testing.assert_allclose(linear, drift + np.cross(spin, arm_WO), atol=1e-4)
    np.testing.assert_allclose(np.gradient(p, STEP, axis=0)[1:-1], linear[1:-1], atol=2e-3)


@with_physics
def test_impacts_keep_the_momentum(member: EngineMember, opens: Opens) -> None:
    """Two balls that start inside each other fly apart, and one hits a third: m v sums to 0, and energy does not grow.

    The tolerance is that of the solvers, which end at a residual, relative to the momentum that is exchanged.
    """
    masses = np.array([0.3, 0.5, 0.8])
    places = (2.0, 2.08, 2.3)
    balls = [
        body(f"ball{k}", Sphere(0.05), (x, 0.0, 1.0), mass=m, moments=(0.4 * m * 0.05**2,) * 3)
        for k, (x, m) in enumerate(zip(places, masses, strict=True))
    ]
    states = run(opens(member, pendulum(), scene(*balls, gravity=0.0)), 2000)
    velocities = np.array([state[5] for state in states])
    momenta = masses[:, None] * velocities
    before = next(k for k, v in enumerate(velocities) if abs(v[2, 0]) > 0.0) - 1
    assert abs(velocities[before, 1, 0]) > 0.05
    assert abs(velocities[-1, 2, 0]) > 0.02, "the third was hit"
    exchanged = np.abs(momenta).max()
    assert np.abs(momenta.sum(axis=1)).max() < 1e-6 * exchanged
    energy = (masses[:, None] * velocities**2).sum(axis=(1, 2)) / 2
    assert energy[-1] < energy[before] * (1 + 1e-9)


@with_physics
@pytest.mark.parametrize(("slope", "sticks"), [(20.0, True), (26.3, True), (27.9, False), (35.0, False)])
def test_a_block_on_a_slope_slides_beyond_the_angle_of_friction(
    member: EngineMember, opens: Opens, slope: float, sticks: bool
) -> None:
    """Friction coefficients multiply: 0.8 * 0.64 = 0.512 = tan 27.1 deg; beyond, a = g (sin s - mu cos s)."""
    s, mu = math.radians(slope), 0.512
    normal = np.array([math.sin(s), 0.0, math.cos(s)])
    ramp = body("ramp", Box((4.0, 1.0, 0.2)), -0.1 * normal, rpy=(0.0, s, 0.0), fixed=True, friction=0.8)
    half = 0.05
    block = body(
        "block", Box((0.2, 0.2, 2 * half)), half * normal, rpy=(0.0, s, 0.0), mass=1.0, friction=0.64,
        moments=(0.0042, 0.0042, 0.0067),
    )  # fmt: skip
    model = replace(pendulum(), X_WB=Transform.of(xyz=(0.0, 5.0, 0.0)))
    states = run(opens(member, model, scene(ramp, block)), 601)
    down = np.array([math.cos(s), 0.0, -math.sin(s)])
    v = np.array([state[5][0] @ down for state in states])
    if sticks:
        assert abs(v[200:]).max() < 5e-3
    else:
        a = (v[600] - v[200]) / 0.4
        assert a == pytest.approx(G * (math.sin(s) - mu * math.cos(s)), rel=0.05)


@with_physics
def test_contacts_are_sorted_by_name_whatever_the_order_of_the_bodies(member: EngineMember, opens: Opens) -> None:
    table = body("table", Box((1.0, 1.0, 0.2)), (2.0, 0.0, 0.4), fixed=True)
    blocks = [body(name, Box((0.1, 0.1, 0.1)), (1.8 + 0.2 * k, 0.0, 0.55)) for k, name in enumerate("zma")]
    engine = opens(member, pendulum(), scene(blocks[0], table, *blocks[1:]))
    run(engine, 50)
    found = [contact[:2] for contact in engine.contacts()]
    assert found == [("a", "table"), ("m", "table"), ("table", "z")]


@with_physics
@pytest.mark.parametrize("fixed", [True, False])
def test_what_cannot_move_does_not_touch_each_other(fixed: bool, member: EngineMember, opens: Opens) -> None:
    """A base and a foot that is fixed to it stand in a table, a block on the foot, and the bob rests on a pile."""
    cube = Geometry(Transform.identity(), Box((0.2, 0.2, 0.2)))
    end = Geometry(Transform.of(xyz=(0.5, 0.0, 0.0)), Box((0.1, 0.1, 0.1)))
    links = tuple(Link(name, inertial(1.0), (), (cube,)) for name in ("base", "foot"))
    links += (Link("bob", inertial(1.0, (0.5, 0.0, 0.0)), (), (end,)),)
    joints = (joint("swing", "bob", at=(0.0, 0.0, 0.0)), replace(joint("f", "foot", at=(0.0, 1.0, 0.0)), type="fixed"))
    model = RobotModel("bot", "base", links, joints, (), (), (), Transform.identity(), "")
    table = body("table", Box((4.0, 4.0, 0.2)), (0.0, 0.0, -0.19), fixed=True)
    pile = body("pile", Box((0.2, 0.2, 0.04)), (0.5, 0.0, -0.07), mass=50.0, fixed=fixed)
    engine = opens(member, model, scene(table, pile, body("block", Box((0.1, 0.1, 0.1)), (0.0, 1.0, 0.15))))
    run(engine, 50)
    found = {contact[:2] for contact in engine.contacts()}
    assert found == {("block", "robot/foot"), ("pile", "robot/bob")} | (set() if fixed else {("pile", "table")})


@with_physics
def test_contacts_carry_the_weight_and_are_named(member: EngineMember, opens: Opens) -> None:
    table = body("table", Box((1.0, 1.0, 0.2)), (2.0, 0.0, 0.4), fixed=True)
    block = body("block", Box((0.2, 0.2, 0.1)), (2.0, 0.0, 0.55), mass=1.5, moments=(0.01, 0.01, 0.01))
    engine = opens(member, pendulum(), scene(table, block))
    run(engine, 300)
    (contact,) = engine.contacts()
    assert (contact.a, contact.b) == ("block", "table")
    assert contact.force == pytest.approx(1.5 * G, rel=0.02)
    assert abs(contact.distance) < 1e-3


@with_physics
def test_what_the_robot_touches_is_named_by_its_link(member: EngineMember, opens: Opens) -> None:
    model = robot([joint("slide", "pad", kind="prismatic", axis=(1.0, 0.0, 0.0))], [inertial(1.0)])
    pad = replace(model.links[1], collisions=(Geometry(Transform.identity(), Box((0.1, 0.1, 0.1))),))
    model = replace(model, links=(model.links[0], pad))
    wall = body("wall", Box((0.1, 1.0, 1.0)), (0.2, 0.0, 1.0), fixed=True)
    engine = opens(member, model, scene(wall))
    run(engine, 800, lambda *_: np.array([5.0]))
    (contact,) = engine.contacts()
    assert (contact.a, contact.b) == ("robot/pad", "wall")
    assert contact.force == pytest.approx(5.0, rel=0.02)
    run(engine, 3, lambda *_: np.array([5.0]))
    assert not engine.touches_changed()
    run(engine, 2, lambda *_: np.array([40.0]))
    assert engine.touches_changed(), "a knock is seen although it touches nothing else"


# -- engines with physics: robots that they do not hold


def chain(count: int) -> RobotModel:
    joints = [
        joint(f"j{k}", f"l{k}", parent="base" if k == 0 else f"l{k - 1}", at=(0.0, 0.0, 0.01)) for k in range(count)
    ]
    return robot(joints, [inertial(0.1)] * count)


def test_bullet_holds_127_joints_and_says_so_of_128(opens: Opens) -> None:
    member = ENGINES["pybullet"]
    assert member.refuses(chain(127), scene(), None) == ()
    assert np.isfinite(opens(member, chain(127)).read().position).all()
    ((finding, _),) = member.refuses(chain(128), scene(), None)
    assert "128 joints" in finding.message
    with pytest.raises(InvalidInput, match="128 joints"):
        opens(member, chain(128))


def test_bullet_refuses_a_joint_that_moves_no_mass(opens: Opens) -> None:
    model = robot([joint("a", "x"), joint("b", "y", parent="x")], [inertial(1.0), None])
    ((finding, _),) = ENGINES["pybullet"].refuses(model, scene(), None)
    assert finding.message.startswith("link 'y' has no mass")
    with pytest.raises(InvalidInput, match=r"link 'y' has no mass .* moved by joint 'b'"):
        opens(ENGINES["pybullet"], model)
    assert ENGINES["kinematic"].refuses(model, scene(), None) == ()


@with_physics
def test_moments_written_with_few_digits_are_held(member: EngineMember, opens: Opens) -> None:
    """One may exceed the sum of the others by a hundredth of it; the engine gets the nearest that a body can have."""
    rounded = Inertial(1.7, Transform.of(rpy=(0.3, 0.2, 0.1)), frozen(np.diag([0.003, 0.0236, 0.0268])))
    model = robot([joint("a", "x")], [rounded])
    opens(member, model)


def test_what_bullet_holds_is_read_back(tmp_path: Path) -> None:
    """The comparison is silent about the robot that was loaded, and names every way in which another one differs."""
    import pybullet as p

    from manipcli.model.normalised_urdf import engine_urdf
    from manipcli.simulate.engines.pybullet_readback import differences

    skew = Inertial(1.0, Transform.of(xyz=(0.1, 0.2, 0.0), rpy=(0.3, 0.2, 0.1)), frozen(np.diag([0.02, 0.03, 0.04])))
    model = robot([joint("a", "x"), joint("b", "y", parent="x")], [skew, inertial(0.5)])
    ball = (Geometry(Transform.identity(), Sphere(0.1)),)
    model = replace(model, links=(*model.links[:2], replace(model.links[2], collisions=ball)))
    file = tmp_path / "robot.urdf"
    file.write_text(engine_urdf(model, tmp_path))
    client = p.connect(p.DIRECT)
    try:
        loaded = p.loadURDF(str(file), useFixedBase=True, flags=p.URDF_USE_INERTIA_FROM_FILE, physicsClientId=client)
        links = {-1: "base", 0: "x", 1: "y"}

        def told(links_of: tuple[Link, ...] = model.links, joints: tuple[Joint, ...] = model.joints) -> str:
            other = replace(model, links=links_of, joints=joints)
            return "; ".join(differences(p, client, loaded, other, links))

        base, x, y = model.links
        assert told() == ""
        assert "'y' has 1 collision shapes instead of 0" in told((base, x, replace(y, collisions=())))
        assert "'y' has a mass of 0.5 kg instead of 0.6 kg" in told((base, x, replace(y, inertial=inertial(0.6))))
        assert "'y' has its centre of mass" in told((base, x, replace(y, inertial=inertial(0.5, (0.0, 0.1, 0.0)))))
        turned = replace(skew, X_LI=Transform.of(xyz=(0.1, 0.2, 0.0)))
        assert "'x' has other moments" in told((base, replace(x, inertial=turned), y))
        tight = replace(model.joints[1], limits=JointLimits(-1.0, 4.0, 5.0, 50.0))
        assert "'b' has a lower limit of -4 instead of -1" in told(joints=(model.joints[0], tight))
    finally:
        p.disconnect(client)
