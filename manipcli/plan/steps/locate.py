"""`locate`: look at an object with a depth camera, and correct where the robot believes it to be.

- locate: {object: cup, with: wrist_camera}
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from functools import partial
from typing import ClassVar, Final

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import Problem, unknown_body
from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.core.prose import amount, named
from manipcli.model.robot import RobotModel
from manipcli.plan.candidates import Candidate, Candidates
from manipcli.plan.claimed_joints import Claims, above
from manipcli.plan.clauses import at_share
from manipcli.plan.inverse_kinematics import InverseKinematics
from manipcli.plan.motion import Look, PlanningState, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.planner import Planner
from manipcli.plan.sight import Sight
from manipcli.plan.step import StepMember
from manipcli.plan.steps.move import RENAMED, VelocityScaling
from manipcli.scene.scene import Body, Scene
from manipcli.spec.base import Model
from manipcli.spec.names import MovableName, SensorRef

ELEVATIONS: Final = tuple(np.radians([50.0, 35.0, 65.0]))
"""[rad] Of the camera above the horizontal through the object."""
STEEP: Final = tuple(np.radians([75.0, 60.0, 45.0]))
"""[rad] The same of an object whose rotation is not known: from above nothing of it is behind it."""
AROUND: Final = tuple(np.radians([0.0, 40.0, -40.0, 80.0, -80.0, 120.0, -120.0, 180.0]))
"""[rad] About the vertical, from the direction in which the camera is."""
FARTHER: Final = (1.1, 1.5)
"""Distances of the camera, in units of the least at which all of the object is in the picture wherever it can be."""
TRIES: Final = 6
"""Restarts of the inverse kinematics at each view."""
SIGHTING: Final = 100
"""Units of work of a sighting."""


class LocateSpec(Model):
    """Look at an object and correct where the robot believes it to be.

    A camera on the arm is moved to where its picture shows the object, wherever that can be within its `known`. The
    next picture that is taken after the motion decides; the step fails if that does not show the object. All later
    steps are planned again from the corrected pose.
    """

    renamed: ClassVar = RENAMED

    object: MovableName = Field(description="The object to locate; it has `known`.")
    with_: SensorRef = Field(alias="with", description="A camera with depth, of the task or the robot.")
    velocity_scaling: VelocityScaling = 0.5


def candidates(spec: LocateSpec, planner: Planner, state: PlanningState) -> Candidates:
    """The present view; then, with a camera on the arm, views from around the object."""
    sight = planner.sights[spec.with_]
    what = f"cannot locate '{spec.object}' with '{spec.with_}'"
    if state.carried is not None and state.carried.body == spec.object:
        raise NotPlannable(f"{what}: it is in the hand", hint="`locate` it before the `pick`, or after the `place`")
    options = [Candidate(partial(_stay, spec, planner, state, sight), name="from here")]
    joints = above(planner.robot, sight.link, planner.gripper_joints) if sight.link else ()
    if not joints:
        return Candidates(options, what=what)
    solver = InverseKinematics(planner.kinematics, joints, sight.link, X_LT=sight.X_LC)
    views = _views(spec, planner, state, sight, solver)
    return Candidates(itertools.chain(options, views), what=what, decides="branch")


def _stay(spec: LocateSpec, planner: Planner, state: PlanningState, sight: Sight) -> StepPlan:
    """Look without a motion."""
    builder = MotionBuilder(planner, state, verb="look")
    _refuse_unseen(spec, planner, builder.now, sight)
    builder.look(Look(spec.object, spec.with_), sight.latency)
    return builder.plan()


def _views(
    spec: LocateSpec, planner: Planner, state: PlanningState, sight: Sight, solver: InverseKinematics
) -> Iterator[Candidate]:
    """Views from around the object, those near the present direction of the camera first."""
    body = planner.scene.body(spec.object)
    target = planner.body_pose(state, spec.object).apply(body.centre)
    x, y, _ = sight.pose(state).p - target
    here = math.atan2(y, x)
    least = _distance(sight, body)

    def attempt(X_WC: Transform) -> StepPlan:
        builder = MotionBuilder(planner, state, verb="locate")
        with solver.trying(TRIES):
            builder.reach("view", X_WC, speed=spec.velocity_scaling, leaving="spin", free=True, solver=solver)
        _refuse_unseen(spec, planner, builder.now, sight)
        builder.look(Look(spec.object, spec.with_), sight.latency)
        return builder.plan()

    turned = body.known is not None and body.known.rotation > 0.0
    for farther, elevation, around in itertools.product(FARTHER, STEEP if turned else ELEVATIONS, AROUND):
        X_WC = _looking_at(target, here + around, elevation, farther * least)
        angle = math.degrees(here + around) % 360.0
        name = f"from {amount(round(farther * least, 3), 'm')} away at {angle:.0f} deg"
        yield Candidate(partial(attempt, X_WC), name=f"{name}, {math.degrees(elevation):.0f} deg above")


def _distance(sight: Sight, body: Body) -> float:
    """[m] Least distance of the camera at which all of the body is in the picture wherever it can be."""
    radius = float(np.linalg.norm(body.size)) / 2.0
    if body.known is not None:
        radius += body.known.radius or float(np.linalg.norm(body.known.half))
    return max(radius / math.sin(sight.cone), sight.depths[0] + radius)


def _looking_at(target: Array, azimuth: float, elevation: float, distance: float) -> Transform:
    """X_WC of a camera that looks at a point (3,), with the horizon level."""
    back = np.array([
        math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation)
    ])  # fmt: skip
    right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    R = np.column_stack([right, np.cross(-back, right), -back])
    return Transform.of(xyz=target + distance * back, R=R)


def _refuse_unseen(spec: LocateSpec, planner: Planner, state: PlanningState, sight: Sight) -> None:
    """
    Raises:
        NotPlannable: the picture does not show the object well enough, wherever that can be.
    """
    planner.kinematics.work.add(SIGHTING)
    sighting = sight.sighting(state, spec.object)
    if sighting.sufficient:
        return
    hint = "move the camera, or the object; `manipcli view TASK` shows the scene"
    if sighting.hider:
        hint = f"move '{sighting.hider}' away, or mount the camera elsewhere"
    raise NotPlannable(sighting.why(spec.object, spec.with_), hint=hint)


def check(spec: LocateSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """An unknown object. What is said about it and about the camera is checked with the files."""
    return unknown_body(scene, spec.object, ("object",), movable=True)


def uncommanded(spec: LocateSpec, robot: RobotModel, claims: Claims) -> tuple[Problem, ...]:
    """An arm without a controller is found when the camera must be moved."""
    return ()


def clause(spec: LocateSpec, robot: RobotModel) -> str:
    return f"look at {named(spec.object)} with {named(spec.with_)} and correct where it is believed to be" + at_share(
        spec.velocity_scaling, 0.5
    )


MEMBER = StepMember(
    name="locate", spec=LocateSpec, candidates=candidates, check=check, uncommanded=uncommanded, clause=clause
)
