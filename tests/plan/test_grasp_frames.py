"""Grasp frames by their geometry, and antipodal pairs on meshes whose widths are known."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from manipcli.core.geometry import Array, Transform, frozen
from manipcli.plan.antipodal import sampled
from manipcli.plan.grasp_frames import BELOW, Direction, GraspFrame, GraspFrames, first_fitting
from manipcli.scene.scene import Body
from manipcli.shapes.primitives import Box, Geometry

Make = Callable[..., Any]


def block(kind: str = "box") -> Body:
    size = np.array([0.04, 0.06, 0.1])
    return Body(
        name="block", kind=kind, geometries=(Geometry(Transform.identity(), Box((0.04, 0.06, 0.1))),), mass=0.1,
        X_OI=Transform.identity(), inertia=np.eye(3), friction=0.8, rolling_friction=0.0, spinning_friction=0.0,
        restitution=0.0, fixed=False, X_WO=Transform.identity(), interior=None, size=frozen(size),
        centre=frozen(np.zeros(3)),
    )  # fmt: skip


def frames(
    kind: str = "box", *, direction: Direction | None = None, yaw: float | None = None, height: float | None = None
) -> GraspFrames:
    X_WO = Transform.of(xyz=(0.5, 0.1, 0.3), rpy=(0, 0, 0.3))
    return GraspFrames(block(kind), X_WO, Transform.identity(), np.eye(3), direction, yaw, height)


@pytest.mark.parametrize("kind", ["box", "sphere", "cylinder"])
def test_every_frame_is_a_rotation_on_the_axis_of_the_object_and_does_not_come_from_below(kind: str) -> None:
    asked = frames(kind)
    every = [*asked.usual(), *asked.higher(), *asked.further()]
    assert len(every) > 60
    for frame in every:
        R = frame.X_WT.R
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(R) == pytest.approx(1.0)
        np.testing.assert_allclose(frame.X_WT.p[:2], [0.5, 0.1], atol=1e-12)
        assert 0.25 <= frame.X_WT.p[2] <= 0.35
        assert frame.X_WT.p[2] == pytest.approx(0.25 + frame.height)
        assert R[2, 2] < 1e-9


def angle(a: Array, b: Array) -> float:
    return float(np.degrees(np.arccos(np.clip((np.trace(a.T @ b) - 1.0) / 2.0, -1.0, 1.0))))


def test_the_whole_circle_is_covered_and_the_slopes_between() -> None:
    """From every side a frame comes within 30 deg, and at 30 and 60 deg from above."""
    every = [frame.X_WT.R[:, 2] for frame in (*frames().usual(), *frames().further())]
    level = np.array([z for z in every if abs(z[2]) < 1e-6])
    for yaw in np.radians(np.arange(0, 360, 5)):
        assert (level @ np.array([np.cos(yaw), np.sin(yaw), 0.0])).max() > np.cos(np.radians(30.1))
    for pitch in (30.0, 60.0, 90.0):
        assert any(np.degrees(np.arcsin(-z[2])) == pytest.approx(pitch) for z in every)


def test_a_box_is_also_grasped_square_to_its_faces() -> None:
    """At the yaw of the box, 0.3 rad, and quarter turns from it."""
    found = [frame.X_WT.R[:, 2] for frame in frames().further()]
    for turn in range(4):
        yaw = 0.3 + turn * np.pi / 2
        assert any(z @ [np.cos(yaw), np.sin(yaw), 0.0] > 1.0 - 1e-9 for z in found)


def test_what_the_task_sets_stays_set() -> None:
    for frame in frames(direction="side").further():
        assert abs(frame.X_WT.R[2, 2]) < 1e-6
    for frame in frames(direction="top").further():
        assert frame.X_WT.R[2, 2] < -0.99
    for frame in (*frames(height=0.03).usual(), *frames(height=0.03).further()):
        assert frame.height == pytest.approx(0.03)
    assert not frames(height=0.03).higher()
    for frame in frames(direction="side", yaw=1.0).further():
        assert frame.X_WT.R[:, 2] @ [np.cos(1.0), np.sin(1.0), 0.0] == pytest.approx(1.0)


def test_frames_are_lazy_and_only_the_fitting_ones_count() -> None:
    asked: list[Transform] = []

    def fits(X_WT: Transform) -> bool:
        asked.append(X_WT)
        return len(asked) % 2 == 0

    def endless() -> Any:
        frame = frames().usual()[0]
        while True:
            yield GraspFrame(frame.X_WT, 0.0, "x")

    assert len([*first_fitting(endless(), fits, 3)]) == 3
    assert len(asked) == 6


def box_triangles(size: tuple[float, float, float]) -> Array:
    """(12, 3, 3) of a box about the origin."""
    corners = np.array([*itertools.product((-0.5, 0.5), repeat=3)]) * size
    faces = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    return np.array([corners[list(tri)] for a, b, c, d in faces for tri in ((a, b, c), (a, c, d))])


def test_the_pairs_of_a_box_are_as_wide_as_its_edges_and_square_to_its_faces() -> None:
    size = (0.04, 0.06, 0.1)
    pairs = sampled(box_triangles(size), np.random.default_rng(1), 60)
    assert len(pairs) == 60
    for pair in pairs:
        axis = int(np.argmax(np.abs(pair.axis)))
        assert abs(pair.axis[axis]) == pytest.approx(1.0)
        assert pair.width == pytest.approx(size[axis])
        assert pair.middle[axis] == pytest.approx(0.0, abs=1e-12)
        assert (np.abs(pair.middle) <= np.array(size) / 2).all()
    assert {int(np.argmax(np.abs(pair.axis))) for pair in pairs} == {0, 1, 2}


def test_a_wedge_steeper_than_the_friction_cone_has_no_pair_across_it() -> None:
    """A roof with slopes of 45 deg: from one slope the line goes through the floor or an end, never to the other."""
    a, b, c, d = [-0.05, -0.1, 0], [0.05, -0.1, 0], [0.05, 0.1, 0], [-0.05, 0.1, 0]
    e, f = [0, -0.1, 0.05], [0, 0.1, 0.05]
    quads = [(a, b, c, d), (b, c, f, e), (a, d, f, e)]
    corners = np.array([tri for p, q, r, s in quads for tri in ((p, q, r), (p, r, s))] + [(a, b, e), (d, c, f)], float)
    pairs = sampled(corners, np.random.default_rng(2), 100)
    for pair in pairs:
        assert abs(pair.axis[1]) == pytest.approx(1.0)
        assert pair.width == pytest.approx(0.2)


def test_the_same_pairs_come_every_time() -> None:
    first, second = (sampled(box_triangles((0.1, 0.1, 0.1)), np.random.default_rng(0), 20) for _ in range(2))
    for one, other in zip(first, second, strict=True):
        assert np.array_equal(one.middle, other.middle)
    assert BELOW > 0.0
