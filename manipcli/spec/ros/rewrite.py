"""Rewriting of a tree in a form of ROS to our form, with diagnostics."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Literal

from pydantic import BaseModel

from manipcli.core.errors import Diagnostic, Place, Severity
from manipcli.core.text import any_of, did_you_mean, listed, nearest
from manipcli.spec.controllers import ControllerSpec, Role
from manipcli.spec.ros.nodes import MANAGER, Found, at_nodes, has_type, in_namespaces, is_ros2, mapping, named
from manipcli.spec.ros.questions import (
    commanded_joints,
    implied,
    is_typo,
    is_vendor_type,
    may_be,
    neutral,
    renamed,
    scalar_at,
    value_at,
)
from manipcli.spec.ros.table import Block, Table, model_below
from manipcli.spec.ros.tables import (
    BY_TYPE,
    DEFAULTS,
    ELSEWHERE,
    INTERFACES,
    OTHER_NODES,
    SIMULATORS,
    UNSERVED_TYPES,
)
from manipcli.spec.ros.tables import MANAGER as MANAGER_BLOCK
from manipcli.spec.ros.wildcards import Wildcards
from manipcli.spec.source.tree import Entry, MappingNode, Node, ScalarNode, plain

_CLAMPS = frozenset({"i_clamp", "i_clamp_min", "i_clamp_max"})


def rewrite(root: Node, types: Mapping[str, type[ControllerSpec]]) -> tuple[Node, list[Diagnostic]]:
    """The tree in our form (`controllers: {NAME: ...}`), and findings; a tree in our form is returned unchanged.

    `types`: specs of our controllers, by type.
    """
    work = _Rewriting(types)
    if not isinstance(root, MappingNode) or not root.entries:
        return root, []
    version = {key: entry for key, entry in root.entries.items() if key == "version"}
    wrapped = root.entries.get("controllers")
    if is_ros2(root):
        work.form = "ros2"
        found = work.of_nodes(root.without("version"))
        place, rest = root.place, MappingNode(version, root.place)
    elif wrapped is None:
        work.form = "ros1"
        found = work.of_blocks(root.without("version"))
        place, rest = root.place, MappingNode(version, root.place)
    elif isinstance(wrapped.node, MappingNode):
        found = [Found((key,), entry.key_place, entry.node) for key, entry in wrapped.node.entries.items()]
        place, rest = wrapped.key_place, root
    else:
        return root, []
    entries = {
        name: Entry(block.key_place, node)
        for name, block in named(found)
        if (node := work.controller(name, block.node)) is not None
    }
    inner = root.place if wrapped is None else wrapped.node.place
    made = MappingNode(work.started(entries), inner)
    if work.form is not None and work.foreign:
        work.unlike_ros(entries)
    if work.form == "ros2" and work.foreign:
        rest = rest.with_entry("compat", Entry(place, ScalarNode("ros2", place)))
    findings = sorted(work.findings, key=lambda f: (f.place.line, f.place.column) if f.place is not None else (0, 0))
    return rest.with_entry("controllers", Entry(place, made)), findings


class _Rewriting:
    """The rewriting of one file.

    `foreign`: controllers in a form of ROS, which does not state whether they are active. `form`: that of the file;
    None for ours, with ROS types.
    """

    def __init__(self, types: Mapping[str, type[ControllerSpec]]) -> None:
        self.findings: list[Diagnostic] = []
        self.models = types
        self.form: Literal["ros1", "ros2"] | None = None
        self.foreign: list[str] = []

    def report(
        self, code: str, place: Place, message: str, *, hint: str | None = None, severity: Severity = "error"
    ) -> None:
        self.findings.append(Diagnostic(code, message, place, hint=hint, severity=severity))

    def unknown(self, where: str, key: str, place: Place, known: Iterable[str]) -> None:
        """Reports an unknown key: a warning in a file of ROS, whose nodes ignore it; an error if it is one of ours."""
        ours = any(key in model.model_fields for model in self.models.values())
        if self.form is None or ours:
            self.report("CTRL201", place, f"{where}: unknown key '{key}'", hint=did_you_mean(key, known, kind="known"))
        else:
            near = nearest(key, known)
            hint = f"did you mean {any_of(near)}?" if near else None
            message = f"{where}: unknown key '{key}': left out, as in ROS"
            self.report("CTRL201", place, message, hint=hint, severity="warning")

    def other_node(self, block: Found) -> None:
        """Reports a node that is not a controller."""
        simulator = block.name in SIMULATORS
        what = "a simulator's plugin" if simulator else "not a controller"
        severity: Severity = "note" if simulator else "warning"
        self.report("CTRL214", block.key_place, f"'{block.name}' is {what}: left out", severity=severity)

    def unlike_ros(self, entries: Mapping[str, Entry]) -> None:
        """One note on all defaults that differ from those of ROS, and one on a `goal_time` of 0 in ROS 2."""
        differing: dict[str, None] = {}
        endless: list[str] = []
        for name in self.foreign:
            node = entries[name].node
            for key, text in DEFAULTS.get(str(scalar_at(node, "type")), {}).items():
                if self.form in text and value_at(node, key) is None:
                    differing.setdefault(f"{key} {text[self.form]}")
            given = value_at(node, "constraints.goal_time")
            if given is not None and plain(given) in (0, 0.0):
                endless.append(name)
        if differing:
            first = entries[self.foreign[0]].key_place
            self.report("CTRL218", first, f"defaults that differ from ROS's: {'; '.join(differing)}", severity="note")
        if endless and self.form == "ros2":
            message = f"goal_time 0 of {listed(endless, most=3)} means no time limit, as in ROS 2 (`compat: ros2`)"
            hint = "`compat: ros1` in the robot file: no extra time"
            self.report("CTRL219", entries[endless[0]].key_place, message, hint=hint, severity="note")

    def of_blocks(self, root: MappingNode) -> list[Found]:
        """The controllers of a ROS 1 file, or of our form without `controllers:`."""
        found = []
        for block in in_namespaces(root):
            if block.name in OTHER_NODES | SIMULATORS and not has_type(block.node):
                self.other_node(block)
            else:
                found.append(block)
        return found

    def of_nodes(self, root: MappingNode) -> list[Found]:
        """The controllers of a ROS 2 file: their types are at the controller manager or at their own nodes."""
        nodes = list(at_nodes(root))
        managers = [node for node in nodes if node.name in (MANAGER, "")]
        wildcards = Wildcards([node for node in managers if not node.name], self.models)
        own = [node for node in nodes if node not in managers]
        declared = [found for manager in managers for found in self.declared(manager)]
        used: list[Found] = []
        found = []
        for controller in declared:
            blocks = [node for node in own if node.path == controller.path] or [n for n in own if may_be(n, controller)]
            used += blocks
            entries = dict(mapping(controller.node).entries)
            for block in blocks:
                entries.update(mapping(block.node).entries)
            # A missing key is reported at the controller's own block, if it has one.
            nearest = blocks[-1] if blocks else controller
            place = nearest.key_place if blocks else controller.node.place
            found.append(wildcards.given(Found(controller.path, nearest.key_place, MappingNode(entries, place))))
        names = [controller.name for controller in declared]
        for node in own:
            if node in used:
                continue
            given = node if node.name in OTHER_NODES | SIMULATORS else wildcards.given(node)
            if has_type(given.node):
                found.append(given)
            elif node.name in OTHER_NODES | SIMULATORS:
                self.other_node(node)
            else:
                hint = did_you_mean(node.name, names, kind="it names")
                message = f"the controller_manager does not declare controller '{node.name}': left out, as in ROS"
                self.report("CTRL203", node.key_place, message, hint=hint, severity="warning")
        self.of_all(wildcards, found)
        return found

    def of_all(self, wildcards: Wildcards, found: list[Found]) -> None:
        """Reports wildcard parameters that no controller uses."""
        for block, key, entry in wildcards.left():
            where = "/".join(("", *block.path[:-1], "**"))
            if key == "type" and not found:
                message = f"{where}: no controller block uses this type"
                self.report("CTRL203", entry.key_place, message, hint="add `NAME: {ros__parameters: {joints: [...]}}`")
            elif key in ELSEWHERE:
                message = f"{where}: no controller here uses '{key}': left out"
                self.report("CTRL214", entry.key_place, message, severity="warning")
            elif key != "type":
                kinds = {str(plain(kind)) for kind in (mapping(c.node).get("type") for c in found) if kind is not None}
                tables = [BY_TYPE[kind] for kind in sorted(kinds) if kind in BY_TYPE]
                known = [name for t in tables for name in (*self.models[t.own].model_fields, *t.parameters.names)]
                self.unknown(where, key, entry.key_place, [*known, *MANAGER_BLOCK.names, *(c.name for c in found)])

    def declared(self, manager: Found) -> list[Found]:
        """The controllers that a manager declares; reports the manager's own parameters."""
        found, names = [], []
        above = manager.path[:-1]
        for key, entry in mapping(manager.node).entries.items():
            if has_type(entry.node):
                found.append(Found((*above, key), entry.key_place, entry.node))
            else:
                names.append(key)
        for key in names if manager.name else [key for key in names if key in MANAGER_BLOCK.names]:
            self.managers_own(key, mapping(manager.node).entries[key], [controller.name for controller in found])
        return found

    def managers_own(self, key: str, entry: Entry, declared: list[str]) -> None:
        if key == "update_rate":
            rate, hint = plain(entry.node), None
            if isinstance(rate, int | float) and not isinstance(rate, bool) and rate > 0:
                hint = f"write `simulation: {{control_period: {1.0 / rate:g} s}}` in the task"
            message = f"{MANAGER}: 'update_rate' has no effect: the task sets the control rate"
            self.report("CTRL214", entry.key_place, message, hint=hint, severity="note")
        elif not neutral(MANAGER_BLOCK, key, entry.node) and not self.unserved(MANAGER, key, entry, MANAGER_BLOCK):
            self.unknown(MANAGER, key, entry.key_place, [*MANAGER_BLOCK.names, *declared])

    def controller(self, name: str, node: Node) -> Node | None:
        """A controller in our form; None if it is left out."""
        if not isinstance(node, MappingNode) or not has_type(node):
            return node
        word, entry = node.get("type"), node.entries["type"]
        if not isinstance(word, ScalarNode) or not isinstance(word.value, str) or "/" not in word.value:
            return node
        table = BY_TYPE.get(word.value)
        model = None if table is None else self.models.get(table.own)
        if table is None or model is None:
            self.unknown_type(name, word.value, word.place)
            return None
        if not self.has_interface(name, node, table):
            return None
        own = ScalarNode(table.own, word.place, written=word.value)
        node = node.with_entry("type", Entry(entry.key_place, own))
        node = table.reshape(implied(renamed(node, table.parameters), table, word))
        if table.needs and not node.entries.keys() & {*table.needs}:
            needed = table.needs[0]
            message = f"controller '{name}' has no '{needed}': left out"
            self.report("CTRL214", word.place, message, hint=f"add `{needed}: ...`", severity="warning")
            return None
        self.foreign.append(name)
        node = self.effective(name, node, table)
        served = self.served(name, node, table.parameters, model, ignored=ELSEWHERE)
        self.unclamped(name, mapping(mapping(served).get("gains")))
        return served

    def has_interface(self, name: str, node: MappingNode, table: Table) -> bool:
        """Whether its command interface exists here; if not, reports it: as an error if it looks like a typo."""
        key = table.interface
        word = node.get(key) if key else None
        if not isinstance(word, ScalarNode) or not isinstance(word.value, str) or word.value in INTERFACES:
            return True
        near = [interface for interface in INTERFACES if is_typo(word.value, interface)]
        if near:
            message = f"controller '{name}': unknown {key} '{word.value}'"
            self.report("CTRL203", word.place, message, hint=did_you_mean(word.value, near))
        else:
            message = f"controller '{name}': joints have no interface '{word.value}' ({key}): left out"
            hint = f"interfaces: {', '.join(INTERFACES)}"
            self.report("CTRL214", word.place, message, hint=hint, severity="warning")
        return False

    def effective(self, name: str, node: MappingNode, table: Table) -> MappingNode:
        """Removes and reports keys that have no effect on the commanded interface."""
        word = node.get("command_interface")
        interface = str(word.value) if isinstance(word, ScalarNode) else ""
        for key in table.idle.get(interface, ()):
            entry = node.entries.get(key)
            if entry is not None and not neutral(table.parameters, key, entry.node):
                message = f"{name}: '{key}' has no effect on the {interface} interface: left out"
                hint = "for a grip force, use `command_interface: effort` with `gains`"
                self.report("CTRL214", entry.key_place, message, hint=hint, severity="warning")
                node = node.without(key)
        return node

    def unclamped(self, name: str, gains: MappingNode) -> None:
        """Reports integral gains that have no effect in ROS 1 but act here."""
        for joint, entry in gains.entries.items() if self.form != "ros2" else ():
            block = mapping(entry.node)
            gain = block.entries.get("i")
            if gain is None or plain(gain.node) in (0, 0.0) or _CLAMPS & block.entries.keys():
                continue
            message = f"{name}.gains.{joint}: in ROS 1 an 'i' without 'i_clamp' has no effect; here it acts unclamped"
            self.report("CTRL216", gain.key_place, message, hint="add `i_clamp`, or remove `i`", severity="warning")

    def unknown_type(self, name: str, word: str, place: Place) -> None:
        if word in UNSERVED_TYPES:
            message = f"controller '{name}': ROS type '{word}' is not supported: left out"
            self.report("CTRL214", place, message, severity="warning")
        elif is_vendor_type(word):
            package, _, own = word.partition("/")
            message = f"controller '{name}': type '{word}' of package '{package}' is not supported: left out"
            same = [known for known in BY_TYPE if known.partition("/")[2] == own]
            hint = did_you_mean(word, same, kind="supported")
            self.report("CTRL214", place, message, hint=hint, severity="warning")
        else:
            hint = did_you_mean(word, [*BY_TYPE, *UNSERVED_TYPES], kind="supported")
            self.report("CTRL203", place, f"controller '{name}': unknown type '{word}'", hint=hint)

    def served(
        self,
        where: str,
        node: Node,
        block: Block,
        model: type[BaseModel] | None,
        *,
        ignored: frozenset[str] = frozenset(),
    ) -> Node:
        """`node` without the ROS parameters that the spec does not have, and without those that ROS itself has
        `ignored` here; reports unknown keys.
        """
        if not isinstance(node, MappingNode):
            return node
        node = renamed(node, block)
        kept: dict[str, Entry] = {}
        fields = () if model is None else tuple(model.model_fields)
        for key, entry in node.entries.items():
            if neutral(block, key, entry.node):
                continue
            given = plain(entry.node)
            if key in block.refused:
                self.report("CTRL220", entry.key_place, f"{where}: {key}: {block.refused[key]}")
                continue
            if key in block.filled and given == []:
                self.report("CTRL206", entry.node.place, f"{where}.{key}: expected at least 1 item, got none")
            if isinstance(given, int | float) and given > block.most.get(key, math.inf):
                message = f"{where}: '{key}: {given:g}' (rad or m) is above {block.most[key]:g}: not enforced"
                self.report("CTRL214", entry.key_place, message, hint="in degrees? write radians", severity="warning")
            elif given in block.unserved.get(key, ()):
                message = f"{where}: ROS parameter '{key}: {given}' is not supported: left out"
                self.report("CTRL214", entry.key_place, message, severity="warning")
            elif block.joint is not None and isinstance(entry.node, MappingNode) and key not in fields:
                inner = self.served(f"{where}.{key}", entry.node, block.joint, model)
                kept[key] = Entry(entry.key_place, inner)
            elif key in fields:
                below = block.inner.get(key)
                inner = entry.node
                if below is not None:
                    path = where if key == "joints" else f"{where}.{key}"  # ROS has no such level
                    inner = self.served(path, inner, below, model_below(model, key))
                kept[key] = Entry(entry.key_place, inner)
            elif block.joint is not None:
                kept[key] = entry  # not a block: validation reports it
            elif key in ignored and key not in block.names:
                message = f"{where}: '{key}' is a parameter of other ROS controllers: left out"
                self.report("CTRL214", entry.key_place, message, severity="warning")
            elif not self.unserved(where, key, entry, block):
                self.unknown(where, key, entry.key_place, [*fields, *block.names])
        return MappingNode(kept, node.place)

    def unserved(self, where: str, key: str, entry: Entry, block: Block) -> bool:
        """Whether this is a ROS parameter; if so, reports that it is left out."""
        if key not in block.names:
            return False
        severity: Severity = "note" if key in block.quiet else "warning"
        message = f"{where}: ROS parameter '{key}' is not supported: left out"
        self.report("CTRL214", entry.key_place, message, severity=severity)
        return True

    def role(self, node: Node) -> Role:
        word = mapping(node).get("type")
        model = self.models.get(str(word.value)) if isinstance(word, ScalarNode) else None
        return "other" if model is None else model.role

    def started(self, entries: dict[str, Entry]) -> dict[str, Entry]:
        """Activates one controller per joint, since ROS files do not state it: the first one that steps can use."""
        owners: dict[str, str] = {}
        result = dict(entries)
        for name in sorted(entries, key=lambda name: self.role(entries[name].node) == "other"):
            entry = entries[name]
            node = entry.node
            if isinstance(node, MappingNode) and name in self.foreign and "active" not in node.entries:
                joints = commanded_joints(node)
                taken = next((joint for joint in joints if joint in owners), None)
                if taken is not None:
                    message = f"controller '{name}' starts inactive: '{owners[taken]}' commands '{taken}'"
                    hint = "set `active`, or add a `switch_controllers` step"
                    self.report("CTRL215", entry.key_place, message, hint=hint, severity="note")
                    off = Entry(entry.key_place, ScalarNode(False, entry.key_place))
                    entry = Entry(entry.key_place, node.with_entry("active", off))
                else:
                    owners.update(dict.fromkeys(joints, name))
            result[name] = entry
        return self.chained(result)

    def chained(self, entries: dict[str, Entry]) -> dict[str, Entry]:
        """Deactivates controllers that command references of one that starts inactive."""
        result = dict(entries)
        off = {name for name, entry in entries.items() if scalar_at(entry.node, "active") is False}
        for name, entry in entries.items():
            target = scalar_at(entry.node, "chained_to")
            if name in self.foreign and target in off and name not in off and isinstance(entry.node, MappingNode):
                message = f"controller '{name}' starts inactive, as '{target}', whose references it commands"
                hint = "set `active`, or add a `switch_controllers` step"
                self.report("CTRL215", entry.key_place, message, hint=hint, severity="note")
                active = Entry(entry.key_place, ScalarNode(False, entry.key_place))
                result[name] = Entry(entry.key_place, entry.node.with_entry("active", active))
        return result
