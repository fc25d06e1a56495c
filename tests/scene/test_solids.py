"""A solid has the volume, centre and inertia of its shapes; oracles: closed forms, and trimesh for meshes."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh

from manipcli.core.geometry import Transform
from manipcli.scene.mass_properties import union
from manipcli.scene.solids import mesh_solid, solid
from manipcli.shapes.primitives import Box, Cylinder, Geometry, Mesh, Shape, Sphere


def at(shape: Shape, **pose: object) -> Geometry:
    return Geometry(Transform.of(**pose), shape)  # type: ignore[arg-type]


def saved(mesh: trimesh.Trimesh, folder: Path, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Mesh:
    path = folder / "mesh.stl"
    mesh.export(path)
    return Mesh("package://p/mesh.stl", path, scale)


def test_disjoint_primitives_are_the_closed_form() -> None:
    parts = (
        at(Box((0.1, 0.2, 0.3)), xyz=(1.0, 0.0, 0.0), rpy=(0.3, 0.2, 0.1)),
        at(Cylinder(0.1, 0.4), xyz=(0.0, 1.0, 0.2)),
        at(Sphere(0.2), xyz=(0.0, -1.0, 0.0)),
    )
    found = solid(parts)
    assert found is not None
    volume = 0.1 * 0.2 * 0.3 + math.pi * 0.1**2 * 0.4 + 4 / 3 * math.pi * 0.2**3
    expected = union(parts, volume)
    assert found.volume == pytest.approx(volume, rel=1e-12)
    np.testing.assert_allclose(found.centre, expected.X_LI.p, atol=1e-12)
    np.testing.assert_allclose(found.inertia, expected.inertia, rtol=1e-9, atol=1e-12)


def test_what_primitives_have_in_common_counts_once() -> None:
    """A capsule from a cylinder and two balls: V = pi r^2 l + 4/3 pi r^3, and its inertia in closed form."""
    r, length = 0.06, 0.2
    found = solid([at(Cylinder(r, length)), *(at(Sphere(r), xyz=(0, 0, s * length / 2)) for s in (-1, 1))])
    assert found is not None
    tube, ball = math.pi * r**2 * length, 4 / 3 * math.pi * r**3
    assert found.volume == pytest.approx(tube + ball, rel=0.01)
    assert np.abs(found.centre).max() < 0.01 * r
    across = tube * (3 * r**2 + length**2) / 12 + ball * (0.4 * r**2 + length**2 / 4 + 3 / 8 * r * length)
    np.testing.assert_allclose(np.diag(found.inertia)[:2], across, rtol=0.01)
    np.testing.assert_allclose(found.inertia[2, 2], (tube / 2 + 0.4 * ball) * r**2, rtol=0.01)


@pytest.mark.parametrize("inward", [False, True])
@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (0.001, 0.001, 0.001), (1.0, -2.0, 0.5)])
def test_a_closed_mesh_is_measured_as_it_is(tmp_path: Path, scale: tuple[float, float, float], inward: bool) -> None:
    ring = trimesh.creation.annulus(r_min=0.3, r_max=0.5, height=0.4)
    ring.apply_translation((0.1, 0.2, 0.3))
    written = ring.copy()
    if inward:
        written.invert()
    found = mesh_solid(saved(written, tmp_path, scale))
    ring.apply_scale(scale)
    if ring.volume < 0.0:
        ring.invert()
    assert found is not None
    assert found.by == ("closed mesh",)
    assert found.volume == pytest.approx(ring.volume, rel=1e-5)
    np.testing.assert_allclose(found.centre, ring.center_mass, rtol=1e-5)
    np.testing.assert_allclose(found.inertia, ring.moment_inertia, rtol=1e-4, atol=1e-6 * found.inertia.max())


def test_an_open_mesh_is_measured_as_its_hull(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.1)
    ball.update_faces(np.arange(len(ball.faces)) > 20)
    found = mesh_solid(saved(ball, tmp_path))
    assert found is not None
    assert found.by == ("convex hull of a mesh",)
    assert found.volume == pytest.approx(ball.convex_hull.volume, rel=0.03)
    np.testing.assert_allclose(found.centre, ball.convex_hull.center_mass, atol=1e-3)


def test_what_has_no_volume_has_no_solid(tmp_path: Path) -> None:
    flat = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2], [1, 3, 2]])
    assert solid([]) is None
    assert mesh_solid(saved(flat, tmp_path)) is None
    assert mesh_solid(Mesh("package://p/none.stl", tmp_path / "none.stl")) is None
