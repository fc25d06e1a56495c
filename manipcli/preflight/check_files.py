"""The findings of files, and the names and schemas of file formats, for `check`, `list` and `schema`."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

from manipcli.conditions.members import CONDITIONS
from manipcli.control.controllers import CONTROLLERS
from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.description.lint.checks import CHECKS
from manipcli.description.lint.inspection import DESCRIPTIONS, inspect
from manipcli.plan.steps import STEPS
from manipcli.preflight.findings import preflight_findings
from manipcli.preflight.robot_findings import robot_findings
from manipcli.scene.overlap_hints import SHAPES
from manipcli.simulate.engines import ENGINES
from manipcli.spec import load
from manipcli.spec.condition import COMBINATIONS, QUANTIFIERS
from manipcli.spec.schema import controllers_schema, robot_schema, task_schema
from manipcli.spec.source.tree import Plain
from manipcli.spec.structure.words import WORDS
from manipcli.task.lint import lint
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import Plan
from manipcli.task.robot_file import read_robot
from manipcli.task.task import Task
from manipcli.task.task_names import task_names
from manipcli.task.vocabulary import controllers_spec, robot_spec, task_spec


def check_files(
    paths: Sequence[Path],
    *,
    overrides: Sequence[str] = (),
    seed: int | None = None,
    sample: int | None = None,
    package_path: Sequence[Path] = (),
    allow_outside: bool = False,
    on_progress: Callable[[str], None] = lambda _: None,
    on_plan: Callable[[Path, Plan], None] = lambda *_: None,
) -> tuple[Diagnostic, ...]:
    """The findings of all files, without duplicates; a task is checked with its robot and controllers files.

    Args:
        paths: task, robot and controllers files, URDF and xacro.
        overrides, seed, sample: for the tasks, see `load_task`.
        package_path: folders with packages.
        allow_outside: whether a file may be outside of these folders.
        on_progress: receives what the planner tries, see `plan_task`.
        on_plan: receives the plan of each task, and its file.
    """

    def of_task(path: Path) -> Task:
        return load_task(
            path, overrides=overrides, seed=seed, sample=sample, package_path=package_path, allow_outside=allow_outside
        )

    return tuple(
        dict.fromkeys(
            finding
            for path in paths
            for finding in _findings(path, of_task, package_path, allow_outside, on_progress, partial(on_plan, path))
        )
    )


def _findings(
    path: Path,
    of_task: Callable[[Path], Task],
    package_path: Sequence[Path],
    allow_outside: bool,
    on_progress: Callable[[str], None],
    on_plan: Callable[[Plan], None],
) -> tuple[Diagnostic, ...]:
    try:
        if path.suffix.lower() in DESCRIPTIONS:
            return inspect(path, package_path=package_path, allow_outside=allow_outside).examination.findings
        kind = load.kind_of(path)
        if kind == "task":
            task = of_task(path)
            preflight = preflight_findings(task, margins=True, on_progress=on_progress, on_plan=on_plan)
            return (*task.findings, *lint(task), *preflight)
        if kind == "controllers":
            return load.load_controllers(path, model=controllers_spec()).findings
        file, robot, findings = read_robot(path, package_path=package_path, allow_outside=allow_outside)
        return (*findings, *robot_findings(file, robot))
    except InvalidInput as invalid:
        return invalid.findings


def kind_of(path: Path) -> load.FileKind | None:
    """The kind of a file: task, robot or controllers; None if it is another or cannot be read."""
    try:
        return load.kind_of(path, types=CONTROLLERS.names)
    except InvalidInput:
        return None


def words(kind: str) -> tuple[str, ...]:
    """The names in files (`steps`, `expectations`, `conditions`, `shapes`, `engines`), or the codes of `checks`."""
    known = {
        "steps": (*STEPS.names, *WORDS),
        "expectations": (*CONDITIONS.names, *COMBINATIONS, *QUANTIFIERS),
        "conditions": (*CONDITIONS.names, *COMBINATIONS),
        "shapes": SHAPES,
        "engines": ENGINES.names,
        "checks": tuple(check.code for check in CHECKS),
    }
    return known[kind]


def schema(
    kind: load.FileKind, *, task: Path | None = None, package_path: Sequence[Path] = (), allow_outside: bool = False
) -> Mapping[str, Plain]:
    """The JSON Schema of a kind of file.

    Args:
        kind: of the file.
        task: with the names of this task; for the kind `task`.
        package_path, allow_outside: where the files of its robot may be.

    Raises:
        InvalidInput: the task cannot be read.
    """
    names = None
    if task is not None:
        names = task_names(task, package_path=package_path, allow_outside=allow_outside)
    texts: dict[load.FileKind, Callable[[], str]] = {
        "task": lambda: task_schema(task_spec(), names),
        "robot": lambda: robot_schema(robot_spec()),
        "controllers": lambda: controllers_schema(controllers_spec()),
    }
    parsed: Mapping[str, Plain] = json.loads(texts[kind]())
    return parsed
