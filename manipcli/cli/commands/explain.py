"""`manipcli explain CODE|TASK`: what a code of a finding means; what a task does, in English."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from manipcli.cli import console
from manipcli.cli.options import AllowOutside, Format, Overrides, PackagePath, Seed
from manipcli.cli.volume import Verbose
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput
from manipcli.core.text import did_you_mean


def explain(
    subject: Annotated[
        str,
        typer.Argument(metavar="CODE|TASK", help="Code of a finding (TASK203), or a task file.", show_default=False),
    ],
    *,
    values: Annotated[
        bool,
        typer.Option("--values", help="Of a task: list each value, and where it comes from; write out each round."),
    ] = False,
    verbose: Verbose = False,
    overrides: Overrides = None,
    seed: Seed = None,
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
    format_: Format = "text",
) -> ExitCode:
    """Explain a code, or a task.

    A code: what it reports, why, and an example with and without the defect. A task: its steps, expectations, watches
    and varied values as English sentences with resolved numbers; with --values also the place of each value (file,
    line and column), its override, its default, or its expression and parameters. --verbose implies --values. Nothing
    is planned.
    """
    if _is_file(subject):
        return _task(
            Path(subject),
            tuple(overrides or ()),
            seed,
            tuple(package_path or ()),
            allow_outside=allow_outside,
            format_=format_,
            values=values or verbose,
        )
    if values or overrides or seed is not None:
        message = f"--values, --set and --seed need a task; '{subject}' is not a file"
        raise InvalidInput([Diagnostic("USE052", message)])
    from dataclasses import asdict

    from manipcli.report.codes.code_page import code_pages, render_text, similar
    from manipcli.report.json import dumps

    page = code_pages().get(subject.upper())
    if page is None:
        hint = did_you_mean(subject.upper(), similar(subject), kind="codes")
        raise InvalidInput([Diagnostic("USE094", f"there is no code or file '{subject}'", hint=hint)])
    console.result(dumps(asdict(page)) if format_ == "json" else render_text(page))
    return ExitCode.PASSED


def _is_file(subject: str) -> bool:
    """Whether it is the path of a file; codes are single words without a dot."""
    return bool(subject) and ("/" in subject or "." in subject or Path(subject).exists())


def _task(
    path: Path,
    overrides: tuple[str, ...],
    seed: int | None,
    package_path: tuple[Path, ...],
    *,
    allow_outside: bool,
    format_: Format,
    values: bool,
) -> ExitCode:
    from manipcli import pipeline
    from manipcli.report.explanation import render_json, render_text
    from manipcli.report.text import describe

    task, warnings = pipeline.explain_task(
        path, overrides=overrides, seed=seed, package_path=package_path, allow_outside=allow_outside
    )
    for warning in warnings:
        console.talk(describe(warning))
    console.result(render_json(task) if format_ == "json" else render_text(task, values=values))
    return ExitCode.PASSED
