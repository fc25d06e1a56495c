"""Launch-file substitutions, `$(var tf_prefix)`: values from the robot file's `args:`, and those left open."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from manipcli.core.errors import Diagnostic, Place, Severity
from manipcli.spec.robot import Arguments
from manipcli.spec.source.tree import Entry, MappingNode, Node, ScalarNode, SequenceNode

_SUBSTITUTION = re.compile(r"\$\([a-z][^()]*\)")
_NAMED = re.compile(r"\$\((?:var|arg)\s+([^()\s]+)\s*\)")


def substituted(node: Node, values: Arguments) -> Node:
    """The tree with `$(var NAME)` and `$(arg NAME)` replaced in keys and strings, where `values` has the name.

    A string that is a single substitution becomes the value itself, which may be a number.
    """
    if not values:
        return node
    if isinstance(node, MappingNode):
        entries = {
            str(_filled(key, values)): Entry(entry.key_place, substituted(entry.node, values))
            for key, entry in node.entries.items()
        }
        return MappingNode(entries, node.place)
    if isinstance(node, SequenceNode):
        return SequenceNode(tuple(substituted(item, values) for item in node.items), node.place)
    if isinstance(node.value, str):
        return ScalarNode(_filled(node.value, values), node.place, node.written)
    return node


def _filled(text: str, values: Arguments) -> bool | int | float | str:
    whole = _NAMED.fullmatch(text)
    if whole is not None and whole[1] in values:
        return values[whole[1]]
    return _NAMED.sub(lambda match: str(values.get(match[1], match[0])), text)


def open_substitutions(root: Node, values: Mapping[str, object] | None) -> list[Diagnostic]:
    """A finding for each substitution in a controller or its name, at its first place.

    Args:
        root: a tree in our form; parts of a ROS file that are left out need no values.
        values: those that are known; None without a robot file: the findings are then warnings.
    """
    severity: Severity = "warning" if values is None else "error"
    controllers = root.get("controllers") if isinstance(root, MappingNode) else None
    named = controllers.entries.values() if isinstance(controllers, MappingNode) else ()
    places: dict[str, dict[tuple[int, int], Place]] = {}
    for text, place in (found for entry in named for found in _texts(entry.node)):
        for word in _SUBSTITUTION.findall(text):
            places.setdefault(word, {}).setdefault((place.line, place.column), place)
    return [
        Diagnostic(
            "CTRL217",
            f"unresolved launch substitution '{word}'" + (f" in {len(at)} places" if len(at) > 1 else ""),
            at[min(at)],
            hint=_hint(word),
            severity=severity,
        )
        for word, at in places.items()
    ]


def _hint(word: str) -> str:
    named = _NAMED.fullmatch(word)
    if named is None:
        return "replace it by its value; delete it if the value is empty"
    return f"give its value in the robot file: `args: {{{named[1]}: ...}}` ('' if it is empty)"


def _texts(node: Node) -> Iterator[tuple[str, Place]]:
    """All keys and strings, with their places."""
    if isinstance(node, MappingNode):
        for key, entry in node.entries.items():
            yield key, entry.key_place
            yield from _texts(entry.node)
    elif isinstance(node, SequenceNode):
        for item in node.items:
            yield from _texts(item)
    elif isinstance(node, ScalarNode) and isinstance(node.value, str):
        yield node.value, node.place
