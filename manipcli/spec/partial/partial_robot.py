"""The valid part of a faulty robot file, so that the rest can be checked, too.

Places stay those of the file; the result is never planned or run.
"""

from __future__ import annotations

from dataclasses import replace

from pydantic import ValidationError

from manipcli.core.errors import Loc
from manipcli.spec.located import Located, Source
from manipcli.spec.robot import RobotSpec
from manipcli.spec.source.tree import Entry, MappingNode, Node, ScalarNode, SequenceNode, without

_LINKS = ("description", "args", "attach")
"""Keys without which the links and joints are unknown."""
_NAMED = ("groups", "poses", "tool", "transmissions")
"""Keys whose names a task uses."""
_ROUNDS = 5


def salvage_robot(source: Source, model: type[RobotSpec] = RobotSpec) -> Located[RobotSpec] | None:
    """The robot file without invalid values; None if the links and joints are unknown. `model`: see `load_robot`."""
    root = source.root
    for _ in range(_ROUNDS):
        if not isinstance(root, MappingNode):
            return None
        left = replace(source, root=root, whole=source.root)
        try:
            return Located(model.model_validate(left.plain()), left)
        except ValidationError as error:
            faults = dict.fromkeys(fault["loc"] for fault in error.errors(include_url=False))
            if any(fault[0] in _LINKS for fault in faults):
                return None
            # Groups last: the poses of a removed group are removed with it.
            root = _without(root, sorted(faults, key=lambda fault: fault[0] == "groups"))
    return None


def is_whole(file: Located[RobotSpec]) -> bool:
    """Whether no name that a task may use was removed from the file."""
    return all(file.source.untouched(key) for key in _NAMED)


def _without(root: MappingNode, faults: list[Loc]) -> MappingNode:
    pairs = {fault[1] for fault in faults if fault[0] == "collision_ignore" and len(fault) > 1}
    ignored = root.get("collision_ignore")
    if pairs and isinstance(ignored, SequenceNode):
        items = tuple(item for k, item in enumerate(ignored.items) if k not in pairs)
        root = root.with_node("collision_ignore", SequenceNode(items, ignored.place))
    for fault in faults:
        head, *below = fault
        if head == "robot":
            root = root.with_node("robot", ScalarNode("left out", root.place))
        elif head == "poses" and below:
            root = root.with_node("poses", _unposed(root, *map(str, below[:2])))
        elif head != "collision_ignore" or not below:
            root = without(root, fault[: 3 if head == "limits" else 2])
        if head == "groups":
            root = _ungrouped(root, *map(str, below[:1]))
        if head == "transmissions":  # the actuators are then unknown
            root = root.without("actuators")
    return root


def _unposed(root: MappingNode, pose: str, group: str | None = None) -> Node:
    """The poses, with this pose (or its part for `group`) emptied: other poses may refer to it."""
    poses = root.entries["poses"].node
    assert isinstance(poses, MappingNode)
    old = poses.entries[pose].node
    empty = MappingNode({}, old.place)
    if isinstance(old, MappingNode) and group in old.entries:
        return poses.with_node(pose, old.with_node(group, empty))
    groups = root.get("groups")
    names = groups.entries if isinstance(groups, MappingNode) else ()
    return poses.with_node(pose, MappingNode({name: Entry(old.place, empty) for name in names}, old.place))


def _ungrouped(root: MappingNode, group: str | None = None) -> MappingNode:
    """Removes the entries of `group` from all poses; without `group`, removes all poses."""
    poses = root.get("poses")
    if not isinstance(poses, MappingNode) or group is None:
        return root.without("poses")
    for name, entry in poses.entries.items():
        if isinstance(entry.node, MappingNode):
            poses = poses.with_node(name, entry.node.without(group))
    return root.with_node("poses", poses)
