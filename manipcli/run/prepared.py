"""A task that is loaded, and planned where possible, before its samples are run in forked processes.

A plan is a function of what the planner knows of a task: its files as the planner sees them, the robot and the scene
(`Task.known`). Drawing a sample creates new objects for what the drawn values change there, and keeps the others. So a
sample whose known objects are those of the task as written has its plan; no list of fields decides.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Unpack

from manipcli.core.errors import InvalidInput
from manipcli.core.opened_files import OpenedFiles, opened_by
from manipcli.run.libraries import load_libraries
from manipcli.task.load_task import FileOptions, LoadOptions, WrittenTask, load_task, load_written
from manipcli.task.plan_task import Plan, plan_task
from manipcli.task.task import Task


@dataclass(slots=True)
class Prepared:
    """A task as written, its plan (None: no sample can use it), and the files that were read.

    For one run: a planner changes when it re-plans, so the plan is given once.
    """

    written: WrittenTask
    plan: Plan | None
    files: OpenedFiles

    def load(self, path: Path, *, sample: int | None = None, **options: Unpack[FileOptions]) -> Task:
        """The same as `load_task`, which is called if another task is asked for or a file has changed.

        Raises:
            InvalidInput: as `load_task`.
        """
        if (path, options) != (self.written.path, self.written.options) or not self.files.unchanged():
            self.plan = None
            return load_task(path, **LoadOptions(sample=sample, **options))
        return self.written.sample(sample)

    def take_plan(self, task: Task) -> Plan | None:
        """The plan of a task; None if it is another one, or was taken before."""
        plan, self.plan = self.plan, None
        return plan if same_for_planner(task, self.written.task) else None


def same_for_planner(one: Task, other: Task) -> bool:
    """Whether two tasks consist of the same objects, apart from drawn values and ground truth."""
    a, b = one.known, other.known
    return all(getattr(a, field.name) is getattr(b, field.name) for field in fields(Task))


def prepare(path: Path, **options: Unpack[FileOptions]) -> Prepared:
    """Loads a task, and plans it if its samples differ in the simulation only. Once per process.

    Raises:
        InvalidInput: a file is invalid.
        NotPlannable: a step cannot be planned.
    """

    def prepared() -> tuple[WrittenTask, Plan | None]:
        written = load_written(path, **options)
        load_libraries(written.task)
        if options.get("design") and written.varied:
            with suppress(InvalidInput):
                written.sample(0)  # its libraries and tables
        every_one = not written.varied or written.task.scene is written.task.true.scene  # beliefs differ by sample
        shared = every_one and all(quantity.only_world for quantity in written.varied)
        return written, plan_task(written.task) if shared else None

    (written, plan), files = opened_by(prepared)
    return Prepared(written, plan, files)
