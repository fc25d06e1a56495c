"""`manipcli plan TASK`: the plan of a task, without simulation."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from manipcli.cli import console
from manipcli.cli.options import AllowOutside, Format, Overrides, PackagePath, Sample, Seed, TaskFile
from manipcli.cli.outputs import check_outputs
from manipcli.core.errors import ExitCode, NotPlannable


def plan(
    task: TaskFile,
    *,
    csv: Annotated[
        Path | None, typer.Option("--csv", metavar="FILE", help="Write all points of all trajectories to FILE.")
    ] = None,
    seed: Seed = None,
    sample: Sample = None,
    overrides: Overrides = None,
    format_: Format = "text",
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
) -> ExitCode:
    """Plan a task and show its motions.

    Shows the duration of each motion, the joint that limits it, and its least clearance; simulates nothing.
    """
    from manipcli import pipeline
    from manipcli.report.plan import render_json, render_text, write_csv

    check_outputs(("--csv", csv), reads=(task,))
    loaded = pipeline.load_task(
        task,
        overrides=tuple(overrides or ()),
        seed=seed,
        sample=sample,
        package_path=tuple(package_path or ()),
        allow_outside=allow_outside,
    )
    try:
        planned = pipeline.plan_task(loaded)
    except NotPlannable as refusal:
        if format_ != "json":
            raise
        from manipcli.report.json import render_verdict

        console.result(render_verdict(pipeline.refused(loaded, refusal)))
        return refusal.exit_code
    motions = planned.motions
    if csv is not None:
        from manipcli.core.whole_file import whole_file

        with whole_file(csv) as partial, partial.open("w", encoding="utf-8", newline="") as stream:
            write_csv(motions, stream)
    render = render_json if format_ == "json" else render_text
    console.result(render(loaded.spec.task, motions, loaded.robot, planned.clearances()))
    return ExitCode.PASSED
