"""Spec of `place`, and what can be refused without a plan.

- place: {object: block, onto: red}                    # on the middle of its top
- place: {object: block, into: tray}                   # on the middle of its floor
- place: {object: cup, at: start}
- place: {object: block, at: [0.5, 0.2], onto: table, yaw: 90 deg}
- place: {object: block, at: {of: tray, xyz: [5 cm, 0, 0]}, into: tray}
- place: {object: block, at: {of: red, side: left, gap: 3 cm}}
- place: {object: lid, part: bottom, at: {of: pot/rim, xyz: [0, 0, 0]}}
- place: {object: block, onto: table, region: {box: {centre: [0.5, 0.2], size: [20 cm, 30 cm]}}}
- place: {object: block, into: tray, region: {frame: tray, box: {centre: [0, 0], size: [10 cm, 14 cm]}}}
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Final, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from manipcli.conditions.condition import Problem, unknown_body
from manipcli.conditions.frames import carrier, fixed_frame, unknown_part
from manipcli.core.errors import Loc
from manipcli.core.prose import amount, named, point, shortest
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.plan.place_goals import UPRIGHT, floor_of
from manipcli.plan.ranges import Range
from manipcli.plan.steps.move import RENAMED, VelocityScaling
from manipcli.plan.unknown_names import unknown_posture
from manipcli.scene.drop_test import FORMED
from manipcli.scene.scene import Body, Scene
from manipcli.spec.base import Model, problem
from manipcli.spec.names import BodyName, ContainerName, FrameName, MovableName, PoseName
from manipcli.spec.quantity import Length, Turn
from manipcli.spec.robot import Vector3

STEADY: Final = 0.01
"""[m] An object that is at least twice as wide does not stand on a narrower top: a place is met within 1 cm."""
_ABOVE: Final = "to set it on top of a body, write `onto: BODY`"


class RectangleSpec(Model):
    """A rectangle along the axes of `frame`."""

    centre: tuple[Length, Length] = Field(description="Its centre [x, y] in `frame`.")
    size: tuple[Annotated[Length, Field(ge=0)], Annotated[Length, Field(ge=0)]] = Field(description="Its sides [m].")


class RegionSpec(Model):
    """A region for an object's frame."""

    box: RectangleSpec = Field(description="A rectangle.")
    frame: FrameName | None = Field(
        None, description="`world`, `base`, a body, a part of one or a frame. Default: `world`."
    )


class RelationSpec(Model):
    """A place relative to something: at a point in its frame, or on one side of it."""

    of: FrameName = Field(description="A body, a part of one (`tray/rim`), a named frame, `world` or `base`.")
    xyz: Vector3 | None = Field(
        None, description="Where the object's frame, or its `part`, goes, in the frame of `of` [m]."
    )
    side: Literal["left", "right", "front", "behind"] | None = Field(
        None,
        description="On this side of the body `of`, seen along its own axes: x to the front, y to the left. Its middle "
        "is beside that of the body; without `onto`, its bottom is as high as that of the body.",
    )
    gap: Annotated[Length, Field(ge=0, le=100.0)] | None = Field(
        None, description="With `side`: the smallest distance between the two bodies [m]."
    )

    @model_validator(mode="before")
    @classmethod
    def _level(cls, value: object) -> object:
        side = value.get("side") if isinstance(value, dict) else None
        if side in ("above", "below", "top", "on"):
            raise problem(
                "name", f"unknown side '{side}': expected left, right, front or behind", at=("side",), hint=_ABOVE
            )
        return value

    @model_validator(mode="after")
    def _one(self) -> RelationSpec:
        if (self.xyz is None) == (self.side is None):
            raise problem("conflict", "needs either `xyz` or `side`", hint="`{of: BODY, side: left, gap: 2 cm}`")
        if self.side is None and self.gap is not None:
            raise problem("conflict", "`gap` needs `side`", at=("gap",), key=True, hint="remove `gap`")
        if self.side is not None and self.gap is None:
            raise problem("conflict", "`side` needs a `gap`", at=("side",), key=True, hint="for example `gap: 2 cm`")
        return self


class PlaceSpec(Model):
    """Set down a held object: carry it above its place, lower it straight, let go, and withdraw upwards.

    The object is placed upright, even if it was picked lying; at `start` as it was. `onto` or `into` alone is the
    middle of that body. The step is done when the hand has let go and withdrawn, and the object is within 1 cm and 10
    deg of its place then; rotations about the axis of a round object do not matter.
    """

    renamed: ClassVar = {**RENAMED, "on": "onto"}

    object: MovableName = Field(description="The held object to set down.")
    part: str | None = Field(
        None, description="With `at: {of: ..., xyz: ...}`: the part of the object that goes there. Default: its frame."
    )
    at: Literal["start"] | tuple[Length, Length] | RelationSpec | None = Field(
        None,
        description="`start`: its pose at the start; [x, y] in the world, on `onto` or in `into`; or relative to "
        "something, there in the air or, with `onto` or `into`, under that point. Default: the middle of `onto` or "
        "`into`; without these, and without `region`, `start`.",
    )
    onto: BodyName | None = Field(
        None,
        description="The supporting body: on its top, or inside a tray; in or on a URDF or a mesh, at the first "
        "contact from above.",
    )
    into: ContainerName | None = Field(
        None, description="The container, instead of `onto`: a cup, a tray, a mesh or a URDF."
    )
    region: RegionSpec | None = Field(
        None,
        description="Where on `onto` or in `into` it may be, instead of `at`: at least 10 mm from all other bodies; "
        "the nearest place to its centre is tried first.",
    )
    yaw: Turn | None = Field(
        None,
        description="Rotation about the vertical [rad], from the x axis of the frame of its place: that of the world "
        "at [x, y], of `of` of a relation, of the frame of the region, or of the body in whose middle it is. Default: "
        "as held, or as an arm of few joints can reach.",
    )
    clearance: Annotated[Range, Field(description="Height from which it is lowered straight [m].")] = (0.04, 0.1)
    retreat: Annotated[Range, Field(description="Straight withdrawal of the hand [m].")] = (0.12, 0.18)
    posture: PoseName = Field("open", description="The named pose to which the hand opens.")
    velocity_scaling: VelocityScaling = Field(
        0.5, description="Share of the velocity, acceleration and jerk limits while carrying; lowering uses half."
    )

    @field_validator("at", mode="before")
    @classmethod
    def _two(cls, at: Any) -> Any:
        if isinstance(at, list | tuple) and len(at) == 3:
            hint = "for a point write `at: {of: world, xyz: [x, y, z]}`"
            raise problem("count", "`at: [x, y]` has 2 numbers, not 3", hint=hint)
        if isinstance(at, str) and at != "start":
            hint = f"for the middle of a body write `onto: {at}`"
            raise problem("name", f"expected `start`, [x, y] or a relation, not '{at}'", hint=hint)
        return at

    @property
    def support(self) -> str | None:
        """The body that it is set down on or in."""
        return self.onto if self.onto is not None else self.into

    @property
    def support_key(self) -> Literal["onto", "into"]:
        """Where `support` is written."""
        return "into" if self.onto is None and self.into is not None else "onto"

    @property
    def at_start(self) -> bool:
        """Whether it is placed where it was at the start."""
        if self.region is not None:
            return False
        return self.at == "start" or (self.at is None and self.support is None)


def where(spec: PlaceSpec) -> str:
    """The place in English: `on the middle of 'red'`, `at [0.5, 0.2] m on 'table'`."""
    support = "" if spec.support is None else f"{'on' if spec.onto is not None else 'in'} {named(spec.support)}"
    if spec.region is not None:
        box, frame = spec.region.box, spec.region.frame
        sides = shortest(box.size, "m", " x ", "{}")
        origin = "" if frame in (None, "world") else f" of {named(str(frame))}"
        return f"{support}, with its frame in a rectangle of {sides} around {point(box.centre)}{origin}"
    if spec.at_start:
        return "where it was at the start"
    if spec.at is None:
        return f"{'on' if spec.onto is not None else 'in'} the middle of {named(str(spec.support))}"
    if isinstance(spec.at, RelationSpec):
        return f"{_relative(spec.at, spec.part)}{support and f', {support}'}"
    return f"at {point(spec.at if isinstance(spec.at, tuple) else ())} {support}"


def _relative(at: RelationSpec, part: str | None) -> str:
    if at.side is not None:
        sides = {"left": "to the left of", "right": "to the right of", "front": "in front of", "behind": "behind"}
        return f"{sides[at.side]} {named(at.of)}, with a gap of {amount(at.gap or 0.0, 'm')}"
    own = "" if part is None else f" with its part {named(part)}"
    return f"{own.lstrip()}{own and ' '}at {point(at.xyz or ())} in the frame of {named(at.of)}"


def check(spec: PlaceSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """Unknown names; a place without a support, given twice, or one that nothing stands on."""
    found = list(unknown_body(scene, spec.object, ("object",), movable=True, carried=True))
    found += unknown_posture(robot, spec.posture, ("posture",))
    known = not found
    found += _support(spec, scene)
    found += _given_once(spec)
    if isinstance(spec.at, RelationSpec):
        found += _relation(spec, spec.at, robot, scene)
    if spec.region is not None and spec.region.frame is not None:
        found += _frame(spec, spec.region.frame, ("region", "frame"), robot, scene)
    if spec.part is not None:
        if known and spec.object in {body.name for body in scene.bodies}:
            found += unknown_part(scene, spec.object, spec.part, ("part",))
        if not isinstance(spec.at, RelationSpec) or spec.at.xyz is None:
            under = f"{spec.support}/top" if spec.onto is not None else "FRAME"
            hint = f"write `at: {{of: {under}, xyz: [x, y, z]}}`, or remove `part`"
            found.append(Problem(("part",), "`part` needs a point to which it goes", hint))
    return tuple(found)


def _given_once(spec: PlaceSpec) -> Iterator[Problem]:
    """A place that is given twice, or a support that is missing or of no use."""
    if spec.onto is not None and spec.into is not None:
        yield Problem(("into",), "`onto` and `into` both set the support", "remove one of them")
    # Logs of earlier versions have `at: start`, then a default, with a region.
    if spec.region is not None and spec.at not in (None, "start"):
        yield Problem(("region",), "`region` and `at` both set the place", "remove one of them")
    elif spec.support is None and (spec.region is not None or isinstance(spec.at, tuple)):
        word, example = ("region", "region") if spec.region is not None else ("at", "at: [x, y]")
        yield Problem((word,), f"`{example}` needs a supporting body", "add `onto: BODY`")
    if spec.at == "start" and spec.support is not None and spec.region is None:
        word = spec.support_key
        hint = f"remove `at: start` for the middle of '{spec.support}', or remove `{word}`"
        yield Problem((word,), f"`at: start` and `{word}` both set the place", hint)
    if spec.at_start and spec.yaw is not None:
        hint = "remove `yaw`: `at: start` sets the pose"
        yield Problem(("yaw",), "`yaw` needs a place: `at`, `onto`, `into` or `region`", hint)


def _support(spec: PlaceSpec, scene: Scene) -> Iterator[Problem]:
    """A support that is unknown, the object itself, or one that it cannot be on or in whatever the state."""
    word, name = spec.support_key, spec.support
    if name is None:
        return
    if name == spec.object:
        itself = "placed on itself" if word == "onto" else "put into itself"
        yield Problem((word,), f"'{name}' cannot be {itself}", "name another body")
        return
    unknown = unknown_body(scene, name, (word,))
    if unknown:
        yield from unknown
        return
    under = scene.body(name)
    if name == "floor" and word == "onto" and spec.at is None and spec.region is None:
        yield Problem((word,), "the floor has no middle to place it on", "add `at: [x, y]`")
    if under.fixed and under.X_WO.R[2, 2] < UPRIGHT:
        hint = "place it on an upright body, or at a point: `at: {of: ..., xyz: [x, y, z]}`"
        yield Problem((word,), f"'{name}' is tilted; '{spec.object}' cannot be placed on it", hint)
    elif word == "into" and under.interior is None and under.kind not in FORMED:
        hollow = [body.name for body in scene.bodies if body.interior is not None]
        hint = f"containers here: {', '.join(hollow)}" if hollow else f"to set it on top, write `onto: {name}`"
        yield Problem((word,), f"'{name}' is a {under.kind} and has no hollow", hint)
    elif under.kind == "sphere":
        hint = "place it on a box, a cylinder or the floor"
        yield Problem((word,), f"'{name}' is a sphere; nothing stands on it", hint)
    elif any(body.name == spec.object for body in scene.bodies):
        yield from _size(scene.body(spec.object), under, word)


def _size(body: Body, under: Body, word: str) -> Iterator[Problem]:
    """A top that is too narrow for the object."""
    if under.kind in FORMED or not under.kind or under.interior is not None:
        return
    wide, narrow = float(np.min(body.size[:2])), float(np.min(floor_of(under)[1]))
    if narrow < min(STEADY, wide / 2):
        least = readable(STEADY, "m")
        message = f"the top of '{under.name}' is too narrow for '{body.name}': {readable(narrow, 'm')} wide"
        yield Problem((word,), message, f"place it on a top that is at least {least} wide")


def _relation(spec: PlaceSpec, at: RelationSpec, robot: RobotModel, scene: Scene) -> Iterator[Problem]:
    """A relation to something unknown, to the object itself, to the hand, or a side of what is not a body."""
    bodies = [body.name for body in scene.bodies]
    wrong = tuple(_frame(spec, at.of, ("at", "of"), robot, scene))
    yield from wrong
    if at.side is not None and not wrong and (at.of not in bodies or at.of == "floor"):
        message = f"`side` needs a body; '{at.of}' is {'the floor' if at.of == 'floor' else 'a frame'}"
        yield Problem(("at", "of"), message, "write its point: `xyz: [x, y, z]`")
    elif at.side is not None and not wrong:
        other = scene.body(at.of)
        if other.fixed and other.X_WO.R[2, 2] < UPRIGHT:
            message = f"'{at.of}' is tilted, so its sides are not level"
            yield Problem(("at", "of"), message, "use `xyz` instead of `side`")
    if at.xyz is not None and spec.support is not None and at.xyz[2] != 0.0:
        message = f"the height {readable(at.xyz[2], 'm')} has no effect: `{spec.support_key}` sets the height"
        yield Problem(("at", "xyz", 2), message, f"write 0, or remove `{spec.support_key}`")


def _frame(spec: PlaceSpec, name: str, loc: Loc, robot: RobotModel, scene: Scene) -> Iterator[Problem]:
    """A frame that is unknown, or that moves with the object or the hand."""
    unusable = fixed_frame(robot, scene, name, loc)
    yield from unusable
    if not unusable and carrier(scene, name) == spec.object:
        yield Problem(loc, f"'{spec.object}' cannot be placed relative to itself: it moves with the hand")
