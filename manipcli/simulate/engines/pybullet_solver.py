"""Number of iterations of PyBullet's contact solver, by what the scene contains.

The solver is a projected Gauss-Seidel method: each iteration corrects every contact once. Two parts of effective mass M
press on a body of mass m from both sides. The contacts are coupled by 1 / m, and each responds with 1 / m + 1 / M, so
that an iteration leaves the share (M / (M + m))^2 of the error. The number of iterations for a given error is about
proportional to M / m: light bodies, and light bodies below heavy ones, need many. In a stack, a correction moves by one
body per iteration.

The number is an upper limit: a step ends at a residual of 1e-7, which resting and free bodies reach in about ten.
Measured on held bodies (grip force and creep; docs/explanation/engines.md): from 50 g on, 100 iterations give the
forces of 1000 within their variation, 50 do not. A cup of 5 to 20 g, which a hand presses with 34 N, slips by 0.8 to
3.6 mm in 9 s with 200 iterations and by 0.2 to 0.4 mm with 1000. The contents of a cup are not pressed: 20 loose balls
of 2 g have the same forces with 100 and 1000.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from manipcli.model.drivetrain import reflected_inertia
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Body, Scene

FEW: Final = 100
USUAL: Final = 200
MANY: Final = 1000
GRASPED: Final = 0.0499
"""[kg] A body below this mass, which a hand may press, needs `MANY`: 50 g, with a margin for rounding."""
CONTENTS: Final = 0.0099
"""[kg] The contents of a movable container below this mass get `USUAL`: 10 g, with a margin for rounding."""
RATIO: Final = 50.0
"""Of the masses of the heaviest and the lightest body, up to which `FEW` suffice."""
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
    contents = {body.name for body in bodies if any(_is_inside(body, other) for other in bodies)}
    grasped = next((body for body in bodies if body.name not in contents), heaviest)
    if grasped.mass < GRASPED:
        return Iterations(MANY, f"{_mass(grasped)}, below 50 g")
    if lightest.mass < CONTENTS:
        return Iterations(USUAL, f"{_mass(lightest)}, below 10 g, in a container")
    if heaviest.mass > RATIO * lightest.mass:
        ratio = heaviest.mass / lightest.mass
        return Iterations(USUAL, f"'{heaviest.name}' has {ratio:.3g} times the mass of '{lightest.name}'")
    if len(bodies) > BODIES:
        return Iterations(USUAL, f"{len(bodies)} movable bodies, more than {BODIES}")
    if reflected_inertia(robot).any():
        return Iterations(USUAL, "actuators with rotor inertia")
    return Iterations(FEW, f"{_mass(grasped)}, at least 50 g")


def _mass(body: Body) -> str:
    return f"'{body.name}' has a mass of {1e3 * body.mass:.3g} g"


def _is_inside(body: Body, container: Body) -> bool:
    """Whether the centre of the body's bounding box starts in the interior of the container."""
    if container.interior is None or container is body:
        return False
    X_SW = (container.X_WO @ container.interior.X_OS).inverse()
    return container.interior.contains(X_SW.apply(body.X_WO.apply(body.centre)))
