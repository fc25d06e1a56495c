"""Parts of English sentences about a task: quantities in short units, ranges, points, names, enumerations.

`amount(0.08, "m")` is `8 cm`, `between((0.08, 0.2), "m")` is `8 to 20 cm`, `point((0.5, 0.2, 0))` is `[0.5, 0.2, 0] m`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

DIGITS: Final = 4
"""Significant digits."""
WIDE: Final = 0.2
"""[m] A point further away is written in metres."""
_CHOICES: Final[dict[str, tuple[tuple[str, float], ...]]] = {
    "m": (("cm", 1e2), ("mm", 1e3), ("m", 1.0)),
    "m/s": (("cm/s", 1e2), ("mm/s", 1e3), ("m/s", 1.0)),
    "rad": (("deg", 180.0 / math.pi),),
    "rad/s": (("deg/s", 180.0 / math.pi),),
    "rad/s^2": (("deg/s^2", 180.0 / math.pi),),
    "kg": (("g", 1e3), ("kg", 1.0)),
    "s": (("s", 1.0), ("ms", 1e3), ("min", 1 / 60)),
    "N": (("N", 1.0), ("mN", 1e3)),
}


def amount(value: float, symbol: str) -> str:
    """`value` [SI unit `symbol`] in the unit that writes it shortest."""
    return between((value, value), symbol)


def between(bounds: Sequence[float], symbol: str) -> str:
    """A range of values in one unit; a single amount where both ends are equal."""
    return shortest(list(dict.fromkeys(bounds)), symbol, " to ", "{}")


def point(values: Sequence[float], symbol: str = "m") -> str:
    """A vector in one unit, in brackets."""
    wide = symbol == "m" and any(abs(value) >= WIDE for value in values)
    return shortest(list(values), symbol, ", ", "[{}]", si=wide)


def shortest(values: Sequence[float], symbol: str, by: str, form: str, *, si: bool = False) -> str:
    """`values` joined `by`, in the unit in which this is shortest; `si`: in the SI unit."""
    texts = []
    for unit, factor in ((symbol, 1.0),) if si else _CHOICES.get(symbol, ((symbol, 1.0),)):
        numbers = by.join(_number(value * factor) for value in values)
        if "e" not in numbers or len(_CHOICES.get(symbol, ())) < 2:
            texts.append(f"{form.format(numbers)} {unit}".rstrip())
    return min(texts, key=len) if texts else f"{form.format(by.join(f'{value:g}' for value in values))} {symbol}"


def _number(value: float) -> str:
    return f"{value:.{DIGITS}g}" if value and abs(value) > 1e-12 else "0"  # never -0


def share(value: float) -> str:
    """`50 %`."""
    return f"{_number(100.0 * value)} %"


def named(name: str) -> str:
    """A body, frame or part of the robot: `'cup'`, `the robot`, `link 'hand'`, `the tool`."""
    known = {"robot": "the robot", "tool": "the tool", "world": "the world", "base": "the robot's base"}
    return known.get(name) or (f"link '{name.removeprefix('robot/')}'" if name.startswith("robot/") else f"'{name}'")


def listing(words: Sequence[str], last: str = "and") -> str:
    """`a`, `a and b`, `a, b and c`."""
    return f" {last} ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))


def sentence(clause: str) -> str:
    """A clause with a capital at its start and a full stop."""
    return f"{clause[:1].upper()}{clause[1:]}{'' if clause.endswith(':') else '.'}"
