"""Which sample of a task's `vary:` a run was, and what was drawn for it: as the log keeps it and reports tell it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass

SAMPLE = "sample"
"""Metadata of the log of a sample: `number`, and `values` as JSON by their paths, in SI."""

MOST_SHOWN = 8
"""Values that are told in a line of text."""

Number = float | tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Drawn:
    """Sample `number`: for each path, as after `--set`, its value in SI (a whole number is an `int`)."""

    number: int
    values: tuple[tuple[str, Number], ...]

    def __str__(self) -> str:
        """`sample 17: scene.cup.at=[0.7612, 0.00312], scene.cup.mass=0.2311`, in a line that is not too long."""
        return self.told(MOST_SHOWN)

    def told(self, most: int | None = None) -> str:
        """The same with `most` values; by default with all."""
        first = [f"{path}={value_text(value)}" for path, value in self.values[:most]]
        rest = len(self.values) - len(first)
        if not first:
            return f"sample {self.number}: nothing is drawn"
        return f"sample {self.number}: {', '.join(first)}" + (f", and {rest} more" if rest else "")

    def to_metadata(self) -> dict[str, str]:
        """What `from_metadata` reads."""
        return {"number": str(self.number), "values": json.dumps(dict(self.values))}

    @staticmethod
    def from_metadata(metadata: Mapping[str, str]) -> Drawn:
        """What a log says.

        Raises:
            ValueError: this is not what `to_metadata` writes.
        """
        read = json.loads(metadata.get("values", "null"))
        number = metadata.get("number", "")
        if not isinstance(read, dict) or not number.isdecimal():
            raise ValueError("no sample")
        return Drawn(int(number), tuple((path, _number(value)) for path, value in read.items()))


def _number(value: object) -> Number:
    if isinstance(value, list):
        return tuple(_scalar(one) for one in value)
    return _scalar(value)


def _scalar(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError("no number")
    return value


def value_text(value: Number) -> str:
    """To four digits, in SI."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(value_text, value))}]"
    return f"{value:.4g}"
