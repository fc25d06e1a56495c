"""The names that a task may use, also of a task with errors: an editor asks while it is written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from manipcli.core.errors import InvalidInput
from manipcli.description.packages import NotFound, Packages
from manipcli.scene.body_files import read_urdf
from manipcli.scene.jointed import jointed
from manipcli.scene.scene import FACES, RIM, SEPARATOR
from manipcli.scene.scene_names import RESERVED
from manipcli.shapes.mesh_formats import UnusableMesh
from manipcli.spec.counted import flat_names
from manipcli.spec.load import load_controllers, task_source
from manipcli.spec.located import Source
from manipcli.spec.names import NameKind
from manipcli.spec.scene import BodySpec
from manipcli.spec.schema_names import TaskNames
from manipcli.spec.source.tree import MappingNode, Node, ScalarNode, SequenceNode, child, plain
from manipcli.spec.structure.ids import step_ids
from manipcli.task.robot_file import read_robot
from manipcli.task.task_files import finder
from manipcli.task.vocabulary import controllers_spec, task_spec

HOLLOW = ("cup", "tray", "mesh", "urdf")
"""Shapes that may have a hollow."""


def task_names(path: Path, *, package_path: Sequence[Path] = (), allow_outside: bool = False) -> TaskNames:
    """The names of a task, its robot and its controllers; kinds of a file that cannot be read are missing.

    Raises:
        InvalidInput: the task file cannot be read, or is not YAML.
    """
    find = finder(path, package_path=package_path, allow_outside=allow_outside)
    source, _ = task_source(path, model=task_spec(), find=find)
    packages = Packages(path, package_path=package_path, allow_outside=allow_outside)
    names = {**_of_scene(source, packages), "step": _steps(source), "sensor": _keys(source, "sensors")}
    robot_file = _named(source, path, "robot")
    args = None
    if robot_file is not None:
        try:
            file, robot, _ = read_robot(robot_file, package_path=package_path, allow_outside=allow_outside)
        except InvalidInput:
            pass
        else:
            args = file.spec.args
            names["sensor"] = {*(file.spec.sensors or {}), *_keys(source, "sensors")}
            links = [f"robot{SEPARATOR}{link.name}" for link in robot.links]
            names["joint"] = {joint.name for joint in robot.joints if joint.independent}
            names["link"] = {link.name for link in robot.links}
            names["group"] = {group.name for group in robot.groups}
            names["pose"] = {pose.name for pose in robot.poses}
            names["sensor"] |= {*(file.spec.sensors or {})}
            names["part"] = {*names["body"], "robot", *links}
            names["frame"] |= {*links}
    controllers_file = _named(source, path, "controllers")
    if controllers_file is not None:
        try:
            controllers = load_controllers(controllers_file, model=controllers_spec(), args=args or {})
        except InvalidInput:
            pass
        else:
            names["controller"] = {*controllers.spec.controllers}
    scopes = [step.scope for step in source.structure.steps]
    own = child(source.root, "params")
    params = {
        *(own.entries if isinstance(own, MappingNode) else ()),
        *(name for scope in scopes for name in scope.nodes),
    }
    return TaskNames(names, params)


def _named(source: Source, path: Path, key: str) -> Path | None:
    """The file that the task names under `key`."""
    node = child(source.root, key)
    return path.parent / node.value if isinstance(node, ScalarNode) and isinstance(node.value, str) else None


def _of_scene(source: Source, packages: Packages) -> dict[NameKind, set[str]]:
    scene, frames = child(source.root, "scene"), child(source.root, "frames")
    bodies = flat_names(scene) if isinstance(scene, MappingNode) else {}
    links, parts_of_files, joints = _of_files(bodies, packages)
    floor = child(source.root, "floor")
    ground = set() if isinstance(floor, ScalarNode) and floor.value is False else {"floor"}
    frame = {"world", "base", "tool", *bodies, *ground, *links, *parts_of_files}
    frame |= {f"{link}{SEPARATOR}{part}" for link in links for part in (*FACES, RIM)}
    frame |= {*frames.entries} if isinstance(frames, MappingNode) else set()
    for name, node in bodies.items():
        parts = child(node, "parts")
        own = parts.entries if isinstance(parts, MappingNode) else {}
        frame |= {f"{name}{SEPARATOR}{part}" for part in (*own, *FACES, RIM)}
    return {
        "body": {*bodies, *ground, *links},
        "movable": {*links, *(name for name, node in bodies.items() if not _is_true(child(node, "fixed")))},
        "container": {*links, *(name for name, node in bodies.items() if any(child(node, key) for key in HOLLOW))},
        "part": {*bodies, *ground, *links, "robot"},
        "scene_joint": joints,
        "frame": frame - {*RESERVED} | (frame & {"world", "base", "tool", "floor"}),
    }


def _of_files(bodies: Mapping[str, Node], packages: Packages) -> tuple[set[str], set[str], set[str]]:
    """Links that joints move, parts and joints in the files of bodies; without files that cannot be read."""
    found: tuple[set[str], set[str], set[str]] = (set(), set(), set())
    for name, node in bodies.items():
        urdf = child(node, "urdf")
        if urdf is None:
            continue
        try:
            spec = BodySpec.model_validate({"urdf": plain(urdf)})
            assert spec.urdf is not None
            made, _ = jointed(name, spec, read_urdf(spec.urdf, packages))
        except (InvalidInput, NotFound, UnusableMesh, ValueError):  # reported by `check`
            continue
        more = (
            {joint.child for joint in made.joints},
            {frame.name for frame in made.frames},
            {joint.name for joint in made.joints},
        )
        for names, own in zip(found, more, strict=True):
            names |= own
    return found


def _keys(source: Source, key: str) -> set[str]:
    """The keys of a mapping of the task."""
    node = child(source.root, key)
    return {*node.entries} if isinstance(node, MappingNode) else set()


def _is_true(node: Node | None) -> bool:
    return isinstance(node, ScalarNode) and node.value is True


def _steps(source: Source) -> set[str]:
    """The ids of all steps and blocks, and `end`."""
    found = {"end"}
    steps, blocks = child(source.root, "steps"), child(source.root, "blocks")
    if isinstance(steps, SequenceNode):
        found |= {*step_ids(steps)}
    for block in blocks.items if isinstance(blocks, SequenceNode) else ():
        own = child(block, "id")
        if isinstance(own, ScalarNode) and isinstance(own.value, str):
            found.add(own.value)
    return found
