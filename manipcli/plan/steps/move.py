"""`move`: move the robot to a named pose or joint positions, or the tool to a pose or a point in a frame.

- move: {to: home}
- move: {to: {joint_1: 30 deg, joint_4: -1.2}, velocity_scaling: 0.5}
- move: {pose: {xyz: [0, 0, 0.2], rpy: [180 deg, 0, 0]}, frame: tray, path: linear}
- move: {point: [0.4, 0.1, 0.3], pointing: [0, 0, -1]}
- move: {point: [0, 0, 5 cm], frame: cup/rim, pointing: [0, 0, -1]}
- move: {pose: {xyz: [0.4, 0.2, 0.3], rpy: [180 deg, 0, 0]}, tolerance: {distance: 1 mm, about: {axis: z}}}
- move: {pose: {xyz: [0.4, 0.2, 0.3], rpy: [180 deg, 0, 0]}, path: {arc: {via: [0.5, 0.1, 0.4]}}}
- move: {point: [0.4, 0.2, 0.3], path: {via: [{xyz: [0.4, 0, 0.3], radius: 5 cm}]}}
- move: {pose: {xyz: [0, 0, 12 cm]}, frame: tool, path: linear, touch: [box]}
- move: {pose: {xyz: [0, 0, 5 cm]}, frame: tool, path: linear, velocity_scaling: 0.02, touch: [button], guarded: true}
  until: {contact_force: {pair: [robot, button], above: 5 N, mean_over: 50 ms}}
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from manipcli.conditions.condition import Problem, unknown_body
from manipcli.conditions.frames import unknown_frame
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.core.prose import amount, listing, named, point
from manipcli.model.robot import RobotModel
from manipcli.plan.candidates import Candidate, Candidates
from manipcli.plan.claimed_joints import Claims, unmoved_joints, unmoved_tool
from manipcli.plan.clauses import at_share, joint_values
from manipcli.plan.compliance import Compliance
from manipcli.plan.limit_check import verify_written
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.planner import NOTHING, Planner
from manipcli.plan.pose_error import Leaving, Open, pointed
from manipcli.plan.prediction import met, pushed
from manipcli.plan.step import Part, StepMember
from manipcli.plan.tolerance_spec import ToleranceSpec
from manipcli.plan.tool_path import arc, blended
from manipcli.plan.unknown_names import unknown_joint, unknown_pose
from manipcli.scene.scene import Scene
from manipcli.spec.base import Model, problem
from manipcli.spec.impedance import TaskSpaceSpec, six
from manipcli.spec.names import BodyName, FrameName, JointName, PoseName
from manipcli.spec.quantity import JointValue, Length, Share
from manipcli.spec.robot import PoseSpec, Vector3

VelocityScaling = Annotated[
    Share, Field(gt=0, le=1, description="Share of the velocity, acceleration and jerk limits.")
]
RENAMED = {"speed": "velocity_scaling"}


class ArcSpec(Model):
    """A circular arc of the tool."""

    via: Vector3 = Field(description="A point on the arc, in `frame` [m].")


class ViaSpec(Model):
    """A point that the tool's path passes, with a rounded corner."""

    xyz: Vector3 = Field(description="The point, in `frame` [m].")
    radius: Annotated[Length, Field(gt=0, le=10.0)] = Field(
        description="Distance from it at which the path leaves the straight segment before it and joins the next [m]."
    )


class ToolPathSpec(Model):
    """A curved path of the tool; its orientation changes at a constant rate over the length."""

    arc: ArcSpec | None = Field(None, description="A circular arc to the goal.")
    via: tuple[ViaSpec, ...] = Field((), description="Straight segments to the goal, through without stopping.")

    @model_validator(mode="after")
    def _one(self) -> ToolPathSpec:
        if (self.arc is None) == (not self.via):
            raise problem("conflict", "needs either `arc` or `via`", hint="for example `path: {arc: {via: [x, y, z]}}`")
        return self


class MoveSpec(Model):
    """Move the robot to a named pose or joint positions (`to`), or its tool to a `pose` or a `point` in a `frame`.

    At a `point` the orientation of the tool is free; with `pointing`, only its rotation about the z axis is. Use this
    for arms with fewer than six joints, which reach few poses. Three joints suffice for a point; `pointing` needs five,
    and none may only rotate the tool about its z axis.

    It is done when every joint has arrived: those of the hand within their controller's tolerance, those of the arm
    also within 0.05 rad or 5 mm of the end of the motion, unless the robot may touch something.

    After `pick` or `grasp` the hand stays closed, even if it met nothing, until `release` or `place` opens it. Until
    then a named pose moves only the joints of the arm, and explicit positions for joints of the hand are refused.

    Bodies under `touch` are not obstacles to the hand: it pushes them or presses on them. Name them in the move that
    leaves them, too. The plan assumes that they slide with the tool; if one does not, later steps are re-planned.

    A `guarded` move is planned to its end and stops, slowing down within its limits, as soon as the step's `until`
    holds. Later steps are re-planned from the position that is then held, a little inside of what the tool presses on.
    The plan assumes that the move stops where it meets a body under `touch`. At its end it waits for `until` as other
    steps do.
    """

    renamed: ClassVar = RENAMED

    to: PoseName | dict[JointName, JointValue] | None = Field(
        None, description="A named pose, or joint positions by name."
    )
    pose: PoseSpec | None = Field(None, description="Where the tool goes, in `frame`.")
    point: Vector3 | None = Field(
        None, description="Where the tool's origin goes, in `frame` [m]; its orientation is left open."
    )
    pointing: tuple[float, float, float] | None = Field(
        None, description="With `point`: the direction of the tool's z axis, in `frame`. Default: any."
    )
    tolerance: ToleranceSpec | None = Field(
        None, description="How far from the `pose` or `point` the tool may be. Default: 0.1 mm and 1 mrad."
    )
    frame: FrameName = Field(
        "world",
        description="`world`, `base`, `tool`, `robot/LINK`, a body, a part of one (`cup/rim`), or a named frame.",
    )
    path: Literal["free", "joint", "linear"] | ToolPathSpec = Field(
        "free",
        description="`linear`: the tool on a straight line. `joint`: straight in joint space, to the arm's nearest "
        "configuration. `free`: the same; if that is not free, straight to another configuration, else around "
        "obstacles (not with `touch` or `guarded`). Default `free`. A mapping: a curved path of the tool.",
    )
    velocity_scaling: VelocityScaling = 1.0
    touch: tuple[BodyName, ...] = Field(
        (),
        description="Bodies that the hand, and what it holds, may touch; the step's `allow` names other pairs. "
        "Default: none.",
    )
    guarded: bool = Field(False, description="Stop as soon as the step's `until` holds. Default false.")
    stiffness: TaskSpaceSpec | None = Field(
        None,
        description="The arm yields like a spring along and about the axes of the tool [N/m, N m/rad]; no controllers "
        "file is needed for it. A guarded move then stays at the force at which it stops. Default: it does not yield.",
    )

    @field_validator("to", mode="before")
    @classmethod
    def _by_joint(cls, to: object) -> object:
        by_name = to.items() if isinstance(to, Mapping) else [("", to)]
        listed = next((name for name, value in by_name if isinstance(value, list | tuple)), None)
        if listed is not None:
            hint = "name each joint: {joint: 30 deg}; a list for a group is a pose in the robot file"
            message = "joint positions are a mapping by joint, not a list"
            raise problem("type", message, at=(listed,) if listed else (), hint=hint)
        return to

    @model_validator(mode="after")
    def _one_target(self) -> MoveSpec:
        if [self.to, self.pose, self.point].count(None) != 2:
            raise ValueError("needs exactly one of `to` (a named pose or joints), `pose` and `point` (of the tool)")
        if self.to is not None and self.path not in ("free", "joint"):
            word = "linear" if self.path == "linear" else "{...}"
            raise ValueError(f"`path: {word}` needs a tool `pose` or `point`, not `to`")
        if self.to is not None and self.frame != "world":
            message = "`frame` applies to a tool `pose` or `point`, not to a named pose or joint positions"
            raise problem("conflict", message, at=("frame",), hint="remove `frame`", key=True)
        if self.to is not None and self.tolerance is not None:
            message = "`tolerance` applies to a tool `pose` or `point`, not to a named pose or joint positions"
            raise problem("conflict", message, at=("tolerance",), hint="remove `tolerance`", key=True)
        if self.point is not None and self.tolerance is not None and self.tolerance.about is not None:
            message = "`about` applies to a `pose`; a `point` leaves the rotation open, with `pointing` that about z"
            raise problem("conflict", message, at=("tolerance", "about"), hint="remove `about`", key=True)
        if self.pointing is not None and self.point is None:
            message = "`pointing` needs a `point`; a `pose` already sets the whole orientation"
            raise problem("conflict", message, at=("pointing",), hint="remove `pointing`", key=True)
        if self.pointing is not None and not any(self.pointing):
            raise problem(
                "conflict", "the direction has length 0", at=("pointing",), hint="straight down is [0, 0, -1]"
            )
        if self.to == {}:
            raise ValueError("`to` has no joint")
        return self


CONFIGURATIONS = 4
"""Maximum number of configurations of the arm in which a tool pose is reached."""


def candidates(spec: MoveSpec, planner: Planner, state: PlanningState) -> Candidates:
    """One for joint positions and straight lines; for a pose of the tool one per configuration of the arm."""
    found: list[Array] = []

    def attempt() -> StepPlan:
        planned = _plan(spec, planner, state, avoid=found)
        found.append(planned.end.position)
        return planned

    def options() -> Iterator[Candidate]:
        yield Candidate(attempt)
        many = spec.to is None and spec.path in ("free", "joint")
        while many and 0 < len(found) < CONFIGURATIONS:
            tried = len(found)
            yield Candidate(attempt, name=f"configuration {tried + 1} of the arm")
            if len(found) == tried:
                return  # there is no other

    return Candidates(options(), decides="branch")


def _plan(spec: MoveSpec, planner: Planner, state: PlanningState, *, avoid: Sequence[Array]) -> StepPlan:
    """One motion; a named pose with joints of the hand moves the hand at the same time, unless it is closed."""
    allowed = planner.may_touch(state, spec.touch) if spec.touch else NOTHING
    builder = MotionBuilder(planner, state, verb="move", allowed=allowed)
    # What is pushed or pressed on would be in no known place along a path around something else.
    around = spec.path == "free" and not (spec.touch or spec.guarded)
    if isinstance(spec.to, str):
        pose = planner.robot.pose(spec.to)
        values = dict(zip(pose.joints, pose.positions, strict=True))
        arm = {name: value for name, value in values.items() if name not in planner.gripper_joints}
        chosen = arm if state.closed and arm else values
        builder.joints("move", tuple(chosen), tuple(chosen.values()), speed=spec.velocity_scaling, free=around)
    elif spec.to is not None:
        verify_written(planner.robot, [(name, value, ("to", name)) for name, value in spec.to.items()])
        builder.joints("move", tuple(spec.to), tuple(spec.to.values()), speed=spec.velocity_scaling, free=around)
    else:
        X_WT, leaving = _goal(spec, planner, state)
        if spec.path == "linear":
            builder.straight("move", X_WT, speed=spec.velocity_scaling, leaving=leaving)
        elif isinstance(spec.path, ToolPathSpec):
            poses = _curve(spec.path, planner.frame(spec.frame, state), planner.tool_pose(state), X_WT)
            builder.along("move", poses, speed=spec.velocity_scaling, leaving=leaving)
        else:
            free = spec.path == "free"
            speed = spec.velocity_scaling
            builder.reach("move", X_WT, speed=speed, free=free, searched=around, leaving=leaving, avoid=avoid)
    planned = builder.plan()
    (motion,) = planned.motions
    end = planned.end
    if spec.touch and motion.trajectory is not None:
        if spec.guarded:
            end = met(planner, state, end, motion.trajectory, allowed)
        else:
            end = pushed(planner, state, end, motion.trajectory, spec.touch)
    compliance = None if spec.stiffness is None else Compliance(frozen(six(spec.stiffness)))
    return StepPlan((replace(motion, awaits=spec.guarded, guarded=spec.guarded, compliance=compliance),), end)


def _goal(spec: MoveSpec, planner: Planner, state: PlanningState) -> tuple[Transform, Leaving]:
    """X_WT, and the open part of its orientation, with the tolerance if one is stated."""
    X_WF = planner.frame(spec.frame, state)
    X_WT, open_ = _target(spec, X_WF, planner, state)
    return X_WT, open_ if spec.tolerance is None else spec.tolerance.of(X_WF, X_WT, open_)


def _target(spec: MoveSpec, X_WF: Transform, planner: Planner, state: PlanningState) -> tuple[Transform, Open]:
    """X_WT, and the open part of its orientation, which is as now, or the nearest that points as requested."""
    if spec.pose is not None:
        return X_WF @ spec.pose.transform, "nothing"
    R = planner.tool_pose(state).R
    p = X_WF.apply(spec.point or ())
    if spec.pointing is None:
        return Transform.of(xyz=p, R=R), "rotation"
    z = X_WF.R @ np.array(spec.pointing)
    return Transform.of(xyz=p, R=pointed(R, z / np.linalg.norm(z))), "spin"


def _curve(path: ToolPathSpec, X_WF: Transform, X_WA: Transform, X_WB: Transform) -> tuple[Transform, ...]:
    """Poses of the tool along the path."""
    if path.arc is not None:
        return arc(X_WA, X_WF.apply(path.arc.via), X_WB)
    return blended(X_WA, [(X_WF.apply(via.xyz), via.radius) for via in path.via], X_WB)


def check(spec: MoveSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """Unknown poses, joints, frames and bodies."""
    found = tuple(unknown for k, name in enumerate(spec.touch) for unknown in unknown_body(scene, name, ("touch", k)))
    if isinstance(spec.to, str):
        return found + unknown_pose(robot, spec.to, ("to",))
    if spec.to is not None:
        return found + tuple(problem for name in spec.to for problem in unknown_joint(robot, name, ("to", name)))
    return found + unknown_frame(robot, scene, spec.frame, ("frame",))


def uncommanded(spec: MoveSpec, robot: RobotModel, claims: Claims) -> tuple[Problem, ...]:
    """Joints of two controllers; a tool without a controller."""
    if isinstance(spec.to, str):
        return unmoved_joints(claims, robot.pose(spec.to).joints, ("to",))
    if spec.to is not None:
        return unmoved_joints(claims, tuple(spec.to), ("to",))
    return unmoved_tool(claims, robot, ("pose",) if spec.pose is not None else ("point",))


def part(spec: MoveSpec, robot: RobotModel, hand: Sequence[str]) -> Part:
    """The arm for a goal of the tool; else by the joints that it names."""
    if spec.to is None:
        return "arm"
    poses = {pose.name: pose.joints for pose in robot.poses}
    joints = poses.get(spec.to, ()) if isinstance(spec.to, str) else tuple(spec.to)
    inside = [name in hand for name in joints]
    return "arm" if not any(inside) else "hand" if all(inside) else "both"


def clause(spec: MoveSpec, robot: RobotModel) -> str:
    touch = f"; the hand may touch {listing([named(body) for body in spec.touch])}" if spec.touch else ""
    return f"move {_destination(spec, robot)}{_along(spec)}{at_share(spec.velocity_scaling, 1.0)}{touch}"


def _destination(spec: MoveSpec, robot: RobotModel) -> str:
    if isinstance(spec.to, str):
        return f"to the pose {named(spec.to)}"
    if spec.to is not None:
        return f"the joints so that {joint_values(robot, list(spec.to), list(spec.to.values()))}"
    frame = "" if spec.frame == "world" else f" in the frame of {named(spec.frame)}"
    within = "" if spec.tolerance is None else f", within {amount(spec.tolerance.distance, 'm')}"
    if spec.pose is None:
        pointing = "" if spec.pointing is None else f", its z axis along {point(spec.pointing, '')}"
        return f"the tool to the point {point(spec.point or ())}{frame}{pointing}{within}"
    turned = ""
    if spec.pose.rpy is not None:
        turned = f" with roll, pitch, yaw {point(spec.pose.rpy, 'rad')}"
    elif spec.pose.quat_xyzw is not None:
        turned = f" with the quaternion {point(spec.pose.quat_xyzw, '')} (x, y, z, w)"
    if spec.tolerance is not None:
        within += f" and {amount(spec.tolerance.rotation, 'rad')}"
        about = spec.tolerance.about
        if about is not None:
            axis = f"its {about.axis} axis" if isinstance(about.axis, str) else f"the axis {point(about.axis, '')}"
            within += f", rotated about {axis} by at most {amount(about.within, 'rad')}"
    return f"the tool to {point(spec.pose.xyz)}{frame}{turned}{within}"


def _along(spec: MoveSpec) -> str:
    if isinstance(spec.path, ToolPathSpec):
        if spec.path.arc is not None:
            return f", on an arc through {point(spec.path.arc.via)}"
        corners = [f"{point(via.xyz)} (rounded from {amount(via.radius, 'm')} before it)" for via in spec.path.via]
        return f", past {listing(corners)} without stopping"
    return {"linear": " on a straight line", "joint": " on a straight line in joint space"}.get(spec.path, "")


MEMBER = StepMember(
    name="move",
    spec=MoveSpec,
    candidates=candidates,
    check=check,
    uncommanded=uncommanded,
    clause=clause,
    guarded=lambda spec: spec.guarded,
    compliant=lambda spec: spec.stiffness is not None,
    part=part,
)
