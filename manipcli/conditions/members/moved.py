"""`moved`, `unmoved`: displacement of an object since the start of the run or of the step of `at` or `during`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field, model_validator

from manipcli.conditions.body_poses import centres
from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World, unknown_body, unmoving
from manipcli.conditions.robustness import Robustness, least, robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.core.geometry import Array, rotation_between
from manipcli.core.prose import amount, listing, named
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.spec.base import Model, problem
from manipcli.spec.names import MovableName
from manipcli.spec.quantity import AngleTolerance, Length


class MovedSpec(Model):
    """The object's centre moved by at least `by`, and the object rotated by at least `rotation`, where given."""

    renamed: ClassVar = {"turn": "rotation"}

    object: MovableName = Field(description="A movable body of the scene.")
    by: Annotated[Length, Field(gt=0)] | None = Field(default=None, description="Least distance [m].")
    rotation: AngleTolerance | None = Field(default=None, description="Least angle [rad], to pi.")

    @model_validator(mode="after")
    def _something(self) -> MovedSpec:
        if self.by is None and self.rotation is None:
            raise problem("conflict", "limit missing: give `by` (a length), `rotation` (an angle) or both")
        return self


class UnmovedSpec(Model):
    """The object's centre moved by at most `within`, and the object rotated by at most `rotation`."""

    renamed: ClassVar = {"turn": "rotation"}

    object: MovableName = Field(description="A movable body of the scene.")
    within: Annotated[Length, Field(gt=0)] = Field(description="Largest distance [m].")
    rotation: AngleTolerance | None = Field(default=None, description="Largest angle [rad], to pi. Default: any.")


Change = tuple[Array, Array]
"""(T,) displacement of the centre [m], and rotation of the body [rad]."""


def since_first(world: World, name: str) -> Callable[[StateWindow], Change]:
    """The change of a body's pose since the first tick of the first window."""
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


def monitor_moved(spec: MovedSpec, world: World) -> Monitor:
    """The displacement of the centre minus `by` [m]; the rotation minus `rotation` [rad]; the lesser."""
    changed = since_first(world, spec.object)

    def look(window: StateWindow) -> Robustness:
        far, rotated = changed(window)
        readings = []
        if spec.by is not None:
            text = f"at least {readable(spec.by, 'm')}"
            describe = _text(spec.object, "moved by", far, "m", text)
            readings.append(robustness(far - spec.by, window.times, unit="m", scale=spec.by, describe=describe))
        if spec.rotation is not None:
            text = f"at least {readable(spec.rotation, 'rad')}"
            describe = _text(spec.object, "rotated by", rotated, "rad", text)
            readings.append(
                robustness(rotated - spec.rotation, window.times, unit="rad", scale=spec.rotation, describe=describe)
            )
        return least(readings)

    return look


def monitor_unmoved(spec: UnmovedSpec, world: World) -> Monitor:
    """`within` minus the displacement of the centre [m]; `rotation` minus the rotation [rad]; the lesser."""
    changed = since_first(world, spec.object)

    def look(window: StateWindow) -> Robustness:
        far, rotated = changed(window)
        describe = _text(spec.object, "moved by", far, "m", f"at most {readable(spec.within, 'm')}")
        readings = [robustness(spec.within - far, window.times, unit="m", scale=spec.within, describe=describe)]
        if spec.rotation is not None:
            describe = _text(spec.object, "rotated by", rotated, "rad", f"at most {readable(spec.rotation, 'rad')}")
            readings.append(
                robustness(spec.rotation - rotated, window.times, unit="rad", scale=spec.rotation, describe=describe)
            )
        return least(readings)

    return look


def _text(name: str, verb: str, values: Array, unit: str, limit: str) -> Callable[[int], str]:
    return lambda k: f"'{name}' {verb} {readable(float(values[k]), unit)}; {limit}"


def check(spec: MovedSpec | UnmovedSpec, context: CheckContext) -> tuple[Problem, ...]:
    """An unknown or fixed body."""
    return unknown_body(context.scene, spec.object, ("object",), movable=True)


def moved_clause(spec: MovedSpec, robot: RobotModel) -> str:
    by = [] if spec.by is None else [f"moved by at least {amount(spec.by, 'm')}"]
    by += [] if spec.rotation is None else [f"rotated by at least {amount(spec.rotation, 'rad')}"]
    return f"{named(spec.object)} has {listing(by)} from its start"


def unmoved_clause(spec: UnmovedSpec, robot: RobotModel) -> str:
    turned = "" if spec.rotation is None else f", and rotated by at most {amount(spec.rotation, 'rad')}"
    return f"{named(spec.object)} has moved by at most {amount(spec.within, 'm')} from its start{turned}"


MOVED = Condition(
    name="moved",
    spec=MovedSpec,
    units=("m", "rad"),
    open=monitor_moved,
    check=check,
    absent=lambda spec, world: unmoving(world, (spec.object,)),
    clause=moved_clause,
    example="moved: {object: block, by: 5 cm}",
)
UNMOVED = Condition(
    name="unmoved",
    spec=UnmovedSpec,
    units=("m", "rad"),
    open=monitor_unmoved,
    check=check,
    absent=lambda spec, world: unmoving(world, (spec.object,)),
    scope="always",
    clause=unmoved_clause,
    example="unmoved: {object: vase, within: 2 mm, rotation: 1 deg}",
)
