"""The sample of a task's `vary:` that a run used, and its drawn values, as stored in the log."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass

SAMPLE = "sample"
"""Metadata of the log of a sample: `number`, `values` by path as JSON, in SI, and `design` unless it is random."""

MOST_SHOWN = 8
"""Number of values shown in a line of text."""

Number = float | tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Drawn:
    """Sample `number` and its values in SI by path, as in `--set` (a whole number is an `int`).

    `design` is its design, `sobol:256`; "" for random samples.
    """

    number: int
    values: tuple[tuple[str, Number], ...]
    design: str = ""

    def __str__(self) -> str:
        """`sample 17: scene.cup.at=[0.7612, 0.00312], scene.cup.mass=0.2311`, at most `MOST_SHOWN` values."""
        return self.described(MOST_SHOWN)

    def described(self, most: int | None = None) -> str:
        """The same with at most `most` values; None: all."""
        first = [f"{path}={value_text(value)}" for path, value in self.values[:most]]
        rest = len(self.values) - len(first)
        name = f"sample {self.number}{f' of {self.design}' if self.design else ''}"
        if not first:
            return f"{name}: no values drawn"
        return f"{name}: {', '.join(first)}" + (f", and {rest} more" if rest else "")

    def to_metadata(self) -> dict[str, str]:
        """The metadata that `from_metadata` reads."""
        design = {"design": self.design} if self.design else {}
        return {"number": str(self.number), "values": json.dumps(dict(self.values)), **design}

    @staticmethod
    def from_metadata(metadata: Mapping[str, str]) -> Drawn:
        """The sample in the metadata of a log.

        Raises:
            ValueError: the metadata is damaged.
        """
        read = json.loads(metadata.get("values", "null"))
        number = metadata.get("number", "")
        if not isinstance(read, dict) or not number.isdecimal():
            raise ValueError("not a sample")
        return Drawn(
            int(number), tuple((path, _number(value)) for path, value in read.items()), metadata.get("design", "")
        )


def _number(value: object) -> Number:
    if isinstance(value, list):
        return tuple(_scalar(element) for element in value)
    return _scalar(value)


def _scalar(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError("not a number")
    return value


def value_text(value: Number) -> str:
    """A value as text with four digits, in SI."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(value_text, value))}]"
    return f"{value:.4g}"
