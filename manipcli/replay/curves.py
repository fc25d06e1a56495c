"""Curves as they are drawn or written as a table: panels over one time axis, the steps behind them."""

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
    """One number over time.

    Attributes:
        name: as a user writes it, `joint_states.position[joint_1]`.
        label: what tells it from the others of its panel, `joint_1`.
        log: which log it is from; "" where there is one only.
        times: (T,) [s].
        values: (T,) in the unit of the panel; NaN where there is none.
        held: each value holds until the next, so that it is drawn as stairs.
        end: of its log [s]: the last value holds no longer.
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
    """Curves with one axis of values. `quantity` and `unit` name it, `title` says where they are from."""

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
        """With the label in brackets where there is one only."""
        only = self.labels[0] if len(self.labels) == 1 else ""
        return f"{self.title}[{only}]" if only and self.title != only else self.title

    @property
    def labels(self) -> tuple[str, ...]:
        """Each once."""
        return tuple(dict.fromkeys(curve.label for curve in self.curves))

    @property
    def logs(self) -> tuple[str, ...]:
        """Each once."""
        return tuple(dict.fromkeys(curve.log for curve in self.curves))


@dataclass(frozen=True, slots=True)
class Interval:
    """A step, from `start` to `end` [s]; `done` where it went as it should."""

    name: str
    start: float
    end: float
    done: bool = True


@dataclass(frozen=True, slots=True)
class Chart:
    """Everything that is drawn on one sheet.

    Attributes:
        title: of the whole.
        panels: from top to bottom, at least one.
        steps: behind all panels.
        start, end: of the axis of time [s].
        notes: what else there is to say, a sentence each.
    """

    title: str
    panels: tuple[Panel, ...]
    steps: tuple[Interval, ...]
    start: float
    end: float
    notes: tuple[str, ...] = ()


def thinned(curve: Curve, start: float, end: float, columns: int) -> tuple[Array, Array]:
    """Few points that draw the same line: of each column of a picture the first, lowest, highest and last.

    Args:
        curve: any.
        start, end: what the columns cover [s].
        columns: how many there are.

    Returns:
        Times and values; a gap (NaN) stays one, and a value that is held stays until the end of its log.
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
        # Of numbers with a NaN among them, argmin and argmax are the NaN.
        lowest, highest = int(values[first:stop].argmin()), int(values[first:stop].argmax())
        kept.update((first, first + lowest, first + highest, stop - 1))
    order = np.array(sorted(kept))
    return times[order], values[order]


def write_table(chart: Chart, stream: TextIO) -> None:
    """Writes comma-separated values, which read back the same to the last bit.

    One row per time, one column per curve; a cell is empty where a curve has no value at that time.

    With several logs the first column says which, and each log has its rows after those of the one before.
    """
    curves = list({(one.name, one.log): one for panel in chart.panels for one in panel.curves}.values())
    names = list(dict.fromkeys(one.name for one in curves))
    logs = list(dict.fromkeys(one.log for one in curves))
    writer = csv.writer(stream, lineterminator="\n")
    head = ["log"] if len(logs) > 1 else []
    writer.writerow([*head, "time", *names])
    for log in logs:
        mine = [one for one in curves if one.log == log]
        first = [log] if head else []
        times = np.unique(np.concatenate([one.times for one in mine]))
        columns = [_cells(times, (one for one in mine if one.name == name)) for name in names]
        writer.writerows([*first, repr(time), *row] for time, *row in zip(times.tolist(), *columns, strict=True))


def _cells(times: Array, curves: Iterable[Curve]) -> list[str]:
    """The cells of a column; of several values at one time the last."""
    cells = [""] * len(times)
    for curve in curves:
        at = np.searchsorted(times, curve.times).tolist()
        for k, value in zip(at, curve.values.tolist(), strict=True):
            cells[k] = repr(value)
    return cells
