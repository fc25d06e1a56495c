"""Laws of attachments in every engine with physics: the wrench of a held body, what carries it, and its release."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from manipcli.core.geometry import Array, Transform
from manipcli.model.holding import Holding
from manipcli.model.robot import RobotModel, Tool
from manipcli.scene.joints import SceneJoint
from manipcli.scene.scene import Body
from manipcli.shapes.primitives import Box, Geometry
from manipcli.simulate.engine import EngineMember
from tests.contracts.test_engines import STEP, G, Opens, body, inertial, joint, opens, robot, run, scene, with_physics

__all__ = ["opens"]  # a fixture

X_LT = Transform.of(xyz=(0.3, -0.1, 0.05), rpy=(2.8, 0.3, 0.4))
SLIDING = (0.0, 0.0, 1.0)


def crane(axis: tuple[float, float, float] = SLIDING) -> RobotModel:
    """A link of 0.5 kg that slides along an axis, off its centre of mass, with a tilted tool."""
    made = robot([joint("slide", "arm", kind="prismatic", axis=axis)], [inertial(0.5, (0.02, 0.01, -0.05))])
    return replace(made, tool=Tool("arm", X_LT, Holding("weld", np.inf, np.inf)))


def brick(mass: float = 2.0) -> Body:
    """With its centre of mass away from its origin, 0.1 m from the tool."""
    shape, moments = Box((0.04, 0.04, 0.04)), (0.01, 0.02, 0.03)
    X_OI = Transform.of(xyz=(0.01, 0.02, -0.03))
    return body("brick", shape, (0.38, -0.05, 1.0), rpy=(0.2, 0.1, 0.7), mass=mass, moments=moments, X_OI=X_OI)


def expected(model: RobotModel, force: Array, centre: Array, q: Array) -> Array:
    """(6) The wrench of the tool on a body whose force (3,) acts at its `centre`, in the tool frame."""
    X_WT = Transform.of(xyz=np.array([0.0, 0.0, 1.0]) + q) @ X_LT
    return np.concatenate((X_WT.R.T @ force, X_WT.R.T @ np.cross(centre - X_WT.p, force)))


@with_physics
def test_an_attached_body_hangs_by_its_weight(member: EngineMember, opens: Opens) -> None:
    model, held = crane(), brick()
    engine = opens(member, model, scene(held), modes=("brake",))
    wrench = engine.attach("brick")
    run(engine, 400)
    state = engine.read()
    centre = Transform.of(xyz=state.body_position[0], quat_xyzw=state.body_quat_xyzw[0]).apply(held.X_OI.p)
    np.testing.assert_allclose(state.body_position[0], held.X_WO.p, atol=2e-4)
    weight = np.array([0.0, 0.0, 2.0 * G])
    np.testing.assert_allclose(wrench, expected(model, weight, centre, np.zeros(3)), atol=2e-3)


@with_physics
@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
def test_the_wrench_of_an_accelerated_body_is_newtons(
    member: EngineMember, opens: Opens, axis: tuple[float, float, float]
) -> None:
    """Pushed by F without gravity: a = F / (M + m), and the tool pushes the body with m a."""
    model, held, push = crane(axis), brick(), 5.0
    engine = opens(member, model, scene(held, gravity=0.0))
    wrench = engine.attach("brick")
    states = run(engine, 200, lambda *_: np.array([push]))
    state = engine.read()
    a = push / (0.5 + 2.0)
    q = np.array(axis) * state.position[0]
    assert states[199][1][0] == pytest.approx(a * 199 * STEP, rel=1e-3)
    np.testing.assert_allclose(state.body_position[0] - held.X_WO.p, q, atol=2e-4)
    centre = held.X_WO.apply(held.X_OI.p) + q
    np.testing.assert_allclose(wrench, expected(model, 2.0 * a * np.array(axis), centre, q), atol=0.02)


@with_physics
def test_a_detached_body_falls_from_rest_and_can_be_attached_again(member: EngineMember, opens: Opens) -> None:
    engine = opens(member, crane(), scene(brick()), modes=("brake",))
    engine.attach("brick")
    run(engine, 100)
    engine.detach("brick")
    before = np.array(engine.read().body_position[0])
    run(engine, 100)
    t = 100 * STEP
    fallen = before - engine.read().body_position[0]
    np.testing.assert_allclose(fallen, [0.0, 0.0, G * t * (t + STEP) / 2], atol=2e-4)
    wrench = engine.attach("brick")
    run(engine, 300)
    assert np.linalg.norm(wrench[:3]) == pytest.approx(2.0 * G, rel=1e-3)


@with_physics
def test_a_force_sensor_feels_what_is_attached(member: EngineMember, opens: Opens) -> None:
    engine = opens(member, crane(), scene(brick()), modes=("brake",))
    reading = engine.sense_wrench("slide")
    engine.attach("brick")
    run(engine, 400)
    engine.read()
    np.testing.assert_allclose(reading[:3], [0.0, 0.0, -2.5 * G], atol=5e-3)


@with_physics
def test_two_bodies_are_attached_at_once(member: EngineMember, opens: Opens) -> None:
    other = replace(brick(1.0), name="other", X_WO=Transform.of(xyz=(-0.4, 0.0, 1.0)))
    engine = opens(member, crane(), scene(brick(), other), modes=("brake",))
    wrenches = engine.attach("other"), engine.attach("brick")
    run(engine, 400)
    engine.read()
    assert [float(np.linalg.norm(wrench[:3])) for wrench in wrenches] == pytest.approx([G, 2.0 * G], rel=1e-3)


@with_physics
def test_a_link_of_a_hinge_hangs_at_the_tool(member: EngineMember, opens: Opens) -> None:
    """A lever on a level hinge, held by its end: the wrench has the moment of its weight about the hinge."""
    post = replace(body("post", Box((0.02, 0.02, 0.02)), (0.7, -0.05, 1.0)), fixed=True, mass=0.0)
    held = replace(brick(), name="post/lever", X_WO=Transform.of(xyz=(0.7, -0.05, 1.0), rpy=(0.2, 0.1, 0.7)))
    held = replace(held, geometries=(Geometry(Transform.of(xyz=(-0.3, 0.1, 0.0)), Box((0.04, 0.04, 0.04))),))
    held = replace(held, X_OI=Transform.of(xyz=(-0.2, 0.07, 0.02)))
    X_PJ, axis_O = post.X_WO.inverse() @ held.X_WO, np.array([0.0, 1.0, 0.0])
    hinge = SceneJoint("post/hinge", "revolute", "post", "post/lever", X_PJ, axis_O, -3.0, 3.0)
    model = crane()
    engine = opens(member, model, replace(scene(post, held), joints=(hinge,)), modes=("brake",))
    wrench = engine.attach("post/lever")
    run(engine, 400)
    X_WO, _ = engine.body_state("post/lever")
    np.testing.assert_allclose(X_WO.R, held.X_WO.R, atol=2e-4)
    X_WT = Transform.of(xyz=(0.0, 0.0, 1.0)) @ X_LT
    force, torque = X_WT.R @ wrench[:3], X_WT.R @ wrench[3:]
    axis, centre = X_WO.R @ hinge.axis, X_WO.apply(held.X_OI.p)
    moment = axis @ (torque + np.cross(X_WT.p - X_WO.p, force))
    assert moment == pytest.approx(axis @ np.cross(centre - X_WO.p, [0.0, 0.0, 2.0 * G]), abs=5e-3)
    engine.detach("post/lever")
    run(engine, 100)
    assert abs(hinge.position(post.X_WO, engine.body_state("post/lever")[0])) > 0.01
