"""Steps that cannot succeed whatever the arm does: what the hand holds before them, hollows, and sizes.

The steps are followed in their order with all that the hand may hold: behind an `if`, what it holds after either
branch. A step is refused where none of these allows it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from manipcli.plan.steps.grasp import GraspSpec
from manipcli.plan.steps.jointed_goal import HandleSpec
from manipcli.plan.steps.lift import LiftSpec
from manipcli.plan.steps.pick import PickSpec
from manipcli.plan.steps.place_spec import PlaceSpec
from manipcli.plan.steps.pour import PourSpec
from manipcli.plan.steps.release import ReleaseSpec
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Cylinder
from manipcli.spec.base import Model
from manipcli.spec.block import BlockSpec
from manipcli.spec.task import TaskSpec

NOT_HELD: Final = 310
HANDS_FULL: Final = 311
NO_HOLLOW: Final = 312
TOO_SMALL: Final = 313
SOLID: Final = frozenset({"box", "sphere", "cylinder"})
"""Kinds of bodies that certainly have no hollow."""
ROUND: Final = frozenset({"sphere", "cylinder", "cup"})
PRIMITIVE: Final = SOLID | {"cup", "tray"}
"""Kinds of bodies whose bounding box is tight."""
ROOM: Final = 1e-6
"""[m] A body that is larger than a hollow by less still fits."""

Holding = frozenset[str | None]
"""All that the hand may hold; None for nothing."""


@dataclass(frozen=True, slots=True)
class Impossible:
    """A step that cannot succeed: index, key below its verb, number of the code, message and hint."""

    step: int
    key: str
    number: int
    message: str
    hint: str | None = None


def impossible_steps(spec: TaskSpec, scene: Scene) -> Iterator[Impossible]:
    """The steps of a task that cannot succeed in this scene; `object` and `into` of all steps must exist."""
    found: list[Impossible] = []
    _followed(spec, scene, found, 0, len(spec.steps), frozenset({None}), None)
    yield from found


def _followed(
    spec: TaskSpec, scene: Scene, found: list[Impossible], first: int, last: int, held: Holding, inside: int | None
) -> Holding:
    """What the hand may hold after `steps[first:last]` of the block `inside`; appends to `found`."""
    blocks = {block.first: (n, block) for n, block in reversed([*enumerate(spec.blocks)]) if block.parent == inside}
    k = first
    while k < last:
        if k in blocks and blocks[k][1].last > k:
            number, block = blocks[k]
            held = _after_block(spec, scene, found, number, block, held)
            k = block.last
            continue
        body = spec.steps[k].body
        before = [step.body for step in spec.steps[:k]]
        found += (Impossible(k, *each) for each in _refused(body, scene, held, before))
        held = _after(body, held)
        k += 1
    return held


def _after_block(
    spec: TaskSpec, scene: Scene, found: list[Impossible], number: int, block: BlockSpec, held: Holding
) -> Holding:
    if block.kind == "if":
        split = block.split if block.split >= 0 else block.last
        then = _followed(spec, scene, found, block.first, split, held, number)
        return then | _followed(spec, scene, found, split, block.last, held, number)
    if block.kind == "parallel":  # in no certain order
        for step in spec.steps[block.first : block.last]:
            held |= _after(step.body, held)
        return held
    return _followed(spec, scene, found, block.first, block.last, held, number)


def _after(body: Model, held: Holding) -> Holding:
    match body:
        case PickSpec(object=name):
            return frozenset({name})
        case GraspSpec(object=str(name)):
            return frozenset({name})
        case PlaceSpec() | ReleaseSpec():
            return frozenset({None})
        case LiftSpec(object=name) | PourSpec(object=name):
            return frozenset({name})  # after a finding as well: the next step has no second one
    return held


Refusal = tuple[str, int, str, str | None]


def _refused(body: Model, scene: Scene, held: Holding, before: Sequence[Model]) -> Iterator[Refusal]:
    match body:
        case LiftSpec(object=name) | PlaceSpec(object=name) | PourSpec(object=name) if name not in held:
            other = next((each for each in sorted(filter(None, held))), None)
            holds = "nothing" if other is None else f"'{other}'"
            hint = f"`pick` it first, or `grasp: {{object: {name}}}`"
            yield "object", NOT_HELD, f"'{name}' is not held: the hand holds {holds}", hint
        case HandleSpec(object=name) if None not in held:
            other = min(filter(None, held))
            message = f"the hand cannot take '{name}': it holds '{other}'"
            yield "object", HANDS_FULL, message, f"`place` '{other}' first"
        case PickSpec(object=name) | GraspSpec(object=str(name)) if None not in held:
            if held == {name}:
                hint = "remove this step, or `place` the object first"
                yield "object", HANDS_FULL, f"'{name}' is already in the hand", hint
            else:
                other = min(filter(None, held))
                hint = f"`place` '{other}' first"
                yield "object", HANDS_FULL, f"the hand cannot take '{name}': it holds '{other}'", hint
    match body:
        case PourSpec(object=name, into=into):
            yield from _unpourable(scene, name, into, before)
        case PlaceSpec(object=name, support=str(under)):
            lack = _too_large(scene.body(name), scene.body(under))
            if lack:
                yield (
                    body.support_key,
                    TOO_SMALL,
                    f"'{name}' does not fit into '{under}': {lack}",
                    "choose a larger container",
                )


def _unpourable(scene: Scene, name: str, into: str, before: Sequence[Model]) -> Iterator[Refusal]:
    containers = [body.name for body in scene.bodies if body.interior is not None]
    hint = f"containers: {', '.join(containers)}" if containers else "add a `cup` or a `tray` to the scene"
    for key, one, verb in (("object", name, "from"), ("into", into, "into")):
        body = scene.body(one)
        if body.kind in SOLID:
            message = f"nothing can be poured {verb} '{one}': a {body.kind} has no hollow"
            yield key, NO_HOLLOW, message, hint
        elif body.interior is None and len(body.geometries) == 1:  # a file: one solid, or one convex hull of a mesh
            message = f"nothing can be poured {verb} '{one}': it is one convex part, which has no hollow"
            parts = "a mesh with a hollow has `collision: parts`; " if body.kind == "mesh" else ""
            yield key, NO_HOLLOW, message, parts + hint
        elif body.interior is None:
            message = f"nothing can be poured {verb} '{one}': it has no hollow that is open along its z axis"
            yield key, NO_HOLLOW, message, hint
    if any(isinstance(step, PourSpec) and step.object == name for step in before):
        return  # what it held at the start may be elsewhere
    taken = {getattr(step, "object", None) for step in before}
    for content in _contents(scene, name):
        lack = "" if content.name in taken else _too_large(content, scene.body(into))
        if lack:
            message = f"'{content.name}' in '{name}' does not fit into '{into}': {lack}"
            yield "into", TOO_SMALL, message, "choose a larger container"


def _contents(scene: Scene, container: str) -> Sequence[Body]:
    """The movable bodies whose centre is inside of a container at the start."""
    interior = scene.body(container).interior
    if interior is None:
        return ()
    X_SW = (scene.body(container).X_WO @ interior.X_OS).inverse()
    return [
        body
        for body in scene.movable
        if body.name != container and interior.contains(X_SW.apply(body.X_WO.apply(body.centre)))
    ]


def _too_large(body: Body, container: Body) -> str:
    """Why an upright body certainly does not fit into the hollow of a container at any yaw; "" where it may.

    The least width and the greatest width of the footprint of what fits are at most those of the hollow.
    """
    if container.interior is None or body.kind not in PRIMITIVE:
        return ""
    x, y, z = (float(size) for size in body.size)
    least, most = (x, x) if body.kind in ROUND else (min(x, y), math.hypot(x, y))
    if body.kind == "sphere":
        least = most = min(x, y, z)
    shape, walls = container.interior.shape, container.interior.walls
    if walls is not None:
        narrow, wide = walls.widths
    elif isinstance(shape, Cylinder):
        narrow, wide = 2.0 * shape.radius, 2.0 * shape.radius
    else:
        narrow, wide = min(shape.size[:2]), math.hypot(*shape.size[:2])
    for size, room in ((least, narrow), (most, wide)):
        if size > room + ROOM:
            return f"it is {1000.0 * size:.3g} mm wide, the hollow {1000.0 * room:.3g} mm"
    return ""
