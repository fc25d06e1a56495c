"""What remains of a task once everything that is wrong in it is left out: so that the rest can be checked, too.

The places stay those of the file. Nothing salvaged is ever planned or run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from pydantic import ValidationError

from manipcli.core.errors import Diagnostic, Loc
from manipcli.core.text import nearest
from manipcli.spec.explain import explain
from manipcli.spec.located import Located, Source
from manipcli.spec.override import step_ids
from manipcli.spec.source.tree import Entry, MappingNode, Node, ScalarNode, SequenceNode, child, node_at, without
from manipcli.spec.task import StepSpec, TaskSpec

LISTS = ("steps", "expect", "watch")
"""Their faulty items are left out one by one."""
NAMED = ("scene", "frames")
"""Their faulty entries are replaced by a stand-in, since others may speak of them by name."""
KEPT = ("task", "robot", "controllers")
"""Without these there is no task: a text stands in for them."""
REFERENCES = ("rests_on", "inside", "parent")
"""The names that a stand-in still speaks of."""
CLOCK = ("step", "control_period")
"""One says nothing without the other."""
_ROUNDS = 4
"""What pydantic looks at late shows only once the rest is in order, and what a block needs only once it is short."""


def salvage(source: Source, model: type[TaskSpec]) -> Located[TaskSpec] | None:
    """The task without its faulty steps and expectations, and with a stand-in for each faulty body or frame.

    Returns:
        With the errors as `findings` that showed only when the others were out of the way; None where nothing coherent
        remains.
    """
    root = source.root
    if not isinstance(root, MappingNode):
        return None
    kept: dict[str, tuple[int, ...]] = {}
    late: list[Diagnostic] = []
    for number in range(_ROUNDS):
        left = replace(source, root=root, kept=kept, whole=source.root)
        try:
            return Located(model.model_validate(left.plain()), left, tuple(late))
        except ValidationError as error:
            faults = [one["loc"] for one in error.errors(include_url=False)]
            if number and faults == [()] and left.untouched("simulation", "control_period"):
                late += explain(error, root, model, source.area)
            faults, root = (faults, root) if number else _without_fields(root, faults)
            root = _without(root, faults, kept)
    return None


def intended_ids(source: Source, verbs: Sequence[str]) -> tuple[str, ...]:
    """The ids that the steps of the whole file would have, those that were left out with the verbs nearest to theirs.

    Of a step whose verb cannot be known (none, or several), every id that it could get.
    """
    steps = child(source.root if source.whole is None else source.whole, "steps")
    items = steps.items if isinstance(steps, SequenceNode) else ()
    known: list[Node] = []
    for item in items:
        if isinstance(item, MappingNode):
            words = [word for word in item.entries if word not in StepSpec.model_fields]
        else:
            words = [item.value] if isinstance(item, ScalarNode) and isinstance(item.value, str) else []
        if len(words) == 1:
            word = next(iter(nearest(words[0], verbs)), words[0])
            entries = {"id": item.entries["id"]} if isinstance(item, MappingNode) and "id" in item.entries else {}
            known.append(MappingNode({**entries, word: Entry(item.place, item)}, item.place))
        elif isinstance(child(item, "id"), ScalarNode):
            known.append(item)
    ids = step_ids(SequenceNode(tuple(known), source.root.place))
    more = len(items) - len(known)
    counts = {verb: sum(verb in node.entries for node in known if isinstance(node, MappingNode)) for verb in verbs}
    possible = (f"{verb}_{number}" for verb in verbs for number in range(1, counts[verb] + more + 1) if more)
    return tuple(dict.fromkeys((*ids, *possible)))


def _without_fields(root: MappingNode, faults: list[Loc]) -> tuple[list[Loc], MappingNode]:
    """The tree without the faulty fields of steps, and the faults that are elsewhere: the names in the other fields are
    still to be checked. A step that cannot be without its field is faulty again, and is left out then."""
    steps = root.get("steps")
    if not isinstance(steps, SequenceNode):
        return faults, root
    items, others = [*steps.items], []
    for fault in faults:
        field = fault[3:5] if fault[:1] == ("steps",) else ()  # behind the number of the step and which kind it is
        item = items[int(fault[1])] if field else None
        if fault == ("steps",) and len(faults) > 1:
            continue  # none of the steps was sound; if none is now, that is told again
        if not isinstance(item, MappingNode) or field[0] in ("until", "on_fail", "id"):
            others.append(fault)
        elif node_at(item, field) is not node_at(item, field[:-1]):  # of a value that may be this or that, once
            items[int(fault[1])] = without(item, field)
    return others, root.with_node("steps", SequenceNode(tuple(items), steps.place))


def _without(root: MappingNode, faults: list[Loc], kept: dict[str, tuple[int, ...]]) -> MappingNode:
    """The tree without what the faults are in; `kept` follows which items of the file remain."""
    heads = {str(fault[0]) for fault in faults if len(fault) == 1}
    if heads & {*NAMED}:  # which names there are is not known
        heads |= {*LISTS, "frames"}
    items = {(fault[0], fault[1]) for fault in faults if len(fault) > 1 and fault[0] in (*LISTS, *NAMED)}
    for name in LISTS:
        block = root.get(name)
        if isinstance(block, SequenceNode):
            remaining = [k for k in range(len(block.items)) if (name, k) not in items and name not in heads]
            before = kept.get(name, tuple(range(len(block.items))))
            kept[name] = tuple(before[k] for k in remaining)
            root = root.with_node(name, SequenceNode(tuple(block.items[k] for k in remaining), block.place))
    steps = root.get("steps")
    if not isinstance(steps, SequenceNode) or not steps.items:
        root = root.with_node("steps", _nothing_to_do(root if steps is None else steps))
        kept["steps"] = (0,)
    for name in NAMED:
        block = root.get(name)
        if isinstance(block, MappingNode):
            for key, old in block.entries.items():
                if (name, key) in items:
                    block = block.with_node(key, _stand_in(name, old.node))
            root = root.with_node(name, block)
    for fault in faults:
        head = "record" if not fault else str(fault[0])  # of the whole task only the rates are looked at
        block = root.get(head)
        if head in KEPT:
            root = root.with_node(head, ScalarNode("left out", root.place))
        elif head == "simulation" and isinstance(block, MappingNode) and fault[1:2] in ((), *((w,) for w in CLOCK)):
            root = root.with_node(head, block.without(*CLOCK))
        elif not fault or head not in (*LISTS, *NAMED):
            root = without(root, (head, *fault[1:2]))
    return root.without(*(heads & {"frames", "scene", "expect", "watch"}))


def _nothing_to_do(at: Node) -> Node:
    """The least that a task may do."""
    wait = MappingNode({"wait": Entry(at.place, ScalarNode(0.0, at.place))}, at.place)
    return SequenceNode((wait,), at.place)


def _stand_in(block: str, faulty: Node) -> Node:
    """A frame, or a body of no account, that refers to what the faulty one does."""
    place = faulty.place
    entries: dict[str, Entry] = {}
    for word in REFERENCES[2:] if block == "frames" else REFERENCES[:2]:
        named = child(faulty, word)
        if isinstance(named, ScalarNode) and isinstance(named.value, str):
            entries[word] = Entry(place, named)
    if block == "scene":
        radius = MappingNode({"radius": Entry(place, ScalarNode(1.0, place))}, place)
        entries["sphere"] = Entry(place, radius)
    return MappingNode(entries, place)
