"""The hollow of a body of any shape, against hollows of known form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from manipcli.core.geometry import Transform
from manipcli.scene.body_shapes import cup, tray
from manipcli.scene.containing import within
from manipcli.scene.hollow import hollow_of
from manipcli.scene.scene import Body, Interior, Scene
from manipcli.scene.scene_file import scene_from_json, scene_to_json
from manipcli.scene.walls import Walls
from manipcli.shapes.primitives import Box, Cylinder, Geometry
from manipcli.spec.scene import CupSpec, TraySpec

GREY = (0.5, 0.5, 0.5, 1.0)
SLOPE, FOOT = math.radians(30.0), 0.03
HANDLE = {"reach": 0.035, "height": 0.06}


def funnel() -> tuple[Geometry, ...]:
    """A floor at 4 mm, and walls from the circle of `FOOT` at 0 that lean outwards."""
    made = [Geometry(Transform.of(xyz=(0, 0, 0.002)), Cylinder(FOOT, 0.004))]
    for k in range(24):
        X = Transform.of(rpy=(0, 0, 2.0 * math.pi * k / 24)) @ Transform.of(xyz=(FOOT, 0, 0))
        X = X @ Transform.of(rpy=(0, SLOPE, 0)) @ Transform.of(xyz=(0.002, 0, 0.05))
        made.append(Geometry(X, Box((0.004, 0.03, 0.1))))
    return tuple(made)


@pytest.mark.parametrize("moved", [(0.0, 0.0, 0.0), (0.3, -0.2, 1.0)])
def test_of_a_cup_and_a_tray_the_hollow_is_that_of_their_sizes(moved: tuple[float, float, float]) -> None:
    """Also with a handle, whose loop holds no water, and wherever O is."""
    shapes = (
        cup(CupSpec.model_validate({"radius": 0.045, "height": 0.09, "wall": 0.004, "handle": HANDLE}), GREY),
        tray(TraySpec(size=(0.3, 0.2, 0.05)), GREY),
    )
    for made in shapes:
        X = Transform.of(xyz=moved)
        found = hollow_of([Geometry(X @ each.X_LS, each.shape) for each in made.geometries])
        true = made.interior
        assert found is not None
        assert true is not None
        assert found.walls is None
        np.testing.assert_allclose(found.X_OS.p, X.apply(true.X_OS.p), atol=2e-4)
        if isinstance(true.shape, Box):
            assert isinstance(found.shape, Box)
            np.testing.assert_allclose(found.shape.size, true.shape.size, atol=5e-4)
        else:
            assert isinstance(found.shape, Cylinder)
            assert found.shape.radius == pytest.approx(true.shape.radius, abs=2e-4)
            assert found.shape.length == pytest.approx(true.shape.length, abs=2e-4)


def test_in_a_funnel_the_room_is_the_way_to_the_leaning_wall() -> None:
    """At the height z the inner faces are at FOOT + z tan(slope) from the axis."""
    found = hollow_of(funnel())
    assert found is not None
    assert found.walls is not None
    top = 0.1 * math.cos(SLOPE) - 0.004 * math.sin(SLOPE)
    assert found.X_OS.p[2] + found.floor == pytest.approx(0.004, abs=2e-4)
    # The inner edge is the upper one of a wall that leans outwards, the gaps between the walls begin at the outer one.
    assert top - 1e-3 < found.X_OS.p[2] + found.rim < top + 0.004 * math.sin(SLOPE) + 1e-3
    for z in (0.01, 0.04, 0.08):
        wall = FOOT + z * math.tan(SLOPE)
        for x, inside in ((wall - 0.002, True), (wall + 0.002, False)):
            point = np.array([[x, 0.0, z]])
            assert within(found, point)[0] == inside
            assert found.walls.room(point - found.X_OS.p)[0] == pytest.approx(0.002 if inside else -0.002, abs=4e-4)


def test_water_that_would_run_out_makes_no_hollow() -> None:
    """A table, a block, and a tray with one wall raised; with one wall lowered, its rim is that of the low wall."""
    feet = ((-0.08, -0.08), (-0.08, 0.08), (0.08, -0.08), (0.08, 0.08))
    legs = [Geometry(Transform.of(xyz=(x, y, 0.05)), Box((0.02, 0.02, 0.1))) for x, y in feet]
    assert hollow_of([Geometry(Transform.of(xyz=(0, 0, 0.1)), Box((0.2, 0.2, 0.02))), *legs]) is None
    assert hollow_of([Geometry(Transform.identity(), Box((0.1, 0.1, 0.1)))]) is None
    shapes = list(tray(TraySpec(size=(0.3, 0.2, 0.05)), GREY).geometries)
    for moved in (0.02, -0.02):
        other = Geometry(Transform.of(xyz=(0.0, 0.0, moved)) @ shapes[1].X_LS, shapes[1].shape)
        found = hollow_of([shapes[0], other, *shapes[2:]])
        if moved > 0.0:
            assert found is None
        else:
            assert found is not None
            assert found.X_OS.p[2] + found.rim == pytest.approx(0.03, abs=2e-4)


def test_room_in_a_polygon_is_the_distance_to_its_nearest_side() -> None:
    """Against 40000 points on the sides of a lopsided polygon, at a height between two sections."""
    low, high = np.array([2.0, 1.0, 3.0, 1.5, 2.5]), np.array([4.0, 2.0, 2.0, 3.5, 3.0])
    walls = Walls((0.0, 1.0), (tuple(low), tuple(high)))
    angles = 2.0 * np.pi * np.arange(5) / 5
    corners = (0.75 * low + 0.25 * high)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    t = np.linspace(0.0, 1.0, 8000)[:, None]
    sides = np.concatenate([(1 - t) * corners[k] + t * corners[(k + 1) % 5] for k in range(5)])
    for p, sign in (((0.3, 0.2), 1.0), ((-0.5, -1.0), 1.0), ((3.0, 3.0), -1.0), ((-3.0, 0.5), -1.0)):
        nearest = float(np.min(np.linalg.norm(sides - p, axis=1)))
        assert float(walls.room(np.array([*p, 0.25]))) == pytest.approx(sign * nearest, abs=1e-3)


def test_a_scene_file_keeps_the_walls() -> None:
    interior = hollow_of(funnel())
    body = Body(
        name="funnel", kind="urdf", geometries=(), mass=0.0, X_OI=Transform.identity(), inertia=np.zeros((3, 3)),
        friction=1.0, rolling_friction=0.0, spinning_friction=0.0, restitution=0.0, fixed=True,
        X_WO=Transform.identity(), interior=interior, size=np.ones(3), centre=np.zeros(3),
    )  # fmt: skip
    read = scene_from_json(scene_to_json(Scene((body,), (), np.array([0.0, 0.0, -9.81])))).body("funnel").interior
    assert isinstance(read, Interior)
    assert interior is not None
    assert read.walls == interior.walls
