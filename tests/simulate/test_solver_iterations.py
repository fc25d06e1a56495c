"""The number of solver iterations follows from the scene, and the reason is reported."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Inertial, Joint, JointLimits, Link
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Body, Interior, Scene
from manipcli.shapes.primitives import Box, Cylinder, Geometry
from manipcli.simulate.engine import EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.simulate.engines.pybullet import PybulletSpec

SETTINGS = EngineSettings(1e-3, 1, np.zeros(1))


def _scene(*masses: float) -> Scene:
    """Movable boxes of these masses [kg], and a fixed one."""
    bodies = [_body(f"box_{k}", mass, fixed=False) for k, mass in enumerate(masses)]
    return Scene((*bodies, _body("desk", 0.0, fixed=True)), (), frozen((0.0, 0.0, -9.81)))


def _body(name: str, mass: float, *, fixed: bool) -> Body:
    return Body(
        name=name, kind="box", geometries=(Geometry(Transform.identity(), Box((0.04,) * 3)),), mass=mass,
        X_OI=Transform.identity(), inertia=frozen(np.eye(3) * mass * 1e-4), friction=0.9, rolling_friction=0.0,
        spinning_friction=0.0, restitution=0.0, fixed=fixed, X_WO=Transform.identity(), interior=None,
        size=frozen((0.04,) * 3), centre=frozen((0.0, 0.0, 0.0)),
    )  # fmt: skip


def _robot() -> RobotModel:
    inertial = Inertial(0.05, Transform.identity(), frozen(np.eye(3) * 1e-5))
    slide = Joint(
        "slide", "prismatic", "base", "tip", Transform.identity(), frozen((1.0, 0.0, 0.0)), JointLimits(-1, 1, 1, 20)
    )
    links = (Link("base", None, (), ()), Link("tip", inertial, (), ()))
    return RobotModel("slider", "base", links, (slide,), (), (), (), Transform.identity(), "")


def _chosen(scene: Scene, own: PybulletSpec | None = None) -> dict[str, str]:
    settings = EngineSettings(SETTINGS.step, SETTINGS.substeps, SETTINGS.start, own)
    return dict(ENGINES["pybullet"].chosen(_robot(), scene, settings))


@pytest.mark.parametrize(
    ("masses", "number", "reason"),
    [
        ((), "200", "no movable body"),
        ((0.15, 0.05), "100", "'box_1' has a mass of 50 g, at least 50 g"),
        ((0.15, 0.049), "1000", "'box_1' has a mass of 49 g, below 50 g"),
        ((6.0, 0.06), "200", "'box_0' has 100 times the mass of 'box_1'"),
        ((0.08,) * 5, "100", "80 g"),
        ((0.08,) * 6, "200", "6 movable bodies"),
    ],
)
def test_light_bodies_get_more_iterations(masses: tuple[float, ...], number: str, reason: str) -> None:
    chosen = _chosen(_scene(*masses))
    assert chosen["solver_iterations"] == number
    assert reason in chosen["solver_iterations_reason"]


@pytest.mark.parametrize(("mass", "height", "number"), [(0.01, 0.03, "100"), (0.009, 0.03, "200"), (0.01, 0.2, "1000")])
def test_contents_of_a_container_may_be_light(mass: float, height: float, number: str) -> None:
    """A cup of 150 g with a ball in it, or above it, where a hand may press the ball."""
    interior = Interior(X_OS=Transform.of(xyz=(0.0, 0.0, 0.05)), shape=Cylinder(0.03, 0.1))
    cup = replace(_body("cup", 0.15, fixed=False), interior=interior, X_WO=Transform.of(xyz=(0.5, 0.2, 0.4)))
    ball = replace(_body("ball", mass, fixed=False), X_WO=Transform.of(xyz=(0.5, 0.2, 0.4 + height)))
    assert _chosen(Scene((cup, ball), (), frozen((0.0, 0.0, -9.81))))["solver_iterations"] == number


def test_a_number_in_the_task_is_not_a_choice_of_the_engine() -> None:
    assert _chosen(_scene(0.001), PybulletSpec(solver_iterations=75)) == {}
