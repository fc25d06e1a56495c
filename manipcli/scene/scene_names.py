"""Names of bodies and frames: which may be given, and which are spoken of without being there."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from manipcli.core.errors import Diagnostic, Loc, Place
from manipcli.core.text import did_you_mean
from manipcli.spec.task import TaskSpec

Locate = Callable[[Loc], Place | None]

RESERVED = ("world", "base", "tool", "robot", "start", "floor")


def misnamed(spec: TaskSpec, place: Locate) -> Iterator[Diagnostic]:
    """TASK220 a body's name that means something else; TASK225 an unknown body that another is placed by; TASK227 a
    frame's name that is taken, or an unknown parent."""
    bodies = (*spec.scene, *(("floor",) if spec.floor else ()))
    for name, body in spec.scene.items():
        if name in RESERVED or "/" in name:
            why = "names have no '/'" if "/" in name else "the word means something else in a task"
            message, hint = f"a body cannot be called '{name}': {why}", f"reserved are {', '.join(RESERVED)}"
            yield Diagnostic("TASK220", message, place(("scene", name)), hint=hint)
        for word, other in (("rests_on", body.rests_on), ("inside", body.inside)):
            if other is not None and other not in bodies:
                yield _unknown("TASK225", other, bodies, place(("scene", name, word)))
    for name, frame in spec.frames.items():
        if name in RESERVED or "/" in name or name in spec.scene:
            message = f"a frame cannot be called '{name}': the name is taken"
            yield Diagnostic("TASK227", message, place(("frames", name)))
        if frame.parent in spec.frames and frame.parent not in (*RESERVED, *bodies):
            message = f"'{frame.parent}' is a frame itself; the parent of a frame is `world` or a body"
            its = spec.frames[frame.parent].parent
            other = f"give it the parent '{its}', and its pose there" if its in ("world", *bodies) else None
            yield Diagnostic("TASK227", message, place(("frames", name, "parent")), hint=other)
        elif frame.parent not in ("world", *bodies):
            yield _unknown("TASK227", frame.parent, ("world", *bodies), place(("frames", name, "parent")))


def _unknown(code: str, name: str, known: tuple[str, ...], place: Place | None) -> Diagnostic:
    return Diagnostic(code, f"'{name}' is not in the scene", place, hint=did_you_mean(name, known))
