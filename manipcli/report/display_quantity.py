"""SI values as text in customary units."""

from __future__ import annotations

import math

CUSTOMARY = {
    "m": ("mm", 1e3),
    "rad": ("deg", 180.0 / math.pi),
    "rad/s": ("deg/s", 180.0 / math.pi),
    "m/s": ("mm/s", 1e3),
}


def quantity(value: float, unit: str) -> str:
    """`value` in the SI `unit` as text in its customary unit, to at least two significant digits.

    Lengths are given in mm below 1 m, angles in degrees; any other unit is kept. `0.0041, "m"` gives `4.1 mm`.
    """
    if not math.isfinite(value):
        return "unlimited" if value > 0 else str(value)
    name, scale = (unit, 1.0) if unit == "m" and abs(value) >= 1.0 else CUSTOMARY.get(unit, (unit, 1.0))
    number = value * scale
    size = abs(number)
    digits = f"{number:.0f}" if size >= 100 else f"{number:.1f}" if size >= 1 else f"{number:z.2g}"
    return f"{digits} {name}".rstrip()


def data_size(size: int) -> str:
    """`15.4 MB`, in powers of ten."""
    value, unit = float(size), "B"
    for unit in ("B", "kB", "MB", "GB"):
        if value < 1000.0 or unit == "GB":
            break
        value /= 1000.0
    return f"{size} B" if unit == "B" else f"{value:.1f} {unit}"
