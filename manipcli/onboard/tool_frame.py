"""The tool frame of a hand: between its finger tips, +z out of the hand, y in the direction in which they close."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.core.units import readable
from manipcli.onboard.closure import SLAB, STEPS, Closure, HandShape

INSIDE: Final = 0.012
"""[m] The frame is so far inside the finger tips."""
BESIDE: Final = 0.006
"""[m] A fixed jaw is so far from the object before the other closes: more than the clearance of plans."""
PAST: Final = 0.005
"""[m] The frame is at most so far beyond the tip of the shorter finger."""
SNAP: Final = np.cos(np.radians(20.0))
"""Axes nearer than 20 deg to an axis of the palm are that axis."""


@dataclass(frozen=True, slots=True, eq=False)
class ToolFrame:
    """A tool frame.

    Attributes:
        link: the palm.
        X_PT: its pose there.
        widest: [m] the largest gap between the fingers.
        narrowest: [m] the smallest.
        evidence: why.
    """

    link: str
    X_PT: Transform
    widest: float
    narrowest: float
    evidence: str


def guess_tool_frame(shape: HandShape, closure: Closure, *, width: float) -> ToolFrame:
    """The frame, for an object of this width [m]."""
    R = _axes(shape, closure)
    shares = np.linspace(0.0, 1.0, STEPS + 1)
    between = [_between(shape, closure, share, R) for share in shares]
    gaps = np.array([gap.width for gap in between])
    room = 2.0 * BESIDE if shape.hand.fixed else 0.0
    wanted = min(width + room, 0.6 * float(gaps.max()) + room)
    k = int(np.argmin(np.abs(gaps - wanted)))
    # fingers that curl reach furthest before they are closed, and must not meet what the object stands on
    beyond = max(gap.far for gap in between[: k + 1]) - between[k].far
    p = R @ between[k].p + R[:, 2] * max(0.0, min(beyond, between[k].room))
    snapped = "along axes of the palm" if np.allclose(np.abs(R).max(axis=0), 1.0) else "not along axes of the palm"
    evidence = (
        f"between the finger tips where they are {readable(float(gaps[k]), 'm')} apart, "
        f"{readable(INSIDE, 'm')} inside; y: they close along it; z: out of the hand ({snapped})"
    )
    X_PT = Transform.of(xyz=np.round(p, 4), R=R)
    return ToolFrame(shape.hand.palm, X_PT, float(gaps.max()), float(max(0.0, gaps.min())), evidence)


def _axes(shape: HandShape, closure: Closure) -> Array:
    """R_PT (3, 3)."""
    moved = []
    for finger in closure.fingers:
        step = shape.tip(finger, closure.closed) - shape.tip(finger, closure.opened)
        moved.append(step - (step @ closure.out) * closure.out)
    d = np.array(moved)
    if shape.hand.fixed or len(d) == 1:
        y = d[0]
    else:
        values, vectors = np.linalg.eigh(d.T @ d)
        y = d[0] if values[-2] > 0.9 * values[-1] else vectors[:, -1]
    z = _snapped(closure.out)
    y = y - (y @ z) * z
    if float(np.linalg.norm(y)) < 1e-9:
        y = np.linalg.svd(z[None])[2][1]
    y = _snapped(y / np.linalg.norm(y))
    y = y - (y @ z) * z
    y /= np.linalg.norm(y)
    if y[int(np.argmax(np.abs(y)))] < 0.0:
        y = -y
    return np.column_stack([np.cross(y, z), y, z]) + 0.0


def _snapped(axis: Array) -> Array:
    k = int(np.argmax(np.abs(axis)))
    return np.sign(axis[k]) * np.eye(3)[k] if abs(axis[k]) >= SNAP else axis


class _Gap(NamedTuple):
    """[m] Width between the fingers; `p` (3,) the middle of their tips; how far out the tips are, and `p` may be."""

    width: float
    p: Array
    far: float
    room: float = 0.0


def _between(shape: HandShape, closure: Closure, share: float, R: Array) -> _Gap:
    """The gap of the fingers at a share of their way, in axes R."""
    positions = (1.0 - share) * closure.opened + share * closure.closed
    sides: tuple[list[Array], list[Array]] = ([], [])
    sets = [shape.points(links, positions) @ R for links in closure.fingers]
    if shape.hand.fixed:
        sets.append(shape.points(shape.hand.fixed, positions) @ R)
    opened = [shape.points(links, closure.opened) @ R for links in closure.fingers]
    if shape.hand.fixed:
        opened.append(shape.points(shape.hand.fixed, closure.opened) @ R)
    tops = [points[points[:, 2] >= points[:, 2].max() - SLAB] for points in opened]
    middles = np.array([top[:, 1].mean() for top in tops])
    centre = (middles.max() + middles.min()) / 2.0
    for points, middle in zip(sets, middles, strict=True):
        sides[int(middle > centre)].append(points)
    if not sides[0] or not sides[1]:
        every = np.vstack(sets)
        top = every[every[:, 2] >= every[:, 2].max() - SLAB]
        far = float(every[:, 2].max())
        return _Gap(0.0, np.array([*top[:, :2].mean(axis=0), far - INSIDE]), far)
    low, high = (np.vstack(side) for side in sides)
    short, long = sorted((float(low[:, 2].max()), float(high[:, 2].max())))
    low, high = (side[side[:, 2] >= short - SLAB] for side in (low, high))
    inner = float(low[:, 1].max()), float(high[:, 1].min())
    x = (float(low[:, 0].mean()) + float(high[:, 0].mean())) / 2.0
    z = min(long - INSIDE, short + PAST)
    return _Gap(inner[1] - inner[0], np.array([x, (inner[0] + inner[1]) / 2.0, z]), long, short + PAST - z)
