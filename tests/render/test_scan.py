"""Distances of scans, against circles and boxes met by rays in closed form."""

from __future__ import annotations

import numpy as np

from manipcli.core.geometry import Transform
from manipcli.render.scan import Scan
from manipcli.render.surface import box_surface, cylinder_surface
from manipcli.shapes.primitives import Box, Cylinder


def test_a_round_room_is_equally_far_in_all_directions() -> None:
    X = Transform.of(xyz=(0.0, 0.0, 0.1), rpy=(0.0, 0.0, 0.3))
    scan = Scan([cylinder_surface(Cylinder(2.0, 1.0), 1e-4)], np.linspace(-np.pi, np.pi, 721))
    found = scan.distances(X.R[None], X.p[None])
    assert found.max() <= 2.0 + 1e-12
    assert found.min() >= 2.0 - 2e-4


def test_distances_to_a_box_are_exact() -> None:
    X = Transform.of(xyz=(1.5, 0.2, 0.1), rpy=(0.0, 0.0, 0.5))
    angles = np.linspace(-2.0, 2.0, 401)
    found = Scan([box_surface(Box((0.4, 0.6, 1.0)))], angles).distances(X.R[None], X.p[None])
    d = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=-1)
    origin, along = -X.R.T @ X.p, d @ X.R
    with np.errstate(divide="ignore"):
        ends = np.stack([(side * np.array([0.2, 0.3, 0.5]) - origin) / along for side in (-1.0, 1.0)])
    enter, leave = ends.min(axis=0).max(axis=-1), ends.max(axis=0).min(axis=-1)
    expected = np.where((enter <= leave) & (enter > 0.0), enter, np.inf)
    assert np.isfinite(found).sum() > 20
    assert np.array_equal(np.isfinite(found), np.isfinite(expected))
    hit = np.isfinite(found)
    assert np.abs(found[hit] - expected[hit]).max() < 1e-12


def test_a_tilted_room_has_no_gap() -> None:
    rng = np.random.default_rng(0)
    scan = Scan([box_surface(Box((1.0, 2.0, 1.5)))], np.linspace(-np.pi, np.pi, 500))
    for _ in range(20):
        X = Transform.of(xyz=rng.uniform(-0.2, 0.2, 3), rpy=rng.uniform(-3.0, 3.0, 3))
        assert np.isfinite(scan.distances(X.R[None], X.p[None])).all()


def test_what_is_too_far_is_not_seen() -> None:
    scan = Scan([box_surface(Box((0.2, 9.0, 9.0)))], np.array([0.0, 1.0]), most=2.0)
    assert np.array_equal(scan.distances(np.eye(3)[None], np.array([[1.6, 0.0, 0.0]])), [1.5, np.inf])
