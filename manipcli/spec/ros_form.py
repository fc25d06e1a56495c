"""ROS's own forms of the controllers file, rewritten to ours before validation; every value keeps its place.

ROS 1: `arm_controller: {type: effort_controllers/JointTrajectoryController, joints, gains, constraints}`.
ROS 2: `controller_manager: {ros__parameters: {arm_controller: {type: ...}}}` and
`arm_controller: {ros__parameters: {joints, command_interfaces, gains, constraints}}`.

A parameter that ROS knows and manipcli does not serve is left out with a warning; one that nobody knows stays, and
the validation refuses it.
"""

from __future__ import annotations

from manipcli.core.errors import Finding, Place, Severity
from manipcli.core.text import any_of, did_you_mean
from manipcli.spec.tree import Entry, MappingNode, Node, ScalarNode, SequenceNode

_INTERFACES = ("effort", "velocity", "position")
_TRAJECTORY = "JointTrajectoryController"
_GRIPPER = "GripperActionController"
_TYPES = {
    **{f"{interface}_controllers/{_TRAJECTORY}": ("joint_trajectory", interface) for interface in _INTERFACES},
    f"joint_trajectory_controller/{_TRAJECTORY}": ("joint_trajectory", ""),
    f"effort_controllers/{_GRIPPER}": ("gripper", "effort"),
}
_BROADCASTERS = ("joint_state_broadcaster/JointStateBroadcaster", "joint_state_controller/JointStateController")
_UNSERVED = frozenset(
    {
        "state_publish_rate",
        "action_monitor_rate",
        "allow_partial_joints_goal",
        "stop_trajectory_duration",
        "open_loop_control",
        "allow_integration_in_goal_trajectories",
        "allow_nonzero_velocity_at_trajectory_end",
        "interpolation_method",
        "cmd_timeout",
        "allow_trajectory_replacement",
        "interpolate_from_desired_state",
        "command_joints",
        "speed_scaling",
        "positions_upsampling",
        "set_last_command_interface_value_as_state_on_activation",
        "state_interfaces",
        "hold_trajectory_duration",
        "use_sim_time",
        "update_rate",
        "allow_stalling",
    }
)
_UNSERVED_GAINS = frozenset(
    {
        "antiwindup",
        "antiwindup_strategy",
        "tracking_time_constant",
        "error_deadband",
        "u_clamp_max",
        "u_clamp_min",
        "i_clamp_min",
        "i_clamp_max",
        "normalize_error",
        "angle_wraparound",
        "publish_state",
    }
)
_UNSERVED_CONSTRAINTS = frozenset({"decelerate_on_cancel", "max_deceleration_on_cancel"})


def rewrite(root: Node) -> tuple[Node, list[Finding]]:
    """The tree in our form (`controllers: {NAME: ...}`) and warnings; a tree in our form comes back as it is."""
    work = _Rewriting()
    if not isinstance(root, MappingNode) or not root.entries:
        return root, []
    if any(_is_ros2(entry.node) for entry in root.entries.values()):
        return work.ros2(root), work.findings
    wrapped = root.entries.get("controllers")
    if wrapped is None:
        version = {key: entry for key, entry in root.entries.items() if key == "version"}
        wrapped = Entry(root.place, root.without("version"))
        root = MappingNode({**version, "controllers": wrapped}, root.place)
    if isinstance(wrapped.node, MappingNode):
        entries = {
            name: Entry(entry.key_place, node)
            for name, entry in wrapped.node.entries.items()
            if (node := work.controller(name, entry)) is not None
        }
        root = root.with_entry("controllers", Entry(wrapped.key_place, MappingNode(entries, wrapped.node.place)))
    return root, work.findings


def _is_ros2(node: Node) -> bool:
    return isinstance(node, MappingNode) and "ros__parameters" in node.entries


def _mapping(node: Node | None) -> MappingNode | None:
    return node if isinstance(node, MappingNode) else None


def _text(node: Node | None) -> str:
    return node.value if isinstance(node, ScalarNode) and isinstance(node.value, str) else ""


def _opposite(a: ScalarNode, b: ScalarNode) -> bool:
    return isinstance(a.value, int | float) and isinstance(b.value, int | float) and a.value == -b.value


class _Rewriting:
    def __init__(self) -> None:
        self.findings: list[Finding] = []

    def warn(self, place: Place, message: str, hint: str | None = None) -> None:
        self.findings.append(Finding("CTRL214", message, place, hint=hint, severity="warning"))

    def ros2(self, root: MappingNode) -> Node:
        """The types stand at the controller manager, the parameters at the controllers' own nodes."""
        manager = _mapping(root.get("controller_manager"))
        listed = _mapping(manager.get("ros__parameters")) if manager is not None else None
        entries: dict[str, Entry] = {}
        for name, entry in (listed.entries if listed is not None else {}).items():
            declared = _mapping(entry.node)
            if declared is None:
                self.unserved(name, entry, _UNSERVED, where="controller_manager")
                continue
            own = root.entries.get(name)
            block = _mapping(own.node) if own is not None else None
            parameters = _mapping(block.get("ros__parameters")) if block is not None else None
            merged = MappingNode(
                {**declared.entries, **(parameters.entries if parameters is not None else {})},
                parameters.place if parameters is not None else declared.place,
            )
            node = self.controller(name, Entry(entry.key_place, merged))
            if node is not None:
                entries[name] = Entry(own.key_place if own is not None else entry.key_place, node)
        for name, entry in root.entries.items():
            if name == "controller_manager" or name in entries or (listed is not None and name in listed.entries):
                continue
            node = _mapping(entry.node)
            parameters = _mapping(node.get("ros__parameters")) if node is not None else None
            if parameters is not None and parameters.get("type") is not None:
                made = self.controller(name, Entry(entry.key_place, parameters))
                if made is not None:
                    entries[name] = Entry(entry.key_place, made)
                continue
            hint = did_you_mean(name, listed.entries, kind="it names") if listed is not None else None
            message = f"the controller_manager names no controller '{name}'"
            self.findings.append(Finding("CTRL203", message, entry.key_place, hint=hint))
        return MappingNode({"controllers": Entry(root.place, MappingNode(entries, root.place))}, root.place)

    def controller(self, name: str, entry: Entry) -> Node | None:
        """One controller in our form; None when there is nothing to build for it."""
        node = _mapping(entry.node)
        word = _text(node.get("type")) if node is not None else ""
        if node is None or "/" not in word:
            return entry.node
        place = node.entries["type"].node.place
        if word in _BROADCASTERS:
            message = f"controller '{name}' is not needed: joint states are always recorded"
            self.findings.append(Finding("CTRL214", message, place, severity="note"))
            return None
        if word not in _TYPES:
            hint = did_you_mean(word, _TYPES, kind="served")
            self.findings.append(Finding("CTRL203", f"the controller type '{word}' is not served", place, hint=hint))
            return None
        own, interface = _TYPES[word]
        node = node.with_entry("type", Entry(node.entries["type"].key_place, ScalarNode(own, place, written=word)))
        if interface and "command_interface" not in node.entries:
            node = node.with_entry("command_interface", Entry(place, ScalarNode(interface, place)))
        node = self.interfaces(name, node)
        return self.trajectory(name, node) if own == "joint_trajectory" else self.gripper(name, node)

    def interfaces(self, name: str, node: MappingNode) -> MappingNode:
        """ROS 2's list `command_interfaces`: we command one, the strongest of it."""
        entry = node.entries.get("command_interfaces")
        if entry is None or not isinstance(entry.node, SequenceNode):
            return node
        given = [_text(item) for item in entry.node.items]
        chosen = next((interface for interface in _INTERFACES if interface in given), None)
        if chosen is None:
            return node
        rest = [interface for interface in given if interface != chosen]
        if rest:
            self.warn(entry.node.place, f"controller '{name}' commands {chosen} alone, not {any_of(rest)}")
        value = ScalarNode(chosen, entry.node.place)
        return node.without("command_interfaces").with_entry("command_interface", Entry(entry.key_place, value))

    def trajectory(self, name: str, node: MappingNode) -> Node:
        node = self.served(name, node, _UNSERVED)
        gains = _mapping(node.get("gains"))
        forward = _mapping(node.get("velocity_ff"))
        if gains is not None:
            entries = {joint: Entry(e.key_place, self.gains(name, e.node)) for joint, e in gains.entries.items()}
            if forward is not None:
                for joint, scale in forward.entries.items():
                    block = _mapping(entries[joint].node) if joint in entries else MappingNode({}, scale.key_place)
                    if block is not None:
                        added = block.with_entry("ff_velocity_scale", scale)
                        entries[joint] = Entry(entries[joint].key_place if joint in entries else scale.key_place, added)
                node = node.without("velocity_ff")
            node = node.with_entry("gains", Entry(node.entries["gains"].key_place, MappingNode(entries, gains.place)))
        constraints = _mapping(node.get("constraints"))
        if constraints is not None:
            made = self.constraints(name, constraints)
            node = node.with_entry("constraints", Entry(node.entries["constraints"].key_place, made))
        return node

    def gains(self, name: str, node: Node) -> Node:
        block = _mapping(node)
        if block is None:
            return node
        most, least = block.get("i_clamp_max"), block.get("i_clamp_min")
        if "i_clamp" not in block.entries and isinstance(most, ScalarNode):
            symmetric = not isinstance(least, ScalarNode) or _opposite(least, most)
            clamp = block.entries["i_clamp_max"]
            block = block.without("i_clamp_max", *(("i_clamp_min",) if symmetric else ())).with_entry("i_clamp", clamp)
        return self.served(name, block, _UNSERVED_GAINS)

    def constraints(self, name: str, block: MappingNode) -> Node:
        """ROS writes the joints beside `goal_time`; a tolerance of 0 means that it is not enforced."""
        block = self.served(name, block, _UNSERVED_CONSTRAINTS)
        kept: dict[str, Entry] = {}
        joints: dict[str, Entry] = {}
        for key, entry in block.entries.items():
            inner = _mapping(entry.node)
            if inner is None or key == "joints":
                kept[key] = entry
                continue
            inner = self.served(name, inner, _UNSERVED_CONSTRAINTS)
            zero = [k for k, e in inner.entries.items() if isinstance(e.node, ScalarNode) and e.node.value in (0, 0.0)]
            joints[key] = Entry(entry.key_place, inner.without(*(k for k in zero if k in ("goal", "trajectory"))))
        if joints and "joints" not in kept:
            kept["joints"] = Entry(block.place, MappingNode(joints, block.place))
        return MappingNode(kept, block.place)

    def gripper(self, name: str, node: MappingNode) -> Node:
        node = self.served(name, node, _UNSERVED)
        renamed = {"stall_velocity_threshold": "stall_velocity", "stall_timeout": "stall_time"}
        entries: dict[str, Entry] = {}
        for key, entry in node.entries.items():
            if key == "joint" and isinstance(entry.node, ScalarNode):
                entries["joints"] = Entry(entry.key_place, SequenceNode((entry.node,), entry.node.place))
            else:
                entries[renamed.get(key, key)] = entry
        return MappingNode(entries, node.place)

    def served(self, name: str, node: MappingNode, unserved: frozenset[str]) -> MappingNode:
        """`node` without the parameters that ROS knows and we do not serve."""
        out = [key for key, entry in node.entries.items() if self.unserved(key, entry, unserved, where=name)]
        return node.without(*out)

    def unserved(self, key: str, entry: Entry, unserved: frozenset[str], *, where: str) -> bool:
        if key not in unserved:
            if where == "controller_manager":
                self.findings.append(Finding("CTRL201", f"{where}: unknown key '{key}'", entry.key_place))
            return False
        # What is only about publishing or reading states changes nothing here, and needs no warning's attention.
        severity: Severity = "note" if key in ("state_interfaces", "use_sim_time", "state_publish_rate") else "warning"
        message = f"{where}: ROS knows '{key}', manipcli does not serve it: left out"
        self.findings.append(Finding("CTRL214", message, entry.key_place, severity=severity))
        return True
