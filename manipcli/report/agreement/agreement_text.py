"""Text output of compared runs: what disagrees, a table of all numbers side by side, and a line per run."""

from __future__ import annotations

from collections.abc import Sequence

from manipcli.judge.agreement import Agreement
from manipcli.judge.compared_numbers import Kind, Row
from manipcli.report.agreement.compared_runs import ComparedRuns
from manipcli.report.agreement.disagreement import (
    allowed_of,
    describe,
    difference_of,
    short_summary,
    shown,
    summary,
)
from manipcli.report.run_report import RunReport
from manipcli.report.table import table
from manipcli.report.text import FAIL, PASS
from manipcli.report.text import describe as describe_finding

TITLES: dict[Kind, str] = {
    "margin": "margin",
    "duration": "duration",
    "step_duration": "duration",
    "slip": "slip",
    "rotation": "rotation",
    "grasp_force": "peak force of the grasp",
    "contact_force": "peak contact force",
}


def render_text(compared: ComparedRuns) -> str:
    """All runs of a task: disagreements, numbers side by side, runs, result."""
    agreement = compared.agreement
    if agreement.agrees and not agreement.judged:
        reasons = dict.fromkeys(run.verdict.text for run in agreement.runs)
        runs = runs_table(agreement, compared.reports)
        return "\n".join([runs, "", *(f"{FAIL} {reason}" for reason in reasons), f"{FAIL} {summary(agreement)}"])
    parts = [f"{FAIL} {describe(found)}" for found in agreement.disagreements]
    parts += [describe_finding(warning) for warning in agreement.warnings]
    parts += [""] if parts else []
    parts += [numbers_table(agreement), "", runs_table(agreement, compared.reports), ""]
    failed = [run for run in agreement.runs if run.verdict.verdict != "passed"]
    parts += [f"{FAIL} {run.name}: {run.verdict.text}" for run in failed] + ([""] if failed else [])
    mark = PASS if agreement.agrees and compared.exit_code == 0 else FAIL
    parts.append(f"{mark} {agreement.task}: {short_summary(agreement)}")
    return "\n".join(parts)


def numbers_table(agreement: Agreement) -> str:
    """Every number of every run; the difference is that of the engines at the step of the task, as the last line says
    where there are other runs."""
    names = [run.name for run in agreement.runs]
    several = len(agreement.engines) > 1
    rows = [
        (
            (PASS if limited(row) else "") if agrees(agreement, row) else FAIL,
            row.name or "task",
            TITLES[row.kind],
            *cells(row),
            *((difference_of(row), allowed_of(row)) if several else ()),
        )
        for row in agreement.rows
    ]
    last = ("difference", "allowed") if several else ()
    lines = [table(("", "of", "number", *names, *last), rows, right=(*names, *last))]
    if several and len(agreement.engines) < len(agreement.runs):
        lines.append("difference: between the engines at the step of the task, without the runs at half the step")
    return "\n".join(lines)


def limited(row: Row) -> bool:
    """Whether anything is required of a number: an allowed difference, or the outcome of its expectation or step."""
    return row.allowed is not None or row.kind in ("margin", "step_duration")


def agrees(agreement: Agreement, row: Row) -> bool:
    """Whether no disagreement is about this number or the outcome of its expectation or step."""
    kinds = {row.kind, {"margin": "expectation", "step_duration": "step", "duration": "verdict"}.get(row.kind, "")}
    return not any(found.kind in kinds and found.name == row.name for found in agreement.disagreements)


def cells(row: Row) -> list[str]:
    """The numbers of a row; a margin has a sign, an expectation that was not evaluated its outcome."""
    found = []
    outcomes = row.outcomes or ("",) * len(row.values)
    for value, outcome in zip(row.values, outcomes, strict=True):
        words = outcome.replace("_", " ") or "-"
        number = shown(value) if value is not None else ""
        found.append((number or words) if outcome != "failed" else f"{number} failed".strip())
    return found


def runs_table(agreement: Agreement, reports: Sequence[RunReport]) -> str:
    """One line per run: verdict, step, times, log."""
    rows = [
        (
            f"{PASS if run.verdict.verdict == 'passed' else FAIL} {run.verdict.verdict}",
            run.name,
            f"{1e3 * run.step:g} ms",
            f"{run.verdict.simulated_time:.2f} s",
            f"{run.wall_time:.2f} s",
            report.log or "nothing was run",
        )
        for run, report in zip(agreement.runs, reports, strict=True)
    ]
    headers = ("verdict", "run", "step", "simulated", "real", "log")
    return table(headers, rows, right=("step", "simulated", "real"))
