"""Search for the pose of a body in a picture: starts over the rotations, and which of the results is right."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from manipcli.core.geometry import Array, Transform, wrapped
from manipcli.perception.fit import Comparison, Fit
from manipcli.perception.picture import Mask, Picture, corners
from manipcli.render.surface import Surface

COARSE, FINE = 48, 100
"""Most pixels along a side of the picture in which starts, and results, are compared."""
YAWS = math.radians(20.0)
"""Largest angle between starts."""
BEGUN, KEPT = 8, 4
"""Starts that are followed after the first step, and that are compared in more pixels."""
SLACK = 3e-3
"""Depth error that does not count against a pose before it is refined [m]."""
APART, APART_ROTATION = 2e-3, math.radians(4.0)
"""Poses closer than this are the same [m], [rad]."""
TIE = 25.0
"""Difference of cost between poses that explain a picture equally well, in squared standard deviations."""
SCAN, FLAT, ALIKE = math.radians(5.0), math.radians(15.0), 10
"""Rotations are compared in such steps [rad]. Over such an angle or more [rad], nothing shows which is right if at most
this many pixels more speak against them."""
OUTSIDE = 2e-3
"""A pose is outside the region from this on [m], beside its standard deviation."""


@dataclass(frozen=True, slots=True)
class Found:
    """The result of a search.

    Attributes:
        fit: to the picture.
        state: the best one.
        flat: angle over which the picture shows nothing of its rotation [rad].
        equal: states that explain the picture as well, beside it.
    """

    fit: Fit
    state: Array
    flat: float
    equal: tuple[Array, ...]


def search(picture: Picture, shown: Surface, X_WO: Transform, reach: Array) -> Found:
    """The state of the body that explains a picture best.

    Args:
        picture: what was measured; with pixels that are `near`.
        shown: the surface of the body in O.
        X_WO: believed pose.
        reach: (4,) the state is at most this before; 0: known.
    """
    cloud, size = picture.cloud(), 2.0 * float(np.linalg.norm(shown.vertices, axis=1).max())
    small = picture.around(corners(cloud.min(axis=0) - size, cloud.max(axis=0) + size)).strided(COARSE)
    coarse = Fit(small, shown, X_WO, reach)
    begun = [_begun(coarse, *start) for start in _starts(small, float(reach[3]))]
    kept = _distinct([_coarse(coarse, each.state) for each in _best(begun, BEGUN)])[:KEPT]
    body = np.concatenate([coarse.pose(each.state).apply(shown.corners) for each in kept])
    fine = Fit(picture.around(body).strided(FINE), shown, X_WO, reach)
    found = _distinct([_fine(fine, each.state) for each in kept])
    best = found[0].comparison
    equal = [each for each in found if each.comparison.cost <= best.cost + TIE * max(best.spread, 1.0) ** 2]
    equal = [each for each in equal if (np.abs(each.state[:3]) <= reach[:3] + OUTSIDE).all()] or equal
    chosen = min(equal, key=lambda each: abs(float(wrapped(each.state[3]))))
    state, flat = _centred(fine, chosen, float(reach[3]))
    return Found(fine, state, flat, tuple(each.state for each in equal if each is not chosen))


def _starts(picture: Picture, rotation: float) -> Iterator[tuple[Array, Mask]]:
    """States to start from, each with the pixels whose middle is the body's: all, and each larger patch of them."""
    from scipy.ndimage import label

    numbers, count = label(picture.near)
    sizes = np.bincount(numbers.reshape(-1), minlength=count + 1)[1:]
    large = [int(k) + 1 for k in np.argsort(-sizes, kind="stable")[:3] if sizes[k] >= 0.2 * sizes.max()]
    masks: list[Mask] = [picture.near]
    if len(large) > 1:
        masks += [numbers == k for k in large]
    full = rotation > math.pi - 1e-6
    steps = math.ceil((2.0 * math.pi if full else 2.0 * rotation) / YAWS)
    yaws = np.arange(steps) * 2.0 * math.pi / steps if full else np.linspace(-rotation, rotation, steps + 1)
    for mask in masks:
        for yaw in yaws if steps else (0.0,):
            yield np.array([0.0, 0.0, 0.0, yaw]), mask


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """A state of a fit, and how it explains the picture."""

    state: Array
    comparison: Comparison


def _begun(fit: Fit, start: Array, mask: Mask) -> Hypothesis:
    state = start
    for _ in range(2):
        state = fit.shifted(state, mask)
    state, _ = fit.refined(state, 0.03)
    return Hypothesis(state, fit.compare(state, slack=SLACK))


def _coarse(fit: Fit, state: Array) -> Hypothesis:
    for gate in (0.02, 0.01):
        state, _ = fit.refined(state, gate, edges=True)
    return Hypothesis(state, fit.compare(state, slack=SLACK))


def _fine(fit: Fit, state: Array) -> Hypothesis:
    for gate in (0.005, 0.0, 0.0):
        state, _ = fit.refined(state, gate, edges=True)
    return Hypothesis(state, fit.compare(state))


def _best(hypotheses: list[Hypothesis], count: int) -> list[Hypothesis]:
    """Those with the least costs, the least first."""
    return sorted(hypotheses, key=lambda each: each.comparison.cost)[:count]


def _distinct(hypotheses: list[Hypothesis]) -> list[Hypothesis]:
    """Of those that are nearly the same, the best."""
    found: list[Hypothesis] = []
    for each in _best(hypotheses, len(hypotheses)):
        apart = (each.state - other.state for other in found)
        if all(np.linalg.norm(d[:3]) > APART or abs(float(wrapped(d[3]))) > APART_ROTATION for d in apart):
            found.append(each)
    return found


def _centred(fit: Fit, chosen: Hypothesis, rotation: float) -> tuple[Array, float]:
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
