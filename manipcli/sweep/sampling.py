"""The samples of a sweep: their numbers, the values of each, and the command that repeats it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from manipcli.batch.discovery import read_case, shown_path
from manipcli.batch.job import Job, Settings
from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.core.units import readable
from manipcli.task.designs import Design
from manipcli.task.load_task import WrittenTask, load_written


@dataclass(frozen=True, slots=True)
class Column:
    """A number that a sweep varies: `scene.cup.at.0` for the first component of a list.

    Attributes:
        name, path, component: the name, of a component of the list at the path, or None.
        nominal: value in the file, in the SI `unit`.
        dimension: index among the dimensions of the design.
    """

    name: str
    path: str
    component: int | None
    nominal: float
    unit: str
    dimension: int

    def text(self, value: float) -> str:
        """A value in a readable unit: `80 g`."""
        return readable(value, self.unit, digits=4).replace("-", "−")


class Sampling:
    """The samples of a task.

    Attributes:
        written: the task.
        design: of the samples.
        total: number of samples that the design has; None: no end.
    """

    def __init__(self, path: Path, settings: Settings) -> None:
        """
        Raises:
            InvalidInput: a file is invalid, or the task has no `vary:`.
        """
        self._path, self._settings = path, settings
        self.written: WrittenTask = self.again()
        if not self.written.varied:
            message = f"task '{self.written.task.name}' has no `vary:`, so that all samples are the same"
            hint = "add it: `vary: {scene.cup.at: {offset: {uniform: [-2 cm, 2 cm]}}}`"
            raise InvalidInput([Diagnostic("USE185", message, self.written.task.file.place("task"), hint=hint)])
        self.design: Design = self.written.design
        self.total = self.design.total(self.written.varied)
        self._case = read_case(path, shown=shown_path(path))

    def again(self) -> WrittenTask:
        """The task, loaded from its files now.

        Raises:
            InvalidInput: a file is invalid.
        """
        return load_written(self._path, **Job(read_case(self._path), self._path, self._settings).loading.options)

    @property
    def task(self) -> str:
        """Name of the task."""
        return self.written.task.name

    @property
    def seed(self) -> int:
        return self.written.task.spec.simulation.seed

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """The numbers with more than one value, in the order of the file, without those set by an override."""
        columns: list[Column] = []
        dimension = 0
        drawn = {path for path, _ in self.written.drawn(0).values} if self.design.word != "oat" else None
        for quantity in self.written.varied:
            free = [k for k in range(quantity.dimensions) if self.design.has(quantity, k)]
            for k, nominal in enumerate(quantity.nominal):
                own = dimension if quantity.law.together else dimension + len([j for j in free if j < k])
                name = f"{quantity.path}.{k}" if quantity.vector else quantity.path
                column = Column(name, quantity.path, k if quantity.vector else None, float(nominal), quantity.unit, own)
                if (quantity.values(k) > 1 or self.design.word == "oat") and (drawn is None or quantity.path in drawn):
                    columns.append(column)
            dimension += len(free)
        return tuple(columns)

    @property
    def dimensions(self) -> int:
        """Number of dimensions of the design."""
        return sum(self.design.has(quantity, k) for quantity in self.written.varied for k in range(quantity.dimensions))

    def values(self, number: int) -> tuple[float, ...]:
        """The value of each column in a sample, in SI."""
        drawn = dict(self.written.drawn(number).values)
        found = []
        for column in self.columns:
            value = drawn.get(column.path)
            if value is None:
                found.append(column.nominal)
            elif isinstance(value, tuple):
                found.append(float(value[column.component or 0]))
            else:
                found.append(float(value))
        return tuple(found)

    def job(self, number: int) -> Job:
        """The run of a sample."""
        return Job(replace(self._case, sample=number), self._path, self._settings)

    def commands(self, numbers: Sequence[int]) -> dict[int, str]:
        """The shell command that repeats each sample."""
        return {number: self.job(number).command() for number in numbers}
