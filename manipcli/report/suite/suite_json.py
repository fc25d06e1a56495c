"""JSON output of many runs; the `run` of each case is the object of `manipcli run --format json`."""

from __future__ import annotations

import json
from collections.abc import Sequence

from manipcli.core.errors import Place
from manipcli.report.agreement.agreement_json import agreement_object
from manipcli.report.json import Json, dumps, finding_object, number, render_run
from manipcli.report.suite.suite import CaseReport, Suite


def render_suite(suite: Suite) -> str:
    """The JSON object; `verdict` is `passed`, `failed`, or `error` if a case was not run."""
    good = all(report.passed for report in suite.reports)
    whole = len(suite.reports) == suite.total and suite.total > 0
    return dumps(
        {
            "verdict": "failed" if not good else "passed" if whole else "error",
            "stopped": suite.stopped or None,
            "total": suite.total,
            "passed": sum(report.passed for report in suite.reports),
            "jobs": suite.jobs,
            "wall_time": number(suite.duration),
            "not_run": [case.id for case in suite.undone],
            "notes": list(suite.notes),
            "cases": [_case(report) for report in suite.reports],
        }
    )


def render_tests(ids: Sequence[str]) -> str:
    """The JSON object of tests that are only listed."""
    return dumps({"total": len(ids), "tests": list(ids)})


def _case(report: CaseReport) -> Json:
    tightest = report.tightest
    return {
        "id": report.case.id,
        "file": report.case.file,
        "task": report.case.task,
        "sample": report.case.sample,
        "engine": report.case.variant.engine if report.case.variant is not None else None,
        "half_step": report.case.variant is not None and report.case.variant.half_step,
        "tags": list(report.case.tags),
        "outcome": report.outcome,
        "text": report.text,
        "wall_time": number(report.duration),
        "tightest": None
        if tightest is None
        else {"name": tightest.name, "margin": number(tightest.margin), "unit": tightest.unit},
        "troubles": [
            {"message": trouble.message, "at": number(trouble.at), **_place(trouble.place)}
            for trouble in report.troubles
        ],
        "warnings": [finding_object(warning) for warning in report.warnings],
        "run": json.loads(render_run(report.run)) if report.run is not None else None,
        "agreement": agreement_object(report.agreement) if report.agreement is not None else None,
        "log": report.log,
        "picture": report.picture,
        "page": report.page,
        "output": report.output,
        "notes": list(report.notes),
        "command": report.command,
    }


def _place(place: Place | None) -> dict[str, Json]:
    if place is None:
        return {"file": None, "line": None, "column": None}
    return {"file": place.file, "line": place.line or None, "column": place.column or None}
