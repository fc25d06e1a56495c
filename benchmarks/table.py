"""Rows of a table: what was measured, against what, and the aim."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """One measurement. `values`: one per round; the median is printed; `aim`: at most that, None where none is set."""

    what: str
    values: tuple[float, ...]
    unit: str
    aim: float | None
    note: str = ""

    @property
    def median(self) -> float:
        return statistics.median(self.values)

    def cells(self) -> tuple[str, ...]:
        """What a line of the table shows."""
        low, high = min(self.values), max(self.values)
        spread = f"{low:.3g} .. {high:.3g}" if len(self.values) > 1 else ""
        if self.aim is None:
            verdict, aim = "", ""
        else:
            verdict, aim = ("yes" if self.median <= self.aim else "NO"), f"{self.aim:g}"
        return self.what, f"{self.median:.3g}", self.unit, aim, verdict, spread, self.note


HEAD = ("measured", "median", "unit", "at most", "met", "from .. to", "how")


def markdown(rows: Sequence[Row]) -> str:
    """The table as aligned Markdown."""
    lines = [HEAD, *(row.cells() for row in rows)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(HEAD))]
    texts = ["| " + " | ".join(cell.ljust(w) for cell, w in zip(line, widths, strict=True)) + " |" for line in lines]
    texts.insert(1, "|" + "|".join("-" * (width + 2) for width in widths) + "|")
    return "\n".join(texts)
