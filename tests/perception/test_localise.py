"""Poses from pictures whose depths are those of rays that meet boxes, cylinders and spheres in closed form."""

from __future__ import annotations

import hashlib
import math
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from manipcli.core.geometry import Array, Transform
from manipcli.perception.localise import DepthView, Localisation, NotSeen, Prior, localise
from manipcli.perception.seen_surface import looks_same
from manipcli.render.lens import Lens
from manipcli.scene import body_shapes
from manipcli.scene.body_shapes import BodyShape
from manipcli.scene.scene import Body
from manipcli.shapes.primitives import Box, Cylinder, Geometry, Sphere
from manipcli.spec.scene import BoxSpec, CupSpec, SphereSpec

LENS = Lens.of_field(160, 120, math.radians(40.0))
GREY = (0.5, 0.5, 0.5, 1.0)
NOISE = 1.5e-3
"""Standard deviation of depth [m]."""
REGION = np.array([0.05, 0.05, 0.0])
UP = 0.0, 0.0, 1.0


def body(shape: BodyShape, *more: Geometry) -> Body:
    return Body("it", "it", (*shape.geometries, *more), 0.2, Transform.identity(), np.eye(3), 0.5, 0.0, 0.0, 0.0, False,
                Transform.identity(), shape.interior, shape.size, shape.centre)  # fmt: skip


CUP = body(body_shapes.cup(CupSpec(radius=0.036, height=0.11, wall=0.004), GREY))
HANDLE = tuple(
    Geometry(Transform.of(xyz=xyz), Box(size), GREY)
    for xyz, size in (
        ((0.05, 0.0, 0.08), (0.03, 0.012, 0.01)),
        ((0.05, 0.0, 0.035), (0.03, 0.012, 0.01)),
        ((0.06, 0.0, 0.0575), (0.01, 0.012, 0.055)),
    )
)
MUG = body(body_shapes.cup(CupSpec(radius=0.036, height=0.11, wall=0.004), GREY), *HANDLE)
BRICK = body(body_shapes.box(BoxSpec(size=(0.06, 0.1, 0.05)), GREY))
BALL = body(body_shapes.sphere(SphereSpec(radius=0.04), GREY))
HEIGHT = {id(CUP): 0.0, id(MUG): 0.0, id(BRICK): 0.025, id(BALL): 0.04}
"""Of the origin above the desk."""
DESK = Geometry(Transform.of(xyz=(0.0, 0.0, -0.02)), Box((0.6, 0.8, 0.04)))


def met(shape: Box | Cylinder | Sphere, origin: Array, along: Array) -> Array:
    """(n) how far along rays (n, 3) from an origin (3,) each enters a shape; infinite beside it."""
    a, b, c = (along * along).sum(axis=1), along @ origin, float(origin @ origin)
    if isinstance(shape, Sphere):
        inside = b * b - a * (c - shape.radius**2)
        return np.where(inside >= 0.0, (-b - np.sqrt(np.maximum(inside, 0.0))) / a, np.inf)
    half = np.array(shape.size) / 2.0 if isinstance(shape, Box) else np.array([np.inf, np.inf, shape.length / 2.0])
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([(side * half - origin) / along for side in (-1.0, 1.0)])
    enter, leave = ends.min(axis=0).max(axis=1), ends.max(axis=0).min(axis=1)
    if isinstance(shape, Cylinder):
        a, b, c = (along[:, :2] ** 2).sum(axis=1), along[:, :2] @ origin[:2], float(origin[:2] @ origin[:2])
        inside = b * b - a * (c - shape.radius**2)
        root = np.sqrt(np.maximum(inside, 0.0))
        enter, leave = np.maximum(enter, (-b - root) / a), np.minimum(leave, (-b + root) / a)
        leave = np.where(inside >= 0.0, leave, -np.inf)
    return np.where(enter <= leave, enter, np.inf)


def depth_of(geometries: tuple[Geometry, ...], X_CO: Transform) -> Array:
    """(h, w) depth of primitives."""
    rays = np.stack(np.broadcast_arrays(LENS.columns, LENS.rows[:, None], 1.0), axis=-1).reshape(-1, 3)
    nearest = np.full(len(rays), np.inf)
    for geometry in geometries:
        X = X_CO @ geometry.X_LS
        assert isinstance(geometry.shape, Box | Cylinder | Sphere)
        nearest = np.minimum(nearest, met(geometry.shape, -X.R.T @ X.p, rays @ X.R))
    return nearest.reshape(LENS.height, LENS.width)


def camera(elevation: float = 40.0, azimuth: float = 30.0, distance: float = 0.5) -> Transform:
    """X_WC of a camera that looks at a point above the middle of the desk; angles in degrees."""
    up, around = math.radians(elevation), math.radians(azimuth)
    z = -np.array([math.cos(up) * math.cos(around), math.cos(up) * math.sin(around), math.sin(up)])
    x = np.cross(z, UP) / np.linalg.norm(np.cross(z, UP))
    return Transform.of(xyz=np.array([0.0, 0.0, 0.04]) - distance * z, R=np.stack([x, np.cross(z, x), z], axis=1))


def standing(of: Body, x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> Transform:
    return Transform.of(xyz=(x, y, HEIGHT[id(of)]), rpy=(0.0, 0.0, math.radians(yaw)))


def picture(
    of: Body | None, X_WO: Transform, X_WC: Transform, *more: Geometry, rng: np.random.Generator | None = None
) -> tuple[DepthView, Array]:
    """What a camera measures of a body on the desk, with or without noise, and what was expected: desk and `more`."""
    X_CW = X_WC.inverse()
    expected = depth_of((DESK, *more), X_CW)
    depth = expected if of is None else np.minimum(expected, depth_of(of.geometries, X_CW @ X_WO))
    if rng is not None:
        depth = depth + NOISE * rng.standard_normal(depth.shape)
        depth[rng.random(depth.shape) < 0.02] = np.nan
    return DepthView(LENS, X_WC, np.where(np.isfinite(depth), depth, 0.0), 0.0 if rng is None else NOISE), expected


def looked(
    of: Body, X_WO: Transform, X_WC: Transform, seed: int | None = None, rotation: float = 180.0
) -> Localisation:
    view, expected = picture(of, X_WO, X_WC, rng=None if seed is None else np.random.default_rng(seed))
    return localise(view, Prior(of, standing(of), REGION, math.radians(rotation)), expected)


def yaw_error(found: Transform, true: Transform) -> float:
    """In degrees."""
    R = true.R.T @ found.R
    return abs(math.degrees(math.atan2(R[1, 0], R[0, 0])))


@pytest.mark.parametrize(
    ("of", "yaw", "rotation"),
    [(CUP, 0.0, 0.0), (CUP, 70.0, 180.0), (BALL, 0.0, 180.0), (BRICK, 33.0, 80.0), (MUG, 100.0, 180.0)],
)
def test_without_noise_the_pose_is_exact(of: Body, yaw: float, rotation: float) -> None:
    true = standing(of, 0.043, -0.037, yaw)
    found = looked(of, true, camera(), rotation=rotation)
    assert np.linalg.norm(found.X_WO.p - true.p) < 5e-4
    assert found.X_WO.p[2] == true.p[2]
    assert found.inliers > 0.9
    if of in (BRICK, MUG):
        assert found.free is None
        assert yaw_error(found.X_WO, true) < 0.5
    else:
        assert found.free is not None
        assert np.array_equal(found.X_WO.R, np.eye(3))  # as believed: the picture shows nothing of it
        assert found.covariance[5, 5] == pytest.approx(math.radians(rotation) ** 2 / 3.0)


def test_the_believed_one_of_equal_rotations_is_found() -> None:
    """A box looks the same after half a turn."""
    true = standing(BRICK, 0.02, 0.01, 200.0)
    found = looked(BRICK, true, camera(), seed=1)
    assert yaw_error(found.X_WO, standing(BRICK, yaw=20.0)) < 2.0
    assert math.sqrt(found.covariance[5, 5]) < math.radians(2.0)


@pytest.mark.parametrize("yaw", range(-165, 180, 60))
def test_a_handle_is_found_at_any_yaw(yaw: float) -> None:
    true = standing(MUG, -0.03, 0.045, yaw)
    found = looked(MUG, true, camera(elevation=65.0), seed=abs(yaw))
    assert np.linalg.norm(found.X_WO.p - true.p) < 3e-3
    assert yaw_error(found.X_WO, true) < 3.0
    assert math.sqrt(found.covariance[5, 5]) < math.radians(5.0)


def test_a_hidden_handle_leaves_the_rotation_uncertain() -> None:
    X_WC = camera(elevation=30.0, azimuth=0.0)
    for yaw in (165.0, 180.0):  # behind the cup
        true = standing(MUG, yaw=yaw)
        found = looked(MUG, true, X_WC, seed=3)
        deviation = math.degrees(math.sqrt(found.covariance[5, 5]))
        assert np.linalg.norm(found.X_WO.p - true.p) < 3e-3
        assert 8.0 < deviation < 40.0
        assert yaw_error(found.X_WO, true) < 3.0 * deviation


def test_what_is_known_to_stand_in_front_hides_only_a_part() -> None:
    true, X_WC = standing(CUP, 0.01, 0.02), camera()
    bar = Geometry(Transform.of(xyz=0.75 * true.p + 0.25 * X_WC.p + [0.0, 0.01, 0.03]), Box((0.02, 0.02, 0.3)))
    whole, _ = picture(CUP, true, X_WC)
    view, expected = picture(CUP, true, X_WC, bar, rng=np.random.default_rng(0))
    hidden = (expected < whole.depth - 0.01).sum()
    assert hidden > 200
    found = localise(view, Prior(CUP, standing(CUP), REGION, 0.0), expected)
    assert np.linalg.norm(found.X_WO.p - true.p) < 3e-3


@pytest.mark.parametrize("seed", range(3))
def test_an_absent_body_is_not_seen(seed: int) -> None:
    view, expected = picture(None, Transform.identity(), camera(), rng=np.random.default_rng(seed))
    with pytest.raises(NotSeen, match=r"^\d pixels show something unexpected in its region, at least 30"):
        localise(view, Prior(CUP, standing(CUP), REGION, 0.0), expected)


def test_another_body_in_its_place_is_not_taken_for_it() -> None:
    for there, wanted in ((BRICK, CUP), (CUP, BRICK), (BALL, CUP)):
        view, expected = picture(there, standing(there, 0.01, -0.02, 40.0), camera(), rng=np.random.default_rng(0))
        with pytest.raises(NotSeen, match="no pose in its region explains the picture: of"):
            localise(view, Prior(wanted, standing(wanted), REGION, math.pi), expected)


@pytest.mark.parametrize(("x", "y"), [(0.06, 0.0), (-0.02, -0.075)])
def test_a_body_outside_its_region_is_refused_with_numbers(x: float, y: float) -> None:
    with pytest.raises(NotSeen, match=r"its best pose is [\d.]+ mm outside its region") as refused:
        looked(CUP, standing(CUP, x, y), camera(), seed=0, rotation=0.0)
    beyond = float(refused.value.reason.split(" mm")[0].split()[-1])
    assert beyond == pytest.approx(1e3 * (max(abs(x), abs(y)) - 0.05), abs=1.0)


def test_a_region_that_is_not_in_the_picture_is_said() -> None:
    view, expected = picture(CUP, standing(CUP), camera())
    far = Prior(CUP, Transform.of(xyz=(2.0, 0.0, 0.0)), REGION, 0.0)
    with pytest.raises(NotSeen, match="outside the picture"):
        localise(view, far, expected)


@pytest.mark.parametrize(("of", "axes"), [(BRICK, (0, 1, 5)), (CUP, (0, 1))])
def test_the_covariance_predicts_the_spread(of: Body, axes: tuple[int, ...]) -> None:
    """The squared errors over their covariances have the mean of chi-square: the number of axes."""
    true, squares = standing(of, 0.02, -0.03, 25.0), []
    clean, expected = picture(of, true, camera(distance=0.6))
    for seed in range(25):
        noise = NOISE * np.random.default_rng(seed).standard_normal(clean.depth.shape)
        view = DepthView(LENS, clean.X_WC, clean.depth + noise, NOISE)
        found = localise(view, Prior(of, standing(of), REGION, math.radians(40.0)), expected)
        turn = (true.R.T @ found.X_WO.R)[1, 0]
        error = np.append(found.X_WO.p - true.p, [0.0, 0.0, turn])[list(axes)]
        squares.append(float(error @ np.linalg.solve(found.covariance[np.ix_(axes, axes)], error)))
    assert len(axes) / 3.0 < np.mean(squares) < 3.0 * len(axes)


def test_shapes_look_the_same_after_their_rotations() -> None:
    quarter, half = (math.pi / 2.0,), (math.pi,)
    assert looks_same(CUP.geometries, UP)
    assert not looks_same(CUP.geometries, (1.0, 0.0, 0.0))
    assert not looks_same(MUG.geometries, UP)
    assert looks_same(BALL.geometries, (1.0, 0.0, 0.0))
    assert looks_same(BRICK.geometries, UP, half)
    assert not looks_same(BRICK.geometries, UP, quarter)


@cache
def digest() -> str:
    """Of all that is found, bit by bit."""
    found = looked(MUG, standing(MUG, 0.02, 0.01, 77.0), camera(), seed=5)
    numbers = (found.X_WO.matrix, found.covariance, np.array([found.residual, found.inliers, found.pixels]))
    return hashlib.sha256(b"".join(np.ascontiguousarray(each).tobytes() for each in numbers)).hexdigest()


def test_same_picture_same_bits_in_another_process() -> None:
    again = subprocess.run([sys.executable, Path(__file__)], check=True, capture_output=True, text=True).stdout
    assert again.strip() == digest()
    digest.cache_clear()
    assert again.strip() == digest()


if __name__ == "__main__":
    sys.stdout.write(digest())
