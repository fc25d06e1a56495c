"""What is doubtful in a valid task: unused names, expectations that cannot fail or cannot pass, blind grasps."""

from __future__ import annotations

from collections.abc import Iterator

from manipcli.core.errors import Diagnostic
from manipcli.task.lint.foregone import foregone
from manipcli.task.lint.unlocated import unlocated
from manipcli.task.lint.unused import unused
from manipcli.task.task import Task


def lint(task: Task) -> Iterator[Diagnostic]:
    """The findings of `check` about a valid task; a run does not need them."""
    yield from unused(task)
    yield from foregone(task)
    yield from unlocated(task)
