"""`manipcli check-urdf FILE`: all findings in a robot description, URDF or xacro."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from manipcli.cli import console
from manipcli.cli.options import AllowOutside, PackagePath, XacroArguments, xacro_arguments
from manipcli.cli.outputs import check_outputs, check_picture
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput

if TYPE_CHECKING:
    from manipcli.description.lint.inspection import Inspection

Codes = list[str] | None


def check_urdf(
    file: Annotated[
        str | None,
        typer.Argument(metavar="FILE", help="URDF or xacro: a path, or package://NAME/...", show_default=False),
    ] = None,
    arguments: XacroArguments = None,
    *,
    format_: Annotated[
        Literal["text", "json", "sarif"],
        typer.Option("--format", help="Output format: text, one JSON object, or SARIF 2.1.0."),
    ] = "text",
    select: Annotated[
        Codes,
        typer.Option(
            "--select", metavar="CODES", help="Show only these codes, prefixes or tiers: URDF2,URDF031; repeatable."
        ),
    ] = None,
    ignore: Annotated[
        Codes, typer.Option("--ignore", metavar="CODES", help="Hide these codes, prefixes or tiers; repeatable.")
    ] = None,
    strict: Annotated[bool, typer.Option("--strict", help="Fail on warnings, too.")] = False,
    explain: Annotated[str | None, typer.Option("--explain", metavar="CODE", help="Explain a code and exit.")] = None,
    fix: Annotated[
        bool, typer.Option("--fix", help="Apply safe fixes; write NAME.fixed.urdf next to the file.")
    ] = False,
    in_place: Annotated[bool, typer.Option("--in-place", help="With --fix: change the file itself.")] = False,
    force: Annotated[bool, typer.Option("--force", help="With --fix: replace NAME.fixed.urdf if it exists.")] = False,
    tree: Annotated[bool, typer.Option("--tree", help="Print the tree of links and joints.")] = False,
    picture: Annotated[
        Path | None,
        typer.Option("--picture", metavar="FILE.png", help="Draw the robot into FILE.png.", show_default=False),
    ] = None,
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
    allow_env: Annotated[
        list[str] | None,
        typer.Option("--allow-env", metavar="NAME", help="Allow $(env NAME) to read this variable; repeatable."),
    ] = None,
) -> ExitCode:
    """Check a robot description, URDF or xacro.

    Checks schema, topology, physics, meshes, and readiness for simulation.
    """
    from manipcli.description.lint import inspection as describe
    from manipcli.report import description

    if explain is not None:
        console.result(description.render_explanation(describe.explained(explain)))
        return ExitCode.PASSED
    if file is None:
        raise InvalidInput([Diagnostic("USE043", "FILE is missing", hint="run `manipcli check-urdf FILE`")])
    if in_place and not fix:
        raise InvalidInput([Diagnostic("USE044", "--in-place has no effect without --fix", hint="add --fix")])
    if force and not fix:
        raise InvalidInput([Diagnostic("USE044", "--force has no effect without --fix", hint="add --fix")])
    check_picture(picture)
    path = describe.located(file, package_path=tuple(package_path or ()))
    check_outputs(("--picture", picture), reads=(path,))
    codes = describe.wanted_codes(_words(select), _words(ignore))
    given = xacro_arguments(arguments or [])

    def inspect(path: Path) -> Inspection:
        return describe.inspect(
            path,
            arguments=given,
            package_path=tuple(package_path or ()),
            allow_outside=allow_outside,
            allow_env=tuple(allow_env or ()),
        )

    inspection = inspect(path)
    if fix:
        inspection = _mended(inspection, inspect, in_place=in_place, force=force)
    findings = inspection.reported(codes)
    failing = ("error", "warning") if strict else ("error",)
    passed = not any(finding.severity in failing for finding in findings)
    console.result(_rendered(inspection, findings, codes, format_, passed=passed, tree=tree))
    if picture is not None:
        if inspection.examination.errors:
            console.talk(f"not drawn: {path} has errors")
        else:
            from manipcli.replay.draw_description import draw_description

            console.not_drawn(draw_description(inspection, picture))
            console.talk(f"drawn: {picture}")
    return ExitCode.PASSED if passed else ExitCode.FAILED


def _mended(
    inspection: Inspection, inspect: Callable[[Path], Inspection], *, in_place: bool, force: bool
) -> Inspection:
    """Applies safe fixes; returns the inspection of the fixed file."""
    from manipcli.description.lint import inspection as describe

    path, changes = describe.mend(inspection, in_place=in_place, force=force)
    for change in changes:
        console.talk(f"fixed: {change}")
    console.talk(f"written: {path}" if changes else "nothing to fix; no file written")
    return inspect(path) if changes else inspection


def _rendered(
    inspection: Inspection,
    findings: Sequence[Diagnostic],
    codes: Collection[str],
    format_: str,
    *,
    passed: bool,
    tree: bool,
) -> str:
    from manipcli.description.lint.checks import CHECKS
    from manipcli.report import description, sarif

    if format_ == "sarif":
        return sarif.render(findings, CHECKS)
    render = description.render_json if format_ == "json" else description.render_text
    return render(
        str(inspection.path),
        findings,
        inspection.summary,
        passed=passed,
        left_out=[(code, number) for code, number in inspection.examination.left_out if code in codes],
        tree=inspection.tree if tree else (),
    )


def _words(options: list[str] | None) -> tuple[str, ...]:
    return tuple(word for option in options or [] for word in option.replace(",", " ").split())
