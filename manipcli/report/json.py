"""JSON output of the commands: one object per command, with documented and stable keys.

`run` and `judge` give the same object; keys that only a run has (`wall_time`, `real_time_factor`, `timing`) are null
for `judge`. An error gives the same object with `errors` filled. Numbers are SI; a number that is not finite is null.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass

from manipcli.core.errors import Diagnostic
from manipcli.judge.saturations import Saturations
from manipcli.judge.verdict import BlockOutcome, StepOutcome, Verdict, VerdictWord
from manipcli.report.run_report import RunReport

Json = None | bool | int | float | str | Sequence["Json"] | Mapping[str, "Json"]


def render_run(report: RunReport) -> str:
    """The JSON object of a run: verdict, log and wall times."""
    errors = (*report.verdict.errors, *report.warnings)
    return dumps(_object(report.verdict, errors, **picked(report, "wall_time real_time_factor log timing")))


def render_verdict(verdict: Verdict, log: str | None = None) -> str:
    """The JSON object of a judged log; `log` is None for a task that cannot be planned."""
    return dumps(_object(verdict, verdict.errors, log=log))


def render_errors(
    findings: Sequence[Diagnostic], verdict: VerdictWord = "error", *, known: Mapping[str, Json] | None = None
) -> str:
    """The JSON object of a command that ended without a verdict; `known` holds the keys of the run known by then."""
    return dumps({**_object(None, findings, verdict=verdict), **(known or {})})


def render_findings(
    findings: Sequence[Diagnostic], files: Sequence[str], *, strict: bool = False, more: Mapping[str, Json] = {}
) -> str:
    """The JSON object of checked files; `failed` if a finding is an error, with `strict` also if one is a warning.

    `more`: further keys.
    """
    failing = ("error", "warning") if strict else ("error",)
    failed = any(finding.severity in failing for finding in findings)
    return dumps(
        {
            "verdict": "failed" if failed else "passed",
            "files": list(files),
            "findings": plain(findings),
            **more,
        }
    )


def dumps(value: Json) -> str:
    """JSON text in ASCII; all other characters are escaped."""
    return json.dumps(value, indent=2, allow_nan=False)


def plain(value: object) -> Json:
    """A value as JSON: a dataclass as an object of its fields, numbers rounded by `number`."""
    if isinstance(value, Diagnostic):
        return finding_object(value)
    if isinstance(value, float):
        return number(value)
    if value is None or isinstance(value, int | str):
        return value
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if is_dataclass(value):
        return picked(value, " ".join(field.name for field in fields(value)))
    assert isinstance(value, Sequence)
    return [plain(item) for item in value]


def picked(value: object, keys: str) -> dict[str, Json]:
    """The attributes of a value named by the JSON `keys`, a list separated by spaces."""
    return {key: plain(getattr(value, key)) for key in keys.split()}


def _object(judged: Verdict | None, errors: Sequence[Diagnostic], **known: Json) -> dict[str, Json]:
    """The object of `run` and `judge`, with all its keys in a fixed order."""
    empty = "task verdict text seed engine sample part simulated_time wall_time real_time_factor log timing"
    found: dict[str, Json] = {**dict.fromkeys(empty.split()), "text": "", "saturated": saturated_object(Saturations())}
    found |= {
        "self_contacts": [],
        "located": [],
        "holding": [],
        "steps": [],
        "blocks": [],
        "expectations": [],
        "implied": [],
    }
    found |= {"candidates": []}
    if judged is not None:
        found |= picked(judged, "task verdict text seed engine simulated_time")
        found["saturated"] = saturated_object(judged.saturations)
        found["self_contacts"] = plain(judged.self_contacts)
        found["located"] = plain(judged.located)
        found["holding"] = plain(judged.holding)
        found["steps"] = [step_object(step) for step in judged.steps]
        for key, outcomes in (("expectations", judged.expectations), ("implied", judged.implied)):
            found[key] = [picked(each, "name outcome margin unit at text") for each in outcomes]
        found["candidates"] = plain(judged.candidates)
        if judged.part is not None:
            found["part"] = plain(judged.part)
        found["blocks"] = [block_object(judged, block) for block in judged.blocks]
        if judged.drawn is not None:
            found["sample"] = {"number": judged.drawn.number, "values": dict(judged.drawn.values)}
    return {**found, **known, "errors": plain(errors)}


def saturated_object(saturations: Saturations) -> dict[str, Json]:
    """Number of saturated ticks of each saturated joint and actuator."""
    return {
        "joints": _counted(saturations.joints),
        "actuators": _counted(saturations.actuators),
        "limits": {kind: dict(some) for kind, of in saturations.kinds.items() if (some := _counted(of))},
    }


def _counted(counts: Mapping[str, int]) -> dict[str, Json]:
    return {name: count for name, count in counts.items() if count}


def step_object(step: StepOutcome) -> dict[str, Json]:
    return picked(step, "id verb outcome started ended planned_duration text tolerated attempts replanned")


def block_object(judged: Verdict, block: BlockOutcome) -> dict[str, Json]:
    """A block with the ids of its steps and of the block around it."""
    return {
        **picked(block, "id word outcome taken started ended attempts text tolerated"),
        "parent": None if block.parent is None else judged.blocks[block.parent].id,
        "steps": [step.id for step in judged.steps[block.first : block.last]],
    }


def finding_object(finding: Diagnostic) -> dict[str, Json]:
    place = finding.place
    written = place is not None and place.line > 0
    return {
        **picked(finding, "severity code"),
        "file": place.file if place is not None else None,
        **(picked(place, "line column") if written else {"line": None, "column": None}),
        **picked(finding, "message hint"),
    }


def number(value: float | None) -> float | None:
    """Rounded to 1e-9, which removes rounding noise (4.2 instead of 4.200000000000001); None if not finite."""
    return round(float(value), 9) if value is not None and math.isfinite(value) else None
