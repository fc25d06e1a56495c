"""The kernels of pictures and scans give the bits of the laws in Python."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from manipcli.core.geometry import Transform
from manipcli.render.lens import Lens
from manipcli.render.raster import Raster
from manipcli.render.scan import Scan
from manipcli.render.surface import box_surface, cylinder_surface, sphere_surface
from manipcli.shapes.primitives import Box, Cylinder, Sphere

SURFACES = [
    sphere_surface(Sphere(0.3)),
    box_surface(Box((0.5, 0.2, 0.7))),
    cylinder_surface(Cylinder(0.1, 0.9)),
    box_surface(Box((3.0, 3.0, 0.1))),
]


def _poses(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    placed = [
        Transform.of(xyz=rng.uniform((-0.6, -0.6, -0.1), (0.6, 0.6, 1.1)), rpy=rng.uniform(-3, 3, 3)) for _ in SURFACES
    ]
    return np.array([X.R for X in placed]), np.array([X.p for X in placed])


def test_pictures(equal_bits: Callable[..., None]) -> None:
    def scenario(rng: np.random.Generator) -> list[Any]:
        light = rng.standard_normal(3)
        seen = Raster(SURFACES, Lens.of_field(48, 36, rng.uniform(0.5, 2.5)), 0.01).see(*_poses(rng), light)
        return [seen.depth, seen.face, seen.shade, seen.slope]

    equal_bits(scenario, "raster", seeds=10)


def test_scans(equal_bits: Callable[..., None]) -> None:
    def scenario(rng: np.random.Generator) -> list[Any]:
        first = rng.uniform(-4.0, 4.0)
        angles = np.linspace(first, first + rng.uniform(0.1, 6.28), int(rng.integers(1, 200)))
        return [Scan(SURFACES, angles, rng.uniform(0.5, 3.0)).distances(*_poses(rng))]

    equal_bits(scenario, "scan", seeds=30)
