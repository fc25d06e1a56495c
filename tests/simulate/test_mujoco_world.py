"""The world that MuJoCo gets: names, meshes, friction of pairs, rotor inertia, damping and limits of joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from manipcli.control.command import JointCommand, Mode
from manipcli.core.errors import ManipcliError
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.description.elements import Inertial, Joint, JointLimits, Link, TransmissionTag
from manipcli.model.robot import Actuator, RobotModel
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.mesh_formats import binary_stl
from manipcli.shapes.primitives import Box, Geometry, Mesh, Shape, Sphere
from manipcli.simulate.engine import Engine, EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.simulate.engines.mujoco_friction import friction_pairs
from manipcli.simulate.engines.mujoco_shapes import THICKNESS, convex_parts

STEP, G = 1e-3, 9.81


def robot(*shapes: Shape, names: Sequence[str] = ("base", "slider"), friction: float = 1.0) -> RobotModel:
    """1 kg on a vertical slide."""
    solid = Inertial(1.0, Transform.identity(), frozen(np.eye(3) * 0.01))
    limits = JointLimits(-0.5, 0.5, 5.0, 50.0)
    at = Transform.of(xyz=(0.0, 0.0, 1.0))
    slide = Joint("slide", "prismatic", names[0], names[1], at, frozen((0.0, 0.0, 1.0)), limits)
    collisions = tuple(Geometry(Transform.identity(), shape) for shape in shapes)
    links = (Link(names[0], None, (), collisions), Link(names[1], solid, (), collisions))
    return RobotModel("bot", names[0], links, (slide,), (), (), (), Transform.identity(), "", friction=friction)


def body(name: str, shape: Shape, at: Sequence[float], **changes: object) -> Body:
    made = Body(
        name=name, kind="box", geometries=(Geometry(Transform.identity(), shape),), mass=0.5,
        X_OI=Transform.identity(), inertia=frozen(np.eye(3) * 1e-3), friction=0.5, rolling_friction=0.0,
        spinning_friction=0.0, restitution=0.0, fixed=False, X_WO=Transform.of(xyz=at), interior=None,
        size=frozen([0.1] * 3), centre=frozen(np.zeros(3)),
    )  # fmt: skip
    return replace(made, **changes)  # type: ignore[arg-type]


def opened(model: RobotModel, *bodies: Body, gravity: float = G, mode: Mode = "effort") -> Engine:
    scene = Scene(bodies, (), frozen((0.0, 0.0, -gravity)))
    engine = ENGINES["mujoco"].open(model, scene, EngineSettings(STEP, 1, np.zeros(1)))
    engine.write(commanded(mode))
    return engine


def commanded(mode: Mode, value: float = 0.0) -> JointCommand:
    command = JointCommand(1)
    command.obey([mode])
    command.effort[:] = value
    return command


def stepped(engine: Engine, steps: int) -> Engine:
    for _ in range(steps):
        engine.advance()
    return engine


@pytest.mark.parametrize("odd", ["base", "", "link0", "a/b c\n\"'<&>", "\u00fc" * 300])
def test_any_names_can_be_simulated(odd: str) -> None:
    """A body may have the name of a link, an empty one, or one that the engine itself would use."""
    table = body(odd, Box((1.0, 1.0, 0.2)), (2.0, 0.0, 0.4), fixed=True)
    engine = stepped(opened(robot(names=(odd, "slider")), table, body("block", Box((0.1,) * 3), (2.0, 0.0, 0.55))), 100)
    (contact,) = engine.contacts()
    assert {contact.a, contact.b} == {odd, "block"}


def test_links_of_the_robot_do_not_collide_with_each_other() -> None:
    engine = stepped(opened(robot(Box((0.4, 0.4, 3.0))), gravity=0.0), 10)
    assert engine.contacts() == ()
    assert engine.read().position[0] == 0.0


@pytest.mark.parametrize("reduction", [1.0, 10.0])
def test_the_inertia_of_a_rotor_is_added_to_the_load(reduction: float) -> None:
    """From rest, v = F t / (m + n^2 J)."""
    motor = Actuator("motor", rotor_inertia=0.02)
    tag = TransmissionTag("t", "SimpleTransmission", ("slide",), (1.0,), (0.0,), ("motor",), (reduction,))
    engine = opened(replace(robot(), actuators=(motor,), transmissions=(tag,)), gravity=0.0)
    engine.write(commanded("effort", 3.0))
    state = stepped(engine, 50).read()
    assert state.velocity[0] == pytest.approx(3.0 * 50 * STEP / (1.0 + reduction**2 * 0.02), rel=1e-9)


@pytest.mark.parametrize("damping", [5.0, 5e4])
def test_damping_slows_a_joint_and_is_stable_however_stiff(damping: float) -> None:
    """The end speed is F / b; before it, v = F / b (1 - (1 + h b / m)^-k): implicit Euler."""
    model = robot()
    model = replace(model, joints=(replace(model.joints[0], damping=damping),))
    engine = opened(model, gravity=0.0)
    engine.write(commanded("effort", 2.0))
    for k in (1, 20):
        state = stepped(engine, 1 if k == 1 else 19).read()
        expected = 2.0 / damping * (1.0 - (1.0 + STEP * damping) ** -k)
        assert state.velocity[0] == pytest.approx(expected, rel=1e-9)


def test_a_joint_stops_at_its_limit() -> None:
    engine = opened(robot())
    engine.write(commanded("effort", 30.0))
    state = stepped(engine, 1000).read()
    assert state.position[0] == pytest.approx(0.5, abs=1e-3)
    assert abs(state.velocity[0]) < 1e-3


def test_a_brake_holds_without_creeping() -> None:
    state = stepped(opened(robot(), mode="brake"), 2000).read()
    assert abs(state.position[0]) < 1e-6
    assert state.effort[0] == pytest.approx(G, rel=1e-6)


def test_friction_multiplies_for_every_pair() -> None:
    """By hand: 0.5 * 0.4; rolling and spinning friction times the other body's sliding friction, summed."""
    a = body("a", Sphere(0.1), (0.0, 0.0, 0.0), friction=0.5, rolling_friction=0.01)
    b = body("b", Sphere(0.1), (1.0, 0.0, 0.0), friction=0.4, rolling_friction=0.02, spinning_friction=0.03)
    fixed = [body(name, Sphere(0.1), (2.0, 0.0, 0.0), friction=0.0, fixed=True) for name in "cd"]
    pairs = {
        (one, two): (values, size) for one, two, values, size in friction_pairs(Scene((a, b, *fixed), (), a.inertia))
    }
    values, size = pairs["a", "b"]
    np.testing.assert_allclose(values, [0.2, 0.2, 0.015, 0.014, 0.014], rtol=1e-12)
    assert size == 6
    assert ("c", "d") not in pairs
    assert pairs["a", "c"][0] == [0.0] * 5


def _slides(mu: float, rolling: float, shape: Shape) -> Array:
    """Velocity and spin after 0.3 s of a body that starts 0.1 mm above a tilted table: 20 deg."""
    tilt = np.radians(20.0)
    normal = np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    table = body("table", Box((4.0, 4.0, 0.2)), -0.1 * normal, fixed=True, friction=1.0)
    table = replace(table, X_WO=Transform.of(xyz=-0.1 * normal, rpy=(0.0, tilt, 0.0)))
    ball = body(
        "ball", shape, (0.05 + 1e-4) * normal, friction=mu, rolling_friction=rolling, inertia=frozen(np.eye(3) * 5e-4)
    )
    model = replace(robot(), X_WB=Transform.of(xyz=(0.0, 5.0, 0.0)))
    state = stepped(opened(model, table, ball), 300).read()
    return np.array([state.body_linear[0] @ [np.cos(tilt), 0.0, -np.sin(tilt)], state.body_angular[0][1]])


def test_a_ball_rolls_slides_and_is_stopped_by_rolling_friction() -> None:
    """m = 0.5 kg, r = 0.05 m, I = 2/5 m r^2: rolling a = 5/7 g sin s; without friction a = g sin s and no spin; with
    rolling friction [m] above r tan s = 18 mm it stays."""
    along = G * np.sin(np.radians(20.0))
    speed, spin = _slides(0.8, 0.0, Sphere(0.05))
    assert speed == pytest.approx(5.0 / 7.0 * along * 0.3, rel=0.03)
    assert spin == pytest.approx(speed / 0.05, rel=0.01)
    speed, spin = _slides(0.0, 0.0, Sphere(0.05))
    assert speed == pytest.approx(along * 0.3, rel=0.03)
    assert abs(spin) < 0.02 * speed / 0.05
    speed, spin = _slides(0.8, 0.03, Sphere(0.05))
    assert abs(speed) < 0.01


@pytest.mark.parametrize("step", [5e-4, 1e-3, 2e-3, 4e-3])
def test_a_sliding_block_presses_steadily_whatever_the_physics_step(step: float) -> None:
    """N = m g cos s at every step, and v = g t (sin s - mu cos s)."""
    s, mu, seconds = np.radians(35.0), 0.4, 0.6
    normal = np.array([np.sin(s), 0.0, np.cos(s)])
    table, block = (
        replace(
            body(name, Box(size), (0.0, 0.0, 0.0), friction=friction, fixed=fixed),
            X_WO=Transform.of(xyz=height * normal, rpy=(0.0, s, 0.0)),
        )
        for name, size, height, friction, fixed in (
            ("table", (6.0, 1.0, 0.2), -0.1, 1.0, True),
            ("block", (0.2, 0.16, 0.1), 0.05, mu, False),
        )
    )
    scene = Scene((table, block), (), frozen((0.0, 0.0, -G)))
    model = replace(robot(), X_WB=Transform.of(xyz=(0.0, 5.0, 0.0)))
    engine = ENGINES["mujoco"].open(model, scene, EngineSettings(step, 1, np.zeros(1)))
    forces = []
    for _ in range(round(seconds / step)):
        engine.advance()
        forces.append(sum(contact.force for contact in engine.contacts()))
    np.testing.assert_allclose(forces[len(forces) // 2 :], 0.5 * G * np.cos(s), rtol=0.01)
    speed = float(engine.read().body_linear[0] @ [np.cos(s), 0.0, -np.sin(s)])
    assert speed == pytest.approx(G * seconds * (np.sin(s) - mu * np.cos(s)), rel=0.01)


def _stl(path: Path, points: Sequence[Sequence[float]], triangles: Sequence[Sequence[int]]) -> Mesh:
    path.write_bytes(binary_stl(np.array(points, dtype=float)[np.array(triangles)]))
    return Mesh(f"file://{path}", path, (0.001, 0.001, 0.001))


CUBE = [(x, y, z) for x in (-50.0, 50.0) for y in (-50.0, 50.0) for z in (-50.0, 50.0)]
FACES = [
    (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4),
    (1, 5, 7), (1, 7, 3),
]  # fmt: skip


def test_a_mesh_lies_as_the_box_that_it_is(tmp_path: Path) -> None:
    mesh = _stl(tmp_path / "cube.stl", CUBE, FACES)
    table = body("table", Box((1.0, 1.0, 0.2)), (2.0, 0.0, 0.4), fixed=True)
    states = [
        stepped(opened(robot(), table, body("cube", shape, (2.0, 0.0, 0.55))), 300)
        for shape in (Box((0.1, 0.1, 0.1)), mesh)
    ]
    for engine in states:
        (contact,) = engine.contacts()
        assert contact.force == pytest.approx(0.5 * G, rel=1e-3)
        assert len(contact.points) >= 3
        np.testing.assert_allclose(
            engine.read().body_position[0], [2.0, 0.0, 0.55], atol=3e-4
        )  # the contact grows over 0.3 mm


def test_a_mesh_of_several_objects_is_hollow_between_them(tmp_path: Path) -> None:
    """An OBJ has a hull for each object: a ball between two walls falls through; with one hull, it would lie on top."""
    lines = []
    for k, x in enumerate((-0.2, 0.2)):
        lines += [f"o wall{k}", *(f"v {x + a / 1000} {b / 1000} {c / 1000}" for a, b, c in CUBE)]
        lines += [f"f {a + 1 + 8 * k} {b + 1 + 8 * k} {c + 1 + 8 * k}" for a, b, c in FACES]
    path = tmp_path / "walls.obj"
    path.write_text("\n".join(lines) + "\n")
    mesh = Mesh(f"file://{path}", path)
    assert len(convex_parts(mesh)) == 2
    walls = body("walls", mesh, (2.0, 0.0, 0.5), fixed=True)
    engine = stepped(opened(robot(), walls, body("ball", Sphere(0.04), (2.0, 0.0, 0.6))), 300)
    assert engine.read().body_position[0][2] == pytest.approx(0.6 - G * 0.3**2 / 2, rel=0.01)


def test_a_flat_mesh_has_two_sides(tmp_path: Path) -> None:
    mesh = _stl(
        tmp_path / "sheet.stl", [(-100, -100, 0), (100, -100, 0), (100, 100, 0), (-100, 100, 0)], [(0, 1, 2), (0, 2, 3)]
    )
    (part,) = convex_parts(mesh)
    assert np.ptp(part[:, 2]) == pytest.approx(THICKNESS)
    sheet = body("sheet", mesh, (2.0, 0.0, 0.5), fixed=True)
    engine = stepped(opened(robot(), sheet, body("block", Box((0.1,) * 3), (2.0, 0.0, 0.551))), 300)
    assert engine.read().body_position[0][2] == pytest.approx(0.55, abs=1e-3)


def test_a_contact_that_begins_at_a_distance_of_zero_is_a_change() -> None:
    """Geoms that touch at exactly 0 have no force yet: the pair begins to touch in the next step."""
    table = body("table", Box((1.0, 1.0, 0.25)), (2.0, 0.0, 0.375), fixed=True)
    engine = stepped(opened(robot(), table, body("block", Box((0.25,) * 3), (2.0, 0.0, 0.625))), 1)
    assert engine.contacts() == ()
    engine.advance()
    assert engine.touches_changed()
    assert [(contact.a, contact.b) for contact in engine.contacts()] == [("block", "table")]
    assert not engine.touches_changed()


def test_a_robot_whose_joints_are_not_in_depth_first_order_is_an_error() -> None:
    """Without the check, commands would reach other joints: MuJoCo numbers joints depth-first."""
    model = robot()
    solid, slide = model.links[1].inertial, model.joints[0]
    joints = tuple(
        replace(slide, name=name, parent=parent, child=child)
        for name, parent, child in (("a", "base", "A"), ("b", "base", "B"), ("c", "A", "C"))
    )
    links = (model.links[0], *(Link(name, solid, (), ()) for name in "ABC"))
    settings = EngineSettings(STEP, 1, np.zeros(3))
    with pytest.raises(ManipcliError, match="a different robot"):
        ENGINES["mujoco"].open(replace(model, links=links, joints=joints), Scene((), (), frozen(np.zeros(3))), settings)
