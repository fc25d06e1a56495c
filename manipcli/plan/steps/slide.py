"""`slide`: press on a face with a force, and move along a path on it.

- slide: {object: table, along: [[0, -10 cm], [0, 10 cm]], force: 5 N}
- slide: {object: board/face, along: [[0, 0], [20 cm, 0], [20 cm, 10 cm]], force: 8 N, velocity_scaling: 0.05}
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Annotated, Final

import numpy as np
from pydantic import Field, model_validator

from manipcli.conditions.frames import carrier
from manipcli.core.geometry import Array, Transform
from manipcli.core.prose import amount, listing, named, point
from manipcli.model.robot import RobotModel
from manipcli.plan.clauses import at_share
from manipcli.plan.compliance import compliant
from manipcli.plan.contact_line import hover
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.planner import Planner
from manipcli.plan.step import StepMember, single
from manipcli.plan.steps.move import VelocityScaling
from manipcli.plan.steps.press import AWAY, DOWN, ForceSpec, check, comply, face, press, relax, uncommanded
from manipcli.plan.tool_path import blended
from manipcli.spec.base import problem
from manipcli.spec.quantity import Length
from manipcli.spec.robot import Vector3

ROUND: Final = 0.01
"""[m] Corners of the path are rounded from this distance on, at most 40 % of a segment."""
SETTLED: Final = 0.2
"""[s] The force is held before it moves on."""


class SlideSpec(ForceSpec):
    """Press on a face with a force, and move along a path on it: wipe, polish, trace.

    The hand meets the first point as `press` does, moves through the others, and backs off. Across the force the arm is
    firm, so that friction holds it back by little. It is done when the mean of the felt force along the path is within
    10 % of `force`.
    """

    along: Annotated[tuple[Vector3 | tuple[Length, Length], ...], Field(min_length=2, max_length=100)] = Field(
        description="Points of the path, at least two: [x, y] or [x, y, z] from the middle of the upper face, or of "
        "the part, along its axes [m]. Corners are rounded."
    )
    velocity_scaling: VelocityScaling = 0.1

    @model_validator(mode="after")
    def _moving(self) -> SlideSpec:
        for k, (a, b) in enumerate(pairwise(self.points)):
            if np.linalg.norm(b - a) < 1e-6:
                raise problem("conflict", "it is the same point as the one before", at=("along", k + 1))
        return self

    @property
    def points(self) -> tuple[Array, ...]:
        """(3,) each."""
        return tuple(np.array([*p, 0.0][:3]) for p in self.along)


def _plan(spec: SlideSpec, planner: Planner, state: PlanningState) -> StepPlan:
    builder = MotionBuilder(planner, state, verb="slide")
    X_WF, axis = face(spec, planner, state), spec.axis
    first, *rest = (X_WF.apply(p) for p in spec.points)
    X_WH = hover(builder, planner, carrier(planner.scene, spec.object), first, axis, speed=spec.velocity_scaling)
    compliance = comply(spec, planner, builder.now.position, hold=SETTLED)
    press(builder, "press", compliance)
    corners = [X_WH.p + p - first for p in rest]
    lengths = [float(np.linalg.norm(b - a)) for a, b in pairwise([X_WH.p, *corners])]
    radii = [min(ROUND, 0.4 * a, 0.4 * b) for a, b in pairwise(lengths)]
    X_WE = Transform.of(xyz=corners[-1], R=X_WH.R)
    assert compliance.force is not None
    moving = replace(compliance, force=replace(compliance.force, hold=None))
    with compliant(builder, moving):
        if radii:
            vias = list(zip(corners[:-1], radii, strict=True))
            builder.along("slide", blended(X_WH, vias, X_WE), speed=spec.velocity_scaling)
        else:
            builder.straight("slide", X_WE, speed=spec.velocity_scaling)
    relax(builder, moving)
    builder.straight("withdraw", Transform.of(xyz=-AWAY * axis) @ X_WE, speed=spec.velocity_scaling)
    return builder.plan()


def clause(spec: SlideSpec, robot: RobotModel) -> str:
    direction = "" if spec.direction == DOWN else f" in the direction {point(spec.direction, '')}"
    text = f"press on {named(spec.object)}{direction} with {amount(spec.force, 'N')} and slide through "
    return text + listing([point(p) for p in spec.along]) + at_share(spec.velocity_scaling, 0.1)


MEMBER = StepMember(
    name="slide",
    spec=SlideSpec,
    candidates=single(_plan),
    check=check,
    uncommanded=uncommanded,
    clause=clause,
    compliant=lambda _: True,
    part=lambda *_: "arm",
)
