"""The valid part of a faulty task file, so that the rest can be checked, too.

Places stay those of the file; the result is never planned or run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from pydantic import ValidationError

from manipcli.core.errors import Diagnostic, Loc
from manipcli.core.text import nearest
from manipcli.spec.explain import explain
from manipcli.spec.located import Located, Source
from manipcli.spec.source.tree import Entry, MappingNode, Node, ScalarNode, SequenceNode, child, node_at, without
from manipcli.spec.step import StepSpec
from manipcli.spec.structure.ids import step_ids
from manipcli.spec.task import TaskSpec

LISTS = ("steps", "expect", "watch")
"""Lists whose invalid items are removed one by one."""
NAMED = ("scene", "frames")
"""Mappings whose invalid entries become placeholders, since other entries may refer to them."""
KEPT = ("task", "robot", "controllers")
"""Required keys: an invalid value becomes a placeholder."""
REFERENCES = ("rests_on", "inside", "parent")
"""Names that a placeholder keeps."""
CLOCK = ("step", "control_period")
"""Keys that are only valid together."""
_ROUNDS = 4
"""Pydantic reports some errors only once others are removed."""


def salvage(source: Source, model: type[TaskSpec]) -> Located[TaskSpec] | None:
    """The task without its invalid steps and expectations, with a placeholder for each invalid body or frame.

    Returns:
        The task, whose `findings` are errors that appeared only after the others were removed; None if nothing valid
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
            faults = [fault["loc"] for fault in error.errors(include_url=False)]
            if number and faults == [()] and left.untouched("simulation", "control_period"):
                late += explain(error, root, model, source.area, in_file=left.in_file)
            faults, root = (faults, root) if number else _without_fields(root, faults)
            root = _without(root, faults, kept)
    return None


def intended_ids(source: Source, verbs: Sequence[str]) -> tuple[str, ...]:
    """The ids of all steps of the file; a removed step gets the verb nearest to its own.

    For a step without a recognisable verb, every id that it could get.
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
    """Removes the invalid fields of steps; returns the other faults and the tree. A step that requires its removed
    field is removed in the next round."""
    steps = root.get("steps")
    if not isinstance(steps, SequenceNode):
        return faults, root
    items, others = [*steps.items], []
    for fault in faults:
        field = fault[3:5] if fault[:1] == ("steps",) else ()  # after the index of the step and its union branch
        item = items[int(fault[1])] if field else None
        if fault == ("steps",) and len(faults) > 1:
            continue  # no step was valid; if none is valid now, the next round reports it
        if not isinstance(item, MappingNode) or field[0] in ("until", "on_fail", "id"):
            others.append(fault)
        elif node_at(item, field) is not node_at(item, field[:-1]):  # a union reports a value once per branch
            items[int(fault[1])] = without(item, field)
    return others, root.with_node("steps", SequenceNode(tuple(items), steps.place))


def _without(root: MappingNode, faults: list[Loc], kept: dict[str, tuple[int, ...]]) -> MappingNode:
    """The tree without the faulty blocks; `kept` tracks which items of the file remain."""
    heads = {str(fault[0]) for fault in faults if len(fault) == 1}
    if heads & {*NAMED}:  # the names are then unknown
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
        root = root.with_node("steps", _minimal_steps(root if steps is None else steps))
        kept["steps"] = (0,)
    for name in NAMED:
        block = root.get(name)
        if isinstance(block, MappingNode):
            for key, old in block.entries.items():
                if (name, key) in items:
                    block = block.with_node(key, _placeholder(name, old.node))
            root = root.with_node(name, block)
    for fault in faults:
        head = "record" if not fault else str(fault[0])  # only the check of rates concerns the whole task
        block = root.get(head)
        if head in KEPT:
            root = root.with_node(head, ScalarNode("left out", root.place))
        elif head == "simulation" and isinstance(block, MappingNode) and fault[1:2] in ((), *((w,) for w in CLOCK)):
            root = root.with_node(head, block.without(*CLOCK))
        elif not fault or head not in (*LISTS, *NAMED):
            root = without(root, (head, *fault[1:2]))
    return root.without(*(heads & {"frames", "scene", "expect", "watch"}))


def _minimal_steps(at: Node) -> Node:
    """The minimal valid list of steps."""
    wait = MappingNode({"wait": Entry(at.place, ScalarNode(0.0, at.place))}, at.place)
    return SequenceNode((wait,), at.place)


def _placeholder(block: str, faulty: Node) -> Node:
    """A placeholder frame or body that keeps the references of the faulty one."""
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
