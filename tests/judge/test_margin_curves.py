"""Margins over time: thinned, they keep the deciding value of every interval, however the recording was split."""

from __future__ import annotations

import numpy as np
import pytest

from manipcli.conditions.robustness import Pick, Robustness, least, robustness
from manipcli.judge.margin_curves import MarginCurve, MarginTrace
from manipcli.judge.verdict import ExpectationOutcome

TIMES = np.round(np.arange(0, 2000) * 1e-3, 9)
OUTCOME = ExpectationOutcome("x", "passed", 0.0, "m", 0.0)


def _answer(margins: np.ndarray, times: np.ndarray, *, unit: str = "m", scale: float = 0.1) -> Robustness:
    return robustness(margins, times, unit=unit, scale=scale, describe=lambda k: "")


def _traced(margins: np.ndarray, cuts: list[int], pick: Pick) -> MarginCurve | None:
    trace = MarginTrace(0.02)
    for a, b in zip([0, *cuts], [*cuts, len(TIMES)], strict=True):
        trace.add(_answer(margins[a:b], TIMES[a:b]), TIMES[a:b], pick)
    return trace.curve(OUTCOME)


@pytest.mark.parametrize("pick", ["least", "greatest"])
@pytest.mark.parametrize("cuts", [[], [500, 1000], [7, 13, 1999]])
def test_the_deciding_margin_of_every_interval_is_kept(pick: Pick, cuts: list[int]) -> None:
    """Oracle: the least or greatest of 20 ticks at a time."""
    margins = np.random.default_rng(3).normal(size=len(TIMES))
    curve = _traced(margins, cuts, pick)
    assert curve is not None
    assert (np.diff(curve.times) > 0.0).all()
    assert len(curve.times) <= 100 + len(cuts)
    expected = (np.min if pick == "least" else np.max)(margins.reshape(100, 20), axis=1)
    assert set(expected) <= set(curve.margins)
    at = dict(zip(TIMES, margins, strict=True))
    assert [at[t] for t in curve.times] == curve.margins.tolist()
    np.testing.assert_allclose(curve.relative, curve.margins / 0.1)


def test_what_is_not_known_is_a_gap() -> None:
    margins = np.linspace(1.0, 2.0, len(TIMES))
    margins[400:600] = np.inf
    curve = _traced(margins, [], "least")
    assert curve is not None
    unknown = np.isnan(curve.margins)
    assert (unknown == ((curve.times >= 0.4) & (curve.times < 0.6))).all()


def test_a_margin_of_the_whole_run_has_no_curve() -> None:
    assert _traced(np.full(len(TIMES), 0.3), [1000], "least") is None
    assert MarginTrace(0.02).curve(OUTCOME) is None


def test_margins_in_several_units_are_in_tolerances() -> None:
    """Which member decides is compared in tolerances, so the curve is in them too."""
    falling, rising = np.linspace(3.0, 0.0, len(TIMES)), np.linspace(0.0, 1.0, len(TIMES))
    both = least([_answer(falling, TIMES, unit="rad", scale=1.0), _answer(rising, TIMES, unit="m", scale=0.5)])
    trace = MarginTrace(0.02)
    trace.add(both, TIMES, "least")
    curve = trace.curve(OUTCOME)
    assert curve is not None
    assert curve.unit == ""
    assert curve.margins.tolist() == curve.relative.tolist()
    assert curve.margins.max() <= 1.2
