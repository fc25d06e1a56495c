"""`manipcli view FILE`: a robot or the scene of a task in the browser."""

from __future__ import annotations

from typing import Annotated

import typer

from manipcli.cli import console
from manipcli.cli.interrupts import Interrupts
from manipcli.cli.options import AllowOutside, OpenPage, PackagePath, PagePort, XacroArguments, xacro_arguments
from manipcli.cli.serving import stay
from manipcli.core.errors import ExitCode


def view(
    file: Annotated[
        str,
        typer.Argument(
            metavar="FILE",
            help="URDF, xacro, robot file or task: a path, or package://NAME/...",
            show_default=False,
        ),
    ],
    arguments: XacroArguments = None,
    *,
    port: PagePort = None,
    open_: OpenPage = False,
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
) -> ExitCode:
    """Show a robot, or a task's scene at its start, in the browser.

    With joint sliders, named poses, collision shapes, frames, inertia boxes. Press Ctrl-C to stop.
    """
    with Interrupts():
        given = xacro_arguments(arguments or [])
        from manipcli import pipeline
        from manipcli.description.lint.inspection import located
        from manipcli.replay.view.view import View
        from manipcli.report import text

        places = tuple(package_path or ())
        path = located(file, package_path=places)
        sight = pipeline.load_sight(path, arguments=given, package_path=places, allow_outside=allow_outside)
        for finding in sight.findings:
            console.talk(text.describe(finding))
        with View(sight.robot, sight.scene, q=sight.q, port=port) as page:
            console.not_drawn(page.missing)
            stay(page.url, open_=open_)
    return ExitCode.PASSED
