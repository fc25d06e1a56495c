"""`grasped`: two links of the robot press on an object."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from manipcli.conditions.condition import (
    CheckContext,
    Condition,
    Monitor,
    Problem,
    World,
    unknown_body,
    unpinched,
    untouchable,
)
from manipcli.conditions.robustness import Robustness, robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.core.prose import amount, named
from manipcli.core.units import readable
from manipcli.model.grasp import GRIP_FORCE, pinch_force, pressing
from manipcli.model.robot import RobotModel
from manipcli.spec.base import Model
from manipcli.spec.names import MovableName
from manipcli.spec.quantity import Force


class GraspedSpec(Model):
    """At least two links of the robot press on the object, each with at least `above`."""

    object: MovableName = Field(description="A movable body of the scene.")
    above: Annotated[Force, Field(gt=0)] = Field(
        default=GRIP_FORCE, description="Least force of each link [N]. Default 0.1 N."
    )


def monitor(spec: GraspedSpec, world: World) -> Monitor:
    """The second largest normal force of a link on the object, minus `above` [N]."""

    def look(window: StateWindow) -> Robustness:
        force = window.of_contacts(lambda contacts: pinch_force(contacts, spec.object))

        def describe(k: int) -> str:
            found = [
                f"'{link}' with {readable(force, 'N')}" for force, link in pressing(window.touching(k), spec.object)
            ]
            by = f"touched by {' and '.join(found[:2])}" if found else "not touched by the robot"
            return f"'{spec.object}' is {by}; two links with at least {readable(spec.above, 'N')}"

        return robustness(force - spec.above, window.times, unit="N", scale=spec.above, describe=describe)

    return look


def check(spec: GraspedSpec, context: CheckContext) -> tuple[Problem, ...]:
    """An unknown or fixed body."""
    return unknown_body(context.scene, spec.object, ("object",), movable=True) + unpinched(context, "grasped")


def clause(spec: GraspedSpec, robot: RobotModel) -> str:
    return f"at least two links press on {named(spec.object)} with {amount(spec.above, 'N')} or more each"


GRASPED = Condition(
    name="grasped",
    spec=GraspedSpec,
    units=("N",),
    open=monitor,
    check=check,
    absent=lambda spec, world: untouchable(world),
    clause=clause,
    example="grasped: {object: cup}",
    stateless=True,
)
