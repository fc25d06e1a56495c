"""The machine's view: one JSON object a command, with names that are documented and kept.

`run` and `judge` give the same object; what only a run knows (`wall_time`, `real_time_factor`, `timing`) is null for
`judge`. An error gives the same object too, with `errors` filled. Numbers are SI; what is not a finite number is null.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence

from manipcli.core.errors import Finding
from manipcli.judge.cuts import Cuts
from manipcli.judge.drawn import Drawn
from manipcli.judge.verdict import StepOutcome, Verdict, VerdictWord
from manipcli.report.run_report import RunReport

Json = None | bool | int | float | str | Sequence["Json"] | Mapping[str, "Json"]


def render_run(report: RunReport) -> str:
    """A run: its verdict, its log and its times."""
    timing = report.timing
    return dumps(
        _object(
            verdict=report.verdict.verdict,
            judged=report.verdict,
            wall_time=report.wall_time,
            real_time_factor=report.real_time_factor,
            log=report.log,
            timing={
                "load": number(timing.load),
                "plan": number(timing.plan),
                "simulate": number(timing.simulate),
                "judge": number(timing.judge),
            },
            errors=(*report.verdict.errors, *report.warnings),
        )
    )


def render_verdict(verdict: Verdict, log: str | None = None) -> str:
    """A log, judged; without one, a task that cannot be planned."""
    return dumps(_object(verdict=verdict.verdict, judged=verdict, log=log, errors=verdict.errors))


def render_errors(
    findings: Sequence[Finding], verdict: VerdictWord = "error", *, known: Mapping[str, Json] | None = None
) -> str:
    """A command that ended before there was anything to judge; `known`: what it knew of a run by then."""
    return dumps({**_object(verdict=verdict, errors=findings), **(known or {})})


def render_findings(findings: Sequence[Finding], files: Sequence[str]) -> str:
    """Checked files: `failed` where at least one finding is an error."""
    failed = any(finding.severity == "error" for finding in findings)
    return dumps(
        {
            "verdict": "failed" if failed else "passed",
            "files": list(files),
            "findings": [finding_object(finding) for finding in findings],
        }
    )


def dumps(value: Json) -> str:
    """JSON text in ASCII: control characters and what a terminal might not know are escaped."""
    return json.dumps(value, indent=2, allow_nan=False)


def _object(
    *,
    verdict: VerdictWord,
    judged: Verdict | None = None,
    wall_time: float | None = None,
    real_time_factor: float | None = None,
    log: str | None = None,
    timing: Json = None,
    errors: Sequence[Finding],
) -> dict[str, Json]:
    """The one object, its keys always there."""
    return {
        "task": judged.task if judged is not None else None,
        "verdict": verdict,
        "text": judged.text if judged is not None else "",
        "seed": judged.seed if judged is not None else None,
        "engine": judged.engine if judged is not None else None,
        "sample": _sample(judged.drawn) if judged is not None and judged.drawn is not None else None,
        "simulated_time": number(judged.simulated_time) if judged is not None else None,
        "wall_time": number(wall_time),
        "real_time_factor": number(real_time_factor),
        "log": log,
        "timing": timing,
        "saturated": saturated_object(judged.cuts if judged is not None else Cuts()),
        "steps": [step_object(step) for step in (judged.steps if judged is not None else ())],
        "expectations": [
            {
                "name": expectation.name,
                "outcome": expectation.outcome,
                "margin": number(expectation.margin),
                "unit": expectation.unit,
                "at": number(expectation.at),
                "text": expectation.text,
            }
            for expectation in (judged.expectations if judged is not None else ())
        ],
        "errors": [finding_object(finding) for finding in errors],
    }


def _sample(drawn: Drawn) -> Json:
    return {"number": drawn.number, "values": dict(drawn.values)}


def saturated_object(cuts: Cuts) -> dict[str, Json]:
    """Ticks by joint and by actuator, of those that were cut."""
    return {
        "joints": _counted(cuts.joints),
        "actuators": _counted(cuts.actuators),
        "limits": {kind: dict(some) for kind, of in cuts.kinds.items() if (some := _counted(of))},
    }


def _counted(counts: Mapping[str, int]) -> dict[str, Json]:
    return {name: count for name, count in counts.items() if count}


def step_object(step: StepOutcome) -> dict[str, Json]:
    return {
        "id": step.id,
        "verb": step.verb,
        "outcome": step.outcome,
        "started": number(step.started),
        "ended": number(step.ended),
        "planned_duration": number(step.planned_duration),
        "text": step.text,
        "tolerated": step.tolerated,
        "attempts": [
            {
                "outcome": attempt.outcome,
                "started": number(attempt.started),
                "ended": number(attempt.ended),
                "text": attempt.text,
            }
            for attempt in step.attempts
        ],
        "replanned": list(step.replanned),
    }


def finding_object(finding: Finding) -> dict[str, Json]:
    place = finding.place
    return {
        "severity": finding.severity,
        "code": finding.code,
        "file": place.file if place is not None else None,
        "line": place.line if place is not None and place.line > 0 else None,
        "column": place.column if place is not None and place.line > 0 else None,
        "message": finding.message,
        "hint": finding.hint,
    }


def number(value: float | None) -> float | None:
    """Rounded to 1e-9, which drops the dust of binary fractions (4.2 instead of 4.200000000000001)."""
    return round(float(value), 9) if value is not None and math.isfinite(value) else None
