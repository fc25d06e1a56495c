"""Restructuring of ROS controller blocks that tables of parameters cannot express."""

from __future__ import annotations

from manipcli.spec.source.tree import Entry, MappingNode, Node, ScalarNode, SequenceNode, plain


def chained(node: MappingNode, key: str) -> MappingNode:
    """Replaces `CONTROLLER/joint` in the list under `key` by the joint, and adds `chained_to: CONTROLLER`.

    Unchanged unless every item names the same controller; gains by such a name are then by joint, too.
    """
    listed = node.get(key)
    items = listed.items if isinstance(listed, SequenceNode) else ()
    parts = [str(item.value).rpartition("/") for item in items if isinstance(item, ScalarNode)]
    targets = {target for target, _, _ in parts}
    if not parts or len(parts) != len(items) or len(targets) != 1 or "" in targets:
        return node
    (target,) = targets
    joints = SequenceNode(
        tuple(ScalarNode(joint, item.place) for (_, _, joint), item in zip(parts, items, strict=True)), node.place
    )
    gains = node.entries.get("gains")
    if gains is not None and isinstance(gains.node, MappingNode):
        inner = {name.removeprefix(f"{target}/"): entry for name, entry in gains.node.entries.items()}
        node = node.with_entry("gains", Entry(gains.key_place, MappingNode(inner, gains.node.place)))
    place = node.entries[key].key_place
    node = node.with_entry(key, Entry(place, joints))
    return node.with_entry("chained_to", Entry(place, ScalarNode(target, place)))


def forward(node: MappingNode) -> MappingNode:
    """Replaces the single `joint` of ROS 1, and references of another controller."""
    return chained(one_joint(node), "joints")


def joint_trajectory(node: MappingNode) -> MappingNode:
    """Moves `velocity_ff` into the gains and tolerances under `joints`; removes tolerances of 0 (not enforced).

    `command_joints` that are references of another controller, in the order of `joints`, become `chained_to`; those
    that are the joints themselves are removed.
    """
    node = _without_same(_feed_forward(chained(node, "command_joints")), "command_joints")
    constraints = node.entries.get("constraints")
    if constraints is None or not isinstance(constraints.node, MappingNode):
        return node
    kept: dict[str, Entry] = {}
    joints: dict[str, Entry] = {}
    for key, entry in constraints.node.entries.items():
        if key != "joints" and isinstance(entry.node, MappingNode):
            joints[key] = Entry(entry.key_place, without_zeros(entry.node))
        else:
            kept[key] = entry
    place = constraints.node.place
    if joints and "joints" not in kept:
        kept["joints"] = Entry(place, MappingNode(joints, place))
    return node.with_entry("constraints", Entry(constraints.key_place, MappingNode(kept, place)))


def one_joint(node: MappingNode) -> MappingNode:
    """Replaces the single `joint` of ROS 1 by `joints`."""
    entry = node.entries.get("joint")
    if entry is None or "joints" in node.entries or not isinstance(entry.node, ScalarNode):
        return node
    listed: Node = SequenceNode((entry.node,), entry.node.place)
    return MappingNode(
        {
            ("joints" if key == "joint" else key): (Entry(value.key_place, listed) if key == "joint" else value)
            for key, value in node.entries.items()
        },
        node.place,
    )


def pid(node: MappingNode) -> MappingNode:
    """Moves `pid` of ROS 1, next to `joint` or under each joint name, into `gains`."""
    alone = node.get("joint")
    gains: dict[str, Entry] = {}
    if isinstance(alone, ScalarNode) and isinstance(alone.value, str) and "pid" in node.entries:
        gains[alone.value] = node.entries["pid"]
        node = node.without("pid")
    joints = node.get("joints")
    for item in joints.items if isinstance(joints, SequenceNode) else ():
        name = item.value if isinstance(item, ScalarNode) else None
        own = node.get(name) if isinstance(name, str) else None
        if isinstance(name, str) and isinstance(own, MappingNode) and own.entries.keys() == {"pid"}:
            gains[name] = own.entries["pid"]
            node = node.without(name)
    if gains and "gains" not in node.entries:
        place = next(iter(gains.values())).key_place
        node = node.with_entry("gains", Entry(place, MappingNode(gains, place)))
    node = chained(one_joint(node), "joints")
    return _without_same(node, "reference_and_state_dof_names")


def _without_same(node: MappingNode, key: str) -> MappingNode:
    """Removes a list of joints that is the same as `joints`."""
    given, joints = node.get(key), node.get("joints")
    same = given is not None and joints is not None and plain(given) == plain(joints)
    return node.without(key) if same else node


def without_zeros(block: MappingNode) -> MappingNode:
    """Removes tolerances of 0, which ROS does not enforce."""
    zeros = [
        key
        for key in ("goal", "trajectory")
        if isinstance(found := block.get(key), ScalarNode) and found.value in (0, 0.0)
    ]
    return block.without(*zeros)


def _feed_forward(node: MappingNode) -> MappingNode:
    scales, gains = node.get("velocity_ff"), node.get("gains")
    if not isinstance(scales, MappingNode) or not (gains is None or isinstance(gains, MappingNode)):
        return node
    entries = {} if gains is None else dict(gains.entries)
    for joint, scale in scales.entries.items():
        own = entries.get(joint)
        block = MappingNode({}, scale.key_place) if own is None else own.node
        if isinstance(block, MappingNode):
            key_place = scale.key_place if own is None else own.key_place
            entries[joint] = Entry(key_place, block.with_entry("ff_velocity_scale", scale))
    made = MappingNode(entries, scales.place if gains is None else gains.place)
    key = node.entries["velocity_ff" if gains is None else "gains"].key_place
    return node.without("velocity_ff").with_entry("gains", Entry(key, made))
