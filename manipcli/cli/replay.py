"""`manipcli replay LOG`: a run in the browser, or as a page that plays by itself."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from manipcli.cli import console
from manipcli.cli.interrupts import Interrupts
from manipcli.cli.options import AllowOutside, PackagePath
from manipcli.core.errors import ExitCode


def replay(
    log: Annotated[
        Path, typer.Argument(metavar="LOG", help="An .mcap file, or the .partial of a killed run.", show_default=False)
    ],
    *,
    html: Annotated[
        Path | None,
        typer.Option("--html", metavar="FILE", help="Write one page that plays offline, instead of serving one."),
    ] = None,
    port: Annotated[
        int | None, typer.Option("--port", metavar="N", min=0, max=65535, help="8080 or the next free one when absent.")
    ] = None,
    open_: Annotated[bool, typer.Option("--open", help="Open the page in a browser.")] = False,
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
) -> ExitCode:
    """Show a recorded run: robot and scene over time, steps by name, curves.

    Needs nothing but the log and the packages of its meshes. Ctrl-C ends it.
    """
    with Interrupts():
        from manipcli.flow.replay import open_playback

        playback = open_playback(log, package_path=tuple(package_path or ()), allow_outside=allow_outside)
        if playback.lost is not None:
            console.talk(f"the log is not closed: {playback.lost}")
        for note in playback.notes:
            console.talk(f"note: {note}")
        if html is not None:
            from manipcli.replay.player import player_page

            html.write_text(player_page(playback), "utf-8")
            console.result(str(html))
            return ExitCode.PASSED
        from manipcli.replay.replay import Replay

        with Replay(playback, port=port) as page:
            console.result(page.url)
            console.talk("Ctrl-C ends it")
            if open_:
                import webbrowser

                webbrowser.open(page.url)
            try:
                page.wait()
            except KeyboardInterrupt:
                console.talk("")
    return ExitCode.PASSED
