"""What remains of a robot file once everything that is wrong in it is left out: so that the rest can be checked, too.

As of tasks (`salvage.py`): the places stay those of the file, and nothing salvaged is ever planned or run.
"""

from __future__ import annotations

from dataclasses import replace

from pydantic import ValidationError

from manipcli.core.errors import Loc
from manipcli.spec.located import Located, Source
from manipcli.spec.robot import RobotSpec
from manipcli.spec.source.tree import Entry, MappingNode, Node, ScalarNode, SequenceNode, without

_LINKS = ("description", "args", "attach")
"""Without these it is not known which links and joints there are."""
_NAMED = ("groups", "poses", "tool", "transmissions")
"""What a task asks a robot for."""
_ROUNDS = 5


def salvage_robot(source: Source) -> Located[RobotSpec] | None:
    """The robot file without what is wrong in it; None where it is not known what the rest speaks of."""
    root = source.root
    for _ in range(_ROUNDS):
        if not isinstance(root, MappingNode):
            return None
        left = replace(source, root=root, whole=source.root)
        try:
            return Located(RobotSpec.model_validate(left.plain()), left)
        except ValidationError as error:
            faults = dict.fromkeys(one["loc"] for one in error.errors(include_url=False))
            if any(fault[0] in _LINKS for fault in faults):
                return None
            # Groups last: what poses say of a lost one goes with it.
            root = _without(root, sorted(faults, key=lambda fault: fault[0] == "groups"))
    return None


def is_whole(file: Located[RobotSpec]) -> bool:
    """Whether the robot has everything that a task may ask it for, though errors were left out of its file."""
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
        if head == "transmissions":  # it is not known which actuators there are
            root = root.without("actuators")
    return root


def _unposed(root: MappingNode, pose: str, group: str | None = None) -> Node:
    """The poses, of which this one (its part of one group) says nothing any more: others may name it."""
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
    """Without what poses say of a group that is not known any more, or of all of them."""
    poses = root.get("poses")
    if not isinstance(poses, MappingNode) or group is None:
        return root.without("poses")
    for name, entry in poses.entries.items():
        if isinstance(entry.node, MappingNode):
            poses = poses.with_node(name, entry.node.without(group))
    return root.with_node("poses", poses)
