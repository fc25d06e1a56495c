"""Differences between two runs that are too small to matter, by unit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

FLOORS: Final[Mapping[str, float]] = {"s": 0.05, "J": 1.0, "m": 1e-3, "rad": math.radians(0.5), "N": 0.5}
"""Differences that are always ignored, by SI unit."""


def share_of(share: float, value: float, unit: str) -> float:
    """The allowed difference in `unit`: `share` of |`value`|, or the floor of the unit if that is more."""
    return max(share * abs(value), FLOORS.get(unit, 0.0))
