"""Expansion of structured steps to a flat list of steps and the blocks over it.

It works on the tree, after overrides: every value keeps its place. Parameters are computed for each round and for each
sub-task. Ids are unique by construction: `BLOCK/OWN`, where OWN is given or counted in its list; round k of a `repeat`
is `BLOCK[k]`, and the steps of `else` are `BLOCK/else/OWN`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from typing import Final

from manipcli.core.errors import Loc, Place
from manipcli.core.text import escape
from manipcli.spec.block import BlockKind
from manipcli.spec.condition import ID, ID_HINT
from manipcli.spec.expression import Scope, is_expression, names_used
from manipcli.spec.source.tree import (
    MappingNode,
    Node,
    ScalarNode,
    SequenceNode,
    child,
    dotted,
    mapped,
    shown,
)
from manipcli.spec.structure import words
from manipcli.spec.structure.arguments import arguments
from manipcli.spec.structure.draft import BlockDraft, FlatStep
from manipcli.spec.structure.files import SUB_TASK, Files, TaskFile, TooMuch
from manipcli.spec.structure.ids import own_ids
from manipcli.spec.structure.include import Inclusion
from manipcli.spec.structure.reports import Reports
from manipcli.spec.structure.rounds import rounds_of, written_scope
from manipcli.spec.structure.static import Undecidable, decided, without_parameter

MOST_STEPS: Final = 2000
"""Steps of a task, and rounds and list items that are expanded without a step."""
DEEPEST: Final = 20
"""Nested blocks."""


@dataclass(frozen=True, slots=True)
class Expanded:
    """The flat steps and their blocks.

    Attributes:
        steps: in the order of the file.
        blocks: each before its parts.
        dropped: steps of branches that are never taken.
    """

    steps: tuple[FlatStep, ...]
    blocks: tuple[BlockDraft, ...]
    dropped: tuple[FlatStep, ...]


@dataclass(frozen=True, slots=True)
class _Context:
    """Where a list of steps is: its file, its enclosing block, the beginning of its ids, and the nesting."""

    scope: Scope
    file: TaskFile
    block: int | None = None
    prefix: str = ""
    reserved: tuple[str, ...] = ()
    level: int = 0

    def inside(
        self, block: int, prefix: str, *, scope: Scope | None = None, reserved: tuple[str, ...] = ()
    ) -> _Context:
        """The context of the steps of a block."""
        return _Context(scope or self.scope, self.file, block, prefix, reserved, self.level + 1)


@dataclass(slots=True)
class Expansion:
    """One expansion; `verbs` are the words of steps, `bodies` the names of the scene."""

    verbs: Collection[str]
    reports: Reports
    files: Files
    bodies: Collection[str]
    task: TaskFile
    steps: list[FlatStep] = field(default_factory=list)
    blocks: list[BlockDraft] = field(default_factory=list)
    dropped: list[FlatStep] = field(default_factory=list)
    visited: int = 0
    decided: dict[Place, tuple[MappingNode, Loc, bool]] = field(default_factory=dict)
    """Every `if` on a value of `each`, and whether it holds in a round."""

    def whole(self, steps: Node, scope: Scope) -> Expanded:
        """Expands the steps of a task."""
        with suppress(TooMuch):
            self.list_of_steps(steps, ("steps",), _Context(scope, self.task))
        for item, at, holds in self.decided.values():
            if not holds and self.steps:
                message, hint = "the condition holds in no round", "compare with a value of `each`, spelt as there"
                self.reports.at_key(275, at, item, "if", message, hint, "warning")
        blocks = tuple(block for block in self.blocks if block.last > block.first)
        return Expanded(tuple(self.steps), blocks, tuple(self.dropped))

    def list_of_steps(self, node: Node | None, at: Loc, context: _Context, *, empty: bool = False) -> None:
        """Expands a list of steps at the end of the flat list."""
        if not isinstance(node, SequenceNode):
            assert node is not None
            hint = "write `[{VERB: {...}}, ...]`"
            if isinstance(node, MappingNode):
                is_step = any(key in self.verbs or key in words.WORDS for key in node.entries)
                hint = (
                    "begin each step with '- '"
                    if is_step
                    else f"write `{words.FORMS.get(str(at[-1]), f'{at[-1]}: [STEP, ...]')}`"
                )
            self.reports.at(262, at, node, f"expected a list of steps, not {shown(node)}", hint)
            return
        if not node.items and not empty:
            self.reports.at(262, at, node, "the list has no steps", "remove its key, or write a step")
        items = [self.with_id(item, (*at, k), context) for k, item in enumerate(node.items)]
        first: dict[str, int] = {}
        for k, (item, own) in enumerate(zip(items, own_ids(items), strict=True)):
            self.visited += 1
            if self.visited > 10 * MOST_STEPS:
                self.reports.at(269, at, item, f"the structure has more than {10 * MOST_STEPS} items", _FEWER)
                raise TooMuch
            if own in first:
                message = f"duplicate id '{escape(own)}': {dotted((*at, first[own]))} has it already"
                other = items[first[own]].place
                self.reports.at(210, (*at, k, "id"), _id_of(item), message, f"choose another; the first is at {other}")
                continue
            first[own] = k
            self.item(item, own, (*at, k), context)

    def with_id(self, item: Node, at: Loc, context: _Context) -> Node:
        """The item with its id computed; a faulty id is reported and removed."""
        own = child(item, "id")
        if not isinstance(item, MappingNode) or own is None or (isinstance(own, ScalarNode) and own.value is None):
            return item
        if not isinstance(own, ScalarNode) or not isinstance(own.value, str):
            self.reports.at(205, (*at, "id"), own, f"expected a string, not {shown(own)}", ID_HINT)
            return item.without("id")
        computed = context.scope.computed(own, (*at, "id"))
        text = computed.value if isinstance(computed, ScalarNode) else None
        if computed is own and is_expression(own.value):
            return item.without("id")  # reported
        if not isinstance(text, str) or not ID.fullmatch(text):
            self.reports.at(208, (*at, "id"), own, f"'{escape(str(text))}' is not a valid id", ID_HINT)
            return item.without("id")
        if text in context.reserved:
            self.reports.at(
                208, (*at, "id"), own, f"'{text}' is not a valid id here: it names the branch", "choose another"
            )
            return item.without("id")
        return item.with_node("id", computed)

    def item(self, item: Node, own: str, at: Loc, context: _Context) -> None:
        """Expands one item."""
        wrong = words.misplaced(item, self.verbs) if isinstance(item, MappingNode) else None
        if wrong is not None and isinstance(item, MappingNode):
            self.reports.at_key(wrong.number, at, item, wrong.key, wrong.message, wrong.hint)
            return
        word = words.word_of(item)
        if word is None or not isinstance(item, MappingNode):
            self.steps.append(FlatStep(item, f"{context.prefix}{own}", at, context.scope))
            if len(self.steps) > MOST_STEPS:
                self.reports.at(269, at, item, f"the task has more than {MOST_STEPS} steps", _FEWER)
                raise TooMuch
            return
        if context.level >= DEEPEST:
            self.reports.at(
                269, at, item, f"blocks are nested deeper than {DEEPEST}", "move inner blocks into a sub-task"
            )
            return
        self.check_on_fail(item, at)
        _EXPANDERS[word](self, item, f"{context.prefix}{own}", at, context)

    def check_on_fail(self, item: MappingNode, at: Loc) -> None:
        changed = child(item.get("on_fail") or item, "with") if "on_fail" in item.entries else None
        if isinstance(changed, MappingNode) and changed.entries:
            message = "the retries of a block have no other values"
            self.reports.at(
                261, (*at, "on_fail", "with"), changed, message, "write `on_fail` with `with` at a step in it"
            )

    @contextmanager
    def block(
        self,
        own: str,
        kind: BlockKind,
        word: str,
        at: Loc,
        item: MappingNode,
        context: _Context,
        *,
        is_round: bool = False,
    ) -> Iterator[tuple[BlockDraft, int]]:
        """A block around what is expanded in the context; removed if that has no steps."""
        index = len(self.blocks)
        draft = BlockDraft(own, kind, word, at, item, context.scope, context.block, len(self.steps), is_round=is_round)
        self.blocks.append(draft)
        yield draft, index
        draft.last = len(self.steps)
        if draft.last == draft.first:
            del self.blocks[index:]

    def sequence(self, item: MappingNode, own: str, at: Loc, context: _Context) -> None:
        with self.block(own, "sequence", "sequence", at, item, context) as (_, index):
            self.list_of_steps(item.get("sequence"), (*at, "sequence"), context.inside(index, f"{own}/"))

    def repeat(self, item: MappingNode, own: str, at: Loc, context: _Context) -> None:
        at = (*at, "repeat")
        rounds = rounds_of(item.entries["repeat"].node, at, context.scope, self.reports, self.verbs)
        with self.block(own, "sequence", "repeat", at[:-1], item, context) as (_, index):
            for k, (steps, scope, inner_at) in enumerate(rounds):
                around = replace(context, scope=scope, block=index)
                with self.block(f"{own}[{k}]", "sequence", "repeat", at[:-1], item, around, is_round=True) as (
                    draft,
                    j,
                ):
                    draft.given = {name: scope.nodes[name] for name in sorted(scope.local - context.scope.local)}
                    self.list_of_steps(
                        steps, inner_at, context.inside(j, f"{own}[{k}]/", scope=scope), empty=inner_at[-3] == "rounds"
                    )

    def choice(self, item: MappingNode, own: str, at: Loc, context: _Context) -> None:
        scope = context.scope
        written = item.entries["if"].node
        inside = next((key for key in words.BESIDE["if"] if child(written, key) is not None), None)
        if inside is not None and isinstance(written, MappingNode):
            hint = f"indent `{inside}` as `if`"
            self.reports.at_key(261, (*at, "if"), written, inside, f"`{inside}` belongs next to `if`", hint)
            return
        condition = mapped(written, scope.computed, (*at, "if"))
        if (word := without_parameter(written, scope.names)) is not None:
            message = f"`equal` compares the word '{word[1]}', not the parameter"
            self.reports.at(270, (*at, "if"), word[0], message, f"write `${word[1]}`")
            return
        try:
            holds = _is_refused(condition, scope) or decided(condition)
        except Undecidable as error:
            self.reports.at(270, (*at, "if"), error.node, error.message, error.hint)
            holds = True
        if isinstance(holds, ScalarNode | SequenceNode):
            message = f"expected a condition, or true or false, not {shown(holds)}"
            hint = "write `if: {at_rest: {object: a}}`, or `if: {equal: [$color, red]}`"
            if isinstance(holds, ScalarNode) and holds.written is not None:
                hint = f"compare it: `if: {{equal: [{holds.written}, ...]}}`"
            self.reports.at(270, (*at, "if"), holds, message, hint)
            return
        missing = "then" not in item.entries
        if missing and holds is not False:
            self.reports.at_key(262, at, item, "if", "`then` is missing", f"write `{words.FORMS['if']}`, or use `not`")
            return
        if isinstance(holds, bool) and not scope.isolated and names_used(written) & scope.local:
            before = self.decided.get(item.place, (item, at, False))
            self.decided[item.place] = (item, at, holds or before[2])
        kind: BlockKind = "sequence" if isinstance(holds, bool) else "if"
        with self.block(own, kind, "if", at, item, context) as (draft, index):
            then = context.inside(index, f"{own}/", reserved=(words.ELSE,))
            other = context.inside(index, f"{own}/{words.ELSE}/")
            for key, inner, taken in (("then", then, holds is not False), (words.ELSE, other, holds is not True)):
                if key == words.ELSE and not isinstance(holds, bool):
                    draft.split, draft.condition = len(self.steps), holds
                if key not in item.entries:
                    continue
                with self.dropping(not taken):
                    empty = key == "then" and words.ELSE in item.entries
                    self.list_of_steps(item.entries[key].node, (*at, key), inner, empty=empty)

    @contextmanager
    def dropping(self, drop: bool) -> Iterator[None]:
        """Moves what is expanded in the context to `dropped`."""
        steps, blocks = len(self.steps), len(self.blocks)
        yield
        if drop:
            self.dropped += self.steps[steps:]
            del self.steps[steps:], self.blocks[blocks:]

    def parallel(self, item: MappingNode, own: str, at: Loc, context: _Context) -> None:
        at = (*at, "parallel")
        steps = item.entries["parallel"].node
        items = steps.items if isinstance(steps, SequenceNode) else ()
        if isinstance(steps, SequenceNode) and len(items) != 2:
            self.reports.at(274, at, steps, f"expected 2 steps, one of the arm and one of the hand, not {len(items)}")
            return
        for k, inner in enumerate(items):
            word = words.word_of(inner)
            if word is not None:
                hint = f"write the `parallel` inside `{word}`"
                self.reports.at(274, (*at, k), inner, f"a part of `parallel` is one step, not `{word}`", hint)
                return
        with self.block(own, "parallel", "parallel", at[:-1], item, context) as (_, index):
            self.list_of_steps(steps, at, context.inside(index, f"{own}/"))

    def do(self, item: MappingNode, own: str, at: Loc, context: _Context) -> None:
        block = item.entries["do"].node
        steps: Node | None
        if isinstance(block, MappingNode) and (steps := block.get("steps")) is not None:  # of a log
            inner_at: Loc = (*at, "do", "steps")
            scope, inner = written_scope(block, context.scope, (*at, "do"), isolated=True), context
        else:
            found = self.files.read(block, dotted((*at, "do")), context.file, SUB_TASK)
            if found is None:
                return
            inner, inner_at, steps = replace(context, file=found[0]), ("steps",), found[1].get("steps")
            if steps is None:
                self.reports.at(265, ("steps",), found[1], "the sub-task has no `steps`")
                return
            scope = arguments(item, found[1], at, context.scope, self.reports, self.bodies)
            steps = Inclusion(self.files, self.task).steps(steps, ("steps",), found[0])
        with self.block(own, "sequence", "do", at, item, context) as (draft, index):
            draft.given = {name: scope.nodes[name] for name in sorted(scope.local)}
            self.list_of_steps(steps, inner_at, inner.inside(index, f"{own}/", scope=scope))

    def include(self, item: MappingNode, own: str, at: Loc, context: _Context) -> None:
        """Fragments were inserted before; one with a wrong key next to `include` was reported."""


_Expander = Callable[[Expansion, MappingNode, str, Loc, _Context], None]
_EXPANDERS: Final[Mapping[str, _Expander]] = {
    "sequence": Expansion.sequence,
    "repeat": Expansion.repeat,
    "if": Expansion.choice,
    "parallel": Expansion.parallel,
    "do": Expansion.do,
    "include": Expansion.include,
}
_FEWER: Final = "split the task, or repeat fewer times"


def _is_refused(node: Node, scope: Scope) -> bool:
    """Whether a value in a computed tree was refused."""
    if isinstance(node, MappingNode):
        return any(_is_refused(entry.node, scope) for entry in node.entries.values())
    if isinstance(node, SequenceNode):
        return any(_is_refused(item, scope) for item in node.items)
    return node.place in scope.refused


def _id_of(item: Node) -> Node:
    return child(item, "id") or item
