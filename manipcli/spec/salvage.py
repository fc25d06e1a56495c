"""What remains of a task once everything that is wrong in it is left out: so that the rest can be checked, too.

The places stay those of the file. Nothing salvaged is ever planned or run.
"""

from __future__ import annotations

from pydantic import ValidationError

from manipcli.core.errors import Place
from manipcli.spec.located import Located, Source
from manipcli.spec.task import TaskSpec
from manipcli.spec.tree import Entry, MappingNode, Node, Path, ScalarNode, SequenceNode, plain

LISTS = ("steps", "expect", "watch")
"""Their faulty items are left out one by one."""
NAMED = ("scene", "frames")
"""Their faulty entries are replaced by a stand-in, since others may speak of them by name."""
KEPT = ("task", "robot", "controllers")
"""Without these there is nothing to check."""


def salvage(source: Source, model: type[TaskSpec]) -> Located[TaskSpec] | None:
    """The task without its faulty steps and expectations, and with a stand-in for each faulty body or frame.

    Returns:
        None where nothing coherent remains.
    """
    root = source.root
    if not isinstance(root, MappingNode):
        return None
    kept: dict[str, tuple[int, ...]] = {}
    for _ in range(2):  # what pydantic looks at late shows only once the rest is in order
        try:
            return Located(model.model_validate(plain(root)), Source(source.name, root, source.area, kept))
        except ValidationError as error:
            root = _without(root, [one["loc"] for one in error.errors(include_url=False)], kept)
    return None


def _without(root: MappingNode, faults: list[Path], kept: dict[str, tuple[int, ...]]) -> MappingNode:
    """The tree without what the faults are in; `kept` follows which items of the file remain."""
    items = {(fault[0], fault[1]) for fault in faults if len(fault) > 1 and fault[0] in (*LISTS, *NAMED)}
    for name in LISTS:
        entry = root.entries.get(name)
        if entry is not None and isinstance(entry.node, SequenceNode):
            remaining = [k for k in range(len(entry.node.items)) if (name, k) not in items]
            before = kept.get(name, tuple(range(len(entry.node.items))))
            kept[name] = tuple(before[k] for k in remaining)
            nodes = tuple(entry.node.items[k] for k in remaining)
            root = root.with_entry(name, Entry(entry.key_place, SequenceNode(nodes, entry.node.place)))
    for name in NAMED:
        entry = root.entries.get(name)
        if entry is not None and isinstance(entry.node, MappingNode):
            block = entry.node
            for key, old in block.entries.items():
                if (name, key) in items:
                    block = block.with_entry(key, Entry(old.key_place, _stand_in(name, old.node.place)))
            root = root.with_entry(name, Entry(entry.key_place, block))
    whole = {str(fault[0]) for fault in faults if fault and fault[0] not in (*LISTS, *NAMED, *KEPT)}
    return root.without(*whole)


def _stand_in(block: str, place: Place) -> Node:
    """A frame at the origin, or a body of no account."""
    if block == "frames":
        return MappingNode({}, place)
    radius = MappingNode({"radius": Entry(place, ScalarNode(1.0, place))}, place)
    pose = MappingNode({}, place)
    return MappingNode({"sphere": Entry(place, radius), "pose": Entry(place, pose)}, place)
