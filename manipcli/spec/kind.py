"""Refusal of a file of the wrong kind, with one diagnostic instead of all its missing keys."""

from __future__ import annotations

from collections.abc import Collection

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.spec.ros.nodes import MANAGER
from manipcli.spec.source.tree import MappingNode, Node, ScalarNode, SequenceNode

_DESCRIPTIONS = (".urdf", ".xacro")


def refuse_description(name: str, wanted: str) -> None:
    """Refuses a URDF or xacro, recognised by its `name`, instead of a file of the kind `wanted`.

    Raises:
        InvalidInput: USE105 the file is a URDF or xacro.
    """
    if name.lower().endswith(_DESCRIPTIONS):
        raise _refusal(name, "a robot description", wanted, hint=f"name it in a robot file: `description: {name}`")


def refuse_other_kind(root: Node, name: str, wanted: str) -> None:
    """Refuses the file `name` if its tree is certainly not of the kind `wanted`.

    Raises:
        InvalidInput: USE105 the file is of another kind.
    """
    found = _certain_kind(root) if isinstance(root, MappingNode) else None
    if wanted == "task" and isinstance(root, MappingNode) and _is_sub_task(root):
        hint = "check a task that uses it: `do: " + name.rpartition("/")[2] + "`"
        raise _refusal(name, "a sub-task", wanted, hint=hint)
    if found is not None and found != wanted:
        raise _refusal(name, f"a {found} file", wanted)


def names_controllers(node: Node, types: Collection[str]) -> bool:
    """Whether this or a block below is a controller of ROS or of one of `types`, or ROS's controller manager."""
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
    """The kind of file; None for ROS controllers files and for mixed keys of several kinds."""
    entries = root.entries
    texts = {key for key, entry in entries.items() if isinstance(entry.node, ScalarNode)}
    if "task" in texts or ("steps" in entries and isinstance(entries["steps"].node, SequenceNode)):
        return "task"
    if {"robot", "description"} <= texts:
        return None if entries.keys() & {"controllers", "scene", "expect"} else "robot"
    if entries.keys() <= {"version", "controllers"} and "controllers" in entries.keys() - texts:
        return "controllers"
    return None


def _is_sub_task(root: MappingNode) -> bool:
    """Whether the file has no robot, and declares the types of its params."""
    params = root.get("params")
    declares = isinstance(params, MappingNode) and any(
        isinstance(entry.node, MappingNode) and "type" in entry.node.entries for entry in params.entries.values()
    )
    return declares and root.entries.keys().isdisjoint(("task", "robot", "controllers"))


def _refusal(name: str, found: str, wanted: str, *, hint: str | None = None) -> InvalidInput:
    message = f"expected a {wanted} file, not {found}"
    return InvalidInput([Diagnostic("USE105", message, Place(name, 1, 1), hint=hint)])
