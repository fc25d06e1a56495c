"""Unresolved launch-file substitutions: `$(arg prefix)`, `$(var tf_prefix)`."""

from __future__ import annotations

import re
from collections.abc import Iterator

from manipcli.core.errors import Diagnostic, Place
from manipcli.spec.source.tree import MappingNode, Node, ScalarNode, SequenceNode

_SUBSTITUTION = re.compile(r"\$\([a-z][^()]*\)")


def open_substitutions(root: Node) -> list[Diagnostic]:
    """An error for each substitution in a controller or its name, at its first place.

    Args:
        root: a tree in our form; parts of a ROS file that are left out need no values.
    """
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
            hint="replace it by its value; delete it if the value is empty",
        )
        for word, at in places.items()
    ]


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
