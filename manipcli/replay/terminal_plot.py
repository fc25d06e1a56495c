"""Curves in a terminal: braille dots, two by four a character.

With colours, the curves of a panel share one field; without, each has a field of its own, for dots of two curves look
the same. Either way the range and the last value of each stand beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.core.text import shorten
from manipcli.replay.curves import Chart, Curve, Panel, span_of, thinned, ticks

HIGH, LOW = 10, 4
"""Rows of a field that curves share, and of a field of one curve."""
MARGIN = 10
"""Characters left of a field."""
LEAST = 20
MOST = 40
"""Curves of a panel that are drawn."""
COLOURS = ("34", "33", "32", "31", "35", "36", "94", "93", "92", "91", "95", "96")
"""What a terminal calls its colours."""
_BLANK = 0x2800
_BITS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])

Dots = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Piece:
    """Some text of one colour; "" is that of the terminal."""

    text: str
    colour: str = ""


Line = tuple[Piece, ...]


def render(chart: Chart, *, columns: int, colours: bool) -> tuple[Line, ...]:
    """The lines of a chart.

    Args:
        chart: what is drawn.
        columns: width of the terminal.
        colours: whether it shows colours.
    """
    width = max(columns - MARGIN - 1, LEAST)
    lines: list[Line] = [(Piece(shorten(chart.title, width=max(columns, LEAST))),)]
    for panel in chart.panels:
        lines.append(())
        title = f"{panel.title_with_label}  {_unit(panel)}".rstrip()
        lines.append((Piece(shorten(title, width=max(columns, LEAST))),))
        shown = panel.curves[:MOST]
        below = _time_axis(chart, width)
        if chart.steps and panel is chart.panels[-1]:
            below += _steps(chart, width)
        if colours or len(shown) == 1:
            lines += _field(chart, shown, span_of(shown), width, HIGH)
            lines += below + _legend(panel, shown, marked=colours and len(shown) > 1)
        else:
            for curve in shown:
                lines += _legend(panel, (curve,), marked=False)
                lines += _field(chart, (curve,), span_of((curve,)), width, LOW)
            lines += below
        if len(panel.curves) > MOST:
            lines.append((Piece(f"and {len(panel.curves) - MOST} more curves"),))
    return tuple(lines)


def _unit(panel: Panel) -> str:
    return f"[{panel.unit}]" if panel.unit else ""


def _field(chart: Chart, curves: Sequence[Curve], span: tuple[float, float], width: int, rows: int) -> list[Line]:
    """Curves over each other, with numbers at their left."""
    low, high = span
    if not high > low:
        room = max(0.5, 1e-12 * abs(low))  # of a large number a half is nothing
        low, high = low - room, high + room
    cells = np.zeros((rows, width), dtype=np.int64)
    owner = np.full((rows, width), -1)
    for k, curve in enumerate(curves):
        dots = _dots(curve, chart.start, chart.end, (low, high), (rows * 4, width * 2))
        mine = (dots.reshape(rows, 4, width, 2) * _BITS[None, :, None, :]).sum(axis=(1, 3))
        cells |= mine
        owner[mine > 0] = k
    numbers = {0: high, rows - 1: low}
    if rows >= HIGH:
        numbers[rows // 2] = high - (high - low) * (rows // 2) / (rows - 1)
    return [
        (Piece(f"{_number(numbers[row]) if row in numbers else '':>{MARGIN - 2}} │"), *_row(cells[row], owner[row]))
        for row in range(rows)
    ]


def _row(cells: npt.NDArray[np.int64], owner: npt.NDArray[np.int64]) -> Line:
    """One row of characters, in stretches of one colour."""
    begins = [0, *(np.flatnonzero(np.diff(owner)) + 1).tolist(), len(cells)]
    return tuple(
        Piece(
            "".join(chr(_BLANK + cell) if cell else " " for cell in cells[first:stop].tolist()),
            COLOURS[int(owner[first]) % len(COLOURS)] if owner[first] >= 0 else "",
        )
        for first, stop in pairwise(begins)
    )


def _dots(curve: Curve, start: float, end: float, span: tuple[float, float], size: tuple[int, int]) -> Dots:
    """(rows, columns) where the line of a curve passes."""
    rows, columns = size
    dots = np.zeros(size, dtype=np.bool_)
    times, values = thinned(curve, start, end, columns)
    if curve.held and len(times):
        times, values = _stairs(times, values)
    x = (times - start) / max(end - start, 1e-12) * (columns - 1)
    y = (span[1] - values) / (span[1] - span[0]) * (rows - 1)
    inside = (x >= -0.5) & (x <= columns - 0.5) & np.isfinite(y)
    for k in np.flatnonzero(inside).tolist():
        dots[int(np.clip(round(y[k]), 0, rows - 1)), int(np.clip(round(x[k]), 0, columns - 1))] = True
    for k in np.flatnonzero(inside[:-1] & inside[1:]).tolist():
        steps = int(np.ceil(max(abs(x[k + 1] - x[k]), abs(y[k + 1] - y[k])))) + 1
        part = np.linspace(0.0, 1.0, steps)
        across = np.clip(np.round(x[k] + part * (x[k + 1] - x[k])), 0, columns - 1).astype(int)
        down = np.clip(np.round(y[k] + part * (y[k + 1] - y[k])), 0, rows - 1).astype(int)
        dots[down, across] = True
    return dots


def _stairs(times: Array, values: Array) -> tuple[Array, Array]:
    """Each value until the next time."""
    return np.repeat(times, 2)[1:], np.repeat(values, 2)[:-1]


def _legend(panel: Panel, curves: Sequence[Curve], *, marked: bool) -> list[Line]:
    """Name, range and last value of each curve."""
    several = len(panel.logs) > 1
    names = [
        shorten(" ".join(part for part in (one.label or panel.quantity, one.log if several else "") if part), width=48)
        for one in curves
    ]
    width = max(map(len, names), default=0)
    lines: list[Line] = []
    for k, (name, curve) in enumerate(zip(names, curves, strict=True)):
        finite = curve.values[np.isfinite(curve.values)]
        told = "no value"
        if len(finite):
            told = f"{_number(finite.min())} to {_number(finite.max())}, last {_number(finite[-1])}"
        mark = (Piece("━━ ", COLOURS[k % len(COLOURS)]),) if marked else ()
        lines.append((Piece(" " * MARGIN), *mark, Piece(f"{name:<{width}}  {told}")))
    return lines


def _time_axis(chart: Chart, width: int) -> list[Line]:
    """A line with round times below it."""
    line, numbers = ["─"] * width, [" "] * (width + 8)
    for time in ticks(chart.start, chart.end, max(width // 10, 2)):
        column = round((time - chart.start) / max(chart.end - chart.start, 1e-12) * (width - 1))
        text = _number(time)
        line[column] = "┴"
        first = max(column - len(text) // 2, 0)
        numbers[first : first + len(text)] = text
    text = "".join(numbers).rstrip()
    return [(Piece(f"{'':>{MARGIN - 2}} └{''.join(line)}"),), (Piece(f"{'':>{MARGIN}}{text} s"),)]


def _steps(chart: Chart, width: int) -> list[Line]:
    """The steps along the axis of time, each where it begins; a name too long for its stretch is cut."""
    cells = [" "] * width
    for step in chart.steps:
        first, last = (
            round((min(max(time, chart.start), chart.end) - chart.start) / max(chart.end - chart.start, 1e-12) * width)
            for time in (step.start, step.end)
        )
        if last > first:
            room = last - first - 1
            name = ("" if step.done else "✗") + shorten(step.name, width=200)
            cells[first] = "▏"
            cells[first + 1 : last] = f"{name[:room]:<{room}}"
    return [(Piece(f"{'':>{MARGIN}}{''.join(cells)}".rstrip()),)]


def _number(value: float) -> str:
    text = f"{float(value):.4g}"
    return "0" if text in ("0", "-0") else text
