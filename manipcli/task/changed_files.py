"""The three files of a task with varied values, and the values of `vary:` that they refuse."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import TypeVar, get_args

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.judge.drawn import Number
from manipcli.spec.base import Model
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.located import Area, Located, validate
from manipcli.spec.override import Override, apply
from manipcli.spec.robot import RobotSpec
from manipcli.spec.source.tree import Node, ScalarNode, SequenceNode
from manipcli.spec.task import TaskSpec
from manipcli.task.vary import Varied, bind

M = TypeVar("M", bound=Model)

INSIDE = 1e-9
"""Distance from the ends of a uniform law, as a share of its width, that is certainly drawn."""
Changes = Sequence[tuple[Varied, Number]]


@dataclass(frozen=True, slots=True)
class Files:
    """The three files of a task."""

    task: Located[TaskSpec]
    robot: Located[RobotSpec]
    controllers: Located[ControllersSpec]

    def changed(self, changes: Changes) -> Files:
        """The files with these values.

        Raises:
            InvalidInput: a value is refused; the place is its entry in `vary:`.
        """
        overrides = [
            Override(
                quantity.area,
                quantity.parts,
                _node(value, place := self.task.source.key_place("vary", quantity.key)),
                place,
            )
            for quantity, value in changes
        ]
        return Files(
            _changed(self.task, overrides), _changed(self.robot, overrides), _changed(self.controllers, overrides)
        )


def bound(files: Files) -> tuple[Varied, ...]:
    """All varied quantities of a task, in the order of its file.

    Raises:
        InvalidInput: all keys and ranges of `vary:` that the files refuse.
    """
    varied, wrong = bind(files.task, files.robot, files.controllers)
    findings = (*wrong, *out_of_range(files, varied))
    if findings:
        raise InvalidInput(findings)
    return varied


def out_of_range(files: Files, varied: Sequence[Varied]) -> tuple[Diagnostic, ...]:
    """Errors for ends and items of each law that the fields of the files refuse; a normal law has no ends.

    The laws are tested together, end by end (a shorter law repeats its last one), so that fields that constrain each
    other are not tested against values that are never drawn.
    """
    written = {files.task.source.key_place("vary", quantity.key) for quantity in varied}

    def refused(area: Area, k: int, inside: float) -> tuple[Diagnostic, ...]:
        ends = ((quantity, quantity.ends(inside)) for quantity in varied if quantity.area == area)
        try:
            files.changed([(quantity, values[min(k, len(values) - 1)]) for quantity, values in ends if values])
        except InvalidInput as invalid:
            return tuple(
                finding for finding in invalid.findings if finding.severity == "error" and finding.place in written
            )
        return ()

    found: list[Diagnostic] = []
    for area, k in product(get_args(Area), range(max((len(quantity.ends()) for quantity in varied), default=0))):
        at_ends = refused(area, k, 0.0)
        # The ends themselves are never drawn: a mass from [0, 1 kg] is above 0.
        places = {finding.place for finding in refused(area, k, INSIDE)} if at_ends else set()
        found += [
            replace(finding, message=f"{finding.message} (a value that `vary` may draw)")
            for finding in at_ends
            if finding.place in places
        ]
    return tuple(dict.fromkeys(found))


def _changed(file: Located[M], overrides: Iterable[Override]) -> Located[M]:
    source = file.source
    mine = [override for override in overrides if override.area == source.area]
    if not mine:
        return file
    root, findings = apply(source.root, mine, type(file.spec), source.area)
    return validate(replace(source, root=root), type(file.spec), findings=[*file.findings, *findings])


def _node(value: Number, place: Place) -> Node:
    if isinstance(value, tuple):
        return SequenceNode(tuple(ScalarNode(number, place) for number in value), place)
    return ScalarNode(value, place)
