"""From the words of a command to an empty map: the step, its object, and the points."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Unpack

from manipcli import pipeline
from manipcli.core.units import ANGLE, LENGTH
from manipcli.sweep.reach.grid import Range, grid_of, read_range, read_spacing
from manipcli.sweep.reach.placement import object_of, placement_of
from manipcli.sweep.reach.question import Question
from manipcli.sweep.reach.reach_map import ReachMap
from manipcli.task.load_task import FileOptions
from manipcli.task.task import Task


@dataclass(frozen=True, slots=True)
class Ranges:
    """Ranges and spacing as written; None: the default."""

    x: str | None = None
    y: str | None = None
    yaw: str | None = None
    spacing: str | None = None


def prepared_map(
    path: Path, step: str, ranges: Ranges, *, body: str | None = None, **options: Unpack[FileOptions]
) -> tuple[ReachMap, Task]:
    """A map without results, and the task as written.

    Args:
        path: the task file.
        step: id of the last step that is planned.
        ranges: of the points.
        body: the object that is moved; None: the one that the step acts on.
        options: how the task is loaded.

    Raises:
        InvalidInput: all errors of the files; an unknown step or object; a range that is none.
    """
    read = {
        "x": None if ranges.x is None else read_range("--x", ranges.x, LENGTH),
        "y": None if ranges.y is None else read_range("--y", ranges.y, LENGTH),
        "yaw": None if ranges.yaw is None else read_range("--yaw", ranges.yaw, ANGLE),
    }
    spacing = None if ranges.spacing is None else read_spacing(ranges.spacing)
    task = pipeline.up_to(pipeline.load_task(path, **options), step, option="STEP")
    assert task.part.last is not None
    placement = placement_of(task, object_of(task, task.part.last - 1, step, body))
    default = [Range(low, high, None) for low, high in placement.surface(task)]
    grid = grid_of(read["x"] or default[0], read["y"] or default[1], read["yaw"], spacing)
    return ReachMap(task.name, Question(path, options, step, placement.body), placement, grid, {}), task
