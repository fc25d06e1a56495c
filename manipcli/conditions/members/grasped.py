"""`grasped`: the robot holds an object between two of its links."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from manipcli.conditions.condition import Condition, Gauge, Problem, Setting, World, unknown_body, untouchable
from manipcli.conditions.robustness import Reading, reading
from manipcli.conditions.state_window import Moments
from manipcli.core.units import readable
from manipcli.model.grasp import GRIP_FORCE, pinch_force, pressing
from manipcli.spec.base import Model
from manipcli.spec.quantity import Force


class GraspedSpec(Model):
    """Two links of the robot at least press on the object, each with at least `above`."""

    object: str = Field(description="A body of the scene that can move.")
    above: Annotated[Force, Field(gt=0)] = Field(
        default=GRIP_FORCE, description="Least force of each [N]. Default 0.1 N."
    )


def gauge(spec: GraspedSpec, world: World) -> Gauge:
    """The normal force of the link that presses second hardest, minus `above` [N]."""

    def look(moments: Moments) -> Reading:
        force = moments.of_contacts(lambda contacts: pinch_force(contacts, spec.object))

        def say(k: int) -> str:
            found = [
                f"'{link}' with {readable(force, 'N')}" for force, link in pressing(moments.touching(k), spec.object)
            ]
            by = f"touched by {' and '.join(found[:2])}" if found else "not touched by the robot"
            return f"'{spec.object}' is {by}; two links with at least {readable(spec.above, 'N')}"

        return reading(force - spec.above, moments.times, unit="N", scale=spec.above, say=say)

    return look


def check(spec: GraspedSpec, setting: Setting) -> tuple[Problem, ...]:
    """The body exists and can move."""
    return unknown_body(setting.scene, spec.object, ("object",), movable=True)


GRASPED = Condition(
    name="grasped",
    spec=GraspedSpec,
    units=("N",),
    open=gauge,
    check=check,
    absent=lambda spec, world: untouchable(world),
    example="grasped: {object: cup}",
    stateless=True,
)
