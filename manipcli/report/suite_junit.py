"""Many runs as one JUnit file: the suites that each run has by itself, and one for each that has no verdict or no run.

Times are those on the wall, and stand with the case `run` of each: the simulated time of a step is no time that a test
took.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement, fromstring, indent, tostring

from manipcli.report.junit import safe
from manipcli.report.suite import Case, CaseReport, Suite
from manipcli.report.suite_text import beforehand

COUNTED = ("tests", "failures", "errors", "skipped")


def render_junit(suite: Suite) -> bytes:
    """The file; counts of its root are the sums over the suites."""
    root = Element("testsuites", {"name": "manipcli"})
    for report in suite.reports:
        found = fromstring(report.junit).findall("testsuite") if report.junit else [_without_verdict(report)]
        for one in found:
            one.set("name", safe(report.case.id))
            if report.outcome == "failed" and report.run is not None and report.run.verdict.verdict == "passed":
                _add_baseline(one, report)
            _add_properties(one, report)
            one.set("time", f"{report.duration:.3f}")
            for case in one.iter("testcase"):
                case.set("time", one.get("time", "") if case.get("classname", "").endswith(".run") else "0.000")
                if report.case.sample is not None:
                    case.set("classname", f"{case.get('classname', '')}.sample_{report.case.sample}")
                for told in (*case.iter("failure"), *case.iter("error")):
                    told.text = "\n".join([told.text or "", *map(safe, beforehand(report))])
            if not report.passed:
                SubElement(one, "system-out").text = safe(f"again: {report.command}")
            root.append(one)
    root.extend(_undone(suite, case) for case in suite.undone)
    for count in COUNTED[:-1]:  # a root counts no skipped ones
        root.set(count, str(sum(int(one.get(count, "0")) for one in root)))
    root.set("time", f"{suite.duration:.3f}")
    indent(root)
    text: bytes = tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def _add_properties(suite: Element, report: CaseReport) -> None:
    """What only is known when a run is over: whether its log was kept; and the values that were drawn for it."""
    told = {"log": report.log} if report.log is not None else {}
    if report.run is not None:
        told["simulated_time"] = f"{report.run.verdict.simulated_time:.3f}"
    if report.drawn is not None:
        told["sample"] = str(report.drawn)
    if not told:
        return
    properties = suite.find("properties")
    if properties is None:
        properties = Element("properties")
        suite.insert(0, properties)
    for name, value in told.items():
        SubElement(properties, "property", {"name": name, "value": safe(value)})


def _add_baseline(suite: Element, report: CaseReport) -> None:
    """A run that passed, and is worse than its baseline: the case `baseline`, which fails."""
    words = {"classname": safe(f"{report.case.task}.baseline"), "name": "baseline", "time": "0.000"}
    failure = SubElement(SubElement(suite, "testcase", words), "failure")
    failure.set("type", "baseline")
    failure.set("message", safe(report.text))
    failure.text = "\n".join(safe(f"{one.place}: {one.message}") for one in report.troubles)
    for count in ("tests", "failures"):
        suite.set(count, str(int(suite.get(count, "0")) + 1))


def _without_verdict(report: CaseReport) -> Element:
    """A crash, a hang, a file that cannot be used: a suite with the one case `run`, which is an error."""
    counts = dict.fromkeys(COUNTED, "0") | {"tests": "1", "errors": "1", "time": "0.000"}
    one = Element("testsuite", counts)
    place = report.troubles[0].place if report.troubles else None
    words = {"classname": safe(f"{report.case.task}.run"), "name": "run", "time": "0.000"}
    if place is not None and place.line > 0:
        words |= {"file": safe(place.file), "line": str(place.line)}
    else:  # a word of the command line is no file
        words["file"] = safe(report.case.file)
    error = SubElement(SubElement(one, "testcase", words), "error")
    error.set("type", report.outcome)
    cause = report.troubles[0].message if report.troubles else ""
    error.set("message", safe(": ".join(dict.fromkeys(word for word in (report.text, cause) if word))))
    error.text = "\n".join(safe(f"{one.place}: {one.message}" if one.place else one.message) for one in report.troubles)
    return one


def _undone(suite: Suite, case: Case) -> Element:
    """A case that was not run, or not to its end: an error where somebody interrupted, else skipped."""
    kind, count = ("error", "errors") if suite.stopped == "interrupted" else ("skipped", "skipped")
    counts = dict.fromkeys(COUNTED, "0") | {"tests": "1", count: "1", "time": "0.000"}
    one = Element("testsuite", {"name": safe(case.id), **counts})
    words = {"classname": safe(f"{case.task}.run"), "name": "run", "time": "0.000", "file": safe(case.file)}
    told = SubElement(SubElement(one, "testcase", words), kind, {"message": f"not run to its end: {suite.stopped}"})
    if kind == "error":
        told.set("type", suite.stopped)
    return one
