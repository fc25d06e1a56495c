"""A verdict as JUnit XML, which continuous integration reads: a suite a task, a case a step and an expectation.

There is no standard; what is written here is what the readers have in common (the schema of Jenkins' xUnit plugin), and
`file` and `line` of a case, by which GitLab and actions of GitHub point at a line, and which that schema does not know.
Times are simulated seconds.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from manipcli.core.text import escape
from manipcli.judge.verdict import ExpectationOutcome, StepOutcome, Verdict
from manipcli.report.quantity import quantity
from manipcli.report.run_page import Written
from manipcli.report.text import how_wrong

_NO_XML = re.compile("[\ufffe\uffff]")


def render_junit(
    verdict: Verdict, steps: Sequence[Written], expectations: Sequence[Written], *, log: str = "", file: str = ""
) -> bytes:
    """The file of one run.

    Besides steps and expectations there is the case `run`: it tells of what neither a step nor an expectation does, as
    an interruption or an incomplete log. What could not be judged because something else failed before is skipped.

    Args:
        verdict: what is told.
        steps, expectations: where each of the verdict's stands.
        log: the name of the log.
        file: of the task as CI knows it; "": as in the places.
    """
    cases = [_run(verdict)]
    cases += [
        _step(verdict, one, _attributes(written, file)) for one, written in zip(verdict.steps, steps, strict=True)
    ]
    cases += [
        _expectation(verdict, one, _attributes(written, file))
        for one, written in zip(verdict.expectations, expectations, strict=True)
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
    seed = str(verdict.seed) if verdict.engine else ""  # without an engine the task could not be read
    told = (("verdict", verdict.verdict), ("engine", verdict.engine), ("seed", seed), ("log", log))
    for name, value in told:
        if value:
            SubElement(properties, "property", {"name": name, "value": safe(value)})
    suite.extend(cases)
    indent(suites)
    text: bytes = tostring(suites, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def _run(verdict: Verdict) -> Element:
    """Whether the run came to its end."""
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
        _add(case, "skipped", "not run: the run ended before", "", [])
    elif step.tolerated:
        SubElement(case, "system-out").text = safe(f"{step.outcome}, and the task says that it may: {step.text}")
    elif step.outcome != "done":
        when = "" if step.ended is None else f"at {step.ended:.3f} s"
        message = how_wrong(step) + (f": {step.text}" if step.text else "")
        hints = [f"hint: {one.hint}" for one in verdict.errors if one.hint and verdict.verdict == "failed"]
        _add(case, "failure", message, step.outcome, [when, *hints])
    return case


def _expectation(verdict: Verdict, one: ExpectationOutcome, attributes: dict[str, str]) -> Element:
    case = _case(verdict, "expect", one.name, 0.0, attributes)
    margin = "" if one.margin is None else f"margin {one.margin:+z.9g} {one.unit}".rstrip()
    when = "" if one.at is None else f"at {one.at:.3f} s"
    if one.outcome == "failed":
        size = f" by {quantity(one.distance, one.unit)}" if one.distance else ""
        _add(case, "failure", f"expectation '{one.name}' fails{size}: {one.text}", "failed", [margin, when])
    elif one.outcome == "not_evaluated":
        excused = verdict.verdict == "error" or any(step.went_wrong for step in verdict.steps)
        message = f"expectation '{one.name}' was never evaluated: {one.text}"
        _add(case, "skipped" if excused else "failure", message, "not_evaluated", [])
    elif margin:
        SubElement(case, "system-out").text = safe(", ".join(part for part in (margin, when, one.text) if part))
    return case


def _case(verdict: Verdict, kind: str, name: str, time: float, attributes: dict[str, str]) -> Element:
    words = {"classname": safe(f"{verdict.task}.{kind}"), "name": safe(name), "time": _seconds(time)}
    return Element("testcase", words | attributes)


def _add(case: Element, kind: str, message: str, type_: str, lines: Sequence[str]) -> None:
    words = {"message": safe(message)} | ({"type": type_} if kind != "skipped" else {})
    told = SubElement(case, kind, words)
    if kind != "skipped":
        told.text = "\n".join(safe(line) for part in (message, *lines) for line in part.split("\n") if line)


def _attributes(written: Written, file: str) -> dict[str, str]:
    """Where a reader should point: at the file as the user wrote it, where that is known."""
    name, _, line = written.place.rpartition(":")
    if not line.isdecimal():
        return {}
    return {"file": safe(file or name), "line": line}


def _seconds(time: float) -> str:
    return f"{time:.3f}"


def safe(text: str) -> str:
    """Without the characters that XML has no way to write."""
    return _NO_XML.sub("\ufffd", escape(text))
