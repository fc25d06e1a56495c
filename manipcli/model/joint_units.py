"""Check of units against joint types: angles for prismatic joints, lengths for revolute joints.

The type of a joint value accepts both, because joint types are known only with the robot.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from manipcli.core.errors import Diagnostic, Loc
from manipcli.core.units import describe
from manipcli.description.elements import Joint
from manipcli.model.robot import Group
from manipcli.scene.joints import SceneJoint, joints_of
from manipcli.spec.base import Model
from manipcli.spec.block_fields import Held, children, unit_of
from manipcli.spec.expression import quantity_of
from manipcli.spec.located import Source
from manipcli.spec.source.tree import Node, ScalarNode, SequenceNode, child, shown


def misread_units(
    spec: Model,
    source: Source,
    joints: Iterable[Joint],
    groups: Iterable[Group],
    scene_joints: Sequence[SceneJoint] = (),
) -> Iterator[Diagnostic]:
    """An error for each quantity such as `5 cm` whose unit does not match the type of its joints.

    Args:
        spec, source: the file.
        joints, groups: of the robot.
        scene_joints: of the scene of a task.
    """
    return _Reading(source, joints, groups, scene_joints).below((spec, type(spec), ()), source.root, (), ())


class _Reading:
    """Traversal of a file's nodes together with the values read from them."""

    def __init__(
        self, source: Source, joints: Iterable[Joint], groups: Iterable[Group], scene_joints: Sequence[SceneJoint]
    ) -> None:
        self._source = source
        self._joints: dict[str, Joint | SceneJoint] = {joint.name: joint for joint in joints if joint.moves}
        self._joints |= {joint.name: joint for joint in scene_joints}  # '/' is only in their names
        self._scene = [joint for joint in scene_joints if joint.parent != "world"]  # not of a file with faults
        self._groups = {group.name: group.joints for group in groups}

    def below(self, held: Held, node: Node, path: Loc, about: tuple[str, ...]) -> Iterator[Diagnostic]:
        """Errors at `node` and below; `about`: names of the joints that the enclosing blocks refer to."""
        value, annotation, metadata = held
        if isinstance(node, ScalarNode):
            unit = unit_of(annotation, metadata)
            known = [self._joints[name] for name in about if name in self._joints]
            if isinstance(value, float) and isinstance(node.value, str) and unit is not None and known:
                wanted = [unit.dimensions[-1 if joint.type == "prismatic" else 0] for joint in known]
                given = quantity_of(node.value).dimension
                if given not in wanted:
                    message = f"joint '{known[0].name}' is {known[0].type}: {shown(node)} is {given.name}; "
                    yield self._source.finding(207, path, f"{message}expected {describe(wanted[0])}")
            return
        about = self._named(value) or about
        for k, (key, inside) in enumerate(children(value, annotation).items()):
            part = k if isinstance(node, SequenceNode) else key
            written = child(node, part)
            if written is not None:
                of_scene = path[:1] == ("scene",) and path[2:] == ("joints",)
                own = (f"{path[1]}/{key}",) if of_scene else self._joints_of(value, k, key, inside[0], about)
                yield from self.below(inside, written, (*path, part), own)

    def _named(self, block: object) -> tuple[str, ...]:
        """The joints that a block names in `group`, `joints` or `joint_names`; of the scene in `joint` or `object`."""
        if self._scene:
            named, moved = getattr(block, "joint", None), getattr(block, "object", None)
            found = joints_of(self._scene, moved) if isinstance(moved, str) else ()
            if isinstance(named, str) or len(found) == 1:
                return (named,) if isinstance(named, str) else (found[0].name,)
        group = getattr(block, "group", None)
        if isinstance(group, str):
            return self._groups.get(group, ())
        names = getattr(block, "joints", None) or getattr(block, "joint_names", None)
        return names if isinstance(names, tuple) else ()

    def _joints_of(self, value: object, k: int, key: str, inside: object, about: tuple[str, ...]) -> tuple[str, ...]:
        """The joints of item `k` of a value: its key names a group or a joint; a list is in the order of `about`."""
        if isinstance(value, dict) and isinstance(inside, dict | tuple):
            return self._groups.get(key, about)
        if isinstance(value, dict) and key in self._joints:
            return (key,)
        if isinstance(value, tuple) and isinstance(inside, float) and len(value) == len(about):
            return (about[k],)
        return about
