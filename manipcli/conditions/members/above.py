"""`above`: an object is over another body, with a gap between them."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from manipcli.conditions.body_poses import centres, highest, lowest
from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World, unknown_body, unmoving
from manipcli.conditions.robustness import Robustness, least, robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.core.geometry import rotate_inverse
from manipcli.core.prose import amount, named
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.model.state import body_pose
from manipcli.spec.base import Model
from manipcli.spec.names import BodyName
from manipcli.spec.quantity import Length


class AboveSpec(Model):
    """The object is above `of` by at least `by`, and its centre is over the bounding box of `of`."""

    object: BodyName = Field(description="A body of the scene.")
    of: BodyName = Field(description="The body below it.")
    by: Annotated[Length, Field(ge=0)] = Field(
        default=0.0,
        description="Least gap between the two, along the world's z [m]. Default 0. For an object in contact use "
        "`rests_on`: contacts penetrate a little.",
    )


def monitor(spec: AboveSpec, world: World) -> Monitor:
    """The lesser of two lengths [m]: the gap minus `by`, and the distance of the centre to the edge.

    The gap is from the highest corner of the bounding box of `of` to the lowest corner of the object's. The edge is
    that of the bounding box of `of` along its own x and y; the nearest edge counts, and the distance is negative
    outside. Where units differ, both are divided by half of the shorter side of that box.
    """
    scene = world.scene
    body = scene.body(spec.of)
    half = np.array(body.size[:2]) / 2.0
    scale = float(np.min(half))

    def look(window: StateWindow) -> Robustness:
        states, T = window.states, np.shape(window.times)
        gap = np.broadcast_to(lowest(scene, states, spec.object) - highest(scene, states, spec.of), T)
        X_WB = body_pose(scene, states, spec.of)
        p_B = rotate_inverse(X_WB.quat_xyzw, centres(scene, states, spec.object) - X_WB.position) - body.centre
        over = np.broadcast_to(np.min(half - np.abs(p_B[..., :2]), axis=-1), T)

        def high(k: int) -> str:
            word = "above" if gap[k] >= 0.0 else "below"
            at_least = f"; at least {readable(spec.by, 'm')}" if spec.by else ""
            return f"'{spec.object}' is {readable(abs(float(gap[k])), 'm')} {word} the top of '{spec.of}'{at_least}"

        def within(k: int) -> str:
            word = "inside" if over[k] >= 0.0 else "beyond"
            return (
                f"the centre of '{spec.object}' is {readable(abs(float(over[k])), 'm')} {word} the edge of '{spec.of}'"
            )

        return least(
            [
                robustness(gap - spec.by, window.times, unit="m", scale=scale, describe=high),
                robustness(over, window.times, unit="m", scale=scale, describe=within),
            ]
        )

    return look


def check(spec: AboveSpec, context: CheckContext) -> tuple[Problem, ...]:
    """Unknown bodies, or the same body twice."""
    problems = (
        *unknown_body(context.scene, spec.object, ("object",)),
        *unknown_body(context.scene, spec.of, ("of",)),
    )
    if not problems and spec.object == spec.of:
        return (Problem(("of",), f"'{spec.of}' cannot be above itself"),)
    return problems


def clause(spec: AboveSpec, robot: RobotModel) -> str:
    gap = f" by at least {amount(spec.by, 'm')}" if spec.by else ""
    return f"{named(spec.object)} is above {named(spec.of)}{gap}, its centre over it"


ABOVE = Condition(
    name="above",
    spec=AboveSpec,
    units=("m",),
    open=monitor,
    check=check,
    absent=lambda spec, world: unmoving(world, (spec.object, spec.of)),
    clause=clause,
    example="above: {object: cup, of: tray, by: 5 cm}",
)
