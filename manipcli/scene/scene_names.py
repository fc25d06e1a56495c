"""Checks of the names of bodies and frames: reserved, duplicate and unknown names."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from manipcli.core.errors import Diagnostic, Loc, Place
from manipcli.core.text import did_you_mean
from manipcli.spec.task import TaskSpec

Locate = Callable[[Loc], Place | None]

RESERVED = ("world", "base", "tool", "robot", "start", "floor")


def misnamed(spec: TaskSpec, place: Locate) -> Iterator[Diagnostic]:
    """TASK220: reserved name of a body. TASK225: unknown body in `rests_on` or `inside`. TASK227: reserved or duplicate
    name of a frame, or unknown parent."""
    bodies = (*spec.scene, *(("floor",) if spec.floor else ()))
    for name, body in spec.scene.items():
        if name in RESERVED or "/" in name:
            why = "'/' is not allowed" if "/" in name else "the name is reserved"
            message = f"invalid name of a body: '{name}': {why}"
            hint = f"rename it; reserved names: {', '.join(RESERVED)}"
            yield Diagnostic("TASK220", message, place(("scene", name)), hint=hint)
        for word, other in (("rests_on", body.rests_on), ("inside", body.inside)):
            if other is not None and other not in bodies:
                yield _unknown("TASK225", other, bodies, place(("scene", name, word)))
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


def _unknown(code: str, name: str, known: tuple[str, ...], place: Place | None) -> Diagnostic:
    return Diagnostic(code, f"'{name}' is not in the scene", place, hint=did_you_mean(name, known))
