"""Ids of the items in a list of steps: given, or the verb and the next free number."""

from __future__ import annotations

from collections.abc import Sequence

from manipcli.spec.source.tree import Node, ScalarNode, SequenceNode, child
from manipcli.spec.structure.words import verb_of


def step_ids(steps: SequenceNode) -> tuple[str, ...]:
    """The ids of the steps and blocks in a list, given or generated."""
    return own_ids(steps.items)


def own_ids(items: Sequence[Node]) -> tuple[str, ...]:
    """As `step_ids`. A generated id is never one that is given."""
    given = {node.value for item in items if isinstance(node := child(item, "id"), ScalarNode)}
    counts: dict[str, int] = {}
    ids: list[str] = []
    for item in items:
        own = child(item, "id")
        verb = verb_of(item)
        number = counts.get(verb, 0) + 1
        is_named = isinstance(own, ScalarNode) and isinstance(own.value, str)
        while not is_named and f"{verb}_{number}" in given:
            number += 1
        counts[verb] = number
        ids.append(str(own.value) if isinstance(own, ScalarNode) and is_named else f"{verb}_{number}")
    return tuple(ids)
