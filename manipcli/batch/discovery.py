"""The tests that a task file has, and why a file that was named has none."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

from manipcli.batch.first_look import SUFFIXES, first_look
from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.report.suite.suite import Case


def read_case(path: Path, *, shown: str | None = None) -> Case:
    """The task in a file; of a file that cannot be read, why.

    Args:
        path: the file.
        shown: what it is called; default `path` itself.
    """
    from manipcli.spec.load import read_bytes
    from manipcli.spec.source.tree import MappingNode, ScalarNode, SequenceNode
    from manipcli.spec.source.yaml import parse
    from manipcli.spec.task import TAG, SimulationSpec

    name = shown if shown is not None else str(path)
    try:
        root = parse(read_bytes(path), name)
    except InvalidInput as invalid:
        return Case(name, path.stem, findings=invalid.findings)
    task = root.get("task") if isinstance(root, MappingNode) else None
    if not isinstance(root, MappingNode) or not isinstance(task, ScalarNode) or not isinstance(task.value, str):
        message = "`task:` is no name; expected a text"
        return Case(
            name, path.stem, findings=(Diagnostic("TASK200", message, task.place if task is not None else None),)
        )
    tags = root.get("tags")
    words = [one.value for one in tags.items if isinstance(one, ScalarNode)] if isinstance(tags, SequenceNode) else []
    tagged = tuple(word for word in words if isinstance(word, str) and TAG.fullmatch(word))
    simulation = root.get("simulation")
    engine = simulation.get("engine") if isinstance(simulation, MappingNode) else None
    engine_name = engine.value if isinstance(engine, ScalarNode) else SimulationSpec.model_fields["engine"].default
    return Case(
        file=name,
        task=task.value,
        tags=(*tagged, f"engine_{engine_name}"),
        varied=root.get("vary") is not None,
        line=task.place.line,
    )


def samples_of(case: Case, count: int | None, named: Collection[str] = ()) -> tuple[Case, ...]:
    """Samples 0 to `count` - 1 of a task with a `vary:`; else the task as it is written, and the samples whose names
    (`pour[3]`) are among `named`."""
    if not case.varied:
        return (case,)
    if count is not None:
        return tuple(replace(case, sample=sample) for sample in range(count))
    numbers = (name.removeprefix(f"{case.task}[").removesuffix("]") for name in named)
    samples = (replace(case, sample=int(one)) for one in numbers if one.isdecimal())
    return (case, *sorted((one for one in samples if one.name in named), key=lambda one: one.sample or 0))


def shown_path(path: Path) -> str:
    """Below the working directory relative to it, else as it was given."""
    try:
        return str(path.absolute().relative_to(Path.cwd()))
    except ValueError:
        return str(path)


def is_named_task(path: Path) -> bool:
    """Whether a file that somebody named as a task has the top-level key `task`, however that is written."""
    from manipcli.spec.load import read_bytes
    from manipcli.spec.source.tree import MappingNode
    from manipcli.spec.source.yaml import parse

    if first_look(path, named=True) == "task":
        return True
    if path.suffix.lower() not in SUFFIXES or not path.is_file():
        return False
    try:
        root = parse(read_bytes(path), str(path))
    except InvalidInput:
        return False
    return isinstance(root, MappingNode) and root.get("task") is not None


def refused_path(path: Path) -> tuple[Diagnostic, ...]:
    """Why a file that was named cannot be run as a task; empty where it can."""
    from manipcli.spec.load import read_bytes

    try:
        read_bytes(path)
    except InvalidInput as invalid:
        return invalid.findings
    if is_named_task(path):
        return ()
    message = "this is no task file: a YAML file with the top-level keys `task` and `robot` was expected"
    return (Diagnostic("USE105", message, Place(str(path), 1, 1)),)
