"""Curves: thinned without losing what is seen, in a figure, in a table."""

from __future__ import annotations

import csv
import io
import re
import warnings
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from manipcli.replay import figure
from manipcli.replay.curves import Chart, Curve, Interval, Panel, thinned, write_table

TIMES = np.arange(10_001) / 1000.0
SINE = Curve("a.b[one]", "one", "", TIMES, np.sin(TIMES))
LINE = Curve("a.b[two]", "two", "", TIMES, 0.1 * TIMES)
STEPS = (Interval("pick_1", 0.0, 4.0), Interval("place_1", 4.0, 9.0, done=False))
CHART = Chart("the run", (Panel("a.b", "position", "rad", (SINE, LINE)),), STEPS, 0.0, 10.0)


def test_what_is_left_out_lies_between_what_is_kept() -> None:
    rng = np.random.default_rng(2)
    noisy = replace(SINE, values=rng.normal(size=len(TIMES)))
    times, values = thinned(noisy, 0.0, 10.0, 100)
    assert len(times) <= 4 * 101
    for column in range(100):
        whole = noisy.values[(TIMES / 10.0 * 100).astype(int) == column]
        part = values[(times / 10.0 * 100).astype(int) == column]
        assert (part.min(), part.max()) == (whole.min(), whole.max())
        assert (part[0], part[-1]) == (whole[0], whole[-1])


def test_a_gap_stays_a_gap_and_few_points_stay_all() -> None:
    gap = replace(SINE, values=np.where((TIMES > 3.0) & (TIMES < 3.5), np.nan, SINE.values))
    times, values = thinned(gap, 0.0, 10.0, 200)
    assert np.isnan(values[(times > 3.1) & (times < 3.4)]).all()
    assert np.isfinite(values[(times < 2.9) | (times > 3.6)]).all()
    assert thinned(SINE, 0.0, 10.0, 100_000)[1] is SINE.values


def test_a_value_that_is_held_stays_until_the_end() -> None:
    held = Curve("c", "", "", np.array([0.0, 1.0]), np.array([2.0, 3.0]), held=True)
    times, values = thinned(held, 0.0, 10.0, 100)
    assert (times.tolist(), values.tolist()) == ([0.0, 1.0, 10.0], [2.0, 3.0, 3.0])
    shorter = replace(held, end=4.0)  # than another log beside it
    times, values = thinned(shorter, 0.0, 10.0, 100)
    assert (times.tolist(), values.tolist()) == ([0.0, 1.0, 4.0], [2.0, 3.0, 3.0])


@pytest.mark.slow
@pytest.mark.parametrize("values", [[5.0], [np.nan, np.nan], [], [1e300, 1e300]])
def test_one_value_none_and_a_constant_are_drawn_too(values: list[float]) -> None:
    curve = Curve("a", "", "", np.arange(float(len(values))), np.array(values))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert figure.render(replace(CHART, panels=(Panel("a", "a", "", (curve,)),)), "svg")


@pytest.mark.slow
def test_a_figure_is_the_kind_that_was_asked_for_and_the_same_bytes_each_time() -> None:
    png = figure.render(CHART, "png")
    with Image.open(io.BytesIO(png)) as image:
        assert image.width == round(figure.WIDTH * figure.DPI)
    assert figure.render(CHART, "pdf").startswith(b"%PDF-1.")
    assert [figure.render(CHART, kind) for kind in ("svg", "pdf")] == [
        figure.render(CHART, kind) for kind in ("svg", "pdf")
    ]


def _points(svg: str) -> list[np.ndarray]:
    """The long lines of a figure, in its own coordinates, y up."""
    paths = re.findall(r'<path d="([^"]+)"[^>]*clip-path', svg)
    lines = [np.array(re.findall(r"[ML] ([\d.-]+) ([\d.-]+)", path), dtype=float) * (1.0, -1.0) for path in paths]
    return [line for line in lines if len(line) > 40]


@pytest.mark.slow
def test_the_line_in_a_figure_has_the_shape_of_the_numbers() -> None:
    chart = replace(CHART, panels=(Panel("a", "a", "", (SINE,)),))
    (line,) = _points(figure.render(chart, "svg").decode())
    # Any axis is a linear map: time to x, value to y.
    x, y = line[:, 0], line[:, 1]
    time = 10.0 * (x - x.min()) / np.ptp(x)
    value = -1.0 + 2.0 * (y - y.min()) / np.ptp(y)
    assert np.abs(value - np.sin(time)).max() < 0.02


def test_a_dollar_in_a_name_is_a_dollar() -> None:
    chart = replace(CHART, title="$\\frac$", panels=(Panel("$x_", "$", "%", (replace(SINE, label="a$b$"), LINE)),))
    assert figure.render(chart, "png")


def _table(chart: Chart) -> list[list[str]]:
    stream = io.StringIO()
    write_table(chart, stream)
    return list(csv.reader(io.StringIO(stream.getvalue())))


def test_a_table_reads_back_to_the_last_bit() -> None:
    rng = np.random.default_rng(4)
    times = np.sort(rng.uniform(0.0, 1.0, 50))
    odd = np.concatenate([rng.normal(size=47) * 10.0 ** rng.integers(-300, 300, 47), [np.nan, np.inf, -0.0]])
    half = Curve("x.y", "", "", times[::2], odd[::2])
    head, *rows = _table(replace(CHART, panels=(Panel("p", "p", "", (Curve("a,b", "", "", times, odd), half)),)))
    assert head == ["time", "a,b", "x.y"]
    table = np.array([[float(cell) if cell else 0.125 for cell in row] for row in rows])
    assert table[:, 0].tobytes() == times.tobytes()
    assert table[:, 1].tobytes() == odd.tobytes()
    assert [row[2] == "" for row in rows] == [k % 2 == 1 for k in range(50)]
    assert table[::2, 2].tobytes() == odd[::2].tobytes()


def test_several_logs_are_told_apart() -> None:
    curves = tuple(Curve("a", "", log, TIMES[:3], TIMES[:3] + k) for k, log in enumerate(("one", "two")))
    head, *rows = _table(replace(CHART, panels=(Panel("a", "a", "", curves),)))
    assert head == ["log", "time", "a"]
    assert [row[0] for row in rows] == ["one"] * 3 + ["two"] * 3
    assert [float(row[2]) for row in rows] == [0.0, 0.001, 0.002, 1.0, 1.001, 1.002]
