"""The words that give steps a structure, and the keys of their list items."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Final

from manipcli.core.text import did_you_mean, escape, listed, nearest
from manipcli.spec.condition import ID
from manipcli.spec.source.tree import MappingNode, Node, ScalarNode
from manipcli.spec.step import StepSpec

WORDS: Final[Mapping[str, str]] = {
    "sequence": "Steps one after the other, with one `until`, `timeout` and `on_fail`.",
    "repeat": "Steps done several times: `{times: 3, steps: [...]}`, or `{each: {NAME: [...]}, steps: [...]}`.",
    "if": "A condition; the steps under `then` are done where it holds, else those under `else`.",
    "parallel": "A step of the arm and a step of the hand, done together.",
    "do": "A file with `steps:` and declared `params:`, whose values are given under `with`.",
    "include": "A file whose `steps:` are inserted here.",
}
COMMON: Final = ("id", "until", "timeout", "on_fail")
"""Keys next to every word but `include`."""
BESIDE: Final[Mapping[str, tuple[str, ...]]] = {"if": ("then", "else"), "do": ("with",)}
"""Keys next to a word."""
INSIDE: Final = ("times", "each", "steps")
"""Keys of the block under `repeat`."""
_OWNER: Final = {key: word for word, keys in BESIDE.items() for key in keys} | dict.fromkeys(INSIDE, "repeat")
_KEYS: Final = frozenset({*WORDS, *_OWNER})
ELSE: Final = "else"
LISTS: Final = ("sequence", "then", "else", "parallel")
"""Keys that hold a list of steps."""
SYNONYMS: Final[Mapping[str, str]] = {
    **dict.fromkeys(("loop", "for", "foreach", "for_each", "while"), "repeat"),
    **dict.fromkeys(("when", "case", "choose", "switch", "unless"), "if"),
    **dict.fromkeys(("call", "use", "subtask", "sub_task"), "do"),
    **dict.fromkeys(("group", "block", "serial"), "sequence"),
    **dict.fromkeys(("concurrent", "together", "both"), "parallel"),
    **dict.fromkeys(("import", "insert"), "include"),
}
"""Words of other languages, and the word here."""


@dataclass(frozen=True, slots=True)
class Misplaced:
    """A key that does not belong into a list item: number of the code, the key, message and hint."""

    number: int
    key: str
    message: str
    hint: str | None


def is_structured(steps: Node, verbs: Collection[str] = ()) -> bool:
    """Whether a list of steps has an item with a key of structure; with the `verbs`, also with a misspelt word."""
    return not isinstance(steps, ScalarNode) and any(
        isinstance(item, MappingNode)
        and (not _KEYS.isdisjoint(item.entries) or (bool(verbs) and misplaced(item, verbs) is not None))
        for item in _items(steps)
    )


def _items(steps: Node) -> tuple[Node, ...]:
    if isinstance(steps, MappingNode):
        return (steps,)
    return () if isinstance(steps, ScalarNode) else steps.items


def word_of(item: Node) -> str | None:
    """The word of structure in a list item; None for a step."""
    return next((key for key in item.entries if key in WORDS), None) if isinstance(item, MappingNode) else None


def verb_of(item: Node) -> str:
    """The first part of the id that an item gets: its verb or word, of `do` the name of the file."""
    word = word_of(item)
    if word is None or not isinstance(item, MappingNode):
        keys = item.entries if isinstance(item, MappingNode) else ()
        return next((key for key in keys if key not in StepSpec.model_fields), "")
    named = item.get("do")
    if isinstance(named, ScalarNode) and isinstance(named.value, str):
        stem = re.sub(r"[^A-Za-z0-9_-]", "_", PurePosixPath(named.value).stem)
        return stem if ID.fullmatch(stem) else "do"
    return word


def misplaced(item: MappingNode, verbs: Collection[str]) -> Misplaced | None:
    """The first key that does not belong into this item; None if all do."""
    word = word_of(item)
    others = [key for key in item.entries if key != word and key not in StepSpec.model_fields]
    if word is None:
        return _without_word(others, verbs)
    wanted = (() if word == "include" else COMMON) + BESIDE.get(word, ())
    for key in item.entries:
        if key == word or key in wanted:
            continue
        if key in WORDS or key in verbs:
            hint = "write a list item for each"
            if word not in ("do", "include"):
                hint += f", or put the step in it: `{FORMS[word].replace('STEP, ...', f'{{{key}: ...}}')}`"
            return Misplaced(260, key, f"an item has one verb or word, not both '{word}' and '{key}'", hint)
        if _OWNER.get(key) == word:
            hint = f"indent `{key}` below `{word}:`" if isinstance(item.get(word), MappingNode) else _usual(word)
            return Misplaced(261, key, f"`{key}` belongs inside `{word}`", hint)
        if key in _OWNER:
            return Misplaced(261, key, f"`{key}` belongs to `{_OWNER[key]}`, not to `{word}`", _usual(_OWNER[key]))
        if key in StepSpec.model_fields:
            hint = "an included file keeps its own keys" if word == "include" else f"write `{key}` at the steps in it"
            return Misplaced(261, key, f"`{key}` cannot be next to `{word}`", hint)
        return Misplaced(261, key, f"unknown key '{escape(key)}' next to `{word}`", _beside(key, word, wanted))
    return None


def _beside(key: str, word: str, wanted: Collection[str]) -> str | None:
    """Hint for an unknown key next to a word."""
    if word == "if" and key in ("elif", "elseif", "else_if", "elsif"):
        return "write `else: [{if: {CONDITION}, then: [...]}]`"
    if word == "do" and key in ("params", "parameters", "args", "arguments"):
        return "write `with: {...}`: the values of the parameters of the sub-task"
    if word == "do" and not nearest(key, wanted):
        return f"put a parameter of the sub-task below `with`: `with: {{{escape(key)}: ...}}`"
    return did_you_mean(key, wanted, kind=f"keys next to `{word}`") or _usual(word)


def _without_word(others: list[str], verbs: Collection[str]) -> Misplaced | None:
    key = next((key for key in others if key in _OWNER), None)
    if key is None:
        return _misspelt(others, verbs)
    word = _OWNER[key]
    verb = next((other for other in others if other in verbs), None)
    misspelt = next((other for other in others if other not in _OWNER and other not in verbs), None)
    if verb is not None and key == "with":
        hint = "for other values in retries write `on_fail: {retry: 2, with: {NAME: VALUE}}`"
        return Misplaced(261, key, f"`with` belongs to `do`, not to the verb `{verb}`", hint)
    if verb is not None:
        return Misplaced(261, key, f"`{key}` belongs to `{word}`, not to the verb `{verb}`", _usual(word))
    if misspelt is not None:
        near = did_you_mean(misspelt, [word]) if nearest(misspelt, [word]) else None
        return Misplaced(
            260, misspelt, f"unknown verb '{escape(misspelt)}'", near or other_word(misspelt) or _usual(word)
        )
    hint = _usual(word) + (f"; for a group write `{FORMS['sequence']}`" if key == "steps" else "")
    return Misplaced(261, key, f"`{key}` without `{word}`", hint)


def other_word(key: str) -> str | None:
    """Hint for a word of another language: how its counterpart is written; None for other words."""
    return _usual(SYNONYMS[key]) if key in SYNONYMS else None


def _misspelt(others: list[str], verbs: Collection[str]) -> Misplaced | None:
    """A misspelt word of structure in an item without a verb: what stands in it is not read as a step."""
    if not others or any(key in verbs for key in others):
        return None
    key, known = others[0], (*verbs, *WORDS)
    if not any(near in WORDS for near in nearest(key, known)):
        return None
    message = f"unknown verb '{escape(key)}', expected one of {listed(known, most=40)}"
    return Misplaced(203, key, message, did_you_mean(key, known))


def _usual(word: str) -> str:
    each = " or `repeat: {each: {NAME: [...]}, steps: [...]}`" if word == "repeat" else ""
    return f"write `{FORMS[word]}`{each}"


FORMS: Final[Mapping[str, str]] = {
    "sequence": "sequence: [STEP, ...]",
    "repeat": "repeat: {times: 3, steps: [...]}",
    "if": "if: {CONDITION}, then: [...], else: [...]",
    "parallel": "parallel: [STEP, STEP]",
    "do": "do: FILE.yaml, with: {NAME: VALUE}",
    "include": "include: FILE.yaml",
}
"""How each word is written."""
