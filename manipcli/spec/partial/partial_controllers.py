"""What remains of a controllers file once everything that is wrong in it is left out, value by value: so that the names
in the rest can be checked, too.

As of tasks (`salvage.py`): the places stay those of the file, and nothing salvaged is ever planned or run.
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
"""A value, the block that it leaves short, the controller, what pydantic looks at late."""


def salvage_controllers(source: Source, model: type[ControllersSpec]) -> Located[ControllersSpec] | None:
    """The controllers without the values that are wrong; None where names are for a launch file to complete, or
    nothing coherent remains."""
    root = source.root
    if open_substitutions(root):
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
    """Without the value at `path`, or the block that lacks it, unless it has gone already with what was around it."""
    inside = path[:-1] if missing else path
    node: Node | None = root
    for part in inside:
        node = None if node is None else child(node, part)
    return root if node is None or not inside else without(root, inside)
