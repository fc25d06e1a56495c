"""What to change when two bodies overlap at the start: the value to blame, and a hint."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from manipcli.core.errors import Loc
from manipcli.scene.scene_names import Locate
from manipcli.spec.base import Model
from manipcli.spec.task import TaskSpec

SHAPES: Final = ("box", "sphere", "cylinder", "cup", "tray", "mesh", "urdf")
PLACING: Final = ("pose", "rests_on", "inside", "frame", "at", "yaw")


def apart(spec: TaskSpec, a: str, b: str) -> str:
    """The hint for two bodies that overlap at the start."""
    specs = {name: spec.scene[name] for name in (a, b) if name in spec.scene}
    inside = {each.inside for each in specs.values()}
    middle = [f"'{name}'" for name, each in specs.items() if each.at is None]
    if len(specs) == 2 and len(inside) == 1 and None not in inside and middle:
        where = f"{' and '.join(middle)} {'are' if len(middle) > 1 else 'is'} at the centre of '{inside.pop()}'"
        return f"{where}; move {'one' if len(middle) > 1 else 'it'} with `at: [X, Y]`"
    return "move one of them; contact without overlap is allowed"


def blamed(spec: TaskSpec, place: Locate, bodies: Sequence[str]) -> Loc:
    """The value from `--set` that places or shapes one of these bodies; else the first body."""
    for name in bodies:
        for word in (*PLACING, *SHAPES):
            for loc in _written(getattr(spec.scene[name], word), ("scene", name, word)):
                found = place(loc)
                if found is not None and found.line == 0:
                    return loc
    return ("scene", bodies[0])


def _written(value: object, loc: Loc) -> Iterator[Loc]:
    """The path of a value and of everything below it."""
    yield loc
    if isinstance(value, Model):
        for key in value.model_fields_set:
            yield from _written(getattr(value, key), (*loc, key))
    elif isinstance(value, tuple):
        yield from ((*loc, k) for k in range(len(value)))
