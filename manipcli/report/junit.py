"""A verdict as JUnit XML for continuous integration: one suite per task, one case per step and per expectation.

JUnit XML has no standard. This file follows the schema of Jenkins' xUnit plugin, plus `file` and `line` of a case, with
which GitLab and GitHub actions link a line. Times are simulated seconds.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from manipcli.core.text import escape
from manipcli.judge.verdict import BlockOutcome, ExpectationOutcome, StepOutcome, Verdict
from manipcli.replay.cause import Written
from manipcli.report.display_quantity import quantity
from manipcli.report.nesting import block_line
from manipcli.report.text import how_wrong

_NO_XML = re.compile("[\ufffe\uffff]")


def render_junit(
    verdict: Verdict, steps: Sequence[Written], expectations: Sequence[Written], *, log: str = "", file: str = ""
) -> bytes:
    """The file of one run.

    A block of steps is a case, too: it fails if it timed out though its steps were done. The additional case `run`
    reports what belongs to no step or expectation, such as an interruption or an incomplete log. An expectation that
    was not evaluated because a step failed before is skipped.

    Args:
        verdict: the verdict.
        steps, expectations: where each of the verdict's steps and expectations is written.
        log: name of the log.
        file: path of the task file in CI; "" keeps the files of `steps` and `expectations`.
    """
    cases = [_run(verdict)]
    cases += [
        _step(verdict, step, _attributes(written, file)) for step, written in zip(verdict.steps, steps, strict=True)
    ]
    cases += [_block(verdict, block) for block in verdict.blocks]
    cases += [
        _expectation(verdict, outcome, _attributes(written, file))
        for outcome, written in zip(verdict.expectations, expectations, strict=True)
    ]
    counts = {
        "tests": len(cases),
        "failures": sum(case.find("failure") is not None for case in cases),
        "errors": sum(case.find("error") is not None for case in cases),
    }
    skipped = str(sum(case.find("skipped") is not None for case in cases))
    totals = {name: str(count) for name, count in counts.items()} | {"time": _seconds(verdict.simulated_time)}
    suites = Element("testsuites", {"name": "manipcli", **totals})
    suite = SubElement(suites, "testsuite", {"name": safe(verdict.task), **totals, "skipped": skipped})
    properties = SubElement(suite, "properties")
    seed = str(verdict.seed) if verdict.engine else ""  # no engine: the task file is invalid
    values = (("verdict", verdict.verdict), ("engine", verdict.engine), ("seed", seed), ("log", log))
    for name, value in values:
        if value:
            SubElement(properties, "property", {"name": name, "value": safe(value)})
    if verdict.part is not None:
        SubElement(properties, "property", {"name": "part", "value": safe(str(verdict.part))})
    for held in verdict.holding:
        SubElement(properties, "property", {"name": "holding", "value": safe(held)})
    suite.extend(cases)
    indent(suites)
    text: bytes = tostring(suites, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def _run(verdict: Verdict) -> Element:
    """The case `run`: whether the run finished."""
    place = verdict.errors[0].place if verdict.errors else None
    where = {"file": safe(place.file), "line": str(place.line)} if place is not None and place.line > 0 else {}
    case = _case(verdict, "run", "run", verdict.simulated_time, where)
    if verdict.verdict == "error":
        lines = [str(finding) + (f"\nhint: {finding.hint}" if finding.hint else "") for finding in verdict.errors]
        _add(case, "error", verdict.text or "error", verdict.errors[0].code if verdict.errors else "error", lines)
    elif verdict.verdict == "failed" and verdict.ended_between:
        _add(case, "failure", verdict.text, "failed", [])
    return case


def _step(verdict: Verdict, step: StepOutcome, attributes: dict[str, str]) -> Element:
    took = 0.0 if step.started is None or step.ended is None else step.ended - step.started
    case = _case(verdict, "steps", step.id, took, attributes)
    if step.outcome == "not_run":
        _add(case, "skipped", f"not run: {step.text or 'the run ended before this step'}", "", [])
    elif step.outcome == "skipped":
        _add(case, "skipped", f"skipped: {step.text}", "", [])
    elif step.tolerated:
        SubElement(case, "system-out").text = safe(f"{step.outcome}, tolerated by the task: {step.text}")
    elif step.outcome != "done":
        when = "" if step.ended is None else f"at {step.ended:.3f} s"
        message = how_wrong(step) + (f": {step.text}" if step.text else "")
        hints = [f"hint: {finding.hint}" for finding in verdict.errors if finding.hint and verdict.verdict == "failed"]
        _add(case, "failure", message, step.outcome, [when, *hints])
    return case


def _block(verdict: Verdict, block: BlockOutcome) -> Element:
    took = 0.0 if block.started is None or block.ended is None else block.ended - block.started
    case = _case(verdict, "blocks", block.id, took, {})
    if block.outcome in ("not_run", "skipped"):
        _add(case, "skipped", f"{block.outcome.replace('_', ' ')}: {block.text}", "", [])
    elif any(block is one for one in verdict.blocks_at_fault):
        _add(case, "failure", block_line(block), block.outcome, [])
    else:
        SubElement(case, "system-out").text = safe(block_line(block))
    return case


def _expectation(verdict: Verdict, expectation: ExpectationOutcome, attributes: dict[str, str]) -> Element:
    case = _case(verdict, "expect", expectation.name, 0.0, attributes)
    margin = "" if expectation.margin is None else f"margin {expectation.margin:+z.9g} {expectation.unit}".rstrip()
    when = "" if expectation.at is None else f"at {expectation.at:.3f} s"
    if expectation.outcome == "failed":
        size = f" by {quantity(expectation.distance, expectation.unit)}" if expectation.distance else ""
        _add(
            case,
            "failure",
            f"expectation '{expectation.name}' fails{size}: {expectation.text}",
            "failed",
            [margin, when],
        )
    elif expectation.outcome == "skipped":
        _add(case, "skipped", f"expectation '{expectation.name}' was not asked: {expectation.text}", "", [])
    elif expectation.outcome == "not_evaluated":
        excused = expectation.excused or verdict.verdict == "error" or any(step.went_wrong for step in verdict.steps)
        message = f"expectation '{expectation.name}' was never evaluated: {expectation.text}"
        _add(case, "skipped" if excused else "failure", message, "not_evaluated", [])
    elif margin:
        SubElement(case, "system-out").text = safe(", ".join(part for part in (margin, when, expectation.text) if part))
    return case


def _case(verdict: Verdict, kind: str, name: str, time: float, attributes: dict[str, str]) -> Element:
    words = {"classname": safe(f"{verdict.task}.{kind}"), "name": safe(name), "time": _seconds(time)}
    return Element("testcase", words | attributes)


def _add(case: Element, kind: str, message: str, type_: str, lines: Sequence[str]) -> None:
    words = {"message": safe(message)} | ({"type": type_} if kind != "skipped" else {})
    result = SubElement(case, kind, words)
    if kind != "skipped":
        result.text = "\n".join(safe(line) for part in (message, *lines) for line in part.split("\n") if line)


def _attributes(written: Written, file: str) -> dict[str, str]:
    """`file` and `line` of a case: where the user wrote it, if known."""
    name, _, line = written.place.rpartition(":")
    if not line.isdecimal():
        return {}
    return {"file": safe(file or name), "line": line}


def _seconds(time: float) -> str:
    return f"{time:.3f}"


def safe(text: str) -> str:
    """Text without the characters that XML 1.0 does not allow."""
    return _NO_XML.sub("\ufffd", escape(text))
