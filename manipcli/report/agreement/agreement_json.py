"""JSON output of compared runs; each run has the object of `manipcli run --format json`."""

from __future__ import annotations

import json

from manipcli.judge.agreement import Agreement, Disagreement
from manipcli.judge.compared_numbers import Row
from manipcli.report.agreement.compared_runs import ComparedRuns
from manipcli.report.agreement.disagreement import message, summary
from manipcli.report.json import Json, dumps, finding_object, number, render_run


def render_json(compared: ComparedRuns) -> str:
    """The JSON object of `run --engines`."""
    agreement = compared.agreement
    runs = [
        {"run": run.name, "engine": run.verdict.engine, "step": number(run.step), **json.loads(render_run(report))}
        for run, report in zip(agreement.runs, compared.reports, strict=True)
    ]
    passed = compared.exit_code == 0
    verdict = "passed" if passed else "differs" if not agreement.agrees else "failed"
    return dumps({"task": agreement.task, "verdict": verdict, **agreement_object(agreement), "runs": runs})


def agreement_object(agreement: Agreement) -> dict[str, Json]:
    """The comparison without the runs: its result, disagreements and numbers."""
    return {
        "text": summary(agreement),
        "agrees": agreement.agrees,
        "compared": [run.name for run in agreement.runs],
        "disagreements": [_disagreement(found) for found in agreement.disagreements],
        "numbers": [_row(row) for row in agreement.rows],
        "warnings": [finding_object(finding) for finding in agreement.warnings],
    }


def _row(row: Row) -> Json:
    return {
        "kind": row.kind,
        "name": row.name or None,
        "unit": row.unit,
        "values": [None if value is None else number(value.value) for value in row.values],
        "outcomes": list(row.outcomes),
        "difference": number(row.difference),
        "allowed": number(row.allowed),
    }


def _disagreement(found: Disagreement) -> Json:
    place = found.place
    written = place is not None and place.line > 0
    return {
        "cause": found.cause,
        "kind": found.kind,
        "name": found.name or None,
        "message": message(found),
        "runs": list(found.runs),
        "outcomes": list(found.outcomes),
        "values": [None if value is None else number(value.value) for value in found.values],
        "allowed": number(found.allowed),
        "file": place.file if place is not None else None,
        "line": place.line if place is not None and written else None,
        "column": place.column if place is not None and written else None,
    }
