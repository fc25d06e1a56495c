"""Numbers as people read them: SI in, the customary unit out."""

from __future__ import annotations

import math

_CUSTOMARY = {
    "m": ("mm", 1e3),
    "rad": ("deg", 180.0 / math.pi),
    "rad/s": ("deg/s", 180.0 / math.pi),
    "m/s": ("mm/s", 1e3),
}


def quantity(value: float, unit: str) -> str:
    """`value` in the SI `unit` as text in its customary unit, to three significant digits at least.

    Lengths are given in mm below 1 m, angles in degrees; any other unit is kept. `0.0041, "m"` gives `4.1 mm`.
    """
    name, scale = _CUSTOMARY.get(unit, (unit, 1.0))
    if unit == "m" and abs(value) >= 1.0:
        name, scale = unit, 1.0
    return f"{_short(value * scale)} {name}".rstrip()


def _short(number: float) -> str:
    if not math.isfinite(number):
        return "unlimited" if number > 0 else str(number)
    size = abs(number)
    if size >= 100 or number == int(number):
        return f"{number:.0f}"
    return f"{number:.1f}" if size >= 1 else f"{number:.2g}"
