"""Rounds of a `repeat`, with the parameters of each."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Final

from manipcli.core.errors import Loc
from manipcli.core.text import did_you_mean, escape, listed, nearest
from manipcli.spec.expression import INDEX, NAME, Scope, names_used
from manipcli.spec.source.tree import MappingNode, Node, ScalarNode, SequenceNode, child, mapped, shown
from manipcli.spec.structure import words
from manipcli.spec.structure.reports import Reports

MOST_ROUNDS: Final = 2000


def rounds_of(
    block: Node, at: Loc, scope: Scope, reports: Reports, verbs: Collection[str]
) -> Sequence[tuple[Node, Scope, Loc]]:
    """The steps of each round, their parameters and their place; () with a finding if the block is faulty."""
    if isinstance(block, MappingNode) and isinstance(written := block.get("rounds"), SequenceNode):
        return list(_written_rounds(written, (*at, "rounds"), scope, reports))
    if not isinstance(block, MappingNode):
        hint = f"write `{words.FORMS['repeat']}` or `repeat: {{each: {{NAME: [...]}}, steps: [...]}}`"
        reports.at(262, at, block, f"expected a mapping with `steps` and `times` or `each`, not {shown(block)}", hint)
        return ()
    for key in block.entries:
        if key not in words.INSIDE:
            reports.at_key(261, at, block, key, *_in_repeat(key, block, verbs))
            return ()
    steps = block.get("steps")
    if steps is None:
        reports.at(262, at, block, "the key `steps` is missing", "write the repeated steps below `steps:`")
        return ()
    if ("times" in block.entries) == ("each" in block.entries):
        both = "times" in block.entries
        message = "`times` and `each` exclude each other" if both else "`times` or `each` is missing"
        hint = "the lists of `each` give the number of rounds: remove `times`" if both else "add `times: 3`"
        reports.at(263, at, block.entries["times"].node if both else block, message, hint)
        return ()
    return [(steps, inner, (*at, "steps")) for inner in _scopes(block, steps, at, scope, reports)]


def _written_rounds(rounds: SequenceNode, at: Loc, scope: Scope, reports: Reports) -> Iterator[tuple[Node, Scope, Loc]]:
    """The rounds of a log, see `nest`."""
    for k, each in enumerate(rounds.items):
        steps = child(each, "steps")
        if steps is None:
            reports.at(262, (*at, k), each, "the key `steps` is missing")
            return
        yield steps, written_scope(each, scope, (*at, k)), (*at, k, "steps")


def written_scope(block: Node, scope: Scope, at: Loc, *, isolated: bool = False) -> Scope:
    """The scope of a round or sub-task of a log: with its `params`, where a retry needs them."""
    params = child(block, "params")
    computed = MappingNode({}, block.place) if params is None else mapped(params, scope.computed, (*at, "params"))
    given = {name: entry.node for name, entry in computed.entries.items()} if isinstance(computed, MappingNode) else {}
    return scope.inner(given, isolated=isolated)


def _scopes(block: MappingNode, steps: Node, at: Loc, scope: Scope, reports: Reports) -> list[Scope]:
    if "times" in block.entries:
        times = mapped(block.entries["times"].node, scope.computed, (*at, "times"))
        if times.place in scope.refused:
            return []
        number = times.value if isinstance(times, ScalarNode) else None
        if not isinstance(number, int) or isinstance(number, bool) or not 1 <= number <= MOST_ROUNDS:
            message = f"expected a whole number from 1 to {MOST_ROUNDS}, not {shown(times)}"
            reports.at(263, (*at, "times"), times, message, "write `times: 3`")
            return []
        return [scope.inner({INDEX: ScalarNode(k, times.place)}) for k in range(number)]
    lists = _values(block, steps, at, scope, reports)
    return [
        scope.inner({INDEX: ScalarNode(k, row[0].place), **dict(zip(lists, row, strict=True))})
        for k, row in enumerate(zip(*lists.values(), strict=True))
    ]


def _values(block: MappingNode, steps: Node, at: Loc, scope: Scope, reports: Reports) -> Mapping[str, Sequence[Node]]:
    """The values of `each`, by name, all of the same length; {} with a finding if they are faulty."""
    at, each = (*at, "each"), block.entries["each"].node
    if not isinstance(each, MappingNode) or not each.entries:
        hint = "write `each: {block: [red, blue]}`, then `$block` in the steps"
        reports.at(263, at, each, f"expected names with lists of values, not {shown(each)}", hint)
        return {}
    lists: dict[str, Sequence[Node]] = {}
    used = names_used(steps)
    for name, entry in each.entries.items():
        values = mapped(entry.node, scope.computed, (*at, name))
        if values.place in scope.refused:
            continue
        if not NAME.fullmatch(name) or name == INDEX:
            hint = "use letters, digits and '_'" if name != INDEX else f"`${INDEX}` is the number of the round"
            reports.at_key(263, at, each, name, f"'{escape(name)}' is not a valid parameter name here", hint)
        elif not isinstance(values, SequenceNode) or not values.items:
            message = f"expected a list of values, one for each round, not {shown(values)}"
            reports.at(263, (*at, name), values, message, "write `[a, b, c]`")
        elif (
            empty := next((v for v in values.items if isinstance(v, ScalarNode) and v.value is None), None)
        ) is not None:
            reports.at(263, (*at, name), empty, "a value is missing", "write `[a, b, c]`")
        else:
            lists[name] = values.items
            _warn(name, each, at, scope, used, reports)
    lengths = {name: len(values) for name, values in lists.items()}
    if len(lists) < len(each.entries) or len({*lengths.values()}) > 1:
        if len(lists) == len(each.entries):
            told = listed([f"`{name}` has {length}" for name, length in lengths.items()])
            reports.at(263, at, each, f"the lists have different lengths: {told}", "give each round one value of each")
        return {}
    return lists


def _warn(name: str, each: MappingNode, at: Loc, scope: Scope, used: Collection[str], reports: Reports) -> None:
    if name in scope.names:
        message = f"`{name}` hides the parameter of the same name"
        reports.at_key(271, at, each, name, message, "choose another name", "warning")
    if name not in used and not _misspelt(name, each, used, scope):
        message = f"`${name}` is not used in the steps of this `repeat`"
        reports.at_key(272, at, each, name, message, "remove it, or use it", "warning")


def _misspelt(name: str, each: MappingNode, used: Collection[str], scope: Scope) -> bool:
    """Whether the steps use an unknown name that is near to this one; that is an error of its own."""
    unknown = [other for other in used if other not in each.entries and other not in scope.names and other != INDEX]
    return bool(nearest(name, unknown))


def _in_repeat(key: str, block: MappingNode, verbs: Collection[str]) -> tuple[str, str | None]:
    """Message and hint for an unknown key under `repeat`."""
    if key in words.COMMON:
        return f"`{key}` belongs next to `repeat`, not inside it", f"indent `{key}` as `repeat`"
    if key in verbs or key in words.WORDS:
        return f"`{key}` is a step: it belongs in the list `steps`", f"write `steps: [{{{key}: ...}}]`"
    hint = did_you_mean(key, words.INSIDE, kind="keys of `repeat`")
    if isinstance(block.entries[key].node, SequenceNode) and not nearest(key, words.INSIDE):
        hint = f"put its values below `each`: `each: {{{escape(key)}: [...]}}`"
    return f"unknown key '{escape(key)}' in `repeat`", hint
