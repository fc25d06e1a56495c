"""`joint_at`, `opened`, `closed`: where a joint of the scene is, such as that of a door or a drawer."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field, model_validator

from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World
from manipcli.conditions.robustness import Robustness, least, robustness
from manipcli.conditions.scene_joints import (
    joint_named,
    joint_of,
    not_one_joint,
    unknown_joint,
    unknown_motion,
)
from manipcli.conditions.state_window import StateWindow
from manipcli.core.geometry import Array
from manipcli.core.prose import amount, named
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.model.state import joint_positions
from manipcli.scene.joints import SceneJoint
from manipcli.spec.base import Model, problem
from manipcli.spec.names import BodyName, SceneJointName
from manipcli.spec.quantity import JointTolerance, JointValue

SLIDE, TURN = 0.01, 0.0873
"""[m] and [rad] (5 deg): default tolerances."""


class JointAtSpec(Model):
    """A joint of the scene is `at` a position `within` a tolerance, or `above` and/or `below` one."""

    joint: SceneJointName = Field(description="A joint of the scene, `BODY/JOINT`.")
    at: JointValue | None = Field(None, description="Position [rad or m].")
    within: JointTolerance | None = Field(
        None, description="With `at`: largest difference [rad or m]. Default 5 deg or 1 cm."
    )
    above: JointValue | None = Field(None, description="Least position [rad or m].")
    below: JointValue | None = Field(None, description="Largest position [rad or m].")

    @model_validator(mode="after")
    def _whole(self) -> JointAtSpec:
        bounded = self.above is not None or self.below is not None
        if (self.at is not None) == bounded:
            raise problem("conflict", "give either `at`, or `above` and/or `below`")
        if self.within is not None and self.at is None:
            raise problem("conflict", "`within` needs `at`", at=("within",))
        if self.above is not None and self.below is not None and self.above >= self.below:
            hint = "`above` is the least position, `below` the largest: swap them"
            raise problem("conflict", f"`above` {self.above:g} is not less than `below` {self.below:g}", hint=hint)
        return self


class OpenedSpec(Model):
    """A door, a drawer or a lid is open: its joint is `by` or more from the position that counts as closed."""

    object: BodyName = Field(description="A body with one joint, or the link that a joint moves, `BODY/LINK`.")
    by: Annotated[JointValue, Field(gt=0)] = Field(description="Least opening [rad or m], above 0.")


class ClosedSpec(Model):
    """A door, a drawer or a lid is closed: its joint is at most `within` from the position that counts as closed."""

    object: BodyName = Field(description="A body with one joint, or the link that a joint moves, `BODY/LINK`.")
    within: JointTolerance | None = Field(None, description="Largest opening [rad or m]. Default 5 deg or 1 cm.")


def tolerance(joint: SceneJoint, within: float | None) -> float:
    """[rad or m]"""
    return (SLIDE if joint.slides else TURN) if within is None else within


def monitor_at(spec: JointAtSpec, world: World) -> Monitor:
    """`within` minus |q - at|, or the lesser of q - `above` and `below` - q [rad or m]."""
    joint = joint_named(world.scene, spec.joint)
    within = tolerance(joint, spec.within)

    def look(window: StateWindow) -> Robustness:
        q = joint_positions(world.scene, window.states, joint)

        def describe(k: int) -> str:
            return f"joint '{joint.name}' is at {readable(float(q[k]), joint.unit)}; {_wanted(spec, joint)}"

        margins: list[Array] = [within - abs(joint.apart(q, spec.at))] if spec.at is not None else []
        margins += [q - spec.above] if spec.above is not None else []
        margins += [spec.below - q] if spec.below is not None else []
        return least(
            [robustness(one, window.times, unit=joint.unit, scale=within, describe=describe) for one in margins]
        )

    return look


def _wanted(spec: JointAtSpec, joint: SceneJoint | None) -> str:
    """What is asked, in words; without the joint, for a hinge and for a slide."""
    if spec.at is not None:
        within = spec.within if joint is None else tolerance(joint, spec.within)
        return f"at {_value(spec.at, joint)}" + ("" if within is None else f" within {_value(within, joint)}")
    limits = (("above", spec.above), ("below", spec.below))
    return " and ".join(f"{word} {_value(value, joint)}" for word, value in limits if value is not None)


def _value(value: float, joint: SceneJoint | None = None) -> str:
    return f"{amount(value, 'rad')} or {amount(value, 'm')}" if joint is None else readable(value, joint.unit)


def monitor_opened(spec: OpenedSpec | ClosedSpec, world: World) -> Monitor:
    """`opened`: the opening |q - q_closed| minus `by`; `closed`: `within` minus it [rad or m]."""
    joint = joint_of(world.scene, spec.object)
    opened = isinstance(spec, OpenedSpec)
    limit = spec.by if isinstance(spec, OpenedSpec) else tolerance(joint, spec.within)

    def look(window: StateWindow) -> Robustness:
        opening = abs(joint.apart(joint_positions(world.scene, window.states, joint), joint.closed))
        margin = opening - limit if opened else limit - opening

        def describe(k: int) -> str:
            wanted = f"{'by' if opened else 'within'} {readable(limit, joint.unit)}"
            return f"'{spec.object}' is open by {readable(float(opening[k]), joint.unit)}; {wanted}"

        return robustness(margin, window.times, unit=joint.unit, scale=limit, describe=describe)

    return look


def check_at(spec: JointAtSpec, context: CheckContext) -> tuple[Problem, ...]:
    """An unknown joint; a position that its limits do not allow."""
    if found := unknown_joint(context.scene, spec.joint, ("joint",)):
        return found
    joint = joint_named(context.scene, spec.joint)
    slack = tolerance(joint, spec.within)
    for word, value, low, high in (
        ("at", spec.at, joint.lower - slack, joint.upper + slack),
        ("above", spec.above, -math.inf, joint.upper),
        ("below", spec.below, joint.lower, math.inf),
    ):
        if value is not None and not low <= value <= high:
            limits = f"{readable(joint.lower, joint.unit)} to {readable(joint.upper, joint.unit)}"
            message = f"joint '{joint.name}' cannot be {word} {readable(value, joint.unit)}: its limits are {limits}"
            return (Problem((word,), message),)
    return ()


def check_opened(spec: OpenedSpec | ClosedSpec, context: CheckContext) -> tuple[Problem, ...]:
    """An unknown body, one without a joint, or one with several; an opening that the limits do not allow."""
    scene = context.scene
    if found := not_one_joint(scene, spec.object, ("object",)):
        return found
    joint = joint_of(scene, spec.object)
    most = math.pi if joint.type == "continuous" else max(joint.upper - joint.closed, joint.closed - joint.lower)
    if isinstance(spec, OpenedSpec) and spec.by > most + 1e-9:
        message = f"'{spec.object}' opens by at most {readable(most, joint.unit)}, the limit of joint '{joint.name}'"
        return (Problem(("by",), message),)
    return ()


def clause_at(spec: JointAtSpec, robot: RobotModel) -> str:
    return f"joint {named(spec.joint)} is {_wanted(spec, None)}"


def clause_opened(spec: OpenedSpec | ClosedSpec, robot: RobotModel) -> str:
    if isinstance(spec, OpenedSpec):
        return f"{named(spec.object)} is open by at least {_value(spec.by)}"
    return f"{named(spec.object)} is closed" + ("" if spec.within is None else f" within {_value(spec.within)}")


JOINT_AT = Condition(
    name="joint_at",
    spec=JointAtSpec,
    units=("rad", "m"),
    open=monitor_at,
    check=check_at,
    absent=lambda spec, world: unknown_motion(world, joint_named(world.scene, spec.joint)),
    clause=clause_at,
    example="joint_at: {joint: door/hinge, at: 60 deg, within: 5 deg}",
)
OPENED = Condition(
    name="opened",
    spec=OpenedSpec,
    units=("rad", "m"),
    open=monitor_opened,
    check=check_opened,
    absent=lambda spec, world: unknown_motion(world, joint_of(world.scene, spec.object)),
    clause=clause_opened,
    example="opened: {object: door, by: 60 deg}",
)
CLOSED = Condition(
    name="closed",
    spec=ClosedSpec,
    units=("rad", "m"),
    open=monitor_opened,
    check=check_opened,
    absent=lambda spec, world: unknown_motion(world, joint_of(world.scene, spec.object)),
    clause=clause_opened,
    example="closed: {object: drawer, within: 1 cm}",
)
