"""`manipcli tune ROBOT CONTROLLERS`: gains for a bandwidth and a damping ratio, and what they do."""

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
    robot: Annotated[Path, typer.Argument(metavar="ROBOT", help="The robot file.", show_default=False)],
    controllers: Annotated[
        Path, typer.Argument(metavar="CONTROLLERS", help="The controllers file.", show_default=False)
    ],
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
            help="Damping ratio that p and d give; from 1 on, only an i makes a step overshoot.",
        ),
    ] = 1.0,
    joint: Annotated[
        list[str] | None,
        typer.Option("--joint", metavar="JOINT", help="Only this one; repeatable.", show_default=False),
    ] = None,
    period: Annotated[str, typer.Option("--period", metavar="T", help="The control period: 0.001, 1ms.")] = "1 ms",
    step: Annotated[
        float,
        typer.Option(
            "--step",
            metavar="S",
            min=1e-6,
            max=10.0,
            help="The step [rad] that is tried, a tenth of it [m] where a joint slides; the gains ask for no more "
            "effort in it than there is.",
        ),
    ] = 0.02,
    simulate: Annotated[
        bool, typer.Option("--simulate", help="Try it in the engine: the whole robot, under gravity.")
    ] = False,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="A figure of the steps: .svg, .png or .pdf."),
    ] = None,
    write: Annotated[
        Path | None, typer.Option("--write", metavar="FILE", help="The controllers file with these gains.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the file of --write if it exists.")] = False,
    format_: Format = "text",
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
) -> ExitCode:
    """Propose gains, and show how joints answer a step with them.

    As much of bandwidth and damping as is stable at the control period in all postures looked at, and as efforts allow.
    """  # fmt: skip
    kind, control_period = _checked(robot, output, write, force=force), seconds(period)
    if not 1e-6 <= control_period <= 1.0:
        raise InvalidInput([Diagnostic("USE071", f"a control period of {period}; expected 1 us to 1 s")])
    from manipcli.core.whole_file import write_whole
    from manipcli.report.tuning import render_json, render_text
    from manipcli.tuning import tune as gains

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
    """What kind of figure `output` is to be, once there is a place for all that is written.

    Raises:
        InvalidInput: a file cannot be written there, or `write` is there and not to be replaced, or no such figure.
    """
    if write is not None and write.exists() and not force:
        message = f"'{write}' exists"
        raise InvalidInput([Diagnostic("USE070", message, hint="--force replaces it; or say another name")])
    check_outputs(("--write", write), ("--output", output), reads=(robot,))
    if output is None:
        return None
    from manipcli.replay.figure import kind_of

    return kind_of(output)
