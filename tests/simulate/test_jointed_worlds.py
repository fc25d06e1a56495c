"""Laws of things with joints, in both engines: springs, dampers, dry friction, end stops, and what is placed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from manipcli.core.geometry import Array, Transform
from manipcli.description.packages import Packages
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState, joint_positions
from manipcli.scene.build_scene import build_scene
from manipcli.scene.joint_inertia import moved_inertia
from manipcli.scene.scene import Scene
from manipcli.simulate.engine import Engine, EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.task.robot_file import read_robot
from manipcli.task.vocabulary import task_spec

ROOT = Path(__file__).parents[2]
STEP = 1e-3
Open = Callable[..., tuple[Scene, Engine]]


@pytest.fixture(scope="module")
def robot() -> RobotModel:
    return read_robot(ROOT / "robots" / "differential_wrist" / "robot.yaml")[1]


@pytest.fixture(params=["pybullet", "mujoco"])
def world(request: pytest.FixtureRequest, robot: RobotModel) -> Iterator[Open]:
    pytest.importorskip(request.param)
    opened: list[Engine] = []

    def make(twists: Array | None = None, gravity: float = -9.81, **bodies: Any) -> tuple[Scene, Engine]:
        data = {"task": "t", "robot": "r", "controllers": "c", "steps": [{"wait": "1 s"}], "scene": bodies}
        data["simulation"] = {"gravity": [0, 0, gravity]}
        packages = Packages(ROOT / "tasks" / "objects" / "t.yaml")
        scene = build_scene(task_spec().model_validate(data), packages=packages)
        start = np.zeros(len(robot.joint_names))
        opened.append(ENGINES[request.param].open(robot, scene, EngineSettings(STEP, 1, start, twists=twists)))
        return scene, opened[-1]

    yield make
    for engine in opened:
        engine.close()


def thing(name: str, joint: str, fixed: bool = True, **values: Any) -> dict[str, Any]:
    return {
        "urdf": {"file": f"{name}.urdf"}, "fixed": fixed, "pose": {"xyz": [3, 0, 1]},
        "joints": {joint: {"damping": 0, "friction": 0} | values},
    }  # fmt: skip


def motion(scene: Scene, engine: Engine, ticks: int) -> Array:
    """Positions of the first joint at each tick."""
    found = np.empty(ticks)
    for k in range(ticks):
        found[k] = joint_positions(scene, engine.read(velocities=False), scene.joints[0])
        engine.advance()
    return found


def crossings(values: Array) -> Array:
    """[s] Times at which the values rise through zero, interpolated."""
    k = np.flatnonzero((values[:-1] < 0) & (values[1:] >= 0))
    return STEP * (k - values[k] / (values[k + 1] - values[k]))


def test_a_sprung_door_swings_with_its_period_and_keeps_its_energy(world: Open) -> None:
    """T = 2 pi sqrt(I / k), and the amplitude of the second swing is that of the first."""
    spring = {"stiffness": "30 N m/rad", "rest": 0.9}
    scene, engine = world(door=thing("door", "hinge", start=0.5, spring=spring))
    swing = motion(scene, engine, 800) - 0.9
    period = 2 * math.pi * math.sqrt(moved_inertia(scene, scene.joints[0]) / 30)
    np.testing.assert_allclose(np.diff(crossings(swing)), period, rtol=1e-3)  # (w dt)^2 / 24 of the integration: 1e-5
    assert abs(swing).max() == pytest.approx(0.4, rel=2e-3)
    assert abs(swing[-int(period / STEP) :]).max() == pytest.approx(0.4, rel=2e-3)


def test_damping_takes_the_logarithmic_decrement(world: Open) -> None:
    """ln(a1 / a2) = 2 pi z / sqrt(1 - z^2), with z = d / (2 sqrt(k I))."""
    spring = {"stiffness": "30 N m/rad", "rest": 0.9}
    scene, engine = world(door=thing("door", "hinge", start=0.5, spring=spring, damping=0.4))
    swing = motion(scene, engine, 800) - 0.9
    tops = np.flatnonzero((swing[1:-1] > swing[:-2]) & (swing[1:-1] >= swing[2:])) + 1
    share = 0.4 / (2 * math.sqrt(30 * moved_inertia(scene, scene.joints[0])))
    expected = 2 * math.pi * share / math.sqrt(1 - share**2)
    # Damping acts on the velocity of one step before or after: d dt / I = 0.4 % of the decrement.
    assert math.log(swing[tops[0]] / swing[tops[1]]) == pytest.approx(expected, rel=5e-3)


def test_dry_friction_stops_a_drawer_after_its_way_and_holds_it(world: Open) -> None:
    """m v^2 / 2 = F s; then a push below F does not move it: the weight along a slide at 2 deg."""
    scene, engine = world(
        np.array([[-0.3, 0, 0, 0, 0, 0]]), cabinet=thing("cabinet", "slide", friction=2.0, start=0.02)
    )
    drawer = motion(scene, engine, 500) - 0.02
    way = 1.3 * 0.3**2 / 2 / 2.0
    assert drawer[-1] == pytest.approx(way, rel=0.01)  # half a step of motion: v dt / 2 = 0.15 mm of 29 mm
    assert np.ptp(drawer[-100:]) < 1e-6
    tilted = thing("cabinet", "slide", friction=2.0, start=0.02)
    tilted["pose"] = {"xyz": [3, 0, 1], "rpy": [0, math.radians(-2), 0]}
    scene, engine = world(cabinet=tilted)
    held = motion(scene, engine, 300)
    assert abs(held[-1] - held[0]) < 1e-4  # 1.3 kg g sin(2 deg) = 0.45 N


def test_a_damped_drawer_slides_at_the_speed_of_its_load(world: Open) -> None:
    """On a slope, v = m g sin(a) / d once the start has decayed, in 6 time constants m / d."""
    slope = math.radians(-5)
    tilted = thing("cabinet", "slide", damping=20.0)
    tilted["pose"] = {"xyz": [3, 0, 1], "rpy": [0, slope, 0]}
    scene, engine = world(cabinet=tilted)
    way = motion(scene, engine, 700)
    speed = (way[-1] - way[-200]) / (199 * STEP)
    assert abs(speed) == pytest.approx(1.3 * 9.81 * abs(math.sin(slope)) / 20, rel=5e-3)


def test_an_end_stop_holds(world: Open) -> None:
    """At 2 rad/s against its stop, a door goes beyond it by the motion of about two steps, and never faster back."""
    scene, engine = world(np.array([[0, 0, 0, 0, 0, 2.0]]), door=thing("door", "hinge", start=1.85))
    way = motion(scene, engine, 200)
    assert 1.92 - 1e-3 < way.max() < 1.92 + 0.008
    assert -np.diff(way).min() / STEP < 1.0


def test_a_sprung_button_sinks_by_force_over_stiffness(world: Open) -> None:
    """A block of 300 g on the cap: (m + M) g / k below where the spring is relaxed."""
    spring = {"stiffness": "2 N/mm"}
    button = thing("button", "press", spring=spring, damping=20.0)
    block = {"box": {"size": [0.03, 0.03, 0.03]}, "mass": "300 g", "pose": {"xyz": [3, 0, 1.08]}}
    scene, engine = world(button=button, block=block)
    sunk = motion(scene, engine, 400)[-1]
    assert sunk == pytest.approx((0.3 + 0.05) * 9.81 / 2000, rel=0.01)


def test_links_move_with_their_root_and_keep_the_momentum(world: Open) -> None:
    """A free box with an open lid: placed with twists, read as placed; in the fall both keep momentum about z."""
    scene, engine = world(gravity=0.0, box=thing("lidded_box", "hinge", fixed=False, start=1.0))
    (joint,) = scene.joints
    X_WP, twist = Transform.of(xyz=(2, 1, 1), rpy=(0.3, 0.4, 0.5)), np.array([0.1, 0.2, 0.3, 0.5, -0.4, 0.7])
    X_WC = joint.child_pose(X_WP, 1.2)
    engine.place("box", X_WP, twist)
    engine.place("box/lid", X_WC, joint.child_twist(X_WP, twist, X_WC, 2.0))
    for name, X_WO in (("box", X_WP), ("box/lid", X_WC)):
        pose, _ = engine.body_state(name)
        np.testing.assert_allclose(pose.p, X_WO.p, atol=1e-7)  # Bullet reads the axes from text
        np.testing.assert_allclose(pose.R, X_WO.R, atol=1e-7)
    X_WP, twist = engine.body_state("box")
    X_WC, own = engine.body_state("box/lid")
    assert joint.velocity(X_WP, twist, X_WC, own) == pytest.approx(2.0, abs=1e-6)
    state = engine.read()
    np.testing.assert_allclose(state.body_linear[1], own[:3], atol=1e-7)
    np.testing.assert_allclose(state.body_angular[1], own[3:], atol=1e-7)
    before = momentum(scene, state)
    for _ in range(50):
        engine.advance()
    np.testing.assert_allclose(momentum(scene, engine.read()), before, atol=2e-3)  # first order in 1 ms steps


def momentum(scene: Scene, state: WorldState) -> Array:
    """(6) linear momentum, and angular momentum about the origin, of the movable bodies."""
    total = np.zeros(6)
    for k, body in enumerate(scene.movable):
        X_WO = Transform.of(xyz=state.body_position[k], quat_xyzw=state.body_quat_xyzw[k])
        X_WI, spin = X_WO @ body.X_OI, state.body_angular[k]
        p = body.mass * (state.body_linear[k] + np.cross(spin, X_WI.p - X_WO.p))
        total[:3] += p
        total[3:] += np.cross(X_WI.p, p) + X_WI.R @ body.inertia @ X_WI.R.T @ spin
    return total


def test_parent_and_child_do_not_touch_but_what_lies_in_a_drawer_does(world: Open) -> None:
    ball = {"sphere": {"radius": "2 cm"}, "mass": "50 g", "inside": "cabinet/drawer"}
    scene, engine = world(cabinet=thing("cabinet", "slide"), ball=ball)
    for _ in range(150):
        engine.advance()
    assert {(c.a, c.b) for c in engine.contacts() if "cabinet" in c.a + c.b} == {("ball", "cabinet/drawer")}
    assert [body.name for body in scene.movable] == ["ball", "cabinet/drawer"]


def test_the_ideal_engine_keeps_joints_and_places_links_along_them(robot: RobotModel) -> None:
    data = {
        "task": "t", "robot": "r", "controllers": "c", "steps": [{"wait": "1 s"}],
        "scene": {"box": thing("lidded_box", "hinge", fixed=False, start=1.0)},
    }  # fmt: skip
    scene = build_scene(task_spec().model_validate(data), packages=Packages(ROOT / "tasks" / "objects" / "t.yaml"))
    engine = ENGINES["kinematic"].open(robot, scene, EngineSettings(STEP, 1, np.zeros(len(robot.joint_names))))
    X_WP, (joint,) = Transform.of(xyz=(2, 1, 1), rpy=(0.3, 0.4, 0.5)), scene.joints
    engine.place("box", X_WP, np.zeros(6))
    np.testing.assert_allclose(engine.body_state("box/lid")[0].R, joint.child_pose(X_WP, 1.0).R, atol=1e-12)
    off = joint.child_pose(X_WP, 0.3) @ Transform.of(xyz=(0.0, 0.02, 0.01))
    engine.place("box/lid", off, np.zeros(6))
    np.testing.assert_allclose(engine.body_state("box/lid")[0].p, joint.child_pose(X_WP, 0.3).p, atol=1e-12)
    engine.advance()
    assert joint_positions(scene, engine.read(), joint) == pytest.approx(0.3, abs=1e-12)
