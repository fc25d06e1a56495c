"""What a sweep with the design `oat` shows of a number: up to which values the task passes, all others as written."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from manipcli.sweep.results import SampleResult
from manipcli.sweep.sampling import Column

HEADERS: Final = ("one at a time", "nominal", "tested", "passes", "smallest margin", "at")
"""Of the cells of `Levels`."""


@dataclass(frozen=True, slots=True)
class Levels:
    """A number at its levels.

    Attributes:
        column: the number.
        tested: least and most value.
        passes: least and most of the values next to the one in the file up to which all samples passed; None: the task
            as written has not passed.
        smallest: the smallest margin [tolerances], -inf where a step failed; `at`: the value.
    """

    column: Column
    tested: tuple[float, float]
    passes: tuple[float, float] | None
    smallest: float
    at: float

    @property
    def all_pass(self) -> bool:
        return self.passes == self.tested

    @property
    def cells(self) -> tuple[str, ...]:
        """One text for each of `HEADERS`."""
        passes = "none" if self.passes is None else "all" if self.all_pass else self._range(self.passes)
        margin = f"{self.smallest:.2f}".replace("-", "−") if math.isfinite(self.smallest) else "–"
        nominal, at = self.column.text(self.column.nominal), self.column.text(self.at)
        return (self.column.name, nominal, self._range(self.tested), passes, margin, at)

    def _range(self, ends: tuple[float, float]) -> str:
        least, most = map(self.column.text, ends)
        return least if least == most else f"{least} to {most}"

    def to_json(self) -> Mapping[str, object]:
        """The object in `--format json`."""
        smallest = self.smallest if math.isfinite(self.smallest) else None
        return {"tested": self.tested, "passes": self.passes, "smallest_margin": smallest, "at": self.at}


def levels(column: Column, values: Mapping[int, float], results: Sequence[SampleResult]) -> Levels | None:
    """The levels of a number, from its value in each sample; None without a sample of it.

    Sample 0 is the task as written. A sample of another number has the value in the file, as the level of this number
    that is the value in the file.
    """
    own = sorted(
        ((values[r.number], r) for r in results if r.number == 0 or values[r.number] != column.nominal),
        key=lambda pair: pair[0],
    )
    if len(own) < 2:
        return None
    worst = min(own, key=lambda pair: (pair[1].smallest, abs(pair[0] - column.nominal)))
    as_written = next((k for k, (_, result) in enumerate(own) if result.number == 0), None)
    passes = None
    if as_written is not None and own[as_written][1].passed:
        low = high = as_written
        while low > 0 and own[low - 1][1].passed:
            low -= 1
        while high < len(own) - 1 and own[high + 1][1].passed:
            high += 1
        passes = (own[low][0], own[high][0])
    return Levels(column, (own[0][0], own[-1][0]), passes, worst[1].smallest, worst[0])
