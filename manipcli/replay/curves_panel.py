"""The curves of a run in the panel of a page, with a line at the time that is shown."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.geometry import Array
from manipcli.replay.playback import Playback, PlotTable, filled

if TYPE_CHECKING:
    import viser

ALL = "all"
WINDOWS = {"whole run": 0.0, "10 s": 10.0, "2 s": 2.0, "0.5 s": 0.5}
"""What is shown around the time [s]; 0: everything."""
BINS = 300
"""Of time; in each a curve is drawn from its least to its greatest value, so that no peak is lost."""
LONGEST = 300.0
"""[s] of a run whose curves are read at full rate; those of a longer one are shown as they are sampled."""
BEHIND = 0.7
"""How much of a window lies before the time that is shown."""
COLOURS = (
    "#1769d2", "#d9480f", "#2b8a3e", "#9c36b5", "#c92a2a", "#0b7285", "#e67700",
    "#5f3dc4", "#495057", "#a61e4d", "#087f5b", "#364fc7", "#846358",
)  # fmt: skip


def binned(times: Array, values: Array, bins: int = BINS) -> tuple[Array, Array]:
    """About two rows for each of `bins` intervals: the least and the greatest value of every column.

    Args:
        times: (T,).
        values: (T, c); NaN where there is none.
        bins: how many intervals; fewer than 2 * bins rows are left as they are.
    """
    size = len(times) // bins
    if size <= 2:
        return times, values
    count = len(times) // size
    rows = values[: count * size].reshape(count, size, -1)
    with np.errstate(invalid="ignore"):
        extremes = np.stack([np.fmin.reduce(rows, axis=1), np.fmax.reduce(rows, axis=1)], axis=1)
    heads = times[: count * size].reshape(count, size)[:, [0, size // 2]]
    last = slice(count * size, None)
    return (
        np.concatenate([heads.reshape(-1), times[last]]),
        np.concatenate([extremes.reshape(2 * count, -1), values[last]]),
    )


def with_cursor(times: Array, values: Array, now: float) -> tuple[Array, Array, Array]:
    """Times and values with three rows at `now`, and a column that rises there from their least to their greatest
    value: a vertical line that stands on a flat one. No NaN is left, since uPlot finds no scale with one: a gap has the
    value before it.

    Args:
        times: (T,), at least one.
        values: (T, c).
        now: [s].
    """
    values = filled(values)
    k = int(np.searchsorted(times, now))
    here = np.array([np.interp(now, times, column) for column in values.T]).reshape(1, -1)
    cursor = np.full(len(times) + 3, values.min())
    cursor[k + 1] = values.max()
    return np.insert(times, k, [now] * 3), np.insert(values, k, np.repeat(here, 3, axis=0), axis=0), cursor


class CurvesPanel:
    """What is plotted, chosen by name; whoever moves the time calls `place`.

    Args:
        server: where.
        playback: its curves; at full rate they are read when first looked at closely.
    """

    def __init__(self, server: viser.ViserServer, playback: Playback) -> None:
        self._server = server
        self._playback = playback
        self._curves = {one.name: one for one in playback.curves()}
        self._full: dict[str, PlotTable] | None = None
        self._now = playback.start
        self._lock = threading.Lock()
        self._plot: viser.GuiUplotHandle | None = None
        if not self._curves:
            return
        self._folder = server.gui.add_folder("Curves")
        with self._folder:
            self._table = server.gui.add_dropdown("what", tuple(self._curves))
            self._column = server.gui.add_dropdown("of", (ALL, *self._chosen.columns))
            self._window = server.gui.add_dropdown("window", tuple(WINDOWS))
        self._table.on_update(lambda _: self._chose())
        self._column.on_update(lambda _: self._draw())
        self._window.on_update(lambda _: self._draw())
        self._draw()

    @property
    def _chosen(self) -> PlotTable:
        return self._curves[self._table.value]

    def _chose(self) -> None:
        """Another table: the column stays where it has it, too."""
        before = self._column.value
        self._column.options = (ALL, *self._chosen.columns)
        self._column.value = before if before in self._chosen.columns else ALL  # type: ignore[misc]  # viser's setter
        self._draw()

    def _shown(self) -> tuple[Array, list[tuple[str, str, Array]]]:
        """Times (T,) and the curves: name, unit, values (T,)."""
        tables, window = self._curves, WINDOWS[self._window.value]
        if window and self._playback.end - self._playback.start <= LONGEST:
            if self._full is None:
                self._full = {one.name: one for one in self._playback.tables()}
            tables = self._full or tables
        table = tables.get(self._table.value, self._chosen)
        rows = slice(None)
        if window:
            begin = max(min(self._now - BEHIND * window, self._playback.end - window), self._playback.start)
            rows = slice(*np.searchsorted(table.times, [begin, begin + window + 1e-9]).tolist())
        column = self._column.value
        if column not in table.columns:
            found = [
                (name, unit, table.values[rows, k])
                for k, (name, unit) in enumerate(zip(table.columns, table.units, strict=True))
            ]
            return table.times[rows], found
        found = [(column, table.units[table.columns.index(column)], table.column(column)[rows])]
        reference = tables.get("joint reference")
        if table.name == "joint position" and reference is not None and column in reference.columns:
            found.append(("reference", found[0][1], reference.column(column)[rows]))
        return table.times[rows], found

    def _draw(self) -> None:
        """A new plot: the number of its curves may be another."""
        with self._lock:
            data, names = self._data()
            series: list[viser.uplot.Series] = [{"label": "t [s]"}]
            for k, name in enumerate(names):
                line: viser.uplot.Series = {"label": name, "stroke": COLOURS[k % len(COLOURS)], "width": 1.5}
                line["points"] = {"show": False}
                if name.startswith("reference"):
                    line["dash"] = (6, 4)
                series.append(line)
            series.append({"label": "now", "stroke": "#1d2733", "width": 1, "points": {"show": False}})
            old = self._plot
            with self._folder:
                self._plot = self._server.gui.add_uplot(
                    data, tuple(series), scales={"x": {"time": False}}, legend={"show": True}, height=260
                )
            if old is not None:
                old.remove()

    def _data(self) -> tuple[tuple[Array, ...], list[str]]:
        times, found = self._shown()
        values = np.stack([each for _, _, each in found], axis=1)
        times, values, cursor = with_cursor(*binned(times, values), self._now)
        return (times, *values.T, cursor), [f"{name} [{unit}]" for name, unit, _ in found]

    def place(self, now: float) -> None:
        """Show the time [s]."""
        with self._lock:
            self._now = now
            if self._plot is not None:
                self._plot.data = self._data()[0]
