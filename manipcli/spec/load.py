"""Loading of task, robot and controllers files: text to tree to validated spec, with all errors at once."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.core.text import any_of, escape, listed, nearest_file
from manipcli.spec.base import Model
from manipcli.spec.condition import ID_HINT
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.counted import flat_names
from manipcli.spec.dropped import faults
from manipcli.spec.explain import distinct
from manipcli.spec.expression import substitute
from manipcli.spec.kind import names_controllers, refuse_description, refuse_other_kind
from manipcli.spec.located import Area, Located, Source, validate
from manipcli.spec.override import Override, apply, apply_to_steps, of_structure, read_overrides, seed_override
from manipcli.spec.partial.partial_controllers import salvage_controllers
from manipcli.spec.partial.partial_robot import salvage_robot
from manipcli.spec.partial.partial_task import salvage
from manipcli.spec.robot import Arguments, RobotSpec
from manipcli.spec.ros import rewrite
from manipcli.spec.ros.substitutions import open_substitutions, substituted
from manipcli.spec.source.tree import Entry, MappingNode, Node, ScalarNode, SequenceNode, child
from manipcli.spec.source.yaml import MAX_BYTES, parse
from manipcli.spec.structure.draft import FlatStep
from manipcli.spec.structure.expand import Expansion
from manipcli.spec.structure.files import Files, Find, TaskFile, no_files, within
from manipcli.spec.structure.flatten import flattened
from manipcli.spec.structure.include import included
from manipcli.spec.structure.reports import Reports
from manipcli.spec.task import TaskSpec

FileKind = Literal["task", "robot", "controllers"]
_NONE = "not a task, robot or controllers file"


def read_bytes(path: Path) -> bytes:
    """Reads a file that the user named.

    Raises:
        InvalidInput: USE101 missing; USE102 not a regular file; USE103 unreadable; YAML103 too large.
    """
    place = Place(str(path), 0, 0)
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            what = "a folder, not a file" if stat.S_ISDIR(status.st_mode) else "not a regular file"
            raise InvalidInput([Diagnostic("USE102", f"this is {what}", place)])
        if status.st_size > MAX_BYTES:
            raise InvalidInput([Diagnostic("YAML103", f"the file is larger than {MAX_BYTES // 1_000_000} MB", place)])
        return path.read_bytes()
    except (OSError, ValueError) as error:
        if isinstance(error, OSError) and error.errno in (errno.ENOENT, errno.ENOTDIR):
            raise InvalidInput([Diagnostic("USE101", "there is no such file", place, hint=sibling(path))]) from None
        reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
        raise InvalidInput([Diagnostic("USE103", f"the file cannot be read: {reason}", place)]) from None


def sibling(path: Path) -> str | None:
    """Hint for a missing file: similar names in its folder."""
    try:
        names = sorted(entry.name for entry in os.scandir(path.parent))
    except OSError:
        return f"the folder '{path.parent}' does not exist either"
    close = nearest_file(path.name, names)
    return f"did you mean {any_of(close)}?" if close else f"files in the folder: {listed(names)}" if names else None


def kind_of(path: Path, *, types: Collection[str] | None = None) -> FileKind:
    """The kind of a file, by its top-level keys; any other mapping is a controllers file, as ROS writes them.

    Args:
        path: the file.
        types: our controller types. If given, a controllers file must name a controller of one of these types or of
            ROS.

    Raises:
        InvalidInput: the file cannot be read or is not a YAML mapping; with `types`, it is not of any kind.
    """
    found: list[Diagnostic] = []
    root = parse(read_bytes(path), str(path), ros=True, reported=found if types is None else None)
    if not isinstance(root, MappingNode) and found:
        raise InvalidInput(found)
    if not isinstance(root, MappingNode):
        raise InvalidInput([Diagnostic("USE104", _NONE, Place(str(path), 1, 1))])
    if "task" in root.entries or "steps" in root.entries:
        if types is not None:
            refuse_other_kind(root, str(path), "task")  # a sub-task
        return "task"
    # In a file of ROS `robot` may be a namespace.
    named = "robot" in root.entries and not isinstance(root.get("robot"), MappingNode)
    if named or "description" in root.entries:
        return "robot"
    wrapped = isinstance(root.get("controllers"), MappingNode)
    if types is not None and not wrapped and not names_controllers(root, types):
        raise InvalidInput([Diagnostic("USE104", _NONE, Place(str(path), 1, 1))])
    return "controllers"


def load_task(
    path: Path,
    *,
    model: type[TaskSpec],
    overrides: Sequence[str] = (),
    seed: int | None = None,
    find: Find | None = None,
) -> Located[TaskSpec]:
    """Loads a task file.

    Args:
        path: the file.
        model: the result of `unions.task_model`, with all verbs, conditions and expectations.
        overrides: values of `--set` for all three files; those of the other two are only parsed.
        seed: replaces `simulation.seed`.
        find: finds the sub-tasks and fragments that it names. Default: in the folder of the task and below.

    Raises:
        InvalidInput: every finding of the file and of the overrides.
    """
    find = find or within(path.parent)
    return load_task_text(read_bytes(path), str(path), model=model, overrides=overrides, seed=seed, find=find)


def load_task_text(
    text: str | bytes,
    name: str,
    *,
    model: type[TaskSpec],
    overrides: Sequence[str] = (),
    seed: int | None = None,
    find: Find = no_files,
) -> Located[TaskSpec]:
    """As `load_task`, from text; places call it `name`. By default, it cannot name sub-tasks and fragments."""
    source, findings = _task_source(text, name, model, overrides, seed, find)
    return validate(source, model, findings=findings)


def load_step_text(text: str, name: str, *, model: type[TaskSpec]) -> Located[TaskSpec]:
    """A step, as it is written in a task file, alone in a task that is empty otherwise; places call the text `name`.

    Raises:
        InvalidInput: every finding of the text.
    """
    in_text: list[Diagnostic] = []
    step, place = parse(text, name, reported=in_text), Place(name, 1, 1)
    entries = {key: Entry(place, ScalarNode("step", place)) for key in ("task", "robot", "controllers")}
    entries["steps"] = Entry(place, SequenceNode(() if step is None else (step,), place))
    written = Source(name, MappingNode(entries, place), "TASK")
    source, findings = _flat_source(written, in_text, model, (), None, no_files)
    return validate(source, model, findings=findings)


def task_source(path: Path, *, model: type[TaskSpec], find: Find) -> tuple[Source, list[Diagnostic]]:
    """The tree of a task file with flat steps, before it is validated, and its findings so far; see `load_task`.

    Raises:
        InvalidInput: the file cannot be read, or is not YAML.
    """
    return _task_source(read_bytes(path), str(path), model, (), None, find)


def salvage_task(
    path: Path,
    *,
    model: type[TaskSpec],
    overrides: Sequence[str],
    seed: int | None,
    find: Find | None = None,
) -> Located[TaskSpec] | None:
    """The valid part of a task file that `load_task` refused, for further checks; None if too little is left."""
    try:
        source, _ = _task_source(read_bytes(path), str(path), model, overrides, seed, find or within(path.parent))
    except InvalidInput:
        return None
    return salvage(source, model)


def _task_source(
    text: str | bytes, name: str, model: type[TaskSpec], overrides: Sequence[str], seed: int | None, find: Find
) -> tuple[Source, list[Diagnostic]]:
    """The tree of a task after overrides and parameters, and their diagnostics."""
    written, in_text = _source(text, name, "TASK", "task")
    return _flat_source(written, in_text, model, overrides, seed, find)


def _flat_source(
    written: Source,
    in_text: Sequence[Diagnostic],
    model: type[TaskSpec],
    overrides: Sequence[str],
    seed: int | None,
    find: Find,
) -> tuple[Source, list[Diagnostic]]:
    """The tree of a task with flat steps, from its tree as written and the diagnostics of its text."""
    name = written.name
    wanted = (*read_overrides(overrides), *(() if seed is None else (seed_override(seed),)))
    of_files, others, late = of_structure(wanted)
    source, findings = _changed(written, of_files, model)
    reports, task = Reports(), TaskFile(Path(name), name)
    files = Files(find, _tree, reports)
    source, more = _changed(replace(source, root=included(source.root, files, task)), others, model)
    findings += more
    refused = {finding.place for finding in in_text if finding.place is not None}
    root, scope = substitute(source.root, refused=refused)
    scene = child(root, "scene")
    bodies = tuple(flat_names(scene)) if isinstance(scene, MappingNode) else ()

    def change(steps: Sequence[FlatStep]) -> tuple[FlatStep, ...]:
        changed, wrong = apply_to_steps(steps, late, model)
        findings.extend(wrong)
        return changed

    root, structure = flattened(root, scope, Expansion(model.verbs, reports, files, bodies, task), change)
    source = Source(name, root, "TASK", unknown=frozenset(scope.unknown), structure=structure)
    of_steps = [*scope.findings, *reports.findings]
    if any(finding.severity == "error" for finding in of_steps):  # what seems unused may be used where it is misspelt
        of_steps = [finding for finding in of_steps if finding.code != "TASK272"]
    found = [*in_text, *findings, *of_steps, *_duplicate_ids(source), *faults(source, model)]
    return source, [*distinct(found)]


def _tree(path: Path, name: str) -> tuple[Node | None, list[Diagnostic]]:
    """The tree of a sub-task or fragment, and the findings on its text."""
    findings: list[Diagnostic] = []
    return parse(read_bytes(path), name, reported=findings), findings


def _duplicate_ids(source: Source) -> Iterator[Diagnostic]:
    """Duplicate ids of steps, or of expectations and watches; checked on the tree, so that no other error hides
    them."""
    judged: dict[str, str] = {}
    for key, why, first in (
        ("steps", "ids name steps in the log", dict[str, str]()),
        ("expect", "ids name expectations", judged),
        ("watch", "expectations and watches share their ids", judged),
    ):
        items = None if key == "steps" and source.structure.steps else child(source.root, key)
        for k, item in enumerate(items.items if isinstance(items, SequenceNode) else ()):
            own = child(item, "id")
            if not isinstance(own, ScalarNode) or not isinstance(own.value, str):
                continue
            if key == "steps" and "/" in own.value:
                yield source.finding(208, (key, k, "id"), f"'{escape(own.value)}' is not a valid id", hint=ID_HINT)
            if own.value in first:
                message = f"duplicate id '{escape(own.value)}': {first[own.value]} has it already"
                yield source.finding(210, (key, k, "id"), message, hint=f"choose another: {why}")
            first.setdefault(own.value, f"{key}[{k}]")


def load_robot(path: Path, *, overrides: Sequence[str] = (), model: type[RobotSpec] = RobotSpec) -> Located[RobotSpec]:
    """Loads a robot file; uses the overrides that begin with `robot.`.

    Args:
        path: the file.
        overrides: values of `--set`.
        model: the result of `unions.robot_model`; `RobotSpec` itself knows no type of sensors.
    """
    return load_robot_text(read_bytes(path), str(path), overrides=overrides, model=model)


def load_robot_text(
    text: str | bytes, name: str, *, overrides: Sequence[str] = (), model: type[RobotSpec] = RobotSpec
) -> Located[RobotSpec]:
    """As `load_robot`, from text; places call it `name`."""
    source, findings = _robot_source(text, name, overrides, model)
    return validate(source, model, findings=findings)


def _robot_source(
    text: str | bytes, name: str, overrides: Sequence[str], model: type[RobotSpec]
) -> tuple[Source, list[Diagnostic]]:
    written, in_text = _source(text, name, "ROBOT", "robot")
    source, findings = _changed(written, read_overrides(overrides), model)
    return source, [*in_text, *findings]


def salvage_robot_file(
    path: Path, *, overrides: Sequence[str], model: type[RobotSpec] = RobotSpec
) -> Located[RobotSpec] | None:
    """The valid part of a robot file that `load_robot` refused, for further checks; None if too little is left."""
    try:
        source, _ = _robot_source(read_bytes(path), str(path), overrides, model)
    except InvalidInput:
        return None
    return salvage_robot(source, model)


def load_controllers(
    path: Path, *, model: type[ControllersSpec], overrides: Sequence[str] = (), args: Arguments | None = None
) -> Located[ControllersSpec]:
    """Loads a controllers file in our form or in a form of ROS.

    Args:
        path: the file.
        model: the result of `unions.controllers_model`, with all types of controllers.
        overrides: values of `--set`; those that begin with `controllers.` are used.
        args: values of `$(var NAME)`, from the robot file; None: there is no robot file, and an open substitution is
            a warning instead of an error.
    """
    return load_controllers_text(read_bytes(path), str(path), model=model, overrides=overrides, args=args)


def load_controllers_text(
    text: str | bytes,
    name: str,
    *,
    model: type[ControllersSpec],
    overrides: Sequence[str] = (),
    args: Arguments | None = None,
) -> Located[ControllersSpec]:
    """As `load_controllers`, from text; places call it `name`."""
    source, findings = _controllers_source(text, name, model, overrides, args)
    return validate(source, model, findings=[*findings, *open_substitutions(source.root, args)])


def _controllers_source(
    text: str | bytes, name: str, model: type[ControllersSpec], overrides: Sequence[str], args: Arguments | None
) -> tuple[Source, list[Diagnostic]]:
    written, in_text = _source(text, name, "CTRL", "controllers")
    root, more = rewrite(substituted(written.root, args or {}), model.types)
    source, findings = _changed(Source(name, root, "CTRL"), read_overrides(overrides), model)
    return source, [*in_text, *more, *findings]


def salvage_controllers_file(
    path: Path, *, model: type[ControllersSpec], overrides: Sequence[str], args: Arguments | None = None
) -> Located[ControllersSpec] | None:
    """The valid part of a controllers file that `load_controllers` refused; None if too little is left."""
    try:
        source, _ = _controllers_source(read_bytes(path), str(path), model, overrides, args)
    except InvalidInput:
        return None
    return salvage_controllers(source, model)


def _source(text: str | bytes, name: str, area: Area, kind: FileKind | None = None) -> tuple[Source, list[Diagnostic]]:
    """The tree of a file, and the diagnostics of its text."""
    if kind is not None:
        refuse_description(name, kind)
    findings: list[Diagnostic] = []
    root: Node | None = parse(text, name, ros=area == "CTRL", reported=findings)
    if kind is not None and root is not None:
        refuse_other_kind(root, name, kind)
    return Source(name, MappingNode({}, Place(name, 1, 1)) if root is None else root, area), findings


def _changed(source: Source, overrides: Sequence[Override], model: type[Model]) -> tuple[Source, list[Diagnostic]]:
    if not isinstance(source.root, MappingNode) or not source.root.entries:
        return source, []
    root, findings = apply(source.root, overrides, model, source.area)
    return Source(source.name, root, source.area), findings
