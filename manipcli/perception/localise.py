"""The pose of a body of known shape from one depth picture.

A pure function of what the camera measured and what the robot believes. It knows nothing of the truth.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from manipcli.core.geometry import Array, Transform, frozen, wrapped
from manipcli.perception.fit import Comparison, Fit
from manipcli.perception.picture import Mask, Picture, cut
from manipcli.perception.seen_surface import key, looks_same, seen_surface
from manipcli.render.lens import Lens
from manipcli.render.surface import Surface
from manipcli.scene.scene import Body

LEAST_PIXELS = 30
"""That show the body."""
LEAST_INLIERS = 0.5
"""Share of the pixels that should show the body and do."""
ROOM = 0.02
"""Added to the region on every side when looking [m], so that a body just outside is found and refused."""
OUTSIDE = 2e-3
"""A body is refused farther outside its region than this and three standard deviations [m]."""
COARSE, FINE = 48, 160
"""Most pixels along a side of the picture that starts and results are compared in."""
YAWS = math.radians(20.0)
"""Largest angle between starts."""
BEGUN, KEPT = 8, 4
"""Starts that are followed after the first step, and that are compared in all pixels."""
SLACK = 3e-3
"""Depth error that does not count against a pose before it is refined [m]."""
APART, APART_ROTATION = 2e-3, math.radians(4.0)
"""Poses closer than this are the same [m], [rad]."""
TIE = 25.0
"""Difference of cost between poses that explain a picture equally well, in squared standard deviations."""
SCAN, FLAT, ALIKE = math.radians(5.0), math.radians(15.0), 10
"""Rotations are compared in such steps [rad]. Over such an angle or more [rad], it cannot be told which is right if at most
this many pixels more speak against them."""


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
    coarse = Fit(small := picture.strided(COARSE), shown, prior.X_WO, reach)
    begun = [_begun(coarse, *start) for start in _starts(small, float(reach[3]))]
    kept = _distinct([_coarse(coarse, each.state) for each in _best(begun, BEGUN)])
    kept = kept[:KEPT]
    body = np.concatenate([coarse.pose(each.state).apply(shown.corners) for each in kept])
    fine = Fit(picture.around(body).strided(FINE), shown, prior.X_WO, reach)
    found = _distinct([_fine(fine, each.state) for each in kept])
    best = _best(found, 1)[0].comparison
    equal = [each for each in found if each.comparison.cost <= best.cost + TIE * max(best.spread, 1.0) ** 2]
    chosen = min(equal, key=lambda each: abs(float(wrapped(each.state[3]))))
    return _checked(fine, chosen, [each.state for each in equal], prior, free)


def _volume(prior: Prior, shown: Surface) -> tuple[Array, Array]:
    """Corners in the world of the box that the body can be in, with some room."""
    offsets = shown.vertices @ prior.X_WO.R.T
    low, high = offsets.min(axis=0), offsets.max(axis=0)
    if prior.rotation > 0.0:
        radius = float(np.hypot(offsets[:, 0], offsets[:, 1]).max())
        low[:2], high[:2] = -radius, radius
    reach = np.asarray(prior.region, dtype=np.float64) + ROOM
    return prior.X_WO.p + low - reach, prior.X_WO.p + high + reach


def _starts(picture: Picture, rotation: float) -> Iterator[tuple[Array, Mask]]:
    """States to start from, each with the pixels whose middle is the body's: all, and each larger patch of them."""
    from scipy.ndimage import label

    patches, count = label(picture.near)
    sizes = np.bincount(patches.reshape(-1), minlength=count + 1)[1:]
    large = [k + 1 for k in np.argsort(-sizes, kind="stable")[:3] if sizes[k] >= 0.2 * sizes.max()]
    masks: list[Mask] = [picture.near]
    if len(large) > 1:
        masks += [patches == k for k in large]
    full = rotation > math.pi - 1e-6
    steps = math.ceil((2.0 * math.pi if full else 2.0 * rotation) / YAWS)
    yaws = np.arange(steps) * 2.0 * math.pi / steps if full else np.linspace(-rotation, rotation, steps + 1)
    for mask in masks:
        for yaw in yaws if steps else (0.0,):
            yield np.array([0.0, 0.0, 0.0, yaw]), mask


@dataclass(frozen=True, slots=True)
class _Hypothesis:
    """A state of a fit, and how it explains the picture."""

    state: Array
    comparison: Comparison


def _begun(fit: Fit, start: Array, mask: Mask) -> _Hypothesis:
    state = start
    for _ in range(2):
        state = fit.shifted(state, mask)
    state, _ = fit.refined(state, 0.03)
    return _Hypothesis(state, fit.compare(state, slack=SLACK))


def _coarse(fit: Fit, state: Array) -> _Hypothesis:
    for gate in (0.02, 0.01):
        state, _ = fit.refined(state, gate, edges=True)
    return _Hypothesis(state, fit.compare(state, slack=SLACK))


def _fine(fit: Fit, state: Array) -> _Hypothesis:
    for gate in (0.005, 0.0, 0.0):
        state, _ = fit.refined(state, gate, edges=True)
    return _Hypothesis(state, fit.compare(state))


def _best(hypotheses: list[_Hypothesis], count: int) -> list[_Hypothesis]:
    """Those with the least costs, the least first."""
    return sorted(hypotheses, key=lambda each: each.comparison.cost)[:count]


def _distinct(hypotheses: list[_Hypothesis]) -> list[_Hypothesis]:
    """Of those that are nearly the same, the best."""
    found: list[_Hypothesis] = []
    for each in _best(hypotheses, len(hypotheses)):
        apart = (each.state - other.state for other in found)
        if all(np.linalg.norm(d[:3]) > APART or abs(float(wrapped(d[3]))) > APART_ROTATION for d in apart):
            found.append(each)
    return found


def _centred(fit: Fit, chosen: _Hypothesis, rotation: float) -> tuple[Array, float]:
    """The state in the middle of the rotations that explain the picture as well, such as those that hide a handle, and
    the angle between the outermost ones [rad]."""
    most = chosen.comparison.against + ALIKE
    ends = []
    for sign in (-1.0, 1.0):
        state, count = chosen.state.copy(), 0
        while count * SCAN < math.pi and (rotation >= math.pi or abs(state[3] + sign * SCAN) <= rotation):
            state[3] += sign * SCAN
            if fit.compare(state).against > most:
                break
            count += 1
        ends.append(sign * count * SCAN)
    state, width = chosen.state.copy(), ends[1] - ends[0]
    if width < FLAT:
        return state, 0.0
    state[3] += (ends[0] + ends[1]) / 2.0
    return state, width


def _checked(fit: Fit, chosen: _Hypothesis, equal: list[Array], prior: Prior, free: bool) -> Localisation:
    state, flat = _centred(fit, chosen, 0.0 if free else prior.rotation)
    for _ in range(2):
        state, information = fit.refined(state, 0.0, edges=True)
    comparison = fit.compare(state)
    if comparison.explained < LEAST_PIXELS or comparison.inliers < LEAST_INLIERS:
        raise NotSeen(
            f"no pose in its region explains the picture: the best one explains {comparison.explained} pixels, "
            f"{100.0 * comparison.inliers:.0f} % of those that should show it; at least {LEAST_PIXELS} and "
            f"{100.0 * LEAST_INLIERS:.0f} % are needed"
        )
    covariance = np.zeros((6, 6))
    index = np.array([0, 1, 2, 5])[fit.free]
    covariance[np.ix_(index, index)] = max(comparison.spread, 1.0) ** 2 * np.linalg.inv(information)
    for other in equal:
        # Poses that explain the picture as well, unless the body looks the same.
        apart = np.append(other[:3] - chosen.state[:3], wrapped(other[3] - chosen.state[3]))[[0, 1, 2, 2, 2, 3]]
        apart[3:5] = 0.0
        if not looks_same(prior.body.geometries, key(prior.X_WO.R[2]), (float(apart[5]),)):
            covariance += np.outer(apart, apart) / len(equal)
    covariance[5, 5] += flat**2 / 12.0
    if free:
        covariance[5, 5] = prior.rotation**2 / 3.0
    reach = np.asarray(prior.region, dtype=np.float64)
    beyond = np.abs(state[:3]) - reach
    worst = int(np.argmax(beyond))
    if beyond[worst] > OUTSIDE + 3.0 * math.sqrt(covariance[worst, worst]):
        raise NotSeen(
            f"its best pose is {1e3 * beyond[worst]:.1f} mm outside its region: {1e3 * state[worst]:.1f} mm from the "
            f"believed position along {'xyz'[worst]}, where at most {1e3 * reach[worst]:.1f} mm are possible"
        )
    state[:3] = np.clip(state[:3], -reach, reach)
    state[3] = wrapped(state[3])
    return Localisation(
        X_WO=fit.pose(state),
        covariance=frozen(covariance),
        residual=comparison.residual,
        inliers=comparison.inliers,
        pixels=comparison.explained,
        free=frozen((0.0, 0.0, 1.0)) if free else None,
    )
