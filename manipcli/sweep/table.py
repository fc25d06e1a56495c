"""A sweep as CSV: one row per sample, sorted, the same bytes whatever the order and the number of workers."""

from __future__ import annotations

import csv
import io
import math
from typing import Final

from manipcli.core.text import escape
from manipcli.sweep.analysis import Analysis

FIXED: Final = ("sample", "outcome", "step", "expectation", "simulated_time", "smallest_margin")
"""Columns of every sweep; `smallest_margin` in tolerances, empty where a step failed."""
MARGIN: Final = "margin "
"""How the name of a column with a margin begins; it ends with its unit: `margin upright cup [rad]`."""


def render_csv(analysis: Analysis) -> str:
    """The table: fixed columns, the margin of each expectation in SI, the value of each number in SI."""
    names = [(spread.name, spread.unit) for spread in analysis.spreads]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    margins = [f"{MARGIN}{escape(name)}{f' [{unit}]' if unit else ''}" for name, unit in names]
    writer.writerow([*FIXED, *margins, *(column.name for column in analysis.columns)])
    for result in analysis.sweep.results:
        by_name = {margin.name: margin.value for margin in result.margins}
        row = [result.number, result.outcome, result.step, result.broken, _text(result.simulated)]
        row += [_text(result.smallest), *(_text(by_name.get(name)) for name, _ in names)]
        writer.writerow([*row, *map(_text, analysis.values[result.number])])
    return text.getvalue()


def _text(value: float | None) -> str:
    """All digits; "" where there is no value."""
    return repr(float(value)) if value is not None and math.isfinite(value) else ""
