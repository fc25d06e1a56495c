"""`rests_on`: an object rests on another body."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World, unknown_body, untouchable
from manipcli.conditions.robustness import Robustness, robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.conditions.touch import between
from manipcli.core.prose import named, share
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.spec.base import Model
from manipcli.spec.names import BodyName, MovableName
from manipcli.spec.quantity import Share


class RestsOnSpec(Model):
    """The object presses on `of` with at least `share` of its own weight."""

    object: MovableName = Field(description="A movable body of the scene.")
    of: BodyName = Field(description="The body that carries it.")
    share: Annotated[Share, Field(gt=0)] = Field(default=0.5, description="Least share of its weight. Default 50 %.")


def monitor(spec: RestsOnSpec, world: World) -> Monitor:
    """The normal force between the two minus `share` m g [N], g the scene's gravity.

    Only the magnitude of the normal force counts, not its direction: an object pressed hard against a wall also counts
    as resting on it. Where units differ, the margin is divided by `share` m g.
    """
    weight = world.scene.body(spec.object).mass * float(np.linalg.norm(world.scene.gravity))
    wanted = spec.share * weight
    pair = (spec.object, spec.of)

    def look(window: StateWindow) -> Robustness:
        force = window.of_contacts(lambda contacts: sum(c.force for c in contacts if between(pair, c)))

        def describe(k: int) -> str:
            presses = f"'{spec.object}' presses on '{spec.of}' with {readable(float(force[k]), 'N')}"
            return f"{presses}, its weight is {readable(weight, 'N')}; at least {readable(wanted, 'N')}"

        return robustness(force - wanted, window.times, unit="N", scale=wanted or 1.0, describe=describe)

    return look


def check(spec: RestsOnSpec, context: CheckContext) -> tuple[Problem, ...]:
    """Unknown bodies, the same body twice, a fixed object, or no gravity."""
    problems = (
        *unknown_body(context.scene, spec.object, ("object",), movable=True),
        *unknown_body(context.scene, spec.of, ("of",)),
    )
    if not problems and spec.object == spec.of:
        return (Problem(("of",), f"'{spec.of}' cannot rest on itself"),)
    if not problems and not context.scene.gravity.any():
        return (Problem(("object",), f"'{spec.object}' has no weight: the scene has no gravity"),)
    return problems


def clause(spec: RestsOnSpec, robot: RobotModel) -> str:
    return f"{named(spec.object)} rests on {named(spec.of)} with at least {share(spec.share)} of its weight"


RESTS_ON = Condition(
    name="rests_on",
    spec=RestsOnSpec,
    units=("N",),
    open=monitor,
    check=check,
    absent=lambda spec, world: untouchable(world),
    clause=clause,
    example="rests_on: {object: cup, of: desk}",
)
