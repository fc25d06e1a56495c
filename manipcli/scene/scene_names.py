"""Checks of the names of bodies and frames: reserved, duplicate and unknown names."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping

from manipcli.core.errors import Diagnostic, Loc, Place
from manipcli.core.text import did_you_mean
from manipcli.scene.scene import FACES, RIM, SEPARATOR
from manipcli.spec.counted import members
from manipcli.spec.scene import BodySpec
from manipcli.spec.task import TaskSpec

Locate = Callable[[Loc], Place | None]

RESERVED = ("world", "base", "tool", "robot", "start", "floor")


def misnamed(
    spec: TaskSpec, place: Locate, links: Mapping[str, BodySpec] | None = None, parts: Collection[str] = ()
) -> Iterator[Diagnostic]:
    """TASK220: reserved name of a body. TASK225: unknown body in `rests_on` or `inside`. TASK227: reserved or duplicate
    name of a frame, or unknown parent. TASK290: invalid name of a part. TASK291: unknown `frame` of a body.

    `links`: the bodies that joints move; None: unknown. `parts`: those from the files of bodies.
    """
    bodies = (*spec.scene, *(("floor",) if spec.floor else ()), *(_links(spec) if links is None else links))
    for name, body in spec.scene.items():
        if name in RESERVED or "/" in name:
            why = "'/' is not allowed" if "/" in name else "the name is reserved"
            message = f"invalid name of a body: '{name}': {why}"
            hint = f"rename it; reserved names: {', '.join(RESERVED)}"
            yield Diagnostic("TASK220", message, place(("scene", name)), hint=hint)
        for word, other in (("rests_on", body.rests_on), ("inside", body.inside)):
            if other is not None and other not in bodies:
                yield _unknown("TASK225", other, bodies, place(("scene", name, word)))
        for part in body.parts or ():
            if SEPARATOR in part or not part:
                message = f"invalid name of a part: '{part}'"
                yield Diagnostic(
                    "TASK290", message, place(("scene", name, "parts", part)), hint="use a name without '/'"
                )
        if body.frame not in parts:
            yield from _unknown_frame(spec, name, body.frame, place, bodies)
    for name, frame in spec.frames.items():
        if name in RESERVED or "/" in name or name in spec.scene:
            message = f"invalid name of a frame: '{name}' is already in use"
            yield Diagnostic("TASK227", message, place(("frames", name)))
        if frame.parent in spec.frames and frame.parent not in (*RESERVED, *bodies):
            message = f"parent '{frame.parent}' is a frame; expected `world` or a body"
            its = spec.frames[frame.parent].parent
            other = f"use the parent '{its}' and the pose relative to it" if its in ("world", *bodies) else None
            yield Diagnostic("TASK227", message, place(("frames", name, "parent")), hint=other)
        elif frame.parent not in ("world", *bodies):
            yield _unknown("TASK227", frame.parent, ("world", *bodies), place(("frames", name, "parent")))


def miscounted(spec: TaskSpec, place: Locate) -> Iterator[Diagnostic]:
    """TASK220: invalid name of a body with a `count`. TASK294: a key that does not go with `count`, or `grid` alone."""
    flat = [name for name, body in spec.scene.items() if body.count is None]
    for name, body in spec.scene.items():
        if body.count is None:
            if body.grid is not None:
                hint = "add `count: 20`, or remove `grid`"
                yield Diagnostic(
                    "TASK294", f"body '{name}' has `grid` without `count`", place(("scene", name, "grid")), hint
                )
            continue
        if name in RESERVED or "[" in name:
            why = "'[' is not allowed with `count`" if "[" in name else "the name is reserved"
            yield Diagnostic("TASK220", f"invalid name of a body: '{name}': {why}", place(("scene", name)), "rename it")
        for taken in (one for one in members(name, body.count) if one in flat):
            message = f"body '{taken}' is already one of the {body.count} bodies '{name}'"
            yield Diagnostic("TASK294", message, place(("scene", taken)), hint="rename one of them")
        at_inside = body.at is not None and body.inside is not None
        for key, given, why in (
            ("pose", body.pose is not None, "write `inside: CONTAINER`, or `rests_on: BODY` with `at: [x, y]`"),
            ("at", at_inside, "remove `at`: they fill the container from its floor"),
            ("fixed", body.fixed, "remove `fixed`: they fall and settle before the start"),
            ("known", body.known is not None, "remove `known`: they are known exactly, relative to their container"),
        ):
            if given:
                message = f"body '{name}' has both `count` and `{key}`"
                yield Diagnostic("TASK294", message, place(("scene", name, key)), hint=why)


def parts_of(body: BodySpec) -> tuple[str, ...]:
    """The names of the parts of a body: those of the task, and those that its shape has."""
    rim = (RIM,) if body.cup is not None or body.tray is not None else ()
    return tuple(dict.fromkeys((*(body.parts or ()), *FACES, *rim)))


def _links(spec: TaskSpec) -> Iterator[str]:
    """The names in the task that may be those of links, if the files of its bodies cannot be read."""
    named = [name for body in spec.scene.values() for name in (body.frame, body.inside, body.rests_on)]
    for name in (*named, *(frame.parent for frame in spec.frames.values())):
        own = spec.scene.get((name or "").partition(SEPARATOR)[0])
        if name is not None and own is not None and own.urdf is not None:
            yield name


def _unknown_frame(
    spec: TaskSpec, name: str, frame: str | None, place: Locate, bodies: tuple[str, ...]
) -> Iterator[Diagnostic]:
    """A finding if the `frame` of a body is not the world, another body, a part of one, or a named frame."""
    if frame is None or frame in ("world", *bodies, *spec.frames):
        return
    at = place(("scene", name, "frame"))
    owner, _, part = frame.rpartition(SEPARATOR)
    if owner in bodies and owner != "floor":
        parts = parts_of(spec.scene[owner]) if owner in spec.scene else (*FACES, RIM)
        if part not in parts:
            message = f"'{owner}' has no part '{part}'"
            yield Diagnostic("TASK291", message, at, hint=did_you_mean(part, parts, kind=f"parts of '{owner}'"))
    elif frame in ("base", "tool") or owner == "robot":
        message = f"'{frame}' is a frame of the robot; a body is placed in the scene"
        yield Diagnostic("TASK291", message, at, hint="use `world`, a body, a part of one or a named frame")
    else:
        yield _unknown("TASK291", frame, ("world", *bodies, *spec.frames), at)


def _unknown(code: str, name: str, known: tuple[str, ...], place: Place | None) -> Diagnostic:
    return Diagnostic(code, f"'{name}' is not in the scene", place, hint=did_you_mean(name, known))
