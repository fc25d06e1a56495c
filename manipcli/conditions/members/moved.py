"""`moved`, `unmoved`: an object was displaced, or stayed, since the time that is looked at began."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field, model_validator

from manipcli.conditions.body_poses import centres
from manipcli.conditions.condition import CheckContext, Condition, Gauge, Problem, World, unknown_body, unmoving
from manipcli.conditions.robustness import Robustness, least, robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.core.geometry import Array, rotation_between
from manipcli.core.units import readable
from manipcli.spec.base import Model, problem
from manipcli.spec.quantity import AngleTolerance, Length


class MovedSpec(Model):
    """The object's centre is at least `by` away from where it was, or the object rotated by at least
    `rotation`; both where both are given."""

    renamed: ClassVar = {"turn": "rotation"}

    object: str = Field(description="A body of the scene that can move.")
    by: Annotated[Length, Field(gt=0)] | None = Field(default=None, description="Least distance [m].")
    rotation: AngleTolerance | None = Field(default=None, description="Least angle [rad], to pi.")

    @model_validator(mode="after")
    def _something(self) -> MovedSpec:
        if self.by is None and self.rotation is None:
            raise problem("conflict", "say how far: `by` (a length), `rotation` (an angle), or both")
        return self


class UnmovedSpec(Model):
    """The object's centre is at most `within` away from where it was, and the object rotated by at most `rotation`."""

    renamed: ClassVar = {"turn": "rotation"}

    object: str = Field(description="A body of the scene that can move.")
    within: Annotated[Length, Field(gt=0)] = Field(description="Largest distance [m].")
    rotation: AngleTolerance | None = Field(default=None, description="Largest angle [rad], to pi. Default: any.")


Change = tuple[Array, Array]
"""(T,) how far the centre moved [m], and by how much the body rotated [rad]."""


def since_first(world: World, name: str) -> Callable[[StateWindow], Change]:
    """How a body was displaced since the first tick that is shown."""
    scene = world.scene
    k = scene.movable.index(scene.body(name))
    first: list[Change] = []

    def changed(window: StateWindow) -> Change:
        centre, quat = centres(scene, window.states, name), window.states.body_quat_xyzw[:, k]
        if not first:
            first.append((centre[0].copy(), quat[0].copy()))
        p, q = first[0]
        return np.linalg.norm(centre - p, axis=-1), np.linalg.norm(rotation_between(q, quat), axis=-1)

    return changed


def gauge_moved(spec: MovedSpec, world: World) -> Gauge:
    """How far the centre is from where it was, minus `by` [m]; its rotation minus `rotation` [rad]; the lesser."""
    changed = since_first(world, spec.object)

    def look(window: StateWindow) -> Robustness:
        far, rotated = changed(window)
        readings = []
        if spec.by is not None:
            text = f"at least {readable(spec.by, 'm')}"
            say = _say(spec.object, "moved by", far, "m", text)
            readings.append(robustness(far - spec.by, window.times, unit="m", scale=spec.by, say=say))
        if spec.rotation is not None:
            text = f"at least {readable(spec.rotation, 'rad')}"
            say = _say(spec.object, "rotated by", rotated, "rad", text)
            readings.append(robustness(rotated - spec.rotation, window.times, unit="rad", scale=spec.rotation, say=say))
        return least(readings)

    return look


def gauge_unmoved(spec: UnmovedSpec, world: World) -> Gauge:
    """`within` minus the distance of the centre from where it was [m]; `rotation` minus its rotation [rad]."""
    changed = since_first(world, spec.object)

    def look(window: StateWindow) -> Robustness:
        far, rotated = changed(window)
        say = _say(spec.object, "moved by", far, "m", f"at most {readable(spec.within, 'm')}")
        readings = [robustness(spec.within - far, window.times, unit="m", scale=spec.within, say=say)]
        if spec.rotation is not None:
            say = _say(spec.object, "rotated by", rotated, "rad", f"at most {readable(spec.rotation, 'rad')}")
            readings.append(robustness(spec.rotation - rotated, window.times, unit="rad", scale=spec.rotation, say=say))
        return least(readings)

    return look


def _say(name: str, verb: str, values: Array, unit: str, limit: str) -> Callable[[int], str]:
    return lambda k: f"'{name}' {verb} {readable(float(values[k]), unit)}; {limit}"


def check(spec: MovedSpec | UnmovedSpec, context: CheckContext) -> tuple[Problem, ...]:
    """The body exists and can move."""
    return unknown_body(context.scene, spec.object, ("object",), movable=True)


MOVED = Condition(
    name="moved",
    spec=MovedSpec,
    units=("m", "rad"),
    open=gauge_moved,
    check=check,
    absent=lambda spec, world: unmoving(world, (spec.object,)),
    example="moved: {object: block, by: 5 cm}",
)
UNMOVED = Condition(
    name="unmoved",
    spec=UnmovedSpec,
    units=("m", "rad"),
    open=gauge_unmoved,
    check=check,
    absent=lambda spec, world: unmoving(world, (spec.object,)),
    scope="always",
    example="unmoved: {object: vase, within: 2 mm, rotation: 1 deg}",
)
