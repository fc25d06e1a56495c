"""The tool frame of a hand: between its finger tips, +z out of the hand, y in the direction in which they close."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.core.units import readable
from manipcli.model.hand.closure import STEPS, Closure, HandShape
from manipcli.model.hand.gap import INSIDE, closing_axis, gap_between

BESIDE: Final = 0.006
"""[m] A fixed jaw is so far from the object before the other closes: more than the clearance of plans."""
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
    between = [
        gap_between(shape, closure, (1.0 - share) * closure.opened + share * closure.closed, R) for share in shares
    ]
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
    y = closing_axis(shape, closure)
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
