"""`manipcli reach TASK STEP`: a map of where the object may be so that the step can be planned."""

from __future__ import annotations

import time
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manipcli.cli import console
from manipcli.cli.options import AllowOutside, Format, Overrides, PackagePath, Seed, TaskFile, cores
from manipcli.cli.outputs import check_outputs
from manipcli.core.errors import ExitCode

if TYPE_CHECKING:
    from manipcli.pipeline import Task
    from manipcli.sweep.reach.reach_map import ReachMap

PERIOD = 0.2
"""[s] between two drawings of the live line."""
QUIET_PERIOD = 20.0
"""[s] between two lines where the output is not a terminal."""


def reach(
    task: TaskFile,
    step: Annotated[str, typer.Argument(metavar="STEP", help="Last step to plan, by its id.", show_default=False)],
    *,
    object_: Annotated[
        str | None, typer.Option("--object", metavar="NAME", help="Body to move [default: the step's object].")
    ] = None,
    x: Annotated[
        str | None,
        typer.Option("--x", metavar="LOW:HIGH:N", help="Values of x, 50cm:1m:11 [default: what the object rests on]."),
    ] = None,
    y: Annotated[str | None, typer.Option("--y", metavar="LOW:HIGH:N", help="Values of y [default: as x].")] = None,
    yaw: Annotated[
        str | None,
        typer.Option("--yaw", metavar="LOW:HIGH:N", help="Yaws at each place, '0:180 deg:7' [default: the task's]."),
    ] = None,
    spacing: Annotated[
        str | None,
        typer.Option("--step", metavar="D", help="Distance of the points, '2 cm' [default: at most 400 points]."),
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option("--picture", metavar="FILE", help="Draw the maps, seen from above: .png, .svg or .pdf."),
    ] = None,
    csv: Annotated[
        Path | None, typer.Option("--csv", metavar="FILE", help="Write a row for each point to FILE.")
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option("-n", "--workers", metavar="W", min=1, help="Parallel processes [default: number of cores]."),
    ] = None,
    seed: Seed = None,
    overrides: Overrides = None,
    format_: Format = "text",
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print only the result.")] = False,
) -> ExitCode:
    """Map where the object may be so that a step can be planned: success, clearance, manipulability, reasons.

    Plans the task up to STEP with the object at each point of a grid; simulates nothing. After Ctrl-C, the points that
    were planned are shown and written.
    """
    from manipcli.cli.interrupts import Interrupts

    with Interrupts():
        from manipcli.sweep.reach.prepare import Ranges, prepared_map
        from manipcli.sweep.reach.workers import planned_points

        check_outputs(("--csv", csv), ("--picture", picture), reads=(task,))
        if picture is not None:
            from manipcli.replay.figure import kind_of

            kind_of(picture)
        found, loaded = prepared_map(
            task,
            step,
            Ranges(x, y, yaw, spacing),
            body=object_,
            overrides=tuple(overrides or ()),
            seed=seed,
            package_path=tuple(package_path or ()),
            allow_outside=allow_outside,
        )
        grid = found.grid
        points = [(number, found.placement.overrides(*grid.point(number))) for number in grid.order()]
        line = _Line(found, quiet=quiet)
        interrupted: KeyboardInterrupt | None = None
        try:
            with closing(planned_points(found.question, points, at_once=workers or cores(), beat=line.show)) as results:
                for result in results:
                    found.results[result.number] = result
        except KeyboardInterrupt as interrupt:
            interrupted = interrupt
        line.clear()
    if found.results:
        _report(found, loaded, csv, picture, format_)
    if interrupted is not None:
        raise interrupted
    return ExitCode.PASSED if found.planned else ExitCode.FAILED


def _report(found: ReachMap, task: Task, csv: Path | None, picture: Path | None, format_: str) -> None:
    from manipcli.core.whole_file import write_whole
    from manipcli.sweep.reach.text import render_csv, render_json, render_text

    console.result(render_json(found) if format_ == "json" else render_text(found))
    if csv is not None:
        write_whole(csv, render_csv(found).encode())
        console.talk(f"written: {csv}")
    if picture is not None:
        from manipcli.replay.figure import kind_of
        from manipcli.sweep.reach.picture import render_picture

        write_whole(picture, render_picture(found, task, kind_of(picture)))
        console.talk(f"written: {picture}")


class _Line:
    """The progress of a map: a live line on a terminal, else a line now and then."""

    def __init__(self, found: ReachMap, *, quiet: bool) -> None:
        self._found = found
        self._live = console.is_live() and not quiet
        self._quiet = quiet
        self._began = time.monotonic()
        self._next = self._began + (0.0 if self._live else QUIET_PERIOD)

    def show(self) -> None:
        from manipcli.sweep.reach.text import progress_text

        now = time.monotonic()
        if self._quiet or now < self._next:
            return
        self._next = now + (PERIOD if self._live else QUIET_PERIOD)
        results = self._found.results
        planned = sum(result.planned for result in results.values())
        text = progress_text(len(results), planned, self._found.grid.count, now - self._began)
        (console.redraw if self._live else console.talk)(text)

    def clear(self) -> None:
        if self._live:
            console.redraw("")
