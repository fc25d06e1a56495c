"""The search for a hole: a peg slides along a spiral until it drops in.

On the Archimedean spiral r = p phi / (2 pi) no point of the disc is farther than p / 2 from the path. A peg with the
clearance c drops in where its axis is within c of that of the hole, so that p <= 2 c finds it. Chhatpar and Branicky,
Search strategies for peg-in-hole assemblies with position uncertainty (2001).
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from manipcli.core.geometry import Array

SHARE: Final = 1.4
"""Pitch per clearance; less than 2, as friction bends the path."""
SPEED: Final = 0.007
"""[m/s] On the spiral."""
TURNING: Final = 9.0
"""[rad/s] At most: near the middle it is slower."""
START: Final = 0.5
"""[s] In which it gets up to speed, and rests at its end."""
SAMPLE: Final = 0.02
"""[s] Between two points."""
FINEST: Final = 5e-5
"""[m] Least pitch."""


def pitch_of(clearance: float) -> float:
    """[m] between two turns."""
    return max(SHARE * clearance, FINEST)


def spiral(pitch: float, radius: float) -> tuple[Array, Array]:
    """Times (k) [s] and points (k, 2) [m] of the spiral that covers the disc of `radius` [m], and straight back.

    The angular rate is min(TURNING, SPEED / sqrt(r^2 + (pitch / 2 pi)^2)); it rises and falls smoothly.
    """
    a, fine = pitch / math.tau, 1e-3
    last = (radius + pitch / 2.0) / a  # the outermost turn has no neighbour
    phi = np.linspace(0.0, last, max(100, round(20.0 * last)))
    slow = np.maximum(a * np.hypot(1.0, phi) / SPEED, 1.0 / TURNING)  # [s/rad]
    clock = np.append(0.0, np.cumsum(np.diff(phi) * (slow[1:] + slow[:-1]) / 2.0))
    total = float(clock[-1]) + START
    at = np.arange(0.0, total + fine, fine)
    pace = _smooth(at / START) * _smooth((total - at) / START)
    passed = np.append(0.0, np.cumsum((pace[1:] + pace[:-1]) / 2.0) * fine)
    out = np.interp(passed / passed[-1] * clock[-1], clock, phi)[:: round(SAMPLE / fine)]
    points = a * out[:, None] * np.stack([np.cos(out), np.sin(out)], axis=1)
    ticks = max(math.ceil(START / SAMPLE), math.ceil(2.0 * a * last / SPEED / SAMPLE))
    back = (1.0 - _smooth(np.arange(1, ticks + 1) / ticks))[:, None] * points[-1]
    points = np.concatenate([points, back])
    return SAMPLE * np.arange(len(points), dtype=np.float64), points


def _smooth(u: Array) -> Array:
    u = np.clip(u, 0.0, 1.0)
    return np.asarray(u**3 * (10.0 - 15.0 * u + 6.0 * u * u))
