"""Curves as a table of comma-separated values: numbers written so that they read back the same to the last bit."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from typing import TextIO

import numpy as np

from manipcli.replay.curves import Chart, Curve


def write_table(chart: Chart, stream: TextIO) -> None:
    """One row a time, one column a curve; a cell is empty where a curve has no value at that time.

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


def _cells(times: np.typing.NDArray[np.float64], curves: Iterable[Curve]) -> list[str]:
    """The cells of a column; of several values at one time the last."""
    cells = [""] * len(times)
    for curve in curves:
        at = np.searchsorted(times, curve.times).tolist()
        for k, value in zip(at, curve.values.tolist(), strict=True):
            cells[k] = repr(value)
    return cells
