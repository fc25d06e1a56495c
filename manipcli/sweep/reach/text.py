"""A map in the terminal, as CSV and as JSON."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterator, Sequence
from typing import Final

from manipcli.core.text import number_of
from manipcli.core.units import readable
from manipcli.sweep.reach.question import PointResult
from manipcli.sweep.reach.reach_map import ReachMap
from manipcli.sweep.text import pace_text

SYMBOLS: Final = "abcdefghijklmnopqrstuvwxyz"
"""Of the reasons, the commonest first; the last one is of all others."""
SHARES: Final = ("░", "▒", "▓", "█")
"""Of the yaws that can be planned: up to a quarter, ..., all of them."""
MISSING: Final = "?"
WIDE: Final = 36
"""Columns of a map whose cells are two characters wide, about a square."""
MOST: Final = 100
"""Columns and rows of a map; of a larger grid some are left out."""


def progress_text(done: int, planned: int, asked: int, elapsed: float) -> str:
    """`120 of 273: 80 planned, 40 refused, 3.1 per second, 49 s left`."""
    text = f"{done} of {asked}: {planned} planned, {done - planned} refused"
    if not done or elapsed <= 0.0:
        return text
    return f"{text}, {pace_text(done / elapsed, (asked - done) * elapsed / done, of='point')}"


def render_text(found: ReachMap) -> str:
    """The counts, the map with its legend, the best point and the commands that repeat a point."""
    grid, placement = found.grid, found.placement
    what = f"{found.task}: '{placement.body}' for '{found.question.step}'"
    lines = [f"{what}: {found.planned} of {len(found.results)} points can be planned"]
    if found.missing:
        lines.append(f"interrupted: {found.missing} of {grid.count} points were not planned")
    frame = f" in {placement.frame}" if placement.frame else ""
    yaws = f", {number_of(len(grid.yaw), 'yaw')}" if grid.yaw else ""
    lines += [f"x {_span(grid.x)}, y {_span(grid.y)}{frame}{yaws}", "", *_drawn(found), ""]
    lines += _legend(found)
    shown = (
        ("most clearance", found.roomiest),
        ("most manipulability", found.most_dexterous),
        ("refused", found.first_refusal()),
    )
    for word, result in shown:
        if result is not None:
            said = _numbers(result) if result.planned else result.reason
            lines += ["", f"{word}: {_where(found, result)}: {said}", f"    {found.command(result.number)}"]
    return "\n".join(lines)


def _drawn(found: ReachMap) -> Iterator[str]:
    """A row of characters for each y, the largest at the top."""
    grid = found.grid
    columns, rows = (range(0, len(axis), math.ceil(len(axis) / MOST)) for axis in (grid.x, grid.y))
    width = 2 if len(columns) <= WIDE else 1
    symbols = _symbols(found)
    labels = {row: f"{grid.y[row]:.3f}" for row in rows}
    edge = max(map(len, labels.values()))
    for row in reversed(rows):
        cells = (_cell(found.cells.get((row, column), ()), symbols, len(grid.yaw)) for column in columns)
        drawn = "".join(cell * width if cell in SHARES else cell.ljust(width) for cell in cells)
        yield f"{labels[row]:>{edge}} {drawn}".rstrip().replace("-", "−")
    first, last = f"{grid.x[columns[0]]:.3f}", f"{grid.x[columns[-1]]:.3f}"
    room = max(len(first) + 1, width * len(columns) - len(last))
    yield f"{' ' * edge} {first:<{room}}{last if len(columns) > 1 else ''}".rstrip().replace("-", "−")


def _symbols(found: ReachMap) -> dict[tuple[str, str], str]:
    return {(code, reason): SYMBOLS[min(k, len(SYMBOLS) - 1)] for k, (code, reason, _) in enumerate(found.reasons)}


def _cell(results: Sequence[PointResult], symbols: dict[tuple[str, str], str], yaws: int) -> str:
    planned = sum(result.planned for result in results)
    if not results:
        return MISSING
    if planned:
        return SHARES[math.ceil(4 * planned / max(yaws, 1)) - 1]
    return min(symbols[result.code, result.reason] for result in results)


def _legend(found: ReachMap) -> Iterator[str]:
    if found.planned and found.grid.yaw:
        yield f"{''.join(SHARES)} up to 25, 50, 75, 100 % of the yaws can be planned"
    elif found.planned:
        yield f"█ {found.planned} can be planned"
    symbols = _symbols(found)
    for code, reason, count in found.reasons[: len(SYMBOLS) - 1]:
        yield f"{symbols[code, reason]} {count} {reason}{f' ({code})' if code else ''}"
    if rest := found.reasons[len(SYMBOLS) - 1 :]:
        yield f"{SYMBOLS[-1]} {sum(count for *_, count in rest)} of {len(rest)} other reasons; --csv has them"
    if found.missing:
        yield f"{MISSING} {found.missing} not planned yet"


def _span(values: tuple[float, ...]) -> str:
    if len(values) == 1:
        return readable(values[0], "m")
    steps = readable((values[-1] - values[0]) / (len(values) - 1), "m")
    return f"{values[0]:g} to {values[-1]:g} m by {steps}".replace("-", "−")


def _where(found: ReachMap, result: PointResult) -> str:
    x, y, yaw = found.grid.point(result.number)
    return f"[{x:g}, {y:g}] m{'' if yaw is None else f', yaw {math.degrees(yaw):g} deg'}".replace("-", "−")


def _numbers(result: PointResult) -> str:
    near = "" if result.clearance is None else f"clearance {readable(result.clearance, 'm')} ({result.between})"
    easy = "" if result.manipulability is None else f"manipulability {result.manipulability:.3f}"
    return ", ".join(text for text in (near, easy) if text) or "planned"


HEADS: Final = (
    "x", "y", "yaw", "outcome", "clearance", "between", "manipulability", "code", "step", "reason", "cause",
)  # fmt: skip
"""Columns of the CSV; SI units. `yaw` is empty where it is that of the file."""


def render_csv(found: ReachMap) -> str:
    """A row for each point, by number: along x first, then y, then yaw."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADS)
    for one in found.ordered:
        x, y, yaw = found.grid.point(one.number)
        numbers = [_text(x), _text(y), _text(yaw), one.outcome, _text(one.clearance), one.between]
        writer.writerow([*numbers, _text(one.manipulability), one.code, one.step, one.reason, one.cause])
    return text.getvalue()


def _text(value: float | None) -> str:
    return "" if value is None else repr(value)


def render_json(found: ReachMap) -> str:
    """The map as one JSON object."""
    return json.dumps(
        {
            "task": found.task,
            "step": found.question.step,
            "object": found.placement.body,
            "frame": found.placement.frame.strip("'") or "world",
            "x": found.grid.x,
            "y": found.grid.y,
            "yaw": found.grid.yaw,
            "planned": found.planned,
            "count": len(found.results),
            "missing": found.missing,
            "reasons": [{"code": code, "reason": reason, "count": n} for code, reason, n in found.reasons],
            "most_clearance": _number(found.roomiest),
            "most_manipulability": _number(found.most_dexterous),
            "points": [_object(found, result) for result in found.ordered],
        },
        indent=2,
        allow_nan=False,
    )


def _number(result: PointResult | None) -> int | None:
    return None if result is None else result.number


def _object(found: ReachMap, result: PointResult) -> dict[str, object]:
    x, y, yaw = found.grid.point(result.number)
    return {
        "number": result.number,
        "x": x,
        "y": y,
        "yaw": yaw,
        "outcome": result.outcome,
        "clearance": result.clearance,
        "between": result.between,
        "manipulability": result.manipulability,
        "code": result.code,
        "step": result.step,
        "reason": result.reason,
        "cause": result.cause,
        "command": found.command(result.number),
    }
