"""Many runs, for people: a line each as they end, why those that did not pass did not, and a summary."""

from __future__ import annotations

from collections.abc import Sequence

from manipcli.core.errors import Diagnostic
from manipcli.core.text import number_of, shorten
from manipcli.report.quantity import quantity
from manipcli.report.suite.suite import Case, CaseReport, Suite
from manipcli.report.text import FAIL, PASS, describe

LONGEST = 60
"""Characters of an id that the other columns make room for."""

WIDEST = 110
"""Characters of a cause in the line of a case; the whole of it is told at the end."""


def id_width(cases: Sequence[Case]) -> int:
    """How wide the column of ids is."""
    return min(LONGEST, max((len(case.id) for case in cases), default=0))


def render_line(report: CaseReport, *, width: int = 0) -> str:
    """`✓ passed  tasks/pour.yaml::pour  3.5 s  inside: 14 mm to spare`."""
    mark = PASS if report.passed else FAIL
    head = f"{mark} {report.outcome:<7}  {report.case.id:<{width}}  {report.duration:6.2f} s"
    line = f"{head}  {shorten(gist(report), width=WIDEST)}".rstrip()
    return "\n".join([line, *(f"    {note}" for note in report.notes)]) if report.passed else line


def gist(report: CaseReport) -> str:
    """The smallest margin; of what did not pass, the first cause where that is not the margin."""
    tightest = report.tightest
    if report.passed:
        if tightest is None:
            return "nothing expected" if report.run is not None and not report.run.verdict.expectations else ""
        if not tightest.distance:
            return ""
        return f"{tightest.name}: {quantity(tightest.distance, tightest.unit)} to spare"
    cause = report.troubles[0].message if report.troubles else report.text
    if tightest is not None and tightest.outcome == "failed" and tightest.distance and cause.startswith(tightest.name):
        return f"{tightest.name}: fails by {quantity(tightest.distance, tightest.unit)}"
    return cause


def render_case(report: CaseReport) -> str:
    """What came of a case: its id, what is wrong with it, and where to look."""
    mark = PASS if report.passed else FAIL
    return "\n".join([f"{mark} {report.case.id} {report.outcome}", *(f"  {line}" for line in case_lines(report))])


def case_lines(report: CaseReport) -> list[str]:
    """All that is wrong with a case, what is not, where to look, and how to see it again."""
    lines = []
    for trouble in report.troubles:
        where = f"{trouble.place}: " if trouble.place is not None else ""
        lines.append(f"{where}{trouble.message}")
    lines += beforehand(report)
    lines += judged_lines(report)
    kept = (("log", report.log), ("picture", report.picture), ("report", report.page), ("output", report.output))
    lines += [f"{name}: {path}" for name, path in kept if path is not None]
    return [*lines, *report.notes, f"again: {report.command}"]


def beforehand(report: CaseReport, *, whole: bool = False) -> list[str]:
    """What was known before anything moved: the values that were drawn, all of them where there is room for the
    `whole`, and the warnings."""
    warned = [line for one in report.warnings for line in describe(one).split("\n")]
    if report.drawn is None:
        return warned
    return [report.drawn.told() if whole else str(report.drawn), *warned]


def judged_lines(report: CaseReport) -> list[str]:
    """What was expected and is met: that, too, says where the fault is not."""
    if report.run is None:
        return []
    return [
        f"{PASS} {one.name}" + (f": {quantity(one.distance, one.unit)} to spare" if one.distance else "")
        for one in report.run.verdict.expectations
        if one.outcome == "passed"
    ]


def render_summary(suite: Suite) -> str:
    """How many passed, and what became of the others."""
    words = [report.outcome for report in suite.reports]
    counts = [(words.count(word), word) for word in ("failed", "error", "crashed", "hung", "invalid", "passed")]
    undone = suite.total - len(words)
    told = [f"{count} {word}" for count, word in counts if count] + ([f"{undone} not run"] if undone else [])
    good = suite.total and all(report.passed for report in suite.reports) and not undone
    why = {"": "", "interrupted": "; interrupted", "first failure": "; stopped at the first failure"}[suite.stopped]
    text = ", ".join(told) or "nothing to run"
    return f"{PASS if good else FAIL} {text} in {suite.duration:.1f} s, {number_of(suite.jobs, 'process')}{why}"


def render_suite(suite: Suite) -> str:
    """What is left to say when all lines are out. What is wrong with a file is told once, and not for each sample."""
    failures = [render_case(one) for one in once_a_file(suite.reports) if not one.passed]
    return "\n\n".join([*failures, "\n".join([*suite.notes, render_summary(suite)])])


def once_a_file(reports: Sequence[CaseReport]) -> list[CaseReport]:
    """Of samples that cannot be run for the same reasons only the first."""
    seen: set[tuple[str, tuple[Diagnostic, ...]]] = set()
    kept = []
    for one in reports:
        why = (one.case.file, one.findings)
        if one.outcome != "invalid" or why not in seen:
            kept.append(one)
        seen.add(why)
    return kept
