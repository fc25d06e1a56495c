"""Which tasks there are: YAML files with a name under the top-level key `task`, and the key `robot`, below the folders
that are named."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from manipcli.batch.first_look import LEFT_OUT, SUFFIXES, first_look, is_entered
from manipcli.core.errors import Finding, InvalidInput, Place
from manipcli.report.suite import Case


def task_files(paths: Sequence[Path], *, tell: Callable[[str], None] | None = None) -> tuple[Path, ...]:
    """The task files among and below `paths`, each once, folder by folder in the order of names.

    Args:
        paths: files and folders.
        tell: takes a line about each file in a folder that looks like a task and is left out.

    Raises:
        InvalidInput: a path is not there, or is a file but no task.
    """
    found: dict[str, Path] = {}
    refused: list[Finding] = []
    for path in paths:
        if path.is_dir():
            looks = [(file, first_look(file)) for file in _files(path)]
            below = [file for file, look in looks if look == "task"]
            if tell is not None:
                for file, look in looks:
                    if look in LEFT_OUT:
                        tell(f"{shown_path(file)} {LEFT_OUT[look]}")
        else:
            below = [path]
            refused += _no_task(path)
        for file in below:
            found.setdefault(os.path.realpath(file), file)
    if refused:
        raise InvalidInput(refused)
    return tuple(found.values())


def baselines_of_none(paths: Sequence[Path], files: Iterable[Path]) -> tuple[Path, ...]:
    """Baselines below the folders among `paths` that belong to none of the task `files`: nothing is compared with them.

    What else is called so is left alone.
    """
    from manipcli.batch.baseline import is_baseline, kept_baseline

    owned = {os.path.realpath(kept_baseline(file)) for file in files}
    below = [file for path in paths if path.is_dir() for file in _files(path)]
    named = {os.path.realpath(file): file for file in below if file.name.endswith(".baseline.json")}
    return tuple(file for real, file in named.items() if real not in owned and is_baseline(file))


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
        return Case(name, path.stem, findings=(Finding("TASK200", message, task.place if task is not None else None),))
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


def failed_of(case: Case, failed: Collection[str]) -> tuple[Case, ...]:
    """The task as it is written and its samples, of those whose ids are among `failed`."""
    numbers = [one.removeprefix(f"{case.id}[").removesuffix("]") for one in failed if one.startswith(f"{case.id}[")]
    samples = sorted(int(one) for one in numbers if one.isdecimal()) if case.varied else ()
    candidates = (case, *(replace(case, sample=number) for number in samples))
    return tuple(one for one in candidates if one.id in failed)


def samples_of(case: Case, count: int | None) -> tuple[Case, ...]:
    """Samples 0 to `count` - 1 of a task that varies; else, and where `count` is None, the task as it is written."""
    if count is None or not case.varied:
        return (case,)
    return tuple(replace(case, sample=sample) for sample in range(count))


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


def _files(folder: Path) -> Iterator[Path]:
    for place, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if is_entered(Path(place, name)))
        yield from (Path(place, name) for name in sorted(names))


def _no_task(path: Path) -> tuple[Finding, ...]:
    """Why a file that was named is not run."""
    from manipcli.spec.load import read_bytes

    try:
        read_bytes(path)
    except InvalidInput as invalid:
        return invalid.findings
    if is_named_task(path):
        return ()
    message = "this is no task file: a YAML file with the top-level keys `task` and `robot` was expected"
    return (Finding("USE105", message, Place(str(path), 1, 1)),)
