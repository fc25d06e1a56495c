"""A plan as JSON or CSV: an object per motion with its limits and margins, or a row per trajectory point."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, TextIO

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.collision import CollisionHit
from manipcli.model.robot import RobotModel
from manipcli.plan.candidates import Dropped
from manipcli.plan.grasp_margin import GraspMargin
from manipcli.plan.motion_margins import MotionMargins
from manipcli.plan.trajectory import JointTrajectory
from manipcli.plan.why_not import stage_of
from manipcli.report.json import Json, dumps, picked, plain


class PlannedStep(Protocol):
    """The shown fields of a step."""

    @property
    def id(self) -> str: ...
    @property
    def verb(self) -> str: ...
    @property
    def candidate(self) -> str: ...
    @property
    def dropped(self) -> Sequence[Dropped]: ...


class PlannedMotion(Protocol):
    """The shown fields of a motion; `trajectory` is None for a motion of the hand alone."""

    @property
    def step_id(self) -> str: ...
    @property
    def verb(self) -> str: ...
    @property
    def label(self) -> str: ...
    @property
    def trajectory(self) -> JointTrajectory | None: ...
    @property
    def duration(self) -> float: ...


@dataclass(frozen=True, slots=True)
class Limiting:
    """The nearest limit of a motion: its joint, its quantity, and the used fraction of the limit."""

    joint: str
    quantity: str
    fraction: float


def limiting(trajectory: JointTrajectory, robot: RobotModel) -> Limiting | None:
    """The nearest limit of a motion: the largest |v| / v_max, |a| / a_max or |da/dt| / j_max of all joints and times.

    A time-optimal motion at full speed reaches a fraction of 1, one with `velocity_scaling: 0.5` about 0.5. None if the
    points have no derivatives or the robot has no such limit.
    """
    used: list[Limiting] = []
    jerks = None
    if trajectory.accelerations is not None and len(trajectory.times) > 1:
        jerks = np.diff(trajectory.accelerations, axis=0) / np.diff(trajectory.times)[:, None]
    for k, name in enumerate(trajectory.names):
        limits = robot.joint(name).limits
        for quantity, values, limit in (
            ("velocity", trajectory.velocities, limits.velocity),
            ("acceleration", trajectory.accelerations, limits.acceleration),
            ("jerk", jerks, limits.jerk),
        ):
            if values is not None and limit:
                used.append(Limiting(name, quantity, float(np.abs(values[:, k]).max()) / limit))
    return max(used, key=lambda use: use.fraction, default=None)


class PlannedTask(Protocol):
    """The shown parts of a plan."""

    @property
    def steps(self) -> Sequence[PlannedStep]: ...
    @property
    def motions(self) -> Sequence[PlannedMotion]: ...
    def clearances(self) -> Sequence[CollisionHit | None]: ...
    def path_kinds(self) -> Sequence[str]: ...
    def margins(self) -> Sequence[MotionMargins]: ...
    def grasps(self) -> Sequence[tuple[str, GraspMargin]]: ...


def render_json(task: str, plan: PlannedTask, robot: RobotModel) -> str:
    """The plan as one JSON object; durations in s, `used` as a fraction of the limit, clearances in m."""
    motions = zip(plan.motions, plan.path_kinds(), plan.clearances(), plan.margins(), strict=True)
    return dumps(
        {
            "task": task,
            "verdict": "passed",
            "duration": round(sum(motion.duration for motion in plan.motions), 9),
            "motions": [_motion(motion, kind, robot, near, margins) for motion, kind, near, margins in motions],
            "steps": [_step(step) for step in plan.steps],
            "grasps": [
                {"step": step, **picked(margin, "body force friction weight ratio acceleration contacts")}
                for step, margin in plan.grasps()
            ],
            "errors": [],
        }
    )


def _step(step: PlannedStep) -> Json:
    return {
        "id": step.id,
        "verb": step.verb,
        "candidate": step.candidate or None,
        "dropped": [
            {"name": one.name or None, "stage": stage_of(one.refusal.cause), "cause": one.refusal.cause}
            for one in step.dropped
        ],
    }


def write_csv(motions: Sequence[PlannedMotion], stream: TextIO) -> None:
    """Write one row per trajectory point: `time` [s] from the start of its motion, positions in rad or m.

    Columns of joints that a motion does not move, and missing velocities and accelerations, are empty.
    """
    joints = list(dict.fromkeys(name for motion in motions if motion.trajectory for name in motion.trajectory.names))
    kinds = ("position", "velocity", "acceleration")
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["step", "motion", "time", *(f"{joint}_{kind}" for kind in kinds for joint in joints)])
    for motion in motions:
        trajectory = motion.trajectory
        if trajectory is None:
            continue
        columns = [
            _column(trajectory, values, joint)
            for values in (trajectory.positions, trajectory.velocities, trajectory.accelerations)
            for joint in joints
        ]
        for time, *row in zip(trajectory.times, *columns, strict=True):
            writer.writerow([motion.step_id, motion.label, f"{time:.6f}", *row])


def _column(trajectory: JointTrajectory, values: Array | None, joint: str) -> list[str]:
    if values is None or joint not in trajectory.names:
        return [""] * len(trajectory.times)
    return [f"{value:.9g}" for value in values[:, trajectory.names.index(joint)]]


def _motion(
    motion: PlannedMotion, kind: str, robot: RobotModel, near: CollisionHit | None, margins: MotionMargins
) -> Json:
    trajectory = motion.trajectory
    most = limiting(trajectory, robot) if trajectory is not None else None
    return {
        "step": motion.step_id,
        "verb": motion.verb,
        "motion": motion.label,
        "duration": round(motion.duration, 9),
        "path": kind or None,
        "joints": list(trajectory.names) if trajectory is not None else [],
        "limited_by": None
        if most is None
        else {"joint": most.joint, "quantity": most.quantity, "used": round(most.fraction, 6)},
        "bound_by": None if margins.binding is None else picked(margins.binding, "joint quantity share"),
        "margins": plain(margins.margins),
        "manipulability": None if margins.manipulability is None else picked(margins.manipulability, "least time"),
        "clearance": None
        if near is None
        else {"between": [near.a, near.b], "distance": round(near.distance, 6), "time": round(near.time, 6)},
    }
