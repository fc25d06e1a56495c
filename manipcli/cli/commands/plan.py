"""`manipcli plan TASK`: the plan of a task, without simulation."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from manipcli.cli import console
from manipcli.cli.options import (
    AllowOutside,
    Design,
    Format,
    Overrides,
    PackagePath,
    Sample,
    Seed,
    TaskFile,
    check_design,
)
from manipcli.cli.outputs import check_outputs, check_picture
from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput, NotPlannable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from manipcli.pipeline import Plan
    from manipcli.replay.camera import Vector
    from manipcli.replay.planned_playback import TriedPath
    from manipcli.replay.playback import Playback

Export = Literal["jointtrajectory"]


def plan(
    task: TaskFile,
    *,
    csv: Annotated[
        Path | None, typer.Option("--csv", metavar="FILE", help="Write all points of all trajectories to FILE.")
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option("--picture", metavar="FILE.png", help="Draw the scene with the tool's path and dropped ones."),
    ] = None,
    view: Annotated[
        str | None,
        typer.Option(
            "--view",
            metavar="VIEW",
            help="With --picture: iso, front, back, left, right, top, or AZIMUTH,ELEVATION [default: least hidden].",
        ),
    ] = None,
    curves: Annotated[
        Path | None,
        typer.Option("--curves", metavar="FILE", help="Draw each joint's motion with its limits: .svg, .png or .pdf."),
    ] = None,
    html: Annotated[
        Path | None,
        typer.Option("--html", metavar="FILE", help="Write a page that plays the planned motion to FILE."),
    ] = None,
    export: Annotated[
        Export | None,
        typer.Option("--export", help="Write each step as a ROS message in YAML, for the arm's joints."),
    ] = None,
    folder: Annotated[
        Path | None,
        typer.Option("--to", metavar="FOLDER", help="With --export: folder of the files [default: TASK_trajectories]."),
    ] = None,
    until: Annotated[
        str | None, typer.Option("--until", metavar="STEP", help="Plan up to this step or block only.")
    ] = None,
    why: Annotated[
        bool,
        typer.Option("--why", help="Search longer before the task is refused, and show every refused candidate."),
    ] = False,
    seed: Seed = None,
    sample: Sample = None,
    design: Design = "",
    overrides: Overrides = None,
    format_: Format = "text",
    package_path: PackagePath = None,
    allow_outside: AllowOutside = False,
) -> ExitCode:
    """Plan a task and show its motions.

    Shows what binds each motion, its margins, its clearance and the dropped candidates; simulates nothing. Without a
    plan, shows the refused candidates by stage; with --why after a longer search, and all of them.
    """
    from manipcli import pipeline
    from manipcli.cli.progress import PlanningProgress

    check_design(design, sample)
    if folder is not None and export is None:
        raise InvalidInput([Diagnostic("USE084", "--to has no effect without --export")])
    check_outputs(("--csv", csv), ("--picture", picture), ("--curves", curves), ("--html", html), reads=(task,))
    towards = _view_of(view, picture)
    kind = None
    if curves is not None:
        from manipcli.replay.figure import kind_of

        kind = kind_of(curves)
    loaded = pipeline.load_task(
        task,
        overrides=tuple(overrides or ()),
        seed=seed,
        sample=sample,
        design=design,
        package_path=tuple(package_path or ()),
        allow_outside=allow_outside,
    )
    if until is not None:
        loaded = pipeline.up_to(loaded, until)
    try:
        with PlanningProgress() as progress:
            planned = pipeline.plan_task(loaded, on_progress=progress.activity, deeper=why)
    except NotPlannable as refusal:
        if html is not None:
            _write_refused_page(pipeline.unplanned(loaded), loaded.spec.task, html, refusal)
        if picture is not None:
            _draw_refused(pipeline.unplanned(loaded), loaded.spec.task, picture, refusal, towards)
        if format_ != "json":
            if sum(group.count for group in refusal.candidates) > 1:
                from manipcli.report.plan_text import render_refused

                console.result(render_refused(refusal.candidates, every=why))
            raise
        from manipcli.report.json import render_verdict

        console.result(render_verdict(pipeline.refused(loaded, refusal)))
        return refusal.exit_code
    name = loaded.spec.task
    if csv is not None:
        from manipcli.core.whole_file import whole_file
        from manipcli.report.plan import write_csv

        with whole_file(csv) as partial, partial.open("w", encoding="utf-8", newline="") as stream:
            write_csv([motion for part in planned.stretches for motion in part.motions], stream)
    if picture is not None:
        _draw(planned, name, picture, towards)
    if curves is not None and kind is not None:
        from manipcli.core.whole_file import write_whole
        from manipcli.replay.plan_figure import plan_figure

        write_whole(curves, plan_figure(planned, name, kind))
    if html is not None:
        _write_page(planned, name, html)
    if export is not None:
        _export(planned, folder or Path(f"{task.stem}_trajectories"))
    if why and planned.effort > loaded.spec.plan.effort:
        effort = math.ceil(planned.effort)
        console.talk(f"note: other commands refuse this task at their work budget: add `plan: {{effort: {effort}}}`")
    if format_ == "json":
        from manipcli.report.plan import render_json

        console.result(render_json(name, planned))
    else:
        from manipcli.report.plan_text import render_text

        console.result(render_text(name, planned, every=why))
    return ExitCode.PASSED


def _view_of(view: str | None, picture: Path | None) -> Vector | None:
    """The direction of `--view`; None without one.

    Raises:
        InvalidInput: there is no such view, it has no effect, or the picture is not a .png file.
    """
    from manipcli.replay.camera import direction

    if picture is not None and picture.suffix.lower() in (".svg", ".pdf"):
        hint = "`--curves FILE` draws the joints' motions as .svg, .png or .pdf"
        raise InvalidInput([Diagnostic("USE063", f"'{picture}' is not a .png file", hint=hint)])
    check_picture(picture)
    if view is not None and picture is None:
        raise InvalidInput([Diagnostic("USE062", "--view has no effect without --picture", hint="add --picture")])
    return None if view is None else direction(view)


def _draw(planned: Plan, name: str, path: Path, towards: Vector | None) -> None:
    from manipcli.replay.planned_playback import planned_playback, tried_paths

    _write_picture(path, planned_playback(planned, name), tried_paths(planned), towards)


def _draw_refused(nothing: Plan, name: str, path: Path, refusal: NotPlannable, towards: Vector | None) -> None:
    from manipcli.replay.planned_playback import refused_path, refused_playback

    playback, _ = refused_playback(nothing, name, refusal)
    _write_picture(path, playback, refused_path(nothing, refusal), towards, refused=str(refusal))
    console.talk(f"written: {path}, the start of the task and what was tried")


def _write_picture(
    path: Path, playback: Playback, tried: Sequence[TriedPath], towards: Vector | None, *, refused: str = ""
) -> None:
    from manipcli.core.whole_file import write_whole
    from manipcli.replay.plan_picture import plan_picture
    from manipcli.replay.renderer import png_bytes

    image, missing = plan_picture(playback, tried, refused=refused, towards=towards)
    console.not_drawn(missing)
    write_whole(path, png_bytes(image))


def _write_page(planned: Plan, name: str, path: Path) -> None:
    from manipcli.core.whole_file import write_whole
    from manipcli.replay.planned_playback import planned_ghosts, planned_playback
    from manipcli.replay.player import player_page

    playback = planned_playback(planned, name)
    ghosts, more = planned_ghosts(planned, playback)
    if more:
        console.talk(f"note: {more} more dropped candidates are not drawn")
    write_whole(path, player_page(playback, ghosts=ghosts).encode())


def _write_refused_page(nothing: Plan, name: str, path: Path, refusal: NotPlannable) -> None:
    from manipcli.core.whole_file import write_whole
    from manipcli.replay.planned_playback import refused_playback
    from manipcli.replay.player import player_page

    playback, ghosts = refused_playback(nothing, name, refusal)
    write_whole(path, player_page(playback, ghosts=ghosts).encode())
    console.talk(f"written: {path}, the start of the task and what was tried")


def _export(planned: Plan, folder: Path) -> None:
    """One file for each step that moves the arm, numbered in the order of the task."""
    from manipcli.core.whole_file import write_whole
    from manipcli.report.joint_trajectory_export import message, step_trajectory

    folder.mkdir(parents=True, exist_ok=True)
    columns = {name: k for k, name in enumerate(planned.planner.robot.joint_names)}
    planned = planned.merged
    spans = iter(planned.spans())
    for k, step in enumerate(planned.steps, start=1):
        trajectory = step_trajectory([next(spans) for _ in step.plan.motions], columns)
        if trajectory is not None:
            path = folder / f"{k:02d}_{step.id.replace('/', '_')}.yaml"
            write_whole(
                path, message(trajectory, f"{step.verb} '{step.id}'; the hand's motion is not included").encode()
            )
            console.talk(f"written: {path}")
