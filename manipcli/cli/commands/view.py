"""`manipcli view FILE`: a robot or the scene of a task in the browser."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manipcli.cli import console
from manipcli.cli.interrupts import Interrupts
from manipcli.cli.options import AllowOutside, OpenPage, PackagePath, PagePort, XacroArguments, xacro_arguments
from manipcli.cli.serving import stay
from manipcli.cli.watch import OWN, watch
from manipcli.core.cache import cache_folder
from manipcli.core.errors import ExitCode, ManipcliError
from manipcli.core.opened_files import OpenedFiles, opened_by, stamp

if TYPE_CHECKING:
    from manipcli.pipeline import Sight
    from manipcli.replay.view.view import View


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

    With joint sliders and named poses, collisions as joints move, the tool frame and how far the hand opens, layers
    (collision shapes, frames, inertia, centres of mass), views, and poses as YAML. A changed file is shown at once.
    Press Ctrl-C to stop.
    """
    with Interrupts():
        given = xacro_arguments(arguments or [])
        from manipcli import pipeline
        from manipcli.description.lint.inspection import located
        from manipcli.replay.view.view import View
        from manipcli.report import text

        places = tuple(package_path or ())
        path = located(file, package_path=places)

        def load() -> Sight:
            sight = pipeline.load_sight(path, arguments=given, package_path=places, allow_outside=allow_outside)
            for finding in sight.findings:
                console.talk(text.describe(finding))
            return sight

        sight, opened = opened_by(load)
        with View(sight.robot, sight.scene, q=sight.q, port=port) as page:
            console.not_drawn(page.missing)
            stay(page.url, open_=open_, meanwhile=partial(_follow, page, load, path, opened))
    return ExitCode.PASSED


def _follow(page: View, load: Callable[[], Sight], path: Path, opened: OpenedFiles) -> None:
    """Shows the files again after each change, until Ctrl-C; errors are printed, and the last good state stays."""
    from manipcli.report import text

    cache = cache_folder()
    read = {
        file: seen
        for file, seen in opened.stamps
        if file.suffix not in OWN and not (cache is not None and file.is_relative_to(cache))
    }
    files = [path, *read]

    def show(changed: tuple[Path, ...]) -> Sequence[Path]:
        if not changed:  # at first: those that changed since they were loaded
            changed = tuple(file for file, seen in read.items() if stamp(file) != seen)
        if changed:
            console.talk(f"changed: {', '.join(sorted(path.name for path in changed))}")
            try:
                sight = load()
                page.replace(sight.robot, sight.scene, q=sight.q)
            except ManipcliError as error:
                console.error(text.render_errors(error.findings))
                page.notify("not shown", str(error))
            except Exception as error:  # noqa: BLE001 (a file that is being written must not end the page)
                console.error(f"✗ not shown: {type(error).__name__}: {error}")
        return files

    watch(show, lambda file: cache is not None and file.is_relative_to(cache))
