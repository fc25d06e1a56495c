"""Charts of curves: panels over one time axis with the steps behind, and their CSV table."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TextIO

import numpy as np

from manipcli.core.geometry import Array


@dataclass(frozen=True, slots=True)
class Curve:
    """A number over time.

    Attributes:
        name: name on the command line, `joint_states.position[joint_1]`.
        label: name within its panel, `joint_1`.
        log: name of its log; "" if there is only one.
        times: (T,) [s].
        values: (T,) in the unit of the panel; NaN if missing.
        held: each value holds until the next one; drawn as a step curve.
        end: end of its log [s], until which the last value holds.
    """

    name: str
    label: str
    log: str
    times: Array
    values: Array
    held: bool = False
    end: float = math.inf


@dataclass(frozen=True, slots=True)
class Panel:
    """Curves with a common value axis, named by `quantity` and `unit`; `title` names their source."""

    title: str
    quantity: str
    unit: str
    curves: tuple[Curve, ...]

    @property
    def axis(self) -> str:
        """`position [rad]`."""
        return f"{self.quantity} [{self.unit}]" if self.unit else self.quantity

    @property
    def title_with_label(self) -> str:
        """The title, with the label in brackets if there is only one."""
        only = self.labels[0] if len(self.labels) == 1 else ""
        return f"{self.title}[{only}]" if only and self.title != only else self.title

    @property
    def labels(self) -> tuple[str, ...]:
        """The distinct values, in order."""
        return tuple(dict.fromkeys(curve.label for curve in self.curves))

    @property
    def logs(self) -> tuple[str, ...]:
        """The distinct values, in order."""
        return tuple(dict.fromkeys(curve.log for curve in self.curves))


@dataclass(frozen=True, slots=True)
class Interval:
    """A step from `start` to `end` [s]; `done` if it succeeded."""

    name: str
    start: float
    end: float
    done: bool = True


@dataclass(frozen=True, slots=True)
class Chart:
    """Content of one figure.

    Attributes:
        title: title of the figure.
        panels: from top to bottom, at least one.
        steps: steps, drawn behind all panels.
        start, end: range of the time axis [s].
        notes: remarks, one sentence each.
    """

    title: str
    panels: tuple[Panel, ...]
    steps: tuple[Interval, ...]
    start: float
    end: float
    notes: tuple[str, ...] = ()


def thinned(curve: Curve, start: float, end: float, columns: int) -> tuple[Array, Array]:
    """Fewer points that draw the same line: the first, lowest, highest and last of each pixel column.

    Args:
        curve: the curve.
        start, end: time range of the columns [s].
        columns: number of columns.

    Returns:
        Times and values; gaps (NaN) are kept, and a held value lasts until the end of its log.
    """
    times, values = curve.times, curve.values
    last = min(end, curve.end)
    if curve.held and len(times) and times[-1] < last:
        times, values = np.append(times, last), np.append(values, values[-1])
    if len(times) <= 4 * columns or end <= start:
        return times, values
    column = np.clip(((times - start) / (end - start) * columns).astype(np.int64), -1, columns)
    begins = np.flatnonzero(np.diff(column, prepend=column[0] - 1)).tolist()
    kept: set[int] = set()
    for first, stop in zip(begins, [*begins[1:], len(times)], strict=True):
        # argmin and argmax return the index of a NaN if there is one.
        lowest, highest = int(values[first:stop].argmin()), int(values[first:stop].argmax())
        kept.update((first, first + lowest, first + highest, stop - 1))
    order = np.array(sorted(kept))
    return times[order], values[order]


def write_table(chart: Chart, stream: TextIO) -> None:
    """Write comma-separated values that read back bit for bit.

    One row per time, one column per curve; a cell is empty where a curve has no value at that time.

    With several logs the first column is the name of the log, and the rows are ordered by log.
    """
    curves = list({(curve.name, curve.log): curve for panel in chart.panels for curve in panel.curves}.values())
    names = list(dict.fromkeys(curve.name for curve in curves))
    logs = list(dict.fromkeys(curve.log for curve in curves))
    writer = csv.writer(stream, lineterminator="\n")
    head = ["log"] if len(logs) > 1 else []
    writer.writerow([*head, "time", *names])
    for log in logs:
        mine = [curve for curve in curves if curve.log == log]
        first = [log] if head else []
        times = np.unique(np.concatenate([curve.times for curve in mine]))
        columns = [_cells(times, (curve for curve in mine if curve.name == name)) for name in names]
        writer.writerows([*first, repr(time), *row] for time, *row in zip(times.tolist(), *columns, strict=True))


def _cells(times: Array, curves: Iterable[Curve]) -> list[str]:
    """The cells of a column; the last value if there are several at one time."""
    cells = [""] * len(times)
    for curve in curves:
        at = np.searchsorted(times, curve.times).tolist()
        for k, value in zip(at, curve.values.tolist(), strict=True):
            cells[k] = repr(value)
    return cells
