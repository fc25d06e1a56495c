"""The tests in a task file, and why a named file has none."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path

from manipcli.batch.first_look import SUFFIXES, first_look
from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.judge.measured_run import variants_of
from manipcli.report.suite.suite import AGREEMENT, ENGINE, Case


def read_case(path: Path, *, shown: str | None = None) -> Case:
    """The task in a file, or the findings of a file that cannot be read.

    Args:
        path: the file.
        shown: its name in messages; default `path` itself.
    """
    from manipcli.spec.load import read_bytes
    from manipcli.spec.simulation import SimulationSpec
    from manipcli.spec.source.tree import MappingNode, ScalarNode, SequenceNode
    from manipcli.spec.source.yaml import parse
    from manipcli.spec.task import TAG

    name = shown if shown is not None else str(path)
    try:
        root = parse(read_bytes(path), name)
    except InvalidInput as invalid:
        return Case(name, path.stem, findings=invalid.findings)
    task = root.get("task") if isinstance(root, MappingNode) else None
    if not isinstance(root, MappingNode) or not isinstance(task, ScalarNode) or not isinstance(task.value, str):
        message = "`task:` is not a name; expected text"
        return Case(
            name, path.stem, findings=(Diagnostic("TASK200", message, task.place if task is not None else None),)
        )
    tags = root.get("tags")
    words = [tag.value for tag in tags.items if isinstance(tag, ScalarNode)] if isinstance(tags, SequenceNode) else []
    tagged = tuple(word for word in words if isinstance(word, str) and TAG.fullmatch(word))
    simulation = root.get("simulation")
    engine = simulation.get("engine") if isinstance(simulation, MappingNode) else None
    engine_name = engine.value if isinstance(engine, ScalarNode) else SimulationSpec.model_fields["engine"].default
    return Case(
        file=name,
        task=task.value,
        tags=(*tagged, f"{ENGINE}{engine_name}"),
        varied=root.get("vary") is not None,
        line=task.place.line,
    )


def samples_of(case: Case, count: int | None, named: Collection[str] = ()) -> tuple[Case, ...]:
    """Samples 0 to `count` - 1 of a task with a `vary:`; without `count` the task as written, and the samples whose
    names (`pour[3]`) are in `named`."""
    if not case.varied:
        return (case,)
    if count is not None:
        return tuple(replace(case, sample=sample) for sample in range(count))
    beginning = f"{case.task}["
    words = (name.removeprefix(beginning).removesuffix("]") for name in named if name.startswith(beginning))
    numbers = {word.partition("-")[0] for word in words}
    chosen = {int(number) for number in numbers if number.isdecimal() and str(int(number)) == number}
    return (case, *(replace(case, sample=number) for number in sorted(chosen)))


def variants_of_case(case: Case, engines: Sequence[str], *, check_step: bool) -> tuple[Case, ...]:
    """The case in each engine, also at half the step with `check_step`, then their agreement; the case itself without.

    Without `engines`: the engine of the task.
    """
    if case.findings or not (engines or check_step):
        return (case,)
    tags = tuple(tag for tag in case.tags if not tag.startswith(ENGINE))
    variants = variants_of(engines or (case.engine,), check_step=check_step)
    runs = (replace(case, variant=variant, tags=(*tags, f"{ENGINE}{variant.engine}")) for variant in variants)
    return (*runs, replace(case, compared=variants, tags=(*tags, AGREEMENT)))


def shown_path(path: Path) -> str:
    """The path relative to the working directory if it is below it, else as given."""
    try:
        return str(path.absolute().relative_to(Path.cwd()))
    except ValueError:
        return str(path)


def is_named_task(path: Path) -> bool:
    """Whether a named file has the top-level key `task`, in any YAML form."""
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
    """Findings that prevent running a named file as a task; empty where there are none."""
    from manipcli.spec.load import read_bytes

    try:
        read_bytes(path)
    except InvalidInput as invalid:
        return invalid.findings
    if is_named_task(path):
        return ()
    message = "the file is not a task; expected a YAML file with the top-level keys `task` and `robot`"
    return (Diagnostic("USE105", message, Place(str(path), 1, 1)),)
