"""Expansion of structured steps to a flat list of steps and the blocks over it.

It works on the tree, after overrides: every value keeps its place. Parameters are computed for each round and for each
sub-task. Ids are unique by construction: `BLOCK/OWN`, where OWN is given or counted in its list; round k of a `repeat`
is `BLOCK[k]`, and the steps of `else` are `BLOCK/else/OWN`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from typing import Final

from manipcli.core.errors import Diagnostic, Loc, Severity
from manipcli.core.text import did_you_mean, escape, listed
from manipcli.spec.block import BlockKind
from manipcli.spec.condition import ID, ID_HINT
from manipcli.spec.expression import INDEX, NAME, Scope, is_expression, names_used
from manipcli.spec.source.tree import (
    Entry,
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
from manipcli.spec.structure.draft import BlockDraft, FlatStep
from manipcli.spec.structure.ids import own_ids
from manipcli.spec.structure.static import Undecidable, decided

MOST_STEPS: Final = 2000
"""Steps of a task, and rounds and list items that are expanded without a step."""
DEEPEST: Final = 20
"""Nested blocks."""


class TooMuch(Exception):
    """Stops the expansion; its finding is already in the list."""


@dataclass(frozen=True, slots=True)
class Expanded:
    """The flat steps and their blocks.

    Attributes:
        steps: in the order of the file.
        blocks: each before its parts.
        dropped: steps of branches that are never taken.
        findings: of the structure; those of expressions are in the scope.
    """

    steps: tuple[FlatStep, ...]
    blocks: tuple[BlockDraft, ...]
    dropped: tuple[FlatStep, ...]
    findings: tuple[Diagnostic, ...]


@dataclass(frozen=True, slots=True)
class _Context:
    """Where a list of steps is: its enclosing block and the beginning of its ids."""

    scope: Scope
    block: int | None = None
    prefix: str = ""
    reserved: tuple[str, ...] = ()


@dataclass(slots=True)
class Expansion:
    """One expansion; `verbs` are the words of steps."""

    verbs: Collection[str]
    steps: list[FlatStep] = field(default_factory=list)
    blocks: list[BlockDraft] = field(default_factory=list)
    dropped: list[FlatStep] = field(default_factory=list)
    findings: list[Diagnostic] = field(default_factory=list)
    visited: int = 0

    def whole(self, steps: Node, scope: Scope) -> Expanded:
        """Expands the steps of a task."""
        with suppress(TooMuch):
            self.list_of_steps(steps, ("steps",), _Context(scope))
        blocks = tuple(block for block in self.blocks if block.last > block.first)
        return Expanded(tuple(self.steps), blocks, tuple(self.dropped), tuple(self.findings))

    def report(
        self, number: int, at: Loc, node: Node, message: str, hint: str | None = None, severity: Severity = "error"
    ) -> None:
        """A finding at a node; the same one in several rounds is reported once."""
        finding = Diagnostic(f"TASK{number}", f"{dotted(at)}: {message}", node.place, hint, severity)
        if finding not in self.findings:
            self.findings.append(finding)

    def at_key(self, number: int, at: Loc, item: MappingNode, key: str, message: str, hint: str | None = None) -> None:
        """A finding at a key of an item."""
        place = item.entries[key].key_place
        self.report(number, at, ScalarNode(None, place), message, hint)

    def list_of_steps(self, node: Node | None, at: Loc, context: _Context, *, empty: bool = False) -> None:
        """Expands a list of steps at the end of the flat list."""
        if not isinstance(node, SequenceNode):
            assert node is not None
            hint = "begin each step with '- '" if isinstance(node, MappingNode) else "write `[{VERB: {...}}, ...]`"
            self.report(262, at, node, f"expected a list of steps, not {shown(node)}", hint)
            return
        if not node.items and not empty:
            self.report(262, at, node, "the list has no steps", "remove its key, or write a step")
        items = [self.with_id(item, (*at, k), context) for k, item in enumerate(node.items)]
        first: dict[str, int] = {}
        for k, (item, own) in enumerate(zip(items, own_ids(items), strict=True)):
            self.visited += 1
            if self.visited > 10 * MOST_STEPS:
                self.report(269, at, item, f"the structure has more than {10 * MOST_STEPS} items", _FEWER)
                raise TooMuch
            if own in first:
                message = f"duplicate id '{escape(own)}': {dotted((*at, first[own]))} has it already"
                other = items[first[own]].place
                self.report(210, (*at, k, "id"), _id_of(item), message, f"choose another; the first is at {other}")
                continue
            first[own] = k
            self.item(item, own, (*at, k), context)

    def with_id(self, item: Node, at: Loc, context: _Context) -> Node:
        """The item with its id computed; a faulty id is reported and removed."""
        own = child(item, "id")
        if not isinstance(item, MappingNode) or not isinstance(own, ScalarNode) or not isinstance(own.value, str):
            return item
        computed = context.scope.computed(own, (*at, "id"))
        text = computed.value if isinstance(computed, ScalarNode) else None
        if computed is own and is_expression(own.value):
            return item.without("id")  # reported
        if not isinstance(text, str) or not ID.fullmatch(text):
            self.report(208, (*at, "id"), own, f"'{escape(str(text))}' is not a valid id", ID_HINT)
            return item.without("id")
        if text in context.reserved:
            self.report(
                208, (*at, "id"), own, f"'{text}' is not a valid id here: it names the branch", "choose another"
            )
            return item.without("id")
        return item.with_node("id", computed)

    def item(self, item: Node, own: str, at: Loc, context: _Context) -> None:
        """Expands one item."""
        wrong = words.misplaced(item, self.verbs) if isinstance(item, MappingNode) else None
        if wrong is not None and isinstance(item, MappingNode):
            self.at_key(wrong.number, at, item, wrong.key, wrong.message, wrong.hint)
            return
        word = words.word_of(item)
        if word is None or not isinstance(item, MappingNode):
            self.steps.append(FlatStep(item, f"{context.prefix}{own}", at, context.scope))
            if len(self.steps) > MOST_STEPS:
                self.report(269, at, item, f"the task has more than {MOST_STEPS} steps", _FEWER)
                raise TooMuch
            return
        if len(at) > 2 * DEEPEST:
            self.report(269, at, item, f"blocks are nested deeper than {DEEPEST}", "move inner blocks into a sub-task")
            return
        self.check_on_fail(item, at)
        _EXPANDERS[word](self, item, f"{context.prefix}{own}", at, context)

    def check_on_fail(self, item: MappingNode, at: Loc) -> None:
        changed = child(item.get("on_fail") or item, "with") if "on_fail" in item.entries else None
        if isinstance(changed, MappingNode) and changed.entries:
            message = "the retries of a block have no other values"
            self.report(261, (*at, "on_fail", "with"), changed, message, "write `on_fail` with `with` at a step in it")

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
            self.list_of_steps(item.get("sequence"), (*at, "sequence"), _Context(context.scope, index, f"{own}/"))

    def repeat(self, item: MappingNode, own: str, at: Loc, context: _Context) -> None:
        at = (*at, "repeat")
        rounds = self.rounds(item.entries["repeat"].node, at, context.scope)
        with self.block(own, "sequence", "repeat", at[:-1], item, context) as (_, index):
            for k, (steps, scope, inner_at) in enumerate(rounds):
                around = _Context(scope, index)
                with self.block(f"{own}[{k}]", "sequence", "repeat", at[:-1], item, around, is_round=True) as (_, j):
                    self.list_of_steps(
                        steps, inner_at, _Context(scope, j, f"{own}[{k}]/"), empty=inner_at[-3] == "rounds"
                    )

    def rounds(self, block: Node, at: Loc, scope: Scope) -> Sequence[tuple[Node, Scope, Loc]]:
        """The steps of each round, their parameters and their place; () with a finding if the block is faulty."""
        if isinstance(block, MappingNode) and isinstance(written := block.get("rounds"), SequenceNode):
            return list(self.written_rounds(written, (*at, "rounds"), scope))
        if not isinstance(block, MappingNode):
            hint = f"write `{words.FORMS['repeat']}` or `repeat: {{each: {{NAME: [...]}}, steps: [...]}}`"
            self.report(
                262, at, block, f"expected a mapping with `steps` and `times` or `each`, not {shown(block)}", hint
            )
            return ()
        for key in block.entries:
            if key not in words.INSIDE:
                self.at_key(261, at, block, key, *_in_repeat(key, self.verbs))
                return ()
        steps = block.get("steps")
        if steps is None:
            self.report(262, at, block, "the key `steps` is missing", "write the repeated steps below `steps:`")
            return ()
        if ("times" in block.entries) == ("each" in block.entries):
            both = "times" in block.entries
            message = "`times` and `each` exclude each other" if both else "`times` or `each` is missing"
            hint = "the lists of `each` give the number of rounds: remove `times`" if both else "add `times: 3`"
            self.report(263, at, block.entries["times"].node if both else block, message, hint)
            return ()
        return [(steps, inner, (*at, "steps")) for inner in self.round_scopes(block, steps, at, scope)]

    def written_rounds(self, rounds: SequenceNode, at: Loc, scope: Scope) -> Iterator[tuple[Node, Scope, Loc]]:
        """The rounds of a log, see `nest`."""
        for k, each in enumerate(rounds.items):
            steps = child(each, "steps")
            if steps is None:
                self.report(262, (*at, k), each, "the key `steps` is missing")
                return
            yield steps, self.inner(each, scope, (*at, k)), (*at, k, "steps")

    def inner(self, block: Node, scope: Scope, at: Loc, *, isolated: bool = False) -> Scope:
        """The scope of a round or sub-task of a log: with its `params`, where a retry needs them."""
        params = child(block, "params")
        computed = MappingNode({}, block.place) if params is None else mapped(params, scope.computed, (*at, "params"))
        given = (
            {name: entry.node for name, entry in computed.entries.items()} if isinstance(computed, MappingNode) else {}
        )
        return scope.inner(given, isolated=isolated)

    def round_scopes(self, block: MappingNode, steps: Node, at: Loc, scope: Scope) -> list[Scope]:
        if "times" in block.entries:
            times = mapped(block.entries["times"].node, scope.computed, (*at, "times"))
            if times.place in scope.refused:
                return []
            number = times.value if isinstance(times, ScalarNode) else None
            if not isinstance(number, int) or isinstance(number, bool) or not 1 <= number <= MOST_STEPS:
                message = f"expected a whole number from 1 to {MOST_STEPS}, not {shown(times)}"
                self.report(263, (*at, "times"), times, message, "write `times: 3`")
                return []
            return [scope.inner({INDEX: ScalarNode(k, times.place)}) for k in range(number)]
        lists = self.lists_of_values(block, steps, at, scope)
        return [
            scope.inner({INDEX: ScalarNode(k, row[0].place), **dict(zip(lists, row, strict=True))})
            for k, row in enumerate(zip(*lists.values(), strict=True))
        ]

    def lists_of_values(self, block: MappingNode, steps: Node, at: Loc, scope: Scope) -> Mapping[str, Sequence[Node]]:
        """The values of `each`, by name, all of the same length; {} with a finding if they are faulty."""
        at, each = (*at, "each"), block.entries["each"].node
        if not isinstance(each, MappingNode) or not each.entries:
            hint = "write `each: {block: [red, blue]}`, then `$block` in the steps"
            self.report(263, at, each, f"expected names with lists of values, not {shown(each)}", hint)
            return {}
        lists: dict[str, Sequence[Node]] = {}
        used = names_used(steps)
        for name, entry in each.entries.items():
            values = mapped(entry.node, scope.computed, (*at, name))
            if values.place in scope.refused:
                continue
            if not NAME.fullmatch(name) or name == INDEX:
                hint = "use letters, digits and '_'" if name != INDEX else f"`${INDEX}` is the number of the round"
                self.at_key(263, at, each, name, f"'{escape(name)}' is not a valid parameter name here", hint)
            elif not isinstance(values, SequenceNode) or not values.items:
                message = f"expected a list of values, one for each round, not {shown(values)}"
                self.report(263, (*at, name), values, message, "write `[a, b, c]`")
            else:
                lists[name] = values.items
                self.warn_about(name, entry, at, scope, used)
        lengths = {name: len(values) for name, values in lists.items()}
        if len(lists) < len(each.entries) or len({*lengths.values()}) > 1:
            if len(lists) == len(each.entries):
                told = listed([f"`{name}` has {length}" for name, length in lengths.items()])
                self.report(
                    263, at, each, f"the lists have different lengths: {told}", "give each round one value of each"
                )
            return {}
        return lists

    def warn_about(self, name: str, entry: Entry, at: Loc, scope: Scope, used: Collection[str]) -> None:
        key = ScalarNode(None, entry.key_place)
        if name in scope.names:
            message = f"`{name}` hides the parameter of the same name"
            self.report(271, (*at, name), key, message, "choose another name", "warning")
        if name not in used:
            message = f"`${name}` is not used in the steps of this `repeat`"
            self.report(272, (*at, name), key, message, "remove it, or use it", "warning")

    def choice(self, item: MappingNode, own: str, at: Loc, context: _Context) -> None:
        scope = context.scope
        condition = mapped(item.entries["if"].node, scope.computed, (*at, "if"))
        try:
            holds = decided(condition)
        except Undecidable as error:
            if error.node.place not in scope.refused:
                self.report(270, (*at, "if"), error.node, error.message, error.hint)
            holds = True
        missing = "then" not in item.entries
        if missing and holds is not False:
            self.at_key(262, at, item, "if", "`then` is missing", f"write `{words.FORMS['if']}`, or use `not`")
            return
        kind: BlockKind = "sequence" if isinstance(holds, bool) else "if"
        with self.block(own, kind, "if", at, item, context) as (draft, index):
            then = _Context(scope, index, f"{own}/", (words.ELSE,))
            other = _Context(scope, index, f"{own}/{words.ELSE}/")
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
            self.report(274, at, steps, f"expected 2 steps, one of the arm and one of the hand, not {len(items)}")
            return
        for k, inner in enumerate(items):
            word = words.word_of(inner)
            if word is not None:
                hint = f"write the `parallel` inside `{word}`"
                self.report(274, (*at, k), inner, f"a part of `parallel` is one step, not `{word}`", hint)
                return
        with self.block(own, "parallel", "parallel", at[:-1], item, context) as (_, index):
            self.list_of_steps(steps, at, _Context(context.scope, index, f"{own}/"))

    def do(self, item: MappingNode, own: str, at: Loc, context: _Context) -> None:
        at, block = (*at, "do"), item.entries["do"].node
        if isinstance(block, MappingNode) and (steps := block.get("steps")) is not None:
            scope = self.inner(block, context.scope, at, isolated=True)
            with self.block(own, "sequence", "do", at[:-1], item, replace(context, scope=scope)) as (_, index):
                self.list_of_steps(steps, (*at, "steps"), _Context(scope, index, f"{own}/"))
            return
        self.at_key(264, at, item, "do", "sub-tasks are not read yet")

    def include(self, item: MappingNode, own: str, at: Loc, context: _Context) -> None:
        self.at_key(264, at, item, "include", "files are not included yet")


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


def _in_repeat(key: str, verbs: Collection[str]) -> tuple[str, str | None]:
    """Message and hint for an unknown key under `repeat`."""
    if key in words.COMMON:
        return f"`{key}` belongs next to `repeat`, not inside it", f"indent `{key}` as `repeat`"
    if key in verbs or key in words.WORDS:
        return f"`{key}` is a step: it belongs into the list `steps`", f"write `steps: [{{{key}: ...}}]`"
    hint = did_you_mean(key, words.INSIDE, kind="keys of `repeat`")
    return f"unknown key '{escape(key)}' in `repeat`", hint


def _id_of(item: Node) -> Node:
    return child(item, "id") or item
