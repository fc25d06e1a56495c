"""The valid part of a faulty controllers file, so that the names in it can be checked, too.

Invalid values are removed one by one. Places stay those of the file; the result is never planned or run.
"""

from __future__ import annotations

from dataclasses import replace

from pydantic import ValidationError

from manipcli.core.errors import Loc
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.located import Located, Source
from manipcli.spec.ros.substitutions import open_substitutions
from manipcli.spec.source.tree import MappingNode, Node, child, without

_ROUNDS = 5
"""A value, the block it belongs to, the controller, and errors that pydantic reports last."""


def salvage_controllers(source: Source, model: type[ControllersSpec]) -> Located[ControllersSpec] | None:
    """The controllers without invalid values; None if names contain launch substitutions, or nothing valid remains."""
    root = source.root
    if open_substitutions(root, {}):
        return None
    for _ in range(_ROUNDS):
        if not isinstance(root, MappingNode):
            return None
        left = replace(source, root=root, whole=source.root)
        try:
            return Located(model.model_validate(left.plain()), left)
        except ValidationError as error:
            for fault in error.errors(include_url=False):
                loc = fault["loc"]
                root = _without(root, (*loc[:2], *loc[3:]), missing=fault["type"] == "missing")  # [2]: pydantic's type
    return None


def _without(root: MappingNode, path: Loc, *, missing: bool) -> MappingNode:
    """Removes the value at `path`, or the block that lacks it, unless it is already removed."""
    inside = path[:-1] if missing else path
    node: Node | None = root
    for part in inside:
        node = None if node is None else child(node, part)
    return root if node is None or not inside else without(root, inside)
