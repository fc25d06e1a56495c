"""The three files of a task with other numbers in them, and what of a `vary:` they would refuse."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import TypeVar, get_args

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.judge.drawn import Number
from manipcli.spec.base import Model
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.located import Area, Located, Source, validate
from manipcli.spec.override import Override, apply
from manipcli.spec.robot import RobotSpec
from manipcli.spec.source.tree import Node, ScalarNode, SequenceNode
from manipcli.spec.task import TaskSpec
from manipcli.task.vary import Varied, bind

M = TypeVar("M", bound=Model)

INSIDE = 1e-9
"""Share of a uniform law between its end and what is surely drawn."""
Changes = Sequence[tuple[Varied, Number]]


@dataclass(frozen=True, slots=True)
class Files:
    """The three files of a task."""

    task: Located[TaskSpec]
    robot: Located[RobotSpec]
    controllers: Located[ControllersSpec]

    def changed(self, changes: Changes) -> Files:
        """With these values in their places.

        Raises:
            InvalidInput: one of them is refused; told where it is varied.
        """
        overrides = [
            Override(one.area, one.parts, _node(value, place := self.task.source.key_place("vary", one.key)), place)
            for one, value in changes
        ]
        return Files(
            _changed(self.task, overrides), _changed(self.robot, overrides), _changed(self.controllers, overrides)
        )


def bound(files: Files) -> tuple[Varied, ...]:
    """Everything that the task varies, in the order of its file.

    Raises:
        InvalidInput: every key and every range of `vary:` that the files refuse.
    """
    varied, wrong = bind(files.task, files.robot, files.controllers)
    findings = (*wrong, *out_of_range(files, varied))
    if findings:
        raise InvalidInput(findings)
    return varied


def out_of_range(files: Files, varied: Sequence[Varied]) -> tuple[Diagnostic, ...]:
    """What the fields of the files refuse of the ends and items of each law; a normal law has no ends.

    All laws take their ends together, the shorter ones their last one again, so that fields which must fit each other
    are not compared with values that are never drawn.
    """
    written = {files.task.source.key_place("vary", one.key) for one in varied}

    def refused(area: Area, k: int, inside: float) -> tuple[Diagnostic, ...]:
        ends = ((one, one.ends(inside)) for one in varied if one.area == area)
        try:
            files.changed([(one, values[min(k, len(values) - 1)]) for one, values in ends if values])
        except InvalidInput as invalid:
            return tuple(one for one in invalid.findings if one.severity == "error" and one.place in written)
        return ()

    found: list[Diagnostic] = []
    for area, k in product(get_args(Area), range(max((len(one.ends()) for one in varied), default=0))):
        told = refused(area, k, 0.0)
        # The ends themselves are never drawn: a mass from [0, 1 kg] is above 0.
        places = {finding.place for finding in refused(area, k, INSIDE)} if told else set()
        found += [replace(one, message=f"{one.message}, which may be drawn") for one in told if one.place in places]
    return tuple(dict.fromkeys(found))


def _changed(file: Located[M], overrides: Iterable[Override]) -> Located[M]:
    source = file.source
    mine = [one for one in overrides if one.area == source.area]
    if not mine:
        return file
    root, findings = apply(source.root, mine, type(file.spec), source.area)
    return validate(
        Source(source.name, root, source.area, source.kept), type(file.spec), findings=[*file.findings, *findings]
    )


def _node(value: Number, place: Place) -> Node:
    if isinstance(value, tuple):
        return SequenceNode(tuple(ScalarNode(one, place) for one in value), place)
    return ScalarNode(value, place)
