"""Text output of runs, verdicts and findings: causes first, then steps, expectations with margins, and the log.

Every mark is followed by a word with the same meaning; the console adds colour.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from manipcli.core.errors import Diagnostic
from manipcli.core.text import number_of, one_line
from manipcli.judge.self_contacts import self_contact_line
from manipcli.judge.verdict import BlockOutcome, ExpectationOutcome, StepOutcome, Verdict
from manipcli.report.display_quantity import data_size, quantity
from manipcli.report.doc_pages import more_about
from manipcli.report.located import LOCATED, located_rows
from manipcli.report.nesting import MARKS, block_line, nested
from manipcli.report.rounds import first_of_rounds, round_of_finding
from manipcli.report.run_report import RunReport
from manipcli.report.table import table

PASS, FAIL = "✓", "✗"
LARGE = 50_000_000
"""Size from which a log is reported as large [byte]."""


def render_run(report: RunReport, *, verbose: bool = False) -> str:
    """A run: verdict, speed and path of the log; the errors of a refused task."""
    if report.log is None:
        mark, verdict = FAIL, report.verdict
        return "\n".join([render_errors(verdict.errors), f"{mark} {verdict.task} {verdict.verdict}: nothing was run"])
    speed = (
        f"{report.verdict.simulated_time:.2f} s simulated, {report.wall_time:.2f} s real "
        f"({report.real_time_factor:.1f} x real time while simulating)"
    )
    lines = [*_verdict(report.verdict, speed), *_large_log(report), f"log: {report.log}"]
    if verbose:
        timing = report.timing
        lines.append(
            f"time: load {timing.load:.2f} s, plan {timing.plan:.2f} s, "
            f"simulate {timing.simulate:.2f} s, judge {timing.judge:.2f} s"
        )
    return "\n".join(lines)


def _large_log(report: RunReport) -> list[str]:
    """The size of a large log, and what makes the next one smaller."""
    if report.log_size is None or report.log_size < LARGE:
        return []
    rate = ""
    if report.verdict.simulated_time > 0.0:
        rate = f", {data_size(round(60.0 * report.log_size / report.verdict.simulated_time))} per minute"
    return [f"size of the log: {data_size(report.log_size)}{rate}; `record: {{rates: ...}}` in the task thins it"]


def render_session(report: RunReport, failure: str, *, judged: bool = False) -> str:
    """A live session: how long it was, the expectations of its task, and its log.

    Args:
        report: of the session.
        failure: why the simulation or the network failed; "" if neither did.
        judged: the steps of the task were done: the session is shown as a run.
    """
    verdict = report.verdict
    if judged:
        run = render_run(report)
        return f"{run}\n{FAIL} {verdict.task}: {failure}" if failure and failure not in run else run
    first = f"{FAIL} {verdict.task}: {failure}" if failure else f"{PASS} {verdict.task}: session ended"
    lines = [f"{first} ({verdict.simulated_time:.2f} s simulated, {report.wall_time:.2f} s real)"]
    if verdict.expectations:
        lines += [f"expectations at its end: {verdict.text}", _expectations(verdict.expectations)]
    return "\n".join([*lines, f"log: {report.log}"])


def render_verdict(verdict: Verdict, log: str) -> str:
    """The verdict on a log."""
    return "\n".join([*_verdict(verdict, f"{verdict.simulated_time:.2f} s simulated"), f"log: {log}"])


def render_findings(findings: Sequence[Diagnostic], files: Sequence[str], *, strict: bool = False) -> str:
    """All findings of the checked files, then one line with their number; with `strict`, warnings fail.

    What is the same in several rounds of a loop is told once.
    """
    errors = sum(finding.severity == "error" for finding in findings)
    warnings = sum(finding.severity == "warning" for finding in findings)
    mark, word = (FAIL, "failed") if errors or (strict and warnings) else (PASS, "passed")
    summary = f"{mark} {word}: {number_of(len(files), 'file')} checked, {number_of(errors, 'error')}"
    if warnings:
        summary += f", {number_of(warnings, 'warning')}"
    told = [describe(finding, more) for finding, more in first_of_rounds(findings, round_of_finding)]
    return "\n".join([*told, *filter(None, [more_about(findings)]), summary])


def render_errors(findings: Sequence[Diagnostic]) -> str:
    """Findings that ended a command, and where their codes are explained."""
    return "\n".join([*map(describe, findings), *filter(None, [more_about(findings)])])


def describe(finding: Diagnostic, more: str = "") -> str:
    """One finding on one line: place, severity, code, message and `more`; its hint on the next line."""
    line = one_line(f"{finding}{more}")
    return f"{line}\n  hint: {one_line(finding.hint)}" if finding.hint else line


def describe_step(step: StepOutcome) -> str:
    """One step as one line, for progress output."""
    line = f"{step.id}: {_word(step)}{_tries(step)}"
    if step.started is not None and step.ended is not None:
        line += f" ({step.started:.2f} s to {step.ended:.2f} s)"
    return f"{line}: {step.text}" if step.text and step.outcome != "done" else line


def describe_expectation(expectation: ExpectationOutcome) -> str:
    """One expectation as one line."""
    return f"{expectation.name}: {_margin(expectation)}"


def _verdict(verdict: Verdict, speed: str) -> list[str]:
    lines = [*_causes(verdict)]
    if lines:
        lines.append("")
    if verdict.steps:
        lines += [steps_table(verdict.steps, verdict.blocks), ""]
        if choices := [block_line(block) for block in verdict.blocks if block.taken]:
            lines += [*choices, ""]
    if verdict.expectations:
        lines += [_expectations(verdict.expectations), ""]
    if verdict.located:
        lines += [table(LOCATED, located_rows(verdict.located)), ""]
    mark = PASS if verdict.verdict == "passed" else FAIL
    lines.append(f"{mark} {verdict.task} {verdict.verdict}: {verdict.text or _summary(verdict)}")
    if cut := str(verdict.saturations):
        lines.append(cut)
    lines += verdict.holding
    if touching := self_contact_line(verdict.self_contacts):
        lines.append(f"warning: {touching}")
    lines.append(f"{speed}; engine {verdict.engine}, seed {verdict.seed}")
    if verdict.drawn is not None:
        lines.append(str(verdict.drawn))
    return lines


def _causes(verdict: Verdict) -> list[str]:
    """Causes of a verdict other than passed: errors, then failed steps, then unmet expectations."""
    if verdict.verdict == "passed":
        return []
    causes = [render_errors(verdict.errors)] if verdict.errors else []
    if not causes and verdict.ended_between:
        return [f"{FAIL} {verdict.text}"]
    causes += [
        f"{FAIL} {how_wrong(step)}{f': {step.text}' if step.text else ''}" for step in verdict.steps if step.went_wrong
    ]
    causes += [f"{FAIL} {block_line(block)}" for block in verdict.blocks_at_fault]
    causes += [
        f"{FAIL} expectation '{expectation.name}' {_margin(expectation)}"
        for expectation in (*verdict.expectations, *verdict.implied)
        if expectation.missed
    ]
    return causes


def _marked(one: StepOutcome | BlockOutcome) -> str:
    tries = one.attempts if isinstance(one, BlockOutcome) else len(one.attempts)
    return f"{MARKS.get(one.outcome, FAIL)} {_word(one)}{f' at attempt {tries}' if tries > 1 else ''}"


def _verb(one: StepOutcome | BlockOutcome) -> str:
    """The verb of a step; the key of a block, with the branch that was taken."""
    if isinstance(one, StepOutcome):
        return one.verb
    return f"{one.word}: {one.taken}" if one.taken else one.word


def _word(step: StepOutcome | BlockOutcome) -> str:
    return f"{step.outcome.replace('_', ' ')}{', tolerated' if step.tolerated else ''}"


def _tries(step: StepOutcome) -> str:
    return f" at attempt {len(step.attempts)}" if len(step.attempts) > 1 else ""


_WENT_WRONG = {"failed": "failed", "timeout": "timed out", "interrupted": "was interrupted"}


def how_wrong(step: StepOutcome) -> str:
    """How a step went wrong, such as `step 'pick' timed out`."""
    return f"step '{step.id}' {_WENT_WRONG[step.outcome]}{_tries(step)}"


def _summary(verdict: Verdict) -> str:
    done = sum(step.outcome == "done" for step in verdict.steps)
    text = f"{done} of {number_of(len(verdict.steps), 'step')} done"
    if not verdict.expectations:
        return f"{text}, no expectations"
    met = sum(expectation.outcome == "passed" for expectation in verdict.expectations)
    return f"{text}, {met} of {number_of(len(verdict.expectations), 'expectation')} met"


def steps_table(steps: Sequence[StepOutcome], blocks: Sequence[BlockOutcome] = ()) -> str:
    """A row for each step and block; what is in a block is indented. What done steps report is in a last column."""
    ones = list(nested(steps, blocks))
    results = [_result(one) if isinstance(one, StepOutcome) and one.outcome == "done" else "" for _, one in ones]
    rows = [
        (_marked(one), "  " * depth + one.id, _verb(one), _seconds(one.started), _seconds(one.ended), planned, result)
        for (depth, one), result in zip(ones, results, strict=True)
        for planned in (_seconds(one.planned_duration if isinstance(one, StepOutcome) else None),)
    ]
    headers = ("step", "id", "verb", "started", "ended", "planned", "result")
    count = len(headers) if any(results) else len(headers) - 1
    return table(headers[:count], [row[:count] for row in rows], right=("started", "ended", "planned"))


_OF_FINGERS = re.compile(r"(finger of '[^']*': [^;]*(; |$))+(at t = \S+ s(; |$))?")


def _result(step: StepOutcome) -> str:
    """What a step reports, without what stopped each finger."""
    return _OF_FINGERS.sub("", step.text).removesuffix("; ")


def _expectations(expectations: Sequence[ExpectationOutcome]) -> str:
    rows = [
        (
            f"{PASS if expectation.outcome == 'passed' else FAIL if expectation.missed else '-'} "
            f"{expectation.outcome.replace('_', ' ')}",
            expectation.name,
            _margin(expectation),
        )
        for expectation in expectations
    ]
    return table(("expectation", "name", "margin"), rows)


def _margin(expectation: ExpectationOutcome) -> str:
    """`passes with 4.1 mm to spare (tightest at 17.32 s)`, `fails by ...`, or why it has no margin."""
    detail = f": {expectation.text}" if expectation.text else ""
    if expectation.outcome == "not_evaluated":
        return f"{'not evaluated' if expectation.excused else 'was never evaluated'}{detail}"
    if expectation.outcome == "skipped":
        return f"was not asked{detail}"
    passed = expectation.outcome == "passed"
    when = "" if expectation.at is None else f" ({'tightest' if passed else 'worst'} at {expectation.at:.2f} s)"
    if not expectation.distance:
        return f"{'passes' if passed else 'fails'}{when}{detail}"
    size = quantity(expectation.distance, expectation.unit)
    return f"{f'passes with {size} to spare' if passed else f'fails by {size}'}{when}{detail}"


def _seconds(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f} s"
