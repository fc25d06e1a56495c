"""Mass properties against closed forms and brute force."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats.qmc import Sobol

from manipcli.core.geometry import Array, Transform
from manipcli.scene import body_shapes
from manipcli.scene.mass_properties import union
from manipcli.shapes.primitives import Box, Cylinder, Geometry, Sphere
from manipcli.spec.scene import CupSpec, TraySpec

WHITE = (1.0, 1.0, 1.0, 1.0)


def brute_force(geometries: tuple[Geometry, ...], mass: float, low: Array, high: Array) -> tuple[Array, Array]:
    """Centre of mass and inertia by summing over the 2^16 points of a Sobol sequence that lie in any of the shapes."""
    points = low + (high - low) * Sobol(3, scramble=False).random_base2(16)
    inside = np.zeros(len(points), dtype=bool)
    for geometry in geometries:
        p = (points - geometry.X_LS.p) @ geometry.X_LS.R
        shape = geometry.shape
        if isinstance(shape, Box):
            inside |= np.all(np.abs(p) <= np.array(shape.size) / 2, axis=-1)
        elif isinstance(shape, Sphere):
            inside |= np.linalg.norm(p, axis=-1) <= shape.radius
        elif isinstance(shape, Cylinder):
            inside |= (np.hypot(p[:, 0], p[:, 1]) <= shape.radius) & (np.abs(p[:, 2]) <= shape.length / 2)
    p = points[inside]
    centre = p.mean(axis=0)
    d = p - centre
    inertia = mass * (np.eye(3) * np.mean(np.sum(d * d, axis=1)) - d.T @ d / len(d))
    return centre, inertia


@pytest.mark.parametrize("shape", [Box((0.2, 0.3, 0.4)), Sphere(0.2), Cylinder(0.1, 0.3)])
def test_inertia_of_a_solid_is_that_of_its_points(shape: Box | Sphere | Cylinder) -> None:
    solid = (Geometry(X_LS=Transform.identity(), shape=shape),)
    made = union(solid, 2.0)
    _, inertia = brute_force(solid, 2.0, np.full(3, -0.2), np.full(3, 0.2))
    # Evenly spread, the points miss by well below 1 %.
    np.testing.assert_allclose(made.inertia, inertia, atol=0.005 * np.max(inertia))


def test_inertia_of_a_sphere_and_a_cylinder_are_the_textbook_ones() -> None:
    sphere = union((Geometry(X_LS=Transform.identity(), shape=Sphere(0.1)),), 3.0)
    np.testing.assert_allclose(sphere.inertia, np.eye(3) * (0.4 * 3.0 * 0.01), rtol=1e-12)
    rod = union((Geometry(X_LS=Transform.identity(), shape=Cylinder(0.1, 0.6)),), 3.0)
    across = 3.0 * (3 * 0.01 + 0.36) / 12
    np.testing.assert_allclose(rod.inertia, np.diag([across, across, 3.0 * 0.01 / 2]), rtol=1e-12)


def test_a_box_cut_in_halves_weighs_and_turns_like_the_whole() -> None:
    whole = union((Geometry(X_LS=Transform.of(xyz=(0.5, 0.2, 0.1)), shape=Box((0.4, 0.2, 0.1))),), 5.0)
    halves = tuple(
        Geometry(X_LS=Transform.of(xyz=(0.5 + side * 0.1, 0.2, 0.1)), shape=Box((0.2, 0.2, 0.1))) for side in (-1, 1)
    )
    made = union(halves, 5.0)
    np.testing.assert_allclose(made.X_LI.p, whole.X_LI.p, atol=1e-15)
    np.testing.assert_allclose(made.inertia, whole.inertia, rtol=1e-12, atol=1e-15)


def test_a_turned_part_turns_its_inertia() -> None:
    turned = Geometry(X_LS=Transform.of(rpy=(0.0, 0.0, np.pi / 2)), shape=Box((0.4, 0.2, 0.1)))
    straight = Geometry(X_LS=Transform.identity(), shape=Box((0.2, 0.4, 0.1)))
    np.testing.assert_allclose(union((turned,), 1.0).inertia, union((straight,), 1.0).inertia, atol=1e-15)


def test_cup_has_centre_and_inertia_of_its_points() -> None:
    shape = body_shapes.cup(CupSpec(radius=0.036, height=0.11, wall=0.004), WHITE)
    made = union(shape.geometries, 0.15)
    low, high = shape.centre - shape.size / 2, shape.centre + shape.size / 2
    centre, inertia = brute_force(shape.geometries, 0.15, low, high)
    # The boxes' overlaps, counted twice in the sum of parts, are below 1 % of it.
    np.testing.assert_allclose(made.X_LI.p, centre, atol=0.003 * 0.11)
    np.testing.assert_allclose(made.inertia, inertia, atol=0.004 * np.max(inertia))


def test_tray_has_centre_and_inertia_of_its_points() -> None:
    shape = body_shapes.tray(TraySpec(size=(0.3, 0.2, 0.05), wall=0.01), WHITE)
    made = union(shape.geometries, 0.4)
    centre, inertia = brute_force(shape.geometries, 0.4, shape.centre - shape.size / 2, shape.centre + shape.size / 2)
    np.testing.assert_allclose(made.X_LI.p, centre, atol=0.001 * 0.05)
    np.testing.assert_allclose(made.inertia, inertia, atol=0.001 * np.max(inertia))
