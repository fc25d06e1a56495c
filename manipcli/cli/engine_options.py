"""`--engines` and `--check-step` of `run` and `test`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.text import did_you_mean, listed

Engines = Annotated[
    str | None,
    typer.Option(
        "--engines",
        metavar="A,B",
        help="Run in each engine and compare verdicts, margins, durations, slip and forces; see `agree:` of a task.",
    ),
]
CheckStep = Annotated[
    bool,
    typer.Option("--check-step", help="Run also at half the physics step; the verdict must not change."),
]


def engine_names(word: str | None, *, check_step: bool, overrides: Sequence[str] = ()) -> tuple[str, ...]:
    """The engines of `--engines`; empty without the option.

    Raises:
        InvalidInput: an unknown engine, an engine twice, nothing to compare, or `--set simulation.engine`.
    """
    if word is None:
        return ()
    from manipcli import pipeline

    known = pipeline.words("engines")
    names = tuple(name.strip() for name in word.split(","))
    if not all(names):
        what = "an engine has no name" if any(names) else "no engine"
        hint = f"name the engines with a comma in between, such as --engines {','.join(known[:2])}"
        raise InvalidInput([_finding(word or "''", what, hint)])
    findings = [
        _finding(word, f"unknown engine '{name}'", did_you_mean(name, known, kind="engines"))
        for name in dict.fromkeys(names)
        if name not in known
    ]
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if twice and not findings:
        findings.append(_finding(word, f"{listed(twice)}: given twice", "name each engine once"))
    if len(names) == 1 and not check_step and not findings:
        hint = f"name two engines, or add --check-step; --set simulation.engine={names[0]} runs in one engine"
        findings.append(_finding(word, "one engine; there is nothing to compare", hint))
    for override in overrides:
        if override.partition("=")[0].strip() == "simulation.engine":
            findings.append(_finding(word, f"--set {override}: no effect with --engines", "remove one of the two"))
    if findings:
        raise InvalidInput(findings)
    return names


def _finding(word: str, message: str, hint: str | None) -> Diagnostic:
    return Diagnostic("USE111", f"--engines {word}: {message}", hint=hint)


def refuse_single_outputs(*, to_stdout: bool, junit: Path | None) -> None:
    """Refuses the outputs of `run` that hold one run.

    Raises:
        InvalidInput: `--log -` or `--junit` is given.
    """
    given = (("--log -", to_stdout, "name a file"), ("--junit", junit is not None, "use `manipcli test --engines`"))
    findings = [
        Diagnostic("USE112", f"{option}: no effect with --engines and --check-step", hint=hint)
        for option, is_given, hint in given
        if is_given
    ]
    if findings:
        raise InvalidInput(findings)
