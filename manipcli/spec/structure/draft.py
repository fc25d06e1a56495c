"""Steps and blocks while the structure of a task is expanded, and their nodes in the flat tree."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from manipcli.core.errors import Loc
from manipcli.spec.block import BlockKind
from manipcli.spec.expression import Scope
from manipcli.spec.source.tree import Entry, MappingNode, Node, Scalar, ScalarNode, mapped
from manipcli.spec.structure.words import COMMON


@dataclass(frozen=True, slots=True)
class FlatStep:
    """A step of the flat list: its item before parameters, where it is written, and the parameters there."""

    item: Node
    id: str
    at: Loc
    scope: Scope

    def node(self) -> Node:
        """The step with its id and computed values."""
        return identified(mapped(self.item, self.scope.computed, self.at), self.id)


@dataclass(slots=True)
class BlockDraft:
    """A block whose end is not known yet; see `BlockSpec`. `item` holds its `until`, `timeout` and `on_fail`; `given`:
    the parameters that it adds as a round or a sub-task."""

    id: str
    kind: BlockKind
    word: str
    at: Loc
    item: MappingNode
    scope: Scope
    parent: int | None
    first: int
    last: int = 0
    split: int = -1
    condition: Node | None = None
    is_round: bool = False
    given: Mapping[str, Node] = field(default_factory=dict)

    def node(self) -> Node:
        """The block for `BlockSpec`; a round has none of the keys of its `repeat`."""
        place = self.item.place
        values: dict[str, Scalar] = {
            "id": self.id, "kind": self.kind, "word": self.word, "first": self.first, "last": self.last,
            "split": self.split, "parent": self.parent,
        }  # fmt: skip
        entries = {key: Entry(place, ScalarNode(value, place)) for key, value in values.items()}
        if self.condition is not None:
            entries["condition"] = Entry(self.item.entries["if"].key_place, self.condition)
        for key in () if self.is_round else COMMON[1:]:
            entry = self.item.entries.get(key)
            if entry is not None:
                entries[key] = Entry(entry.key_place, mapped(entry.node, self.scope.computed, (*self.at, key)))
        return MappingNode(entries, place)


def identified(item: Node, own: str) -> Node:
    """A step with this id; the place of an id that it has stays."""
    if not isinstance(item, MappingNode):
        return item
    before = item.entries.get("id")
    place = item.place if before is None else before.node.place
    return item.with_entry("id", Entry(place if before is None else before.key_place, ScalarNode(own, place)))
