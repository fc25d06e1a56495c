"""What the plots of the page of a sweep show: its samples as points, in readable units."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from manipcli.core.units import readable_unit
from manipcli.report.html.markup import link
from manipcli.sweep.analysis import Analysis
from manipcli.sweep.results import SampleResult


@dataclass(frozen=True, slots=True)
class _Axis:
    """A number or a margin: the unit that is shown, and its factor from SI."""

    name: str
    unit: str = ""
    factor: float = 1.0

    @staticmethod
    def of(name: str, unit: str, values: Iterable[float | None]) -> _Axis:
        """In a unit that fits the largest of the values [SI `unit`]."""
        return _Axis(name, *readable_unit(max((abs(v) for v in values if v is not None), default=0.0), unit))

    def shown(self, value: float | None) -> float | None:
        return None if value is None else value * self.factor


def page_data(analysis: Analysis, folder: Path) -> Mapping[str, object]:
    """`numbers` and `margins` with name and unit, `samples` with their values, and the two numbers of the `map`.

    Args:
        analysis: of the sweep. Numbers that matter most come first.
        folder: folder of the page; links to kept logs are relative to it.
    """
    columns = [influence.column for influence in analysis.influences]
    order = [analysis.columns.index(column) for column in columns]
    values = {number: [own[k] for k in order] for number, own in analysis.values.items()}
    names = [spread.name for spread in analysis.spreads if spread.telling]
    by_name = {r.number: {margin.name: margin.finite for margin in r.margins} for r in analysis.sweep.results}
    margins = {number: [own.get(name) for name in names] for number, own in by_name.items()}
    numbers = [
        _Axis.of(column.name, column.unit, (column.nominal, *(own[k] for own in values.values())))
        for k, column in enumerate(columns)
    ]
    units = [spread.unit for spread in analysis.spreads if spread.telling]
    amounts = [_Axis.of(name, units[k], (own[k] for own in margins.values())) for k, name in enumerate(names)]

    def point(result: SampleResult) -> Mapping[str, object]:
        job = analysis.sweep.sampling.job(result.number)
        own, known = values[result.number], margins[result.number]
        return {
            "number": result.number,
            "passed": result.passed,
            "outcome": result.outcome,
            "cause": result.cause,
            "margins": [result.score, *(axis.shown(value) for axis, value in zip(amounts, known, strict=True))],
            "values": [axis.shown(value) for axis, value in zip(numbers, own, strict=True)],
            "command": job.command(),
            "replay": shlex.join(("manipcli", "replay", str(job.log))),
            "link": link(job.log, folder) if job.log.exists() else "",
        }

    passing = [abs(found.rho) if (found := one.passing) is not None else -1.0 for one in analysis.influences]
    return {
        "numbers": [
            {"name": axis.name, "unit": axis.unit, "nominal": axis.shown(column.nominal)}
            for axis, column in zip(numbers, columns, strict=True)
        ],
        "margins": [
            {"name": axis.name, "unit": axis.unit} for axis in (_Axis("smallest margin, in tolerances"), *amounts)
        ],
        "samples": [point(result) for result in analysis.sweep.results],
        "map": sorted(range(len(columns)), key=lambda k: -passing[k])[:2],
    }
