"""Number of iterations of PyBullet's contact solver, by what the scene contains.

The solver is a projected Gauss-Seidel method: each iteration corrects every contact once. Two parts of effective mass M
press on a body of mass m from both sides. The contacts are coupled by 1 / m, and each responds with 1 / m + 1 / M, so
that an iteration leaves the share (M / (M + m))^2 of the error. The number of iterations for a given error is about
proportional to M / m: light bodies, and light bodies below heavy ones, need many. In a stack, a correction moves by one
body per iteration.

The number is an upper limit: a step ends at a residual of 1e-7, which resting and free bodies reach in about ten.
Measured on held bodies (grip force and creep; docs/engines.md): from 10 g on, 100 iterations give the forces of 1000
within their variation, 50 do not; a body of 1 g needs between 200 and 1000.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from manipcli.model.drivetrain import reflected_inertia
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Scene

FEW: Final = 100
USUAL: Final = 200
MANY: Final = 1000
LIGHT: Final = 0.0099
"""[kg] A movable body below this mass needs `MANY`: 10 g, with a margin for rounding."""
RATIO: Final = 50.0
"""Of the masses of the heaviest and the lightest movable body, up to which `FEW` suffice."""
BODIES: Final = 5
"""Movable bodies up to which `FEW` suffice."""


class Iterations(NamedTuple):
    """A number of iterations, and the reason for it."""

    number: int
    reason: str


def iterations(robot: RobotModel, scene: Scene) -> Iterations:
    """The number for a robot and a scene: `USUAL` unless there is evidence for another."""
    bodies = sorted(scene.movable, key=lambda body: body.mass)
    if not bodies:
        return Iterations(USUAL, "no movable body")
    lightest, heaviest = bodies[0], bodies[-1]
    light = f"lightest movable body '{lightest.name}': {1e3 * lightest.mass:.3g} g"
    if lightest.mass < LIGHT:
        return Iterations(MANY, f"{light}, below 10 g")
    if heaviest.mass > RATIO * lightest.mass:
        ratio = heaviest.mass / lightest.mass
        return Iterations(USUAL, f"'{heaviest.name}' has {ratio:.3g} times the mass of '{lightest.name}'")
    if len(bodies) > BODIES:
        return Iterations(USUAL, f"{len(bodies)} movable bodies, more than {BODIES}")
    if reflected_inertia(robot).any():
        return Iterations(USUAL, "actuators with rotor inertia")
    return Iterations(FEW, light)
