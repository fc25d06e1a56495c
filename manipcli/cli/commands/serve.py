"""`manipcli serve TASK`: a running robot that clients of rosbridge, and a page for browsers, can command."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from manipcli.cli import console
from manipcli.cli.options import AllowOutside, Overrides, PackagePath, Sample, Seed, TaskFile, seconds
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput

LOCAL = "127.0.0.1"


def serve(
    task: TaskFile,
    *,
    port: Annotated[
        int, typer.Option("--port", metavar="N", min=0, max=65535, help="Port of the server; 0 is any free port.")
    ] = 9090,
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
    token_file: Annotated[
        Path | None,
        typer.Option("--token-file", metavar="FILE", help="Read the token from FILE [default: a random one, printed]."),
    ] = None,
    open_: Annotated[
        bool, typer.Option("--open", help="Let all programs of this machine command, without a token.")
    ] = False,
    log: Annotated[
        Path | None,
        typer.Option("--log", metavar="PATH", help="Write the log to PATH [default: runs/<task>@live.mcap]."),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the --log file if it exists.")] = False,
    seed: Seed = None,
    sample: Sample = None,
    overrides: Overrides = None,
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print only the result.")] = False,
) -> ExitCode:
    """Simulate a task's scene live, and let clients of rosbridge and browsers command its robot.

    The controllers hold; the steps are not run. The session is recorded. Press Ctrl-C to end it.
    """
    from manipcli.cli.interrupts import Interrupts

    factor, wall = _speed(speed), None if lasting is None else seconds(lasting)
    token = _token(token_file, host=host, open_=open_)
    with Interrupts() as interrupts:
        from manipcli import pipeline
        from manipcli.cli.progress import StepProgress
        from manipcli.live.access import Access
        from manipcli.live.session import LiveOptions
        from manipcli.report import text
        from manipcli.report.run_report import RunReport

        live = LiveOptions(Access(token, host), port, factor, wall, page=not no_page, page_port=page_port)

        urls: list[str] = []

        def announce(url: str) -> None:
            if not urls:
                if token is None:
                    console.talk("--open: every program of this machine can command the robot.")
                console.talk("Press Ctrl-C to end the session.")
            urls.append(url)
            console.result(url)

        def ended(report: RunReport, failure: str) -> None:
            console.result(text.render_session(report, failure))

        with StepProgress(verbose=False, quiet=quiet, interrupts=interrupts) as progress:
            report, failure = pipeline.serve_task(
                task,
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
        console.result(text.render_session(report, failure))
        return ExitCode.FAILED if failure else ExitCode.PASSED


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


def _token(file: Path | None, *, host: str, open_: bool) -> str | None:
    """The token of the server; None for `--open`.

    Raises:
        InvalidInput: options that exclude each other, or a token that is too short or not one line of text.
    """
    from manipcli.live.access import MIN_TOKEN, random_token

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
