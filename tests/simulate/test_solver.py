"""A thing between two fingers is at rest: each presses with what its slide is commanded, and friction carries the
weight. The engine's solver is asked for the forces and for the rest."""

from __future__ import annotations

import numpy as np
import pytest

from manipcli.control.command import JointCommand
from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Inertial, Joint, JointLimits, Link
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Box, Geometry
from manipcli.simulate.engine import EngineSettings
from manipcli.simulate.engines import ENGINES

SIDE, THICK = 0.04, 0.01
"""[m] of the block, and of a finger."""


def _press(force: float, mass: float, ticks: int) -> tuple[np.ndarray, np.ndarray]:
    """The normal forces on both sides (ticks, 2) [N], and where the block is (ticks, 3) [m]."""
    pad = (Geometry(Transform.identity(), Box((THICK, 0.02, 0.02))),)
    inertial = Inertial(0.05, Transform.identity(), frozen(np.eye(3) * 1e-5))
    apart = 0.5 * (SIDE + THICK)
    limits = JointLimits(-0.05, 0.05, 1.0, 200.0)
    joints = tuple(
        Joint(name, "prismatic", "base", name, Transform.of(xyz=(-s * apart, 0.0, 1.0)), frozen((s, 0.0, 0.0)), limits)
        for name, s in (("left", 1.0), ("right", -1.0))
    )
    links = (Link("base", None, (), ()), Link("left", inertial, (), pad), Link("right", inertial, (), pad))
    robot = RobotModel("press", "base", links, joints, (), (), (), Transform.identity(), "")
    block = Body(
        name="block", kind="box", geometries=(Geometry(Transform.identity(), Box((SIDE,) * 3)),), mass=mass,
        X_OI=Transform.identity(), inertia=frozen(np.eye(3) * mass * SIDE**2 / 6.0), friction=0.9, rolling_friction=0.0,
        spinning_friction=0.0, restitution=0.0, fixed=False, X_WO=Transform.of(xyz=(0.0, 0.0, 1.0)), interior=None,
        size=frozen((SIDE,) * 3), centre=frozen((0.0, 0.0, 0.0)),
    )  # fmt: skip
    engine = ENGINES["pybullet"].open(
        robot, Scene((block,), (), frozen((0.0, 0.0, -9.81))), EngineSettings(1e-3, 1, np.zeros(2))
    )
    command = JointCommand(2)
    command.obey(["effort", "effort"])
    forces, places = [], []
    for _ in range(ticks):
        command.effort[:] = force
        engine.write(command)
        engine.advance()
        places.append(engine.read().body_position[0].copy())
        found = {one.b: one.force for one in engine.contacts()}
        forces.append([found.get("robot/left", 0.0), found.get("robot/right", 0.0)])
    engine.close()
    return np.array(forces), np.array(places)


@pytest.mark.parametrize("mass", [0.1, 0.01, 0.005, 0.002])
def test_a_thing_that_is_held_firmly_is_at_rest_be_it_light(mass: float) -> None:
    """10 N a side on 2 g are 500 times its weight. With Bullet's own 50 iterations the forces sway by 0.8 N then."""
    forces, places = _press(10.0, mass, 1000)
    held = forces[500:]
    np.testing.assert_allclose(held.mean(axis=0), 10.0, rtol=3e-3)
    assert held.std(axis=0).max() < 0.04
    assert np.linalg.norm(places[-1] - places[200]) < 1e-3, "it creeps"
