"""The nested outline of a task's steps, with equal rounds and sub-tasks written once.

Rounds that differ only in their values become a template with `$name` for each value. A template is used only if it
gives back the exact text of each round that it stands for.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from manipcli.core.prose import listing
from manipcli.task.explanation import Explanation, Group

INDEX: Final = "index"
LETTERS: Final = "kmnpqrstuvwxyz"


@dataclass(frozen=True, slots=True)
class Item:
    """A step or a block.

    Attributes:
        id: its id; in the template of a round with `[k]` or `[m]`.
        text: its sentence, or the heading of its parts.
        parts: headings ("" for none) and their items.
        then: what follows its parts.
        given: the values of the parameters of a round or a sub-task.
        file: heading of a sub-task without its values; "" for everything else.
        step: index of the step; -1 for a block, and in a template.
    """

    id: str
    text: str
    parts: tuple[tuple[str, tuple[Item, ...]], ...] = ()
    then: str = ""
    given: Mapping[str, str] = field(default_factory=dict)
    file: str = ""
    step: int = -1

    def mapped(self, change: Callable[[str], str]) -> Item:
        """The item with all its texts changed."""
        parts = tuple((change(heading), tuple(item.mapped(change) for item in items)) for heading, items in self.parts)
        given = {name: change(value) for name, value in self.given.items()}
        return replace(
            self, id=change(self.id), text=change(self.text), parts=parts, then=change(self.then), given=given, step=-1
        )


def outline(task: Explanation, *, whole: bool = False) -> tuple[Item, ...]:
    """The items of the task; with `whole`, each round and sub-task is written out."""
    items = tuple(_between(task, 0, len(task.steps), None, whole))
    return items if whole else tuple(_shared(items, {}))


def _between(task: Explanation, first: int, last: int, parent: int | None, whole: bool) -> Iterator[Item]:
    blocks = {
        group.first: k for k, group in enumerate(task.blocks) if group.parent == parent and first <= group.first < last
    }
    k = first
    while k < last:
        if k in blocks:
            yield _block(task, blocks[k], whole)
            k = task.blocks[blocks[k]].last
        else:
            yield Item(task.steps[k].id, task.steps[k].text, step=k)
            k += 1


def _block(task: Explanation, index: int, whole: bool) -> Item:
    group = task.blocks[index]

    def inside(first: int, last: int) -> tuple[Item, ...]:
        return tuple(_between(task, first, last, index, whole))

    if group.kind == "if":
        parts = [("", inside(group.first, group.split)), ("Otherwise:", inside(group.split, group.last))]
        return Item(group.id, group.text, tuple(part for part in parts if part[1]), group.then)
    items = inside(group.first, group.last)
    if group.word == "repeat" and not group.is_round and not whole:
        rounds = [other for other in task.blocks if other.parent == index]
        return _collapsed(group, rounds, items)
    file = "" if group.word != "do" else group.text.partition(" with ")[0].removesuffix(":")
    return Item(group.id, group.text, (("", items),), group.then, group.given, file)


def _collapsed(group: Group, rounds: Sequence[Group], items: Sequence[Item]) -> Item:
    """A `repeat` whose rounds are grouped by template, in the order of their first round."""
    groups: list[tuple[tuple[Item, ...], list[Group]]] = []
    for own, item in zip(rounds, items, strict=True):
        steps = item.parts[0][1]
        known = next((members for form, members in groups if _filled(form, group.id, own) == _bare(steps)), None)
        if known is None:
            groups.append((_template(steps, group.id, own), [own]))
        else:
            known.append(own)
    alone = {own.id: item.parts[0][1] for own, item in zip(rounds, items, strict=True)}
    # A round of its own keeps its values: a value may be in a sentence without being the parameter's.
    parts = tuple(
        (_heading(members, len(groups)), form if len(members) > 1 else alone[members[0].id]) for form, members in groups
    )
    count = len(rounds)
    text = f"Do these steps {count} times:" if count > 1 and not _values(rounds[0]) and len(groups) == 1 else group.text
    text = text.replace("For each of 1 rounds:", "For one round:")
    return Item(group.id, text, parts, group.then)


def _heading(rounds: Sequence[Group], groups: int) -> str:
    """The rounds of a group and their values."""
    letter = _letter(rounds[0].id)
    lines = [f"{letter} = {_number(own)}{_values(own)}" for own in rounds]
    if not _values(rounds[0]):
        return "" if groups == 1 else f"{letter} = {listing([str(_number(own)) for own in rounds])}:"
    return "; ".join(lines) + ":"


def _values(own: Group) -> str:
    texts = [f"{name} = {value}" for name, value in sorted(own.given.items()) if name != INDEX]
    return f", {', '.join(texts)}" if texts else ""


def _letter(round_: str) -> str:
    """The letter for the number of a round: another in each nested `repeat`."""
    return LETTERS[min(round_.count("[") - 1, len(LETTERS) - 1)]


def _number(own: Group) -> int:
    return int(own.id.rpartition("[")[2].removesuffix("]"))


def _bare(items: Sequence[Item]) -> tuple[Item, ...]:
    return tuple(item.mapped(lambda text: text) for item in items)


def _template(items: Sequence[Item], repeat: str, own: Group) -> tuple[Item, ...]:
    """The steps of a round with the names of its parameters instead of their values."""
    names = {value: name for name, value in own.given.items() if name != INDEX}
    forms = sorted(names, key=len, reverse=True)
    found = re.compile("|".join(rf"(?<![\w.]){re.escape(value)}(?![\w.]*\w)" for value in forms)) if forms else None

    def change(text: str) -> str:
        text = text.replace(f"{repeat}[{_number(own)}]", f"{repeat}[{_letter(own.id)}]")
        return text if found is None else found.sub(lambda match: f"${names[match.group()]}", text)

    return tuple(item.mapped(change) for item in items)


def _filled(form: Sequence[Item], repeat: str, own: Group) -> tuple[Item, ...]:
    """A template with the values of a round."""

    def change(text: str) -> str:
        text = text.replace(f"{repeat}[{_letter(own.id)}]", f"{repeat}[{_number(own)}]")
        return re.sub(r"\$([A-Za-z_]\w*)", lambda match: own.given.get(match.group(1), match.group()), text)

    return tuple(item.mapped(change) for item in form)


def _shared(items: Sequence[Item], known: dict[str, list[tuple[Item, tuple[Item, ...]]]]) -> Iterator[Item]:
    """The items, in which a sub-task that was written before is not written out once more."""
    for item in items:
        form = _of_sub_task(item) if item.file else ()
        same = next((first for first, other in known.get(item.file, ()) if item.file and other == form), None)
        if same is not None:
            yield replace(item, text=f"{item.text.removesuffix(':')}, as in {same.id}.", parts=())
            continue
        if item.file:
            known.setdefault(item.file, []).append((item, form))
        yield replace(item, parts=tuple((heading, tuple(_shared(inner, known))) for heading, inner in item.parts))


def _of_sub_task(item: Item) -> tuple[Item, ...]:
    """The steps of a sub-task without its values and ids."""
    names = {value: name for name, value in item.given.items()}
    forms = sorted(names, key=len, reverse=True)

    def change(text: str) -> str:
        text = text.replace(f"{item.id}/", "")
        for value in forms:
            text = re.sub(rf"(?<![\w.]){re.escape(value)}(?![\w.]*\w)", f"${names[value]}", text)
        return text

    return tuple(inner.mapped(change) for _, items in item.parts for inner in items)
