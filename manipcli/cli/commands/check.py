"""`manipcli check FILE...`: all findings of all files at once, without simulation."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

import typer

from manipcli.cli import console
from manipcli.cli.options import AllowOutside, Format, Overrides, PackagePath, Sample, Seed
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput

UNREADABLE: Final = {"USE101", "USE102", "USE103"}
"""Codes of findings about a missing or unreadable file."""


def check(
    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILE...", help="Task, robot, controllers, URDF or xacro files.", show_default=False),
    ],
    *,
    collisions: Annotated[
        bool,
        typer.Option(
            "--collisions", help="Show the self-collision matrix of the robot of one robot file, URDF or task."
        ),
    ] = False,
    strict: Annotated[bool, typer.Option("--strict", help="Fail on warnings, too.")] = False,
    watch: Annotated[
        bool,
        typer.Option(
            "--watch",
            help="Check after each change of a file, show the planned durations, and keep the schema that a task names "
            "for editors current; until Ctrl-C.",
        ),
    ] = False,
    seed: Seed = None,
    sample: Sample = None,
    overrides: Overrides = None,
    format_: Format = "text",
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
) -> ExitCode:
    """Check files and show all findings, without simulation.

    The kind (task, robot, controllers) is read from each file; --set, --seed and --sample apply to the tasks among
    them. A task is planned, and gains, motors and grasps are examined over the plan; a step that cannot be planned is
    an error. With --strict, warnings fail, too. A controllers file does not name a robot: check a task that names both
    to compare joints and gains.
    """
    from manipcli import pipeline
    from manipcli.cli.progress import PlanningProgress
    from manipcli.report import json, text, tool_hand
    from manipcli.report.inertials import render_table

    if watch and collisions:
        raise InvalidInput([Diagnostic("USE059", "--collisions and --watch exclude each other")])
    if watch:
        from manipcli.cli.watched_check import watch_files

        try:
            watch_files(
                files,
                overrides=tuple(overrides or ()),
                seed=seed,
                sample=sample,
                package_path=tuple(package_path or ()),
                allow_outside=allow_outside,
                format_=format_,
                strict=strict,
            )
        except KeyboardInterrupt:
            return ExitCode.PASSED
    if collisions:
        return _self_collisions(files, format_, tuple(package_path or ()), allow_outside=allow_outside)
    with PlanningProgress() as progress:
        findings = pipeline.check_files(
            tuple(files),
            overrides=tuple(overrides or ()),
            seed=seed,
            sample=sample,
            package_path=tuple(package_path or ()),
            allow_outside=allow_outside,
            on_progress=progress.activity,
        )
    failed = any(finding.severity == "error" for finding in findings)
    refused = failed or (strict and any(finding.severity == "warning" for finding in findings))
    kinds = () if failed else [pipeline.kind_of(file) for file in files]
    if (overrides or seed is not None or sample is not None) and not failed and "task" not in kinds:
        raise InvalidInput([Diagnostic("USE052", "--set, --seed and --sample need a task; no file is a task")])
    names = [str(file) for file in files]
    facts = None
    if kinds == ["robot"]:
        facts = pipeline.robot_facts(files[0], package_path=tuple(package_path or ()), allow_outside=allow_outside)
    if format_ == "json":
        more = {} if facts is None else {"tool": tool_hand.tool_object(facts.tool, facts.hand)}
        console.result(json.render_findings(findings, names, strict=strict, more=more))
    else:
        parts = [text.render_findings(findings, names, strict=strict)]
        if facts is not None:
            parts = [
                render_table(facts.inertials) if facts.inertials else "",
                tool_hand.render_text(facts.tool, facts.hand),
                *parts,
            ]
        console.result("\n\n".join(filter(None, parts)))
    if any(finding.code in UNREADABLE for finding in findings):
        return ExitCode.USAGE
    if "controllers" in kinds and "task" not in kinds:
        console.talk("joints and gains of controllers were not compared with a robot: check a task that names both")
    return ExitCode.FAILED if refused else ExitCode.PASSED


def _self_collisions(
    files: list[Path], format_: Format, package_path: tuple[Path, ...], *, allow_outside: bool
) -> ExitCode:
    from manipcli import pipeline
    from manipcli.report.self_collision import render_json, render_text

    if len(files) > 1:
        raise InvalidInput([Diagnostic("USE059", f"--collisions takes one file; given: {len(files)}")])
    robot, matrix = pipeline.self_collisions(files[0], package_path=package_path, allow_outside=allow_outside)
    console.result((render_json if format_ == "json" else render_text)(robot.name, matrix))
    return ExitCode.PASSED
