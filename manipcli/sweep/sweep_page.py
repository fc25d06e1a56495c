"""HTML page of a sweep: one file with all plots, that needs no server."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Final

from manipcli.core.text import listed, number_of
from manipcli.core.units import readable
from manipcli.replay.player import POLICY
from manipcli.report.html.markup import Markup, document, element, joined
from manipcli.report.html.page_parts import heading, mark, table
from manipcli.sweep.analysis import Analysis, Influence, Spread
from manipcli.sweep.one_at_a_time import HEADERS
from manipcli.sweep.page_data import page_data
from manipcli.sweep.results import SampleResult
from manipcli.sweep.text import NAMED, SAME, interval_text, percent

BINS: Final = 24
"""Bars of a histogram."""
_SHOWN: Final = (0, 1, 3, 5, 6)
_HEADS: Final = ("least", "5 %", "median", "95 %", "most")


def render_page(analysis: Analysis, folder: Path) -> str:
    """The HTML file.

    Args:
        analysis: of the sweep.
        folder: folder of the page; links to kept logs are relative to it.
    """
    own, shared = files("manipcli.sweep").joinpath("page"), files("manipcli.report.html").joinpath("page")
    style = Markup(shared.joinpath("report.css").read_text("utf-8") + own.joinpath("sweep.css").read_text("utf-8"))
    script = Markup(own.joinpath("sweep.js").read_text("utf-8"))
    data = json.dumps(page_data(analysis, folder), allow_nan=False).replace("<", "\\u003c")
    good = analysis.sweep.rate.passed == analysis.sweep.asked
    title = f"{'✓' if good else '✗'} {analysis.sweep.sampling.task}: {percent(analysis.sweep.rate.share)}"
    return document(
        title,
        _head(analysis, good=good),
        element("main", _plots(analysis), _influences(analysis), _margins(analysis), _failures(analysis)),
        element("script", Markup(data), type="application/json", id="data"),
        element("script", script),
        style=style,
        policy=POLICY,
    )


def _head(analysis: Analysis, *, good: bool) -> Markup:
    sweep = analysis.sweep
    rate = sweep.rate
    figures = [
        ("success rate", percent(rate.share)),
        *([("95 % interval", interval_text(sweep.interval))] if sweep.interval is not None else []),
        ("design", str(sweep.sampling.design)),
        ("seed", str(sweep.sampling.seed)),
        ("numbers varied", str(len(analysis.columns))),
    ]
    figures += [(outcome, str(count)) for outcome, count in sorted(analysis.outcomes.items()) if outcome != "passed"]
    missing = number_of(len(sweep.missing), "sample")
    return element(
        "header",
        element(
            "div",
            element("h1", sweep.sampling.task),
            element(
                "span", f"{rate.passed} of {rate.count} passed", class_=f"verdict {'passed' if good else 'failed'}"
            ),
            class_="title",
        ),
        element("p", f"{missing} missing", class_="warn") if sweep.missing else None,
        element(
            "dl",
            *(element("div", element("dt", name), element("dd", value)) for name, value in figures),
            class_="figures",
        ),
    )


def _plots(analysis: Analysis) -> Markup | None:
    if not analysis.columns or not analysis.sweep.results:
        return None

    def choice(name: str, label: str) -> Markup:
        return element("label", f"{label} ", element("select", id=name))

    about = (
        "Each point is a sample: filled if it passed, a cross if not. Click one for its values and its command. The "
        "smallest margin is drawn within ±1 tolerance, at −1 where a step failed."
    )
    return element(
        "section",
        heading("samples", "Samples", about),
        element(
            "div",
            element(
                "div",
                element("p", choice("margin", "margin"), class_="choices"),
                element("div", class_="small", id="small"),
                element("h3", "Two numbers"),
                element("p", choice("first", "across"), choice("second", "up"), class_="choices"),
                element("div", id="map"),
            ),
            element("aside", id="sample"),
            class_="explore",
        ),
    )


def _influences(analysis: Analysis) -> Markup | None:
    if not analysis.influences:
        return None
    if analysis.indistinct:
        return element("section", heading("influence", "What matters", SAME))
    headers: tuple[str, ...]
    if analysis.sweep.sampling.design.word == "oat":
        about = "How far each number can go from its value in the task, all others as written. Margins in tolerances."
        found = [one.levels.cells for one in analysis.influences if one.levels is not None]
        levels = table(HEADERS, found, numbers=HEADERS[1:])
        return element("section", heading("influence", "What matters", about), levels)
    if analysis.influences[0].indices is not None:
        about = (
            "Share of the variance of the smallest margin (within ±1 tolerance) that a number explains alone, and with "
            "its interactions. Saltelli (2010) and Jansen (1999), intervals by bootstrap."
        )
        headers = ("number", "nominal", "first-order", "95 % interval", "total", "95 % interval ")
    else:
        about = (
            "Rank correlation of each number with the smallest margin, and with whether the sample passed. Where a "
            "step failed, the sample ranks below all others. Where no number matters, some correlation exceeds the "
            "bound in at most 5 % of sweeps."
        )
        headers = ("number", "nominal", "with margin", "", "with passing", " ", "by chance up to", "  ")
    rows = [_influence_row(one) for one in analysis.influences]
    numbers = ("nominal", "first-order", "total", "with margin", "with passing", "by chance up to")
    return element("section", heading("influence", "What matters", about), table(headers, rows, numbers=numbers))


def _influence_row(one: Influence) -> tuple[str, ...]:
    head = (element("code", one.column.name), one.column.text(one.column.nominal))
    cells: list[str] = []
    if one.indices is not None:
        for index in (one.indices.first, one.indices.whole):
            low, high = index.interval
            cells += [f"{index.value:.2f}".replace("-", "−"), f"{low:.2f} to {high:.2f}".replace("-", "−")]
        return (*head, *cells)
    for found in (one.correlation, one.passing):
        cells += ["–", ""] if found is None else [_signed(found.rho), _bar(found.rho, found.bound)]
    bound = next((f"{found.bound:.2f}" for found in (one.correlation, one.passing) if found is not None), "–")
    return (*head, *cells, bound, "matters" if one.matters else "")


def _bar(rho: float, bound: float) -> Markup:
    """A bar from the middle, with the band of chance behind it."""
    left = 50.0 + min(rho, 0.0) * 50.0
    return element(
        "span",
        element("u", style=f"left:{50.0 - 50.0 * bound:.1f}%;width:{100.0 * bound:.1f}%"),
        element("i", style=f"left:{left:.1f}%;width:{50.0 * abs(rho):.1f}%"),
        class_="rho",
        role="img",
        aria_label=_signed(rho),
    )


def _signed(rho: float) -> str:
    return f"{rho:+.2f}".replace("-", "−")


def _margins(analysis: Analysis) -> Markup | None:
    if not analysis.spreads:
        return None
    rows = [_margin_row(analysis, spread) for spread in analysis.spreads]
    about = "Negative where the expectation is missed."
    headers = ("expectation", "met", *_HEADS, "distribution")
    return element("section", heading("margins", "Margins", about), table(headers, rows, numbers=("met", *_HEADS)))


def _margin_row(analysis: Analysis, spread: Spread) -> tuple[str, ...]:
    found = [
        value
        for result in analysis.sweep.results
        for margin in result.margins
        if margin.name == spread.name and (value := margin.finite) is not None
    ]
    shown = (
        [readable(spread.quantiles[k], spread.unit).replace("-", "−") for k in _SHOWN] if spread.telling else ["–"] * 5
    )
    met = f"{spread.met} of {len(analysis.sweep.results)}"
    return (spread.name, met, *shown, _histogram(found) if spread.telling else "")


def _histogram(values: Sequence[float]) -> Markup:
    """Bars from the least to the most value; those below 0 are marked."""
    low, high = min(values), max(values)
    width = (high - low) / BINS or 1.0
    counts = [0] * BINS
    for value in values:
        counts[min(int((value - low) / width), BINS - 1)] += 1
    tallest = max(counts)
    bars = [
        element(
            "rect",
            x=str(k * 10),
            y=f"{40.0 - 40.0 * count / tallest:.2f}",
            width="9",
            height=f"{40.0 * count / tallest:.2f}",
            class_="bad" if low + (k + 0.5) * width < 0.0 else None,
        )
        for k, count in enumerate(counts)
        if count
    ]
    label = f"{len(values)} values from {low:.3g} to {high:.3g}"
    attributes = {"class_": "histogram", "viewBox": f"0 0 {BINS * 10} 40", "preserveAspectRatio": "none"}
    return element("svg", element("title", label), *bars, role="img", aria_label=label, **attributes)


def _failures(analysis: Analysis) -> Markup:
    parts: list[str | None] = []
    if analysis.failures:
        ways = [
            (str(way), str(len(way.samples)), listed(map(str, way.samples), most=NAMED)) for way in analysis.failures
        ]
        parts += [
            heading("failures", "Ways of failing"),
            table(("failure", "samples", "which"), ways, numbers=("samples",)),
        ]
    rows: list[tuple[str, ...]] = [
        (
            str(result.number),
            mark(result.passed, result.outcome),
            _tolerances(result),
            element("div", result.cause, element("div", element("code", _command(analysis, result)))),
        )
        for result in analysis.worst
    ]
    worst = table(
        ("sample", "verdict", "smallest margin", "cause and command"), rows, numbers=("sample", "smallest margin")
    )
    return joined(
        element("section", *parts) if parts else None,
        element("section", heading("worst", "Smallest margins", "In tolerances of their expectations."), worst),
    )


def _tolerances(result: SampleResult) -> str:
    return f"{result.smallest:.2f}".replace("-", "−") if math.isfinite(result.smallest) else "–"


def _command(analysis: Analysis, result: SampleResult) -> str:
    return analysis.sweep.sampling.job(result.number).command()
