"""A sweep in the terminal and as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Final

from manipcli.core.text import listed, number_of, shorten
from manipcli.core.units import readable
from manipcli.report.table import table
from manipcli.sweep.analysis import LEAST_BASE, Analysis, Influence
from manipcli.sweep.one_at_a_time import HEADERS
from manipcli.sweep.results import SampleResult
from manipcli.sweep.statistics import SHARES, Rate
from manipcli.sweep.sweep import Progress

NAMED = 8
"""Number of samples named for each way of failing."""
SAME: Final = "All samples have the same margin and verdict: which number matters cannot be seen."
_SHOWN = (0, 1, 3, 5, 6)  # of SHARES
_BAR = 10


def percent(share: float) -> str:
    """`97.0 %`."""
    return f"{100.0 * share:.1f} %"


def rate_text(rate: Rate, interval: tuple[float, float] | None) -> str:
    """`194 of 200 passed: 97.0 % (95 % interval 93.6 % to 98.6 %)`; the interval where there is one."""
    text = f"{rate.passed} of {rate.count} passed: {percent(rate.share)}"
    return text if interval is None else f"{text} (95 % interval {interval_text(interval)})"


def interval_text(interval: tuple[float, float]) -> str:
    """`93.6 % to 98.6 %`."""
    return " to ".join(map(percent, interval))


def progress_text(progress: Progress) -> str:
    """`120 of 200: 118 passed, 2 failed, 3.1 per second, 26 s left`."""
    failed = progress.done - progress.passed
    text = f"{progress.done} of {progress.asked}: {progress.passed} passed, {failed} failed"
    return text if progress.left is None else f"{text}, {pace_text(progress.rate, progress.left, of='sample')}"


def pace_text(rate: float, left: float, *, of: str) -> str:
    """`3.1 per second, 26 s left`; `rate` per second, time `left` [s], `of` what."""
    pace = f"{rate:.1f} per second" if rate >= 0.95 else f"{1.0 / rate:.1f} s per {of}"
    return f"{pace}, {_time(left)} left"


def render_text(analysis: Analysis) -> str:
    """The rate, the margins, the ways of failing, what matters, and the worst samples with their commands."""
    sweep = analysis.sweep
    sampling = sweep.sampling
    least = f"design {sampling.design}, seed {sampling.seed}, {number_of(len(analysis.columns), 'number')} varied"
    lines = [f"{sampling.task}: {rate_text(sweep.rate, sweep.interval)}", least]
    if sweep.missing:
        missing = listed(map(str, sweep.missing), most=NAMED)
        lines.append(f"missing: {len(sweep.missing)} of {sweep.asked} samples: {missing}")
    if analysis.spreads:
        lines += ["", _margins(analysis)]
    if analysis.influences:
        lines += ["", _influences(analysis)]
    if analysis.failures:
        lines += ["", "Ways of failing"]
        lines += [
            f"  {len(way.samples)} x {way}: samples {listed(map(str, way.samples), most=NAMED)}"
            for way in analysis.failures
        ]
    if analysis.worst:
        lines += ["", "Smallest margins"]
        for result in analysis.worst:
            lines += [f"  {sample_text(result)}", f"      {sampling.job(result.number).command()}"]
    return "\n".join(lines)


def sample_text(result: SampleResult) -> str:
    """`sample 17 failed: ...`; of a sample that passed its tightest margin."""
    if not result.passed:
        return f"sample {result.number} {result.outcome}: {shorten(result.cause, width=100)}"
    known = [margin for margin in result.margins if margin.telling]
    tightest = min(known, key=lambda margin: margin.relative or 0.0, default=None)
    if tightest is None:
        return f"sample {result.number} passed"
    amount = readable(tightest.value or 0.0, tightest.unit)
    return f"sample {result.number} passed: {tightest.name} by {amount}, {tightest.relative:.2f} of its tolerance"


def _margins(analysis: Analysis) -> str:
    names = {0.0: "least", 0.5: "median", 1.0: "most"}
    headers = ("expectation", "met", *(names.get(SHARES[k], f"{SHARES[k]:.0%}".replace("%", " %")) for k in _SHOWN))
    rows = []
    for spread in analysis.spreads:
        shown = [readable(spread.quantiles[k], spread.unit) for k in _SHOWN] if spread.telling else ["–"] * len(_SHOWN)
        met = f"{spread.met}/{len(analysis.sweep.results)}"
        rows.append((shorten(spread.name, width=48), met, *(text.replace("-", "−") for text in shown)))
    return table(headers, rows, right=headers[1:])


def _influences(analysis: Analysis) -> str:
    """What matters for the smallest margin."""
    headers: tuple[str, ...]
    if analysis.sweep.sampling.design.word == "oat":
        known = [one.levels.cells for one in analysis.influences if one.levels is not None]
        return table(HEADERS, known, right=(HEADERS[1], *HEADERS[4:]))
    if analysis.influences[0].indices is not None:
        headers = ("number", "first-order index", "95 % interval", "total index", "95 % interval ")
        rows = [(one.column.name, *_index_cells(one)) for one in analysis.influences]
        return table(headers, rows, right=headers[1:])
    if analysis.indistinct:
        return SAME
    headers = ("rank correlation", "nominal", "with margin", "with passing", "by chance up to", "")
    rows = []
    for one in analysis.influences:
        pair = (one.correlation, one.passing)
        cells = ["–" if found is None else f"{found.rho:+.2f}".replace("-", "−") for found in pair]
        bound = next((f"{found.bound:.2f}" for found in pair if found is not None), "–")
        nominal = one.column.text(one.column.nominal)
        bar = "█" * round(one.size * _BAR) if one.matters else ""
        rows.append((one.column.name, nominal, *cells, bound, bar))
    shown = table(headers, rows, right=headers[1:5])
    if analysis.sweep.sampling.design.word == "saltelli":
        shown += f"\nIndices need {LEAST_BASE} complete base points; these are correlations."
    return shown


def _index_cells(influence: Influence) -> tuple[str, ...]:
    if influence.indices is None:
        return ("–", "", "–", "")
    cells: list[str] = []
    for index in (influence.indices.first, influence.indices.whole):
        low, high = index.interval
        cells += [f"{index.value:.2f}".replace("-", "−"), f"{low:.2f} to {high:.2f}".replace("-", "−")]
    return tuple(cells)


def render_json(analysis: Analysis) -> str:
    """The sweep as one JSON object."""
    sweep = analysis.sweep
    sampling = sweep.sampling
    return json.dumps(
        {
            "task": sampling.task,
            "design": str(sampling.design),
            "seed": sampling.seed,
            "asked": sweep.asked,
            "passed": sweep.rate.passed,
            "count": sweep.rate.count,
            "rate": sweep.rate.share,
            "interval": sweep.interval,
            "missing": list(sweep.missing),
            "outcomes": dict(sorted(analysis.outcomes.items())),
            "expectations": [
                {
                    "name": spread.name,
                    "unit": spread.unit,
                    "met": spread.met,
                    "evaluated": spread.evaluated,
                    "quantiles": {f"{share:g}": q for share, q in zip(SHARES, spread.quantiles, strict=False)},
                }
                for spread in analysis.spreads
            ],
            "numbers": [_number_object(influence) for influence in analysis.influences],
            "failures": [
                {"outcome": way.outcome, "step": way.step, "expectation": way.broken, "samples": list(way.samples)}
                for way in analysis.failures
            ],
            "samples": [_sample_object(analysis, result) for result in sweep.results],
            "wall_time": sweep.duration,
        },
        indent=2,
        allow_nan=False,
    )


def _number_object(influence: Influence) -> Mapping[str, object]:
    found, indices = influence.correlation, influence.indices
    return {
        "name": influence.column.name,
        "nominal": influence.column.nominal,
        "unit": influence.column.unit,
        "correlation": found.rho if found is not None else None,
        "correlation_with_passing": influence.passing.rho if influence.passing is not None else None,
        "bound": found.bound if found is not None else None,
        "first_order": None if indices is None else {"value": indices.first.value, "interval": indices.first.interval},
        "one_at_a_time": None if influence.levels is None else influence.levels.to_json(),
        "total": None if indices is None else {"value": indices.whole.value, "interval": indices.whole.interval},
    }


def _sample_object(analysis: Analysis, result: SampleResult) -> Mapping[str, object]:
    smallest = result.smallest
    return {
        "sample": result.number,
        "outcome": result.outcome,
        "step": result.step,
        "expectation": result.broken,
        "cause": result.cause,
        "smallest_margin": smallest if math.isfinite(smallest) else None,
        "margins": {margin.name: margin.finite for margin in result.margins},
        "values": dict(zip((column.name for column in analysis.columns), analysis.values[result.number], strict=True)),
        "command": analysis.sweep.sampling.job(result.number).command(),
    }


def _time(seconds: float) -> str:
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    minutes = seconds / 60.0
    return f"{minutes:.0f} min" if minutes < 100.0 else f"{minutes / 60.0:.1f} h"
