"""Falls in closed form: onto a floor, into a box, past it, and along a wall."""

from __future__ import annotations

import math

import numpy as np
import pytest

from manipcli.core.geometry import Transform, frozen
from manipcli.scene.drop_test import GRAZES, LEAST, drop_height
from manipcli.scene.scene import Body
from manipcli.shapes.primitives import Box, Geometry, Sphere

GREY = (0.5, 0.5, 0.5, 1.0)


def body(*parts: tuple[Box | Sphere, tuple[float, float, float]], size: tuple[float, float, float]) -> Body:
    shapes = tuple(Geometry(X_LS=Transform.of(xyz=p), shape=shape, rgba=GREY) for shape, p in parts)
    return Body(
        name="body", kind="urdf", geometries=shapes, mass=1.0, X_OI=Transform.identity(), inertia=frozen(np.eye(3)),
        friction=1.0, rolling_friction=0.0, spinning_friction=0.0, restitution=0.0, fixed=True,
        X_WO=Transform.identity(), interior=None, size=frozen(size), centre=frozen((0.0, 0.0, size[2] / 2)),
    )  # fmt: skip


# A drawer 40 cm wide and long and 10 cm high: a floor of 1 cm, a front and a back of 2 cm.
DRAWER = body(
    (Box((0.4, 0.4, 0.01)), (0.0, 0.0, 0.005)),
    (Box((0.02, 0.4, 0.1)), (0.19, 0.0, 0.05)),
    (Box((0.02, 0.4, 0.1)), (-0.19, 0.0, 0.05)),
    size=(0.4, 0.4, 0.1),
)
FILLING = body((Box((0.36, 0.04, 0.04)), (0.0, 0.0, 0.02)), size=(0.36, 0.04, 0.04))
CUBE = body((Box((0.04, 0.04, 0.04)), (0.0, 0.0, 0.02)), size=(0.04, 0.04, 0.04))
BALL = body((Sphere(0.03), (0.0, 0.0, 0.03)), size=(0.06, 0.06, 0.06))


@pytest.mark.parametrize(
    ("falling", "x", "fall"),
    [
        (CUBE, 0.0, 0.29),
        (CUBE, 0.1595, 0.29),  # half a millimetre beside the front
        (CUBE, 0.16 - 1e-6, 0.29),
        (CUBE, 0.16, 0.29),  # flush with the front
        (CUBE, 0.16 + 1e-6, 0.29),
        (CUBE, 0.16 + 1e-4, 0.2),  # a tenth of a millimetre on its edge
        (FILLING, 0.0, 0.29),
        (CUBE, 0.19, 0.2),
        (CUBE, 0.165, 0.2),
        (BALL, 0.0, 0.29),
        (BALL, 0.204, 0.2 + 0.03 - math.sqrt(0.03**2 - 0.004**2)),  # 4 mm beside the edge of the front
        (CUBE, 0.5, None),
    ],
)
def test_a_fall_ends_at_what_is_met_first(falling: Body, x: float, fall: float | None) -> None:
    X_WU = Transform.of(xyz=(1.0, 2.0, 0.5), rpy=(0.0, 0.0, 0.3))
    found = drop_height(falling, X_WU @ Transform.of(xyz=(x, 0.1, 0.3)), DRAWER, X_WU)
    assert (found is None) == (fall is None)
    assert fall is None or fall - LEAST <= (found or 0.0) <= fall + GRAZES
