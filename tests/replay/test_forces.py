"""The arrows of contact forces: on whom they act, how long they are, and that they go with what touches."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from manipcli.core.geometry import Transform, frozen, matrix_from_rpy, quat_from_matrix
from manipcli.description.elements import Link
from manipcli.logs.replay import open_playback
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact, ContactPoint
from manipcli.pipeline import run_task
from manipcli.replay.forces import LEAST, LONGEST, Forces
from manipcli.replay.playback import Playback
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Geometry, Sphere

ROOT = Path(__file__).parents[2]
TIMES = frozen(np.arange(6) * 0.02)
POINT = ContactPoint((0.1, 0.0, -0.05), (0.0, 0.6, 0.8), 2.0, (0.3, 0.0, 0.0))


def _body(name: str, *, fixed: bool) -> Body:
    return Body(
        name=name, kind="sphere", geometries=(Geometry(Transform.identity(), Sphere(0.1)),), mass=1.0,
        X_OI=Transform.identity(), inertia=frozen(np.eye(3)), friction=1.0, rolling_friction=0.0, spinning_friction=0.0,
        restitution=0.0, fixed=fixed, X_WO=Transform.identity(), interior=None, size=frozen([0.1] * 3),
        centre=frozen([0.0] * 3),
    )  # fmt: skip


def _forces(a: str, b: str, *, since: float = 0.0, **turns: tuple[float, float]) -> Forces:
    """Forces of one contact, recorded at `since`, while `ball` and `cup` move by (1, 2, 3) m/s; `turns`: rates about x
    and y [rad/s]."""
    position = np.zeros((6, 2, 3)) + TIMES[:, None, None] * [1.0, 2.0, 3.0]
    quat = np.zeros((6, 2, 4))
    for j, name in enumerate(("ball", "cup")):
        about_x, about_y = turns.get(name, (0.0, 0.0))
        quat[:, j] = [quat_from_matrix(matrix_from_rpy((about_x * t, about_y * t, 0.0))) for t in TIMES]
    none, bodies = np.zeros((6, 0)), tuple(_body(name, fixed=name == "desk") for name in ("ball", "cup", "desk"))
    playback = Playback(
        name="",
        robot=RobotModel("r", "base", (Link("base", None, (), ()),), (), (), (), (), Transform.identity(), ""),
        scene=Scene(bodies, (), frozen([0.0] * 3)),
        joint_names=(), times=TIMES, position=none, velocity=none, effort=none, reference=none,
        body_position=frozen(position), body_quat_xyzw=frozen(quat),
        contacts=((Contact(a, b, 2.0, 0.0, (POINT,)),),) * 6, contact_times=((since,),) * 6,
    )  # fmt: skip
    return Forces(playback, playback.poses())


@pytest.mark.parametrize(
    ("a", "b", "side"),
    [
        ("ball", "desk", 1.0),
        ("ball", "cup", 1.0),
        ("ball", "robot/base", 1.0),
        ("a_desk", "ball", -1.0),
        ("desk", "robot/base", -1.0),
        ("robot/base", "wall", 1.0),
    ],
)
def test_forces_are_those_on_the_body_that_moves_or_on_the_robot(a: str, b: str, side: float) -> None:
    (push,) = _forces(a, b).at(0)
    np.testing.assert_array_equal(push.point, POINT.position)
    np.testing.assert_allclose(push.normal, side * np.array([0.0, 1.2, 1.6]))
    np.testing.assert_allclose(push.friction, side * np.array(POINT.friction))


def test_a_strong_force_has_the_longest_arrow() -> None:
    assert _forces("ball", "desk").scale * POINT.force == pytest.approx(LONGEST)


@pytest.mark.parametrize("since", [0.0, 0.013, 0.02])
def test_points_go_with_the_body_until_the_next_message(since: float) -> None:
    forces = _forces("ball", "desk", since=since)
    for k in range(1, 6):
        (push,) = forces.at(k)
        np.testing.assert_allclose(
            push.point, POINT.position + (TIMES[k] - since) * np.array([1.0, 2.0, 3.0]), atol=1e-12
        )
        np.testing.assert_allclose(push.normal, [0.0, 1.2, 1.6], atol=1e-12)


def test_the_contact_of_a_rolling_ball_stays_below_it() -> None:
    """The desk does not turn, so the point keeps its offset from the ball although that rolls."""
    (push,) = _forces("ball", "desk", ball=(20.0, 0.0)).at(5)
    np.testing.assert_allclose(push.point, POINT.position + TIMES[5] * np.array([1.0, 2.0, 3.0]), atol=1e-12)


def test_points_between_two_that_turn_together_turn_with_them() -> None:
    (push,) = _forces("ball", "cup", since=0.01, ball=(3.0, 0.0), cup=(3.0, 0.0)).at(5)
    R = matrix_from_rpy((3.0 * (TIMES[5] - 0.01), 0.0, 0.0))
    moved = np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(push.point, TIMES[5] * moved + R @ (POINT.position - 0.01 * moved), atol=1e-9)
    np.testing.assert_allclose(push.normal, POINT.force * R @ POINT.normal, atol=1e-9)
    np.testing.assert_allclose(push.friction, R @ POINT.friction, atol=1e-9)


def test_weak_contacts_and_points_without_force_have_no_arrow() -> None:
    forces = _forces("ball", "desk")
    playback = forces._playback
    for points, force in (((POINT._replace(force=0.0), POINT), 2.0), ((POINT,), LEAST), ((), 2.0)):
        contact = Contact("ball", "desk", force, 0.0, points)
        one = replace(playback, contacts=((contact,),) * 6)
        assert len(Forces(one, one.poses()).at(0)) == (1 if len(points) == 2 else 0)


@pytest.mark.parametrize("engine", ["pybullet", "mujoco"])
def test_the_arrows_on_a_body_at_rest_add_up_to_its_weight(engine: str, tmp_path: Path) -> None:
    """Oracle: Newton's second law with an acceleration of zero, for a body on the table, one that carries another one,
    and that one; within 1 % at each time, from 0.1 s on."""
    task = tmp_path / "rest.yaml"
    task.write_text(
        f"""
task: rest
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
simulation: {{engine: {engine}, step: 1 ms, control_period: 2 ms, seed: 1}}
scene:
  desk: {{box: {{size: [0.6, 1.0, 0.4]}}, pose: {{xyz: [0.85, 0, 0.2]}}, fixed: true}}
  alone: {{box: {{size: [50 mm, 50 mm, 50 mm]}}, mass: 200 g, rests_on: desk, at: [0.75, 0.2]}}
  below: {{box: {{size: [80 mm, 80 mm, 30 mm]}}, mass: 500 g, rests_on: desk, at: [0.75, -0.2]}}
  above: {{box: {{size: [40 mm, 40 mm, 40 mm]}}, mass: 100 g, rests_on: below, at: [0.75, -0.2]}}
steps:
  - wait: 0.3 s
"""
    )
    run_task(task, log=tmp_path / "rest.mcap")
    playback = open_playback(tmp_path / "rest.mcap", package_path=[ROOT / "robots"])
    assert playback.scene is not None
    forces = Forces(playback, playback.poses())
    settled = [k for k, time in enumerate(playback.times.tolist()) if time > 0.1]
    assert len(settled) > 5
    for name in ("alone", "below", "above"):
        weight = -playback.scene.body(name).mass * playback.scene.gravity
        for k in settled:
            np.testing.assert_allclose(forces.net(name, k), weight, atol=0.01 * float(np.linalg.norm(weight)))
