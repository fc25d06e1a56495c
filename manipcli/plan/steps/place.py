"""`place`: set a held object down, let go, and withdraw.

    - place: {object: cup, at: start}
    - place: {object: block, at: [0.5, 0.2], on: table}
"""

from __future__ import annotations

import itertools
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from manipcli.core.geometry import Transform
from manipcli.model.condition import Problem
from manipcli.model.robot import RobotModel
from manipcli.model.scene import Scene
from manipcli.plan.names import unknown_body, unknown_pose
from manipcli.plan.planner import Draft, Planner
from manipcli.plan.search import Range, first_feasible, spread
from manipcli.plan.step import Situation, StepMember, StepPlan
from manipcli.plan.steps.move import Speed
from manipcli.plan.steps.pick import backed_off, slopes
from manipcli.spec.base import Model
from manipcli.spec.quantity import Length


class PlaceSpec(Model):
    """Carry above the place, lower straight, open, withdraw against the direction of approach, rising."""

    object: str = Field(description="What is held and put down.")
    at: Literal["start"] | tuple[Length, Length] = Field(
        "start", description="`start`: where it stood at the start; or [x, y] in the world, on the body `on`."
    )
    on: str | None = Field(None, description="The body whose top takes the object at [x, y].")
    clearance: Annotated[Range, Field(description="Height from which it is lowered straight [m].")] = (0.04, 0.1)
    retreat: Annotated[Range, Field(description="How far the hand withdraws straight [m].")] = (0.12, 0.18)
    posture: str = Field("open", description="The pose to which the hand opens.")
    speed: Speed = Field(0.5, description="Of carrying; lowering takes half of it.")


def plan(spec: PlaceSpec, planner: Planner, situation: Situation) -> StepPlan:
    """The object keeps the orientation about the vertical in which it is held, and stands upright."""
    held = planner.held(situation, spec.object)
    X_WG = _goal(spec, planner, situation)
    X_OT = planner.held_in_tool(situation).inverse()
    X_WT = X_WG @ X_OT

    def attempt(candidate: tuple[float, float, float]) -> StepPlan:
        clearance, retreat, slope = candidate
        draft = Draft(planner, situation)
        draft.straight("carry", Transform.of(xyz=(0.0, 0.0, clearance)) @ X_WT, speed=spec.speed, allowed=held)
        support = planner.touching(draft.with_body(spec.object, X_WG), spec.object)
        draft.straight("lower", X_WT, speed=spec.speed / 2, allowed=held | support)
        draft.open(spec.posture)
        draft.straight("withdraw", backed_off(X_WT, retreat, slope), speed=spec.speed)
        return draft.plan()

    candidates = itertools.product(spread(spec.clearance), spread(spec.retreat), slopes()[::-1])
    return first_feasible(attempt, candidates, what=f"no way to place '{spec.object}'")


def _goal(spec: PlaceSpec, planner: Planner, situation: Situation) -> Transform:
    """X_WG: where the object's frame is to stand."""
    body = planner.scene.body(spec.object)
    if spec.at == "start":
        return body.X_WO
    bottom = float(body.centre[2] - body.size[2] / 2)
    top = 0.0
    if spec.on is not None:
        under = planner.scene.body(spec.on)
        top = float(planner.body_pose(situation, spec.on).p[2] + under.centre[2] + under.size[2] / 2)
    R_WO = planner.body_pose(situation, spec.object).R
    x_axis = R_WO[:, 0]
    yaw = float(np.arctan2(x_axis[1], x_axis[0]))
    return Transform.of(xyz=(spec.at[0], spec.at[1], top - bottom), rpy=(0.0, 0.0, yaw))


def check(spec: PlaceSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """Unknown bodies and postures; a place without a support."""
    found = unknown_body(scene, spec.object, ("object",), movable=True)
    found += unknown_pose(robot, spec.posture, ("posture",))
    if spec.on is not None:
        found += unknown_body(scene, spec.on, ("on",))
    elif spec.at != "start":
        found += (Problem(loc=("at",), message="[x, y] needs the body it is on", hint="add `on: BODY`"),)
    return found


MEMBER = StepMember(name="place", spec=PlaceSpec, plan=plan, check=check)
