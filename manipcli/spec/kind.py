"""A file given in the place of another kind, refused in one finding instead of by all that it lacks."""

from __future__ import annotations

from collections.abc import Collection

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.spec.ros.nodes import MANAGER
from manipcli.spec.source.tree import MappingNode, Node, ScalarNode, SequenceNode

_DESCRIPTIONS = (".urdf", ".xacro")


def refuse_description(name: str, wanted: str) -> None:
    """A URDF or xacro, known by its `name`, where a file of the kind `wanted` belongs.

    Raises:
        InvalidInput: USE105 it is one.
    """
    if name.lower().endswith(_DESCRIPTIONS):
        raise _refusal(name, "a robot description", wanted, hint=f"a robot file names it: `description: {name}`")


def refuse_other_kind(root: Node, name: str, wanted: str) -> None:
    """The tree of the file `name` is of another kind than `wanted`, without doubt.

    Raises:
        InvalidInput: USE105 it is.
    """
    found = _certain_kind(root) if isinstance(root, MappingNode) else None
    if found is not None and found != wanted:
        raise _refusal(name, f"a {found} file", wanted)


def names_controllers(node: Node, types: Collection[str]) -> bool:
    """Whether there is a controller, of ROS or of one of our types, or ROS's manager of them, at or below this."""
    return isinstance(node, MappingNode) and any(
        key == MANAGER
        or (key.rpartition(".")[2] == "type" and _is_controller(entry.node, types))
        or names_controllers(entry.node, types)
        for key, entry in node.entries.items()
    )


def _is_controller(kind: Node, types: Collection[str]) -> bool:
    word = kind.value if isinstance(kind, ScalarNode) else None
    return isinstance(word, str) and ("/" in word or word in types)


def _certain_kind(root: MappingNode) -> str | None:
    """Which kind this is; None for the controllers files of ROS, and where keys of several kinds stand together."""
    entries = root.entries
    texts = {key for key, entry in entries.items() if isinstance(entry.node, ScalarNode)}
    if "task" in texts or ("steps" in entries and isinstance(entries["steps"].node, SequenceNode)):
        return "task"
    if {"robot", "description"} <= texts:
        return None if entries.keys() & {"controllers", "scene", "expect"} else "robot"
    if entries.keys() <= {"version", "controllers"} and "controllers" in entries.keys() - texts:
        return "controllers"
    return None


def _refusal(name: str, found: str, wanted: str, *, hint: str | None = None) -> InvalidInput:
    message = f"this is {found}; a {wanted} file was expected"
    return InvalidInput([Diagnostic("USE105", message, Place(name, 1, 1), hint=hint)])
