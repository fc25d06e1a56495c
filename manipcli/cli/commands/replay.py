"""`manipcli replay LOG`: a run in the browser, as a page, as pictures or as a video."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypedDict

import typer

from manipcli.cli import console
from manipcli.cli.interrupts import Interrupts
from manipcli.cli.log_files import opened
from manipcli.cli.options import AllowOutside, Format, OpenPage, PackagePath, PagePort
from manipcli.cli.serving import stay
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput
from manipcli.core.text import listed

if TYPE_CHECKING:
    from manipcli.cli.pictures import Pictures
    from manipcli.replay.ghost import Ghost
    from manipcli.replay.playback import Playback


def replay(
    log: Annotated[
        Path,
        typer.Argument(
            metavar="LOG",
            help="MCAP file, the .partial file of a killed run, or the folder of a rosbag2.",
            show_default=False,
            callback=opened,
        ),
    ],
    *,
    html: Annotated[
        Path | None,
        typer.Option("--html", metavar="FILE", help="Write a page that plays offline to FILE instead of serving it."),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option("--picture", metavar="FILE.png", help="Draw the run at one time.")
    ] = None,
    at: Annotated[
        str | None,
        typer.Option("--at", metavar="T", help="With --picture: seconds, or a step [default: end of the run]."),
    ] = None,
    sheet: Annotated[
        Path | None,
        typer.Option("--sheet", metavar="FILE.png", help="Draw all steps on one contact sheet."),
    ] = None,
    video: Annotated[
        Path | None,
        typer.Option("--video", metavar="FILE", help="Write a video: .webp, .gif, or .mp4 (needs manipcli[video])."),
    ] = None,
    size: Annotated[
        str | None,
        typer.Option("--size", metavar="WxH", help="Size of pictures [default: 960x720, videos: 640x360]."),
    ] = None,
    view: Annotated[
        str | None,
        typer.Option(
            "--view",
            metavar="VIEW",
            help="View of pictures: iso, front, back, left, right, top, or AZIMUTH,ELEVATION [default: iso].",
        ),
    ] = None,
    forces: Annotated[
        bool | None,
        typer.Option(
            "--forces/--no-forces",
            help="Draw contact forces in pictures [default: in steps that failed].",
            show_default=False,
        ),
    ] = None,
    fps: Annotated[
        float | None, typer.Option("--fps", metavar="N", help="Frames of a video per second [default: 25].")
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option("--speed", metavar="X", help="Seconds of the run per second of a video [default: 1]."),
    ] = None,
    planned: Annotated[
        bool,
        typer.Option("--planned", help="Plan the task again, and draw the planned robot on the page, too."),
    ] = False,
    robot: Annotated[
        str | None,
        typer.Option("--robot", metavar="NAMESPACE", help="Show only this robot of a log with several."),
    ] = None,
    rerun: Annotated[
        bool,
        typer.Option("--rerun", help="Open the viewer Rerun instead of the page (needs manipcli[rerun])."),
    ] = False,
    port: PagePort = None,
    open_: OpenPage = False,
    verify: Annotated[
        bool,
        typer.Option("--verify", help="Simulate the run from the log and compare every message."),
    ] = False,
    allow_different: Annotated[
        bool, typer.Option("--allow-different", help="With --verify: allow other versions or meshes.")
    ] = False,
    format_: Format = "text",
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
) -> ExitCode:
    """Show a recorded run: robot and scene over time, curves.

    Needs only the log and the packages of its meshes. Press Ctrl-C to stop.
    """
    files = (("--html", html), ("--picture", picture), ("--sheet", sheet), ("--video", video))
    drawn = (("--at", at), ("--size", size), ("--view", view), ("--fps", fps), ("--speed", speed), ("--forces", forces))
    shows = (
        *files,
        *drawn,
        ("--planned", planned or None),
        ("--robot", robot),
        ("--port", port),
        ("--open", open_ or None),
        ("--rerun", rerun or None),
    )
    verifies = (("--allow-different", allow_different or None), ("--format json", format_ == "json" or None))
    _refuse(shows if verify else verifies, verify=verify)
    if rerun:
        _check_rerun((("--planned", planned or None), ("--port", port), ("--open", open_ or None)))
    with Interrupts() as interrupts:
        if verify:
            from manipcli.cli.commands.verify import verify as verified

            return verified(
                log,
                allow_different=allow_different,
                package_path=tuple(package_path or ()),
                allow_outside=allow_outside,
                format_=format_,
                interrupts=interrupts,
            )
        from manipcli.cli.outputs import check_outputs
        from manipcli.cli.pictures import Pictures
        from manipcli.logs.replay import open_playback

        check_outputs(*files, reads=(log,))
        pictures = Pictures(
            picture=picture, at=at, sheet=sheet, video=video, size=size, view=view, fps=fps, speed=speed, forces=forces
        )
        if planned and pictures.wanted and html is None:
            raise InvalidInput([Diagnostic("USE062", "--planned has no effect without --html", hint="add --html")])
        where: Where = {"package_path": tuple(package_path or ()), "allow_outside": allow_outside}
        space = None if robot is None else f"/{robot.strip('/')}"
        playback = open_playback(log, rate=pictures.rate, space=space, **where)
        playback, ghosts = _with_plan(log, playback, where) if planned else (playback, ())
        _show(log, playback, ghosts, pictures, html, rerun=rerun, port=port, open_=open_)
    return ExitCode.PASSED


def _refuse(options: Sequence[tuple[str, object]], *, verify: bool) -> None:
    """Refuses the options of the other use; those that are None were not given.

    Raises:
        InvalidInput: an option has no effect.
    """
    given = [option for option, value in options if value is not None]
    if given:
        reason = "with" if verify else "without"
        raise InvalidInput([Diagnostic("USE080", f"{listed(given)}: no effect {reason} --verify")])


def _check_rerun(page: Sequence[tuple[str, object]]) -> None:
    """Checks that Rerun can be opened, before the log is read; `page`: options that concern the page only.

    Raises:
        InvalidInput: an option has no effect, the extra is not installed, or there is no screen.
    """
    from manipcli.replay.rerun.installed import check_installed
    from manipcli.replay.rerun.viewer import check_display

    given = [option for option, value in page if value is not None]
    if given:
        raise InvalidInput([Diagnostic("USE080", f"{listed(given)}: no effect with --rerun")])
    check_installed("--rerun")
    check_display()


class Where(TypedDict):
    """Where meshes are searched."""

    package_path: tuple[Path, ...]
    allow_outside: bool


def _with_plan(log: Path, playback: Playback, where: Where) -> tuple[Playback, tuple[Ghost, ...]]:
    """The playback with notes about its plan, and the planned ghost if there is one."""
    from manipcli.logs.planned_ghost import open_planned_ghost

    ghost, notes = open_planned_ghost(log, playback, **where)
    return replace(playback, notes=(*playback.notes, *notes)), () if ghost is None else (ghost,)


def _show(
    log: Path,
    playback: Playback,
    ghosts: Sequence[Ghost],
    pictures: Pictures,
    html: Path | None,
    *,
    rerun: bool,
    port: int | None,
    open_: bool,
) -> None:
    """Prints what is missing and writes the requested files; without any, serves the page until Ctrl-C."""
    if playback.lost is not None:
        console.talk(f"the log is incomplete: {playback.lost}")
    for note in playback.notes:
        console.talk(f"note: {note}")
    pages = html is not None or not (pictures.wanted or rerun)
    if pages:
        from manipcli.replay.player import player_page

        page = player_page(playback, ghosts=ghosts)
    if html is not None:
        from manipcli.core.whole_file import write_whole

        write_whole(html, page.encode())
        console.result(str(html))
    pictures.make(playback)
    if rerun:
        _open_rerun(log, playback)
    elif html is None and pages:
        from manipcli.replay.page_server import PageServer

        with PageServer(page, port=port) as server:
            stay(server.url, open_=open_)


def _open_rerun(log: Path, playback: Playback) -> None:
    """Opens the viewer on a temporary recording, until its window is closed or Ctrl-C."""
    from tempfile import TemporaryDirectory

    from manipcli.logs.rerun import write_rerun
    from manipcli.replay.playback import RATE
    from manipcli.replay.rerun.viewer import show

    with TemporaryDirectory(prefix="manipcli-") as folder:
        recording = Path(folder) / "run.rrd"
        console.not_drawn(write_rerun(recording, log, playback, rate=RATE))
        try:
            console.talk("Close the window of Rerun, or press Ctrl-C, to stop.")
            show(recording)
        except KeyboardInterrupt:
            console.talk("")
