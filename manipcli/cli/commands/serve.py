"""`manipcli serve`: a running robot that clients of rosbridge, and a page for browsers, can command."""

from __future__ import annotations

import math
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manipcli.cli import console
from manipcli.cli.options import AllowOutside, Overrides, PackagePath, Sample, Seed, seconds
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput
from manipcli.live.names import DEFAULT_PORT

if TYPE_CHECKING:
    from manipcli.live.outlet import OutletOptions

LOCAL = "127.0.0.1"


def serve(
    task: Annotated[Path | None, typer.Argument(metavar="[TASK]", help="Task file.", show_default=False)] = None,
    *,
    robot: Annotated[
        Path | None,
        typer.Option("--robot", metavar="FILE", help="Robot file: serve it alone on the floor, without a task."),
    ] = None,
    controllers: Annotated[
        Path | None, typer.Option("--controllers", metavar="FILE", help="Controllers file of --robot.")
    ] = None,
    port: Annotated[
        int, typer.Option("--port", metavar="N", min=0, max=65535, help="Port of the server; 0 is any free port.")
    ] = DEFAULT_PORT,
    page_port: Annotated[
        int | None,
        typer.Option(
            "--page-port",
            metavar="N",
            min=0,
            max=65535,
            help="Port of the page for browsers [default: first free port from 8080].",
        ),
    ] = None,
    no_page: Annotated[bool, typer.Option("--no-page", help="Serve no page for browsers.")] = False,
    host: Annotated[
        str,
        typer.Option("--host", metavar="ADDRESS", help="Address to listen on; others than the default need a token."),
    ] = LOCAL,
    speed: Annotated[
        str, typer.Option("--speed", metavar="FACTOR", help="Simulated seconds per second, or max.")
    ] = "1",
    lasting: Annotated[
        str | None, typer.Option("--for", metavar="TIME", help="End after TIME of the wall clock (30s, 5min).")
    ] = None,
    foxglove_port: Annotated[
        int | None,
        typer.Option(
            "--foxglove-port",
            metavar="N",
            min=0,
            max=65535,
            help="Port for Foxglove, on 127.0.0.1, read-only; 0 is any free port [default: 8765].",
        ),
    ] = None,
    no_foxglove: Annotated[bool, typer.Option("--no-foxglove", help="Do not serve Foxglove.")] = False,
    token_file: Annotated[
        Path | None,
        typer.Option("--token-file", metavar="FILE", help="Read the token from FILE [default: a random one, printed]."),
    ] = None,
    open_: Annotated[
        bool, typer.Option("--open", help="Let all programs of this machine command, without a token.")
    ] = False,
    run: Annotated[bool, typer.Option("--run", help="Also do the steps of the task, then hold.")] = False,
    log: Annotated[
        Path | None,
        typer.Option(
            "--log",
            metavar="PATH",
            help="Write the log to PATH [default: runs/<task>@live.mcap, or the next free number, -2, ...].",
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace logs that exist.")] = False,
    seed: Seed = None,
    sample: Sample = None,
    overrides: Overrides = None,
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print only the result.")] = False,
) -> ExitCode:
    """Simulate a task's scene, or a robot alone, live, and let clients and browsers command it.

    The controllers hold; with --run the steps are done first, and the exit code is that of `manipcli run`. The session
    is recorded. Press Ctrl-C to end it.
    """
    from manipcli.cli.interrupts import Interrupts

    factor, wall = _speed(speed), None if lasting is None else seconds(lasting)
    if wall is not None and not wall > 0.0:
        raise InvalidInput([Diagnostic("USE050", f"--for is '{lasting}'; expected a time above 0", hint="write 30s")])
    token = _token(token_file, host=host, open_=open_)
    served = _served(task, robot, controllers, run=run)
    with Interrupts() as interrupts:
        from manipcli import pipeline
        from manipcli.cli.progress import StepProgress
        from manipcli.live.access import Access
        from manipcli.live.session import LiveOptions
        from manipcli.report import text
        from manipcli.report.run_report import RunReport, exit_code

        outlets = (*_page(page_port, token, off=no_page), *_foxglove(foxglove_port, off=no_foxglove))
        live = LiveOptions(Access(token, host), port, factor, wall, run=run, outlets=outlets)

        def announce(url: str) -> None:
            console.result(url)
            if token is None:
                console.talk("--open: every program of this machine can command the robot.")
            console.talk("Press Ctrl-C to end the session.")

        def shown(report: RunReport, failure: str) -> str:
            return text.render_session(report, failure, judged=run)

        def ended(report: RunReport, failure: str) -> None:
            console.result(shown(report, failure))

        with served as path, StepProgress(verbose=False, quiet=quiet) as progress:
            report, failure = pipeline.serve_task(
                path,
                live,
                log=log,
                force=force,
                progress=progress,
                between=interrupts.check,
                announce=announce,
                ended=ended,
                overrides=tuple(overrides or ()),
                seed=seed,
                sample=sample,
                package_path=tuple(package_path or ()),
                allow_outside=allow_outside,
            )
        console.result(shown(report, failure))
        code = exit_code(report.verdict) if run else ExitCode.PASSED
        return ExitCode.FAILED if failure and code is ExitCode.PASSED else code


def _served(
    task: Path | None, robot: Path | None, controllers: Path | None, *, run: bool
) -> AbstractContextManager[Path]:
    """The task file: the task, or one for the robot alone.

    Raises:
        InvalidInput: not either a task, or a robot with controllers; or no task to run.
    """
    if task is not None:
        option = "--robot" if robot is not None else "--controllers" if controllers is not None else ""
        if option:
            message = f"task '{task}' and {option} exclude each other: a task names its robot and controllers"
            raise InvalidInput([Diagnostic("USE141", message, hint=f"remove {option}, or the task")])
        return nullcontext(task)
    if robot is None:
        hint = "manipcli serve TASK, or manipcli serve --robot FILE --controllers FILE"
        raise InvalidInput([Diagnostic("USE140", "serve needs a task, or a robot", hint=hint)])
    if controllers is None:
        hint = "`manipcli init --robot DESCRIPTION` writes a robot file with controllers"
        raise InvalidInput([Diagnostic("USE142", "--robot needs --controllers FILE", hint=hint)])
    if run:
        raise InvalidInput([Diagnostic("USE143", "--run needs a task: a robot alone has no steps")])
    from manipcli import pipeline

    return pipeline.bare_task(robot, controllers)


def _speed(word: str) -> float | None:
    """Simulated seconds per second; None for `max`.

    Raises:
        InvalidInput: neither a number above 0 nor `max`.
    """
    if word == "max":
        return None
    try:
        factor = float(word)
    except ValueError:
        factor = math.nan
    if not 0.001 <= factor <= 1000.0:
        raise InvalidInput([Diagnostic("USE130", f"--speed is '{word}'; expected a number from 0.001 to 1000, or max")])
    return factor


def _page(port: int | None, token: str | None, *, off: bool) -> tuple[OutletOptions, ...]:
    """The page for browsers; none with `--no-page`.

    Raises:
        InvalidInput: options that exclude each other.
    """
    from manipcli.live.page.options import PageOptions

    if off and port is not None:
        raise InvalidInput(
            [Diagnostic("USE153", "--no-page and --page-port exclude each other", hint="remove one of them")]
        )
    return () if off else (PageOptions(token, port),)


def _foxglove(port: int | None, *, off: bool) -> tuple[OutletOptions, ...]:
    """The server for Foxglove; none with `--no-foxglove`.

    Raises:
        InvalidInput: options that exclude each other.
    """
    from manipcli.live.foxglove import FoxgloveOptions

    if off and port is not None:
        message = "--no-foxglove and --foxglove-port exclude each other"
        raise InvalidInput([Diagnostic("USE150", message, hint="remove one of them")])
    if off:
        return ()
    return (FoxgloveOptions(),) if port is None else (FoxgloveOptions(port, needed=True),)


def _token(file: Path | None, *, host: str, open_: bool) -> str | None:
    """The token of the server; None for `--open`.

    Raises:
        InvalidInput: no address, options that exclude each other, or a token that is too short or not one line of text.
    """
    from manipcli.live.access import MIN_TOKEN, random_token

    if not host:
        hint = "name an address of this machine; 0.0.0.0 is all of them"
        raise InvalidInput([Diagnostic("USE131", "--host is empty; expected an address", hint=hint)])
    if open_:
        if host != LOCAL or file is not None:
            what = "--token-file" if file is not None else "--host"
            raise InvalidInput(
                [Diagnostic("USE133", f"--open and {what} exclude each other", hint="remove one of them")]
            )
        return None
    if file is None:
        return random_token()
    try:
        token = file.read_text("ascii").strip()
    except UnicodeDecodeError:
        token = ""
    if len(token) < MIN_TOKEN or not token.isprintable() or " " in token:
        message = f"'{file}' has no token; expected one line of {MIN_TOKEN} or more letters, digits or signs"
        raise InvalidInput([Diagnostic("USE134", message)])
    return token
