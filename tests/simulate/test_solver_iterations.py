"""The number of solver iterations follows from the scene, and the reason is reported."""

from __future__ import annotations

import numpy as np
import pytest

from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Inertial, Joint, JointLimits, Link
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Box, Geometry
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
        ((0.15, 0.01), "100", "'box_1': 10 g"),
        ((0.15, 0.009), "1000", "'box_1': 9 g"),
        ((2.0, 0.02), "200", "'box_0' has 100 times the mass of 'box_1'"),
        ((0.08,) * 5, "100", "80 g"),
        ((0.08,) * 6, "200", "6 movable bodies"),
    ],
)
def test_light_bodies_get_more_iterations(masses: tuple[float, ...], number: str, reason: str) -> None:
    chosen = _chosen(_scene(*masses))
    assert chosen["solver_iterations"] == number
    assert reason in chosen["solver_iterations_reason"]


def test_a_number_in_the_task_is_not_a_choice_of_the_engine() -> None:
    assert _chosen(_scene(0.001), PybulletSpec(solver_iterations=75)) == {}
