"""Text output of many runs: one line per run, the causes of failures, and a summary."""

from __future__ import annotations

from collections.abc import Sequence

from manipcli.core.errors import Diagnostic
from manipcli.core.text import number_of, shorten
from manipcli.report.agreement.agreement_text import numbers_table
from manipcli.report.display_quantity import quantity
from manipcli.report.suite.suite import Case, CaseReport, Suite
from manipcli.report.text import FAIL, PASS, describe

LONGEST = 60
"""Widest column of ids [characters]."""

WIDEST = 110
"""Longest cause in the line of a case [characters]; the end of the output shows all of it."""


def id_width(cases: Sequence[Case]) -> int:
    """Width of the column of ids [characters]."""
    return min(LONGEST, max((len(case.id) for case in cases), default=0))


def render_line(report: CaseReport, *, width: int = 0) -> str:
    """`✓ passed  tasks/pour.yaml::pour  3.5 s  inside: 14 mm to spare`."""
    mark = PASS if report.passed else FAIL
    head = f"{mark} {report.outcome:<7}  {report.case.id:<{width}}  {report.duration:6.2f} s"
    line = f"{head}  {shorten(gist(report), width=WIDEST)}".rstrip()
    return "\n".join([line, *(f"    {note}" for note in report.notes)]) if report.passed else line


def gist(report: CaseReport) -> str:
    """The smallest margin; for a failed case its first cause, unless that is the margin."""
    tightest = report.tightest
    if report.passed and report.agreement is not None:
        return report.text
    if report.passed:
        if tightest is None:
            return "no expectations" if report.run is not None and not report.run.verdict.expectations else ""
        if not tightest.distance:
            return ""
        return f"{tightest.name}: {quantity(tightest.distance, tightest.unit)} to spare"
    cause = report.troubles[0].message if report.troubles else report.text
    if tightest is not None and tightest.outcome == "failed" and tightest.distance and cause.startswith(tightest.name):
        return f"{tightest.name}: fails by {quantity(tightest.distance, tightest.unit)}"
    return cause


def render_case(report: CaseReport) -> str:
    """A case with its id, outcome, causes and files."""
    mark = PASS if report.passed else FAIL
    return "\n".join([f"{mark} {report.case.id} {report.outcome}", *(f"  {line}" for line in case_lines(report))])


def case_lines(report: CaseReport) -> list[str]:
    """Causes, met expectations, files of a case and the command that reproduces it."""
    lines = []
    for trouble in report.troubles:
        where = f"{trouble.place}: " if trouble.place is not None else ""
        lines.append(f"{where}{trouble.message}")
    lines += beforehand(report)
    lines += judged_lines(report)
    if report.agreement is not None:
        lines += numbers_table(report.agreement).splitlines()
    kept = (("log", report.log), ("picture", report.picture), ("report", report.page), ("output", report.output))
    lines += [f"{name}: {path}" for name, path in kept if path is not None]
    return [*lines, *report.notes, f"reproduce: {report.command}"]


def beforehand(report: CaseReport, *, whole: bool = False) -> list[str]:
    """Drawn values of a sample (all with `whole`, else the first ones) and warnings from before the run."""
    warned = [line for warning in report.warnings for line in describe(warning).split("\n")]
    if report.drawn is None:
        return warned
    return [report.drawn.described() if whole else str(report.drawn), *warned]


def judged_lines(report: CaseReport) -> list[str]:
    """The met expectations of a failed case: they narrow down the cause."""
    if report.run is None:
        return []
    return [
        f"{PASS} {expectation.name}"
        + (f": {quantity(expectation.distance, expectation.unit)} to spare" if expectation.distance else "")
        for expectation in report.run.verdict.expectations
        if expectation.outcome == "passed"
    ]


def render_summary(suite: Suite) -> str:
    """One line: how many cases passed, failed or were not run, and the duration."""
    words = [report.outcome for report in suite.reports]
    counts = [
        (words.count(word), word) for word in ("failed", "differs", "error", "crashed", "hung", "invalid", "passed")
    ]
    undone = suite.total - len(words)
    parts = [f"{count} {word}" for count, word in counts if count] + ([f"{undone} not run"] if undone else [])
    good = suite.total and all(report.passed for report in suite.reports) and not undone
    why = {"": "", "interrupted": "; interrupted", "first failure": "; stopped at the first failure"}[suite.stopped]
    text = ", ".join(parts) or "nothing to run"
    return f"{PASS if good else FAIL} {text} in {suite.duration:.1f} s, {number_of(suite.jobs, 'process')}{why}"


def slowest_lines(suite: Suite, most: int) -> tuple[str, ...]:
    """The `most` slowest cases, or all of them for 0: `  5.22 s  tasks/pour.yaml::pour`."""
    slowest = sorted(suite.reports, key=lambda report: (-report.duration, report.case.id))
    return tuple(f"{report.duration:7.2f} s  {report.case.id}" for report in slowest[: most or None])


def render_suite(suite: Suite) -> str:
    """Failures, notes and summary after the lines of all cases; errors of a file are shown once, not per sample."""
    failures = [render_case(report) for report in once_a_file(suite.reports) if not report.passed]
    return "\n\n".join([*failures, "\n".join([*suite.notes, render_summary(suite)])])


def once_a_file(reports: Sequence[CaseReport]) -> list[CaseReport]:
    """The reports, with only the first of the samples that are invalid for the same reasons."""
    seen: set[tuple[str, tuple[Diagnostic, ...]]] = set()
    kept = []
    for report in reports:
        why = (report.case.file, report.findings)
        if report.outcome != "invalid" or why not in seen:
            kept.append(report)
        seen.add(why)
    return kept
