"""Blocks as a tree over the flat list of steps, and the steps between two choices.

A stretch is what is done from one choice (`if`) to the next, or to the end of the task. It is named by the outcomes of
the choices before it: `()` begins the task, `(True, False)` follows after `then` of the first and `else` of the second
`if` on that path.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from manipcli.spec.block import BlockSpec

MOST: Final = 8
"""Maximum number of combinations of outcomes that are planned before the run."""

Outcomes = tuple[bool, ...]
"""The outcomes of the choices so far, True for `then`."""
Unit = tuple[int, ...]
"""Indices of steps that are done at the same time: one, or the two of a `parallel`."""


@dataclass(frozen=True, slots=True)
class Group:
    """A block: its `index` among all, and its parts; `other`: those of `else`."""

    index: int
    spec: BlockSpec
    parts: tuple[Item, ...]
    other: tuple[Item, ...] = ()

    @property
    def all(self) -> tuple[Item, ...]:
        """Its parts, and those of `else`."""
        return (*self.parts, *self.other)


Item = int | Group
"""The index of a step, or a block."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """The units up to the next choice `asked`; None at the end of the task."""

    units: tuple[Unit, ...]
    asked: Group | None


def block_tree(count: int, blocks: Sequence[BlockSpec]) -> tuple[Item, ...]:
    """The steps and outermost blocks of a task with `count` steps, in order."""

    def items(first: int, last: int, parent: int | None) -> Iterator[Item]:
        k = first
        inner = ((n, block) for n, block in enumerate(blocks) if block.parent == parent)
        for n, block in inner:
            if block.first < first or block.last > last:
                continue
            yield from range(k, block.first)
            split = block.split if block.kind == "if" else block.last
            yield Group(n, block, (*items(block.first, split, n),), (*items(split, block.last, n),))
            k = block.last
        yield from range(k, last)

    return tuple(items(0, count, None))


def clipped(items: Sequence[Item], kept: range) -> tuple[Item, ...]:
    """The items with only the steps of `kept`, without blocks that have none of them.

    A block without its last step does not come to its `until`.
    """
    found: list[Item] = []
    for item in items:
        if isinstance(item, int):
            found += [item] if item in kept else []
        elif any(k in kept for k in steps_of((item,))):
            spec = item.spec if item.spec.last - 1 in kept else item.spec.model_copy(update={"until": None})
            found.append(Group(item.index, spec, clipped(item.parts, kept), clipped(item.other, kept)))
    return tuple(found)


def steps_of(items: Sequence[Item]) -> tuple[int, ...]:
    """The indices of all steps, in order."""
    return tuple(k for item in items for k in ((item,) if isinstance(item, int) else steps_of(item.all)))


def blocks_of(items: Sequence[Item]) -> tuple[Group, ...]:
    """All blocks, each before its parts."""
    return tuple(block for item in items if not isinstance(item, int) for block in (item, *blocks_of(item.all)))


def stretch(items: Sequence[Item], outcomes: Outcomes) -> Stretch:
    """The stretch after these outcomes."""
    left = [*outcomes]
    found: list[Unit] = []

    def walk(items: Sequence[Item]) -> Group | None:
        for item in items:
            if isinstance(item, int):
                found.append((item,))
            elif item.spec.kind == "parallel":
                found.append(steps_of(item.parts))
            else:
                parts = item.parts
                if item.spec.kind == "if":
                    if not left:
                        return item
                    found.clear()
                    parts = item.parts if left.pop(0) else item.other
                if asked := walk(parts):
                    return asked
        return None

    asked = walk(items)
    return Stretch(tuple(found), asked)


@dataclass(frozen=True, slots=True)
class Choices:
    """The choices of a task that are planned before the run.

    Attributes:
        followed: the outcomes before each choice whose two branches are planned.
        beyond: the first choice whose branches are planned during the run; None without one.
    """

    followed: frozenset[Outcomes]
    beyond: Group | None


def choices(items: Sequence[Item], most: int = MOST) -> Choices:
    """The choices with at most `most` combinations of outcomes: all that come first, second, ... on their paths."""
    followed: set[Outcomes] = set()
    level: list[Outcomes] = [()]
    combinations = 1
    while True:
        asked = [(key, group) for key in level if (group := stretch(items, key).asked) is not None]
        combinations += len(asked)
        if not asked or combinations > most:
            return Choices(frozenset(followed), asked[0][1] if asked else None)
        followed |= {key for key, _ in asked}
        level = [(*key, outcome) for key, _ in asked for outcome in (True, False)]


def named(items: Sequence[Item], outcomes: Outcomes) -> str:
    """The outcomes in words: `if_1: then, if_2: else`."""
    words = []
    for k, outcome in enumerate(outcomes):
        asked = stretch(items, outcomes[:k]).asked
        words.append(f"{'' if asked is None else asked.spec.id}: {'then' if outcome else 'else'}")
    return ", ".join(words)
