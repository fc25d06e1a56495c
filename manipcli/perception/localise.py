"""The pose of a body of known shape from one depth picture.

A pure function of what the camera measured and what the robot believes. It knows nothing of the truth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manipcli.core.geometry import Array, Transform, frozen, wrapped
from manipcli.perception.fit import Comparison
from manipcli.perception.picture import cut
from manipcli.perception.search import OUTSIDE, Found, search
from manipcli.perception.seen_surface import key, looks_same, seen_surface
from manipcli.render.lens import Lens
from manipcli.render.surface import Surface
from manipcli.scene.scene import Body

LEAST_PIXELS = 30
"""That show the body."""
LEAST_INLIERS, LEAST_OPAQUE = 0.5, 0.8
"""Share of the pixels that should show the body and do, and of those of them that nothing else covers."""
ROOM = 0.02
"""Added to the region on every side when looking [m], so that a body just outside is found and refused."""


@dataclass(frozen=True, slots=True)
class DepthView:
    """What a depth camera measured, as the robot knows it.

    Attributes:
        lens: of the camera.
        X_WC: optical frame C (z forward, x right, y down) in the world, from the joints of the robot.
        depth: (h, w) along z [m]; 0 or NaN: not measured.
        noise: standard deviation of depth [m], for each pixel (h, w) or for all.
    """

    lens: Lens
    X_WC: Transform
    depth: Array
    noise: Array | float


@dataclass(frozen=True, slots=True)
class Prior:
    """What the robot believes of the body before it looks.

    Attributes:
        body: with its geometries in O.
        X_WO: believed pose.
        region: (3,) half lengths [m] of the box, along the axes of the world about `X_WO`, that contains its origin; an
            axis with 0 is known.
        rotation: largest rotation about the world's z axis from `X_WO` [rad]; pi: any, 0: known. Its tilt is known.
    """

    body: Body
    X_WO: Transform
    region: Array
    rotation: float


@dataclass(frozen=True, slots=True)
class Localisation:
    """Where the body is.

    Attributes:
        X_WO: its pose.
        covariance: (6, 6) of translation [m2], then rotation [rad2], in the axes of the world.
        residual: root mean square of the depth errors of explained pixels [m].
        inliers: share of the pixels that should show the body and do, 0 to 1.
        pixels: number of pixels that show it.
        free: (3,) axis in the world about which the shape looks the same, so that its rotation stays as believed, or
            None.
    """

    X_WO: Transform
    covariance: Array
    residual: float
    inliers: float
    pixels: int
    free: Array | None


class NotSeen(Exception):
    """The picture does not show the body where it can be.

    Attributes:
        reason: what is missing, with the numbers, as the end of a sentence.
    """

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


def localise(view: DepthView, prior: Prior, expected: Array) -> Localisation:
    """The pose of a body from a depth picture.

    Args:
        view: what was measured.
        prior: what is believed.
        expected: (h, w) depth [m] of everything believed without the body; infinite where nothing is.

    Raises:
        NotSeen: too few pixels, no pose that explains them, or a pose outside the region.
    """
    shown = seen_surface(prior.body.geometries)
    if not len(shown.faces):
        raise NotSeen("it has no shape that a camera can see")
    free = looks_same(prior.body.geometries, key(prior.X_WO.R[2]))
    low, high = _volume(prior, shown)
    picture = cut(view.lens, view.X_WC, view.depth, view.noise, expected, low, high)
    if picture is None:
        raise NotSeen("its region is outside the picture")
    pixels = int(picture.near.sum())
    if pixels < LEAST_PIXELS:
        raise NotSeen(f"{pixels} pixels show something unexpected in its region, at least {LEAST_PIXELS} are needed")
    reach = np.append(np.asarray(prior.region, dtype=np.float64), 0.0 if free else prior.rotation)
    found = search(picture, shown, prior.X_WO, reach)
    state, information = found.fit.refined(found.state, 0.0, edges=True)
    state, information = found.fit.refined(state, 0.0, edges=True)
    comparison = found.fit.compare(state)
    _explained(comparison)
    covariance = np.zeros((6, 6))
    index = np.array([0, 1, 2, 5])[found.fit.free]
    covariance[np.ix_(index, index)] = max(comparison.spread, 1.0) ** 2 * np.linalg.inv(information)
    _inside(state[:3], reach[:3], np.sqrt(np.diag(covariance)[:3]))
    covariance += _ambiguity(found, prior.body, key(prior.X_WO.R[2]))
    if free:
        covariance[5, 5] = prior.rotation**2 / 3.0
    state[:3] = np.clip(state[:3], -reach[:3], reach[:3])
    return Localisation(
        X_WO=found.fit.pose(state),
        covariance=frozen(covariance),
        residual=comparison.residual,
        inliers=comparison.inliers,
        pixels=comparison.explained,
        free=frozen((0.0, 0.0, 1.0)) if free else None,
    )


def _volume(prior: Prior, shown: Surface) -> tuple[Array, Array]:
    """Corners in the world of the box that the body can be in, with some room."""
    offsets = shown.vertices @ prior.X_WO.R.T
    low, high = offsets.min(axis=0), offsets.max(axis=0)
    if prior.rotation > 0.0:
        radius = float(np.hypot(offsets[:, 0], offsets[:, 1]).max())
        low[:2], high[:2] = -radius, radius
    reach = np.asarray(prior.region, dtype=np.float64) + ROOM
    return prior.X_WO.p + low - reach, prior.X_WO.p + high + reach


def _explained(comparison: Comparison) -> None:
    """Raise NotSeen unless the picture shows the body."""
    count, covered, missing = comparison.explained, comparison.covered, comparison.missing
    if count < LEAST_PIXELS or comparison.inliers < LEAST_INLIERS or count < LEAST_OPAQUE * (count + missing):
        raise NotSeen(
            f"no pose in its region explains the picture: of {count + covered + missing} pixels that the best one "
            f"would show, {count} agree, {missing} show something behind it, {covered} something in front"
        )


def _inside(offset: Array, reach: Array, deviation: Array) -> None:
    """Raise NotSeen if a position is outside the region."""
    beyond = np.abs(offset) - reach
    k = int(np.argmax(beyond - 3.0 * deviation))
    if beyond[k] > OUTSIDE + 3.0 * deviation[k]:
        raise NotSeen(
            f"its best pose is {1e3 * beyond[k]:.1f} mm outside its region: {1e3 * offset[k]:.1f} mm along {'xyz'[k]} "
            f"from where it was believed to be, at most {1e3 * reach[k]:.1f} mm are possible"
        )


def _ambiguity(found: Found, body: Body, axis: tuple[float, float, float]) -> Array:
    """(6, 6) covariance of other poses that explain the picture as well, without those in which it looks the same."""
    covariance = np.zeros((6, 6))
    for state in found.equal:
        apart = state - found.state
        if not looks_same(body.geometries, axis, (float(apart[3]),)):
            error = np.array([*apart[:3], 0.0, 0.0, float(wrapped(apart[3]))])
            covariance += np.outer(error, error) / (len(found.equal) + 1)
    covariance[5, 5] += found.flat**2 / 12.0
    return covariance
