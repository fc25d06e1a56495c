"""Frames of a task file: named frames, parts of bodies, and what each of them is fixed to."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from manipcli.core.geometry import Transform, frozen
from manipcli.scene.body_shapes import BodyShape
from manipcli.scene.scene import SEPARATOR, Frame, ready_part
from manipcli.spec.task import TaskSpec


def named_frames(spec: TaskSpec) -> Iterator[Frame]:
    """The frames of the task, then the parts of its bodies."""
    for name, frame in spec.frames.items():
        yield Frame(name=name, parent=frame.parent, X_PF=frame.pose.transform)
    for name, body in spec.scene.items():
        for part, own in (body.parts or {}).items():
            size = None if own.size is None else frozen(own.size)
            yield Frame(f"{name}{SEPARATOR}{part}", name, own.pose.transform, size)


def owner(spec: TaskSpec, name: str | None, parts: Mapping[str, Frame]) -> str:
    """What a frame is fixed to: `world` or a body; itself, if it is one of these. "" without a name.

    `parts`: those that are not in the task but in the file of a body, by name.
    """
    if name is None or name in spec.scene:
        return name or ""
    if name in parts:
        return parts[name].parent
    return spec.frames[name].parent if name in spec.frames else name.rpartition(SEPARATOR)[0] or name


def in_owner(spec: TaskSpec, name: str, shape: BodyShape | None, parts: Mapping[str, Frame]) -> Transform | None:
    """X_PF of a frame in what it is fixed to, whose `shape` is None for the world; None: there is no such frame."""
    fixed_to = owner(spec, name, parts)
    if name == fixed_to:
        return Transform.identity()
    own = next((frame.X_PF for frame in (*named_frames(spec), *parts.values()) if frame.name == name), None)
    if own is not None or shape is None:
        return own
    return ready_part(name.removeprefix(f"{fixed_to}{SEPARATOR}"), shape.size, shape.centre, shape.interior)
