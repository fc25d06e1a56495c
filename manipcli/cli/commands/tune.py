"""`manipcli tune ROBOT CONTROLLERS`: gains for a bandwidth and a damping ratio, and their step response."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manipcli.cli import console
from manipcli.cli.options import AllowOutside, Format, PackagePath, hertz, seconds
from manipcli.cli.outputs import check_outputs
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput

if TYPE_CHECKING:
    from manipcli.replay.figure import Kind


def tune(
    robot: Annotated[Path, typer.Argument(metavar="ROBOT", help="Robot file.", show_default=False)],
    controllers: Annotated[Path, typer.Argument(metavar="CONTROLLERS", help="Controllers file.", show_default=False)],
    *,
    bandwidth: Annotated[
        str, typer.Option("--bandwidth", metavar="F", help="Natural frequency of the loops: 5, '5 Hz'.")
    ] = "5 Hz",
    damping: Annotated[
        float,
        typer.Option(
            "--damping",
            metavar="Z",
            min=0.05,
            max=10.0,
            help="Damping ratio of p and d; from 1 on, a step overshoots only because of i.",
        ),
    ] = 1.0,
    joint: Annotated[
        list[str] | None,
        typer.Option("--joint", metavar="JOINT", help="Tune only this joint; repeatable.", show_default=False),
    ] = None,
    period: Annotated[str, typer.Option("--period", metavar="T", help="Control period: 0.001, 1ms.")] = "1 ms",
    step: Annotated[
        float,
        typer.Option(
            "--step",
            metavar="S",
            min=1e-6,
            max=10.0,
            help="Size of the step [rad]; prismatic joints: a tenth [m]; the gains are limited so that it "
            "does not saturate the effort.",
        ),
    ] = 0.02,
    simulate: Annotated[
        bool, typer.Option("--simulate", help="Simulate the step response of the whole robot under gravity.")
    ] = False,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="FILE", help="Write a figure of the step responses: .svg, .png or .pdf."
        ),
    ] = None,
    write: Annotated[
        Path | None, typer.Option("--write", metavar="FILE", help="Write the controllers file with these gains.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the --write file if it exists.")] = False,
    format_: Format = "text",
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
) -> ExitCode:
    """Propose gains, and show the step response of the joints.

    Uses as much of the bandwidth and damping as is stable at the control period in all examined configurations, and as
    the efforts allow.
    """
    kind, control_period = _checked(robot, output, write, force=force), seconds(period)
    if not 1e-6 <= control_period <= 1.0:
        raise InvalidInput([Diagnostic("USE071", f"--period {period}: expected 1 us to 1 s")])
    from manipcli.core.whole_file import write_whole
    from manipcli.report.tuning import render_json, render_text
    from manipcli.tuning import propose_gains as gains

    tuning = gains.tune(
        robot,
        controllers,
        gains.Wish(hertz(bandwidth), damping, control_period),
        joints=tuple(joint or ()),
        step=step,
        package_path=tuple(package_path or ()),
        allow_outside=allow_outside,
        simulated=simulate,
    )
    render = render_json if format_ == "json" else render_text
    console.result(render(tuning.robot, tuning.wish, tuning.joints, tuning.notes))
    if output is not None and kind is not None:
        from manipcli.replay.figure import render as draw

        write_whole(output, draw(gains.chart_of(tuning), kind))
        console.talk(f"drawn: {output}")
    if write is not None:
        write_whole(write, gains.written(tuning, controllers).encode())
        console.talk(f"written: {write}")
    return ExitCode.PASSED


def _checked(robot: Path, output: Path | None, write: Path | None, *, force: bool) -> Kind | None:
    """The kind of the figure `output`, after checks of all output files.

    Raises:
        InvalidInput: a file cannot be written, `write` exists and is not replaced, or the kind is unknown.
    """
    if write is not None and write.exists() and not force:
        message = f"'{write}' exists"
        raise InvalidInput([Diagnostic("USE070", message, hint="add --force to replace it, or name another file")])
    check_outputs(("--write", write), ("--output", output), reads=(robot,))
    if output is None:
        return None
    from manipcli.replay.figure import kind_of

    return kind_of(output)
