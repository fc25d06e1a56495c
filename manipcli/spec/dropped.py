"""Steps of branches that are never taken, since a condition on parameters is decided: their errors are reported, too.

Values that come from a parameter are not reported: the branch may be left out because of them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import replace
from typing import Final

from pydantic import ValidationError

from manipcli.core.errors import Diagnostic, Place
from manipcli.spec.explain import explain
from manipcli.spec.located import Located, Source
from manipcli.spec.source.tree import Entry, MappingNode, Node, ScalarNode, mapped
from manipcli.spec.structure.structure import Structure
from manipcli.spec.task import TaskSpec

_REQUIRED: Final = ("task", "robot", "controllers")


def dropped_source(source: Source) -> Source | None:
    """The dropped steps as a task of their own; None without any."""
    left = source.structure.left
    if left is None or not left.items:
        return None
    place = left.place
    entries = {key: Entry(place, ScalarNode("x", place)) for key in _REQUIRED}
    root = MappingNode({**entries, "steps": Entry(place, left)}, place)
    return replace(source, root=root, kept={}, whole=None, structure=Structure(source.structure.dropped))


def faults(source: Source, model: type[TaskSpec]) -> list[Diagnostic]:
    """The errors of the dropped steps by themselves."""
    dropped = dropped_source(source)
    if dropped is None:
        return []
    try:
        model.model_validate(dropped.plain())
    except ValidationError as error:
        found = explain(error, dropped.root, model, source.area, in_file=dropped.in_file)
        return list(but_computed(found, dropped.root))
    return []


def dropped_steps(task: Located[TaskSpec]) -> Located[TaskSpec] | None:
    """The dropped steps of a valid task; None without any, or if they are invalid."""
    source = dropped_source(task.source)
    if source is None:
        return None
    try:
        return Located(type(task.spec).model_validate(source.plain()), source)
    except ValidationError:
        return None


def but_computed(findings: Iterable[Diagnostic], root: Node) -> Iterable[Diagnostic]:
    """The findings that are not at a value from a parameter."""
    places = computed_places(root)
    return (finding for finding in findings if finding.place not in places)


def computed_places(root: Node) -> Collection[Place]:
    """Places of the values that come from a parameter."""
    places: set[Place] = set()

    def note(node: ScalarNode, _: object) -> Node:
        if node.written is not None:
            places.add(node.place)
        return node

    mapped(root, note)
    return places
