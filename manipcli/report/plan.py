"""A plan as JSON or CSV: an object per motion with its limits and margins, or a row per trajectory point."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import asdict
from typing import TextIO

from manipcli.core.geometry import Array
from manipcli.model.collision import CollisionHit
from manipcli.plan.block_tree import choices
from manipcli.plan.motion_margins import MotionMargins
from manipcli.plan.trajectory import JointTrajectory
from manipcli.plan.why_not import stage_of
from manipcli.report.json import Json, dumps, picked, plain
from manipcli.task.plan_steps import PlannedStep
from manipcli.task.plan_task import Plan, PlannedMotion


def render_json(task: str, plan: Plan) -> str:
    """The plan as one JSON object; durations in s, `used` as a fraction of the limit, clearances in m."""
    beyond = choices(plan.items).beyond
    return dumps(
        {
            "task": task,
            "verdict": "passed",
            **_path(plan),
            "branches": [{"branch": part.branch, **_path(part)} for part in plan.stretches if part.branch],
            "planned_in_run": None if beyond is None else beyond.spec.id,
            "clearances": [
                {"between": list(each.between), "stated": each.stated, "least": _nearest(each.nearest)}
                for each in plan.stated_clearances()
            ],
            "grasps": [
                {
                    "step": step,
                    **picked(margin, "body force friction weight ratio acceleration contacts"),
                    **({"attachment": margin.attachment} if margin.attachment else {}),
                }
                for step, margin in plan.grasps()
            ],
            "errors": [],
        }
    )


def _path(plan: Plan) -> dict[str, Json]:
    """The steps of a plan."""
    motions = zip(plan.motions, plan.path_kinds(), plan.clearances(), plan.margins(), strict=True)
    return {
        "duration": round(plan.duration, 9),
        "motions": [_motion(motion, kind, near, margins) for motion, kind, near, margins in motions],
        "steps": [_step(step) for step in plan.steps],
    }


def _step(step: PlannedStep) -> Json:
    stream = step.plan.stream
    return {
        "id": step.id,
        "verb": step.verb,
        "candidate": step.candidate or None,
        "dropped": [
            {"name": one.name or None, "stage": stage_of(one.refusal.cause), "cause": one.refusal.cause}
            for one in step.dropped
        ],
        "stream": None if stream is None else asdict(stream),
    }


def write_csv(motions: Sequence[PlannedMotion], stream: TextIO) -> None:
    """Write one row per trajectory point: `time` [s] from the start of its motion, positions in rad or m.

    Columns of joints that a motion does not move, and missing velocities and accelerations, are empty. The first column
    is the branch of the motion, if the task has several.
    """
    branches = any(motion.branch for motion in motions)
    joints = list(dict.fromkeys(name for motion in motions if motion.trajectory for name in motion.trajectory.names))
    kinds = ("position", "velocity", "acceleration")
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(
        [*["branch"] * branches, "step", "motion", "time", *(f"{joint}_{kind}" for kind in kinds for joint in joints)]
    )
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
            writer.writerow([*[motion.branch] * branches, motion.step_id, motion.label, f"{time:.6f}", *row])


def _column(trajectory: JointTrajectory, values: Array | None, joint: str) -> list[str]:
    if values is None or joint not in trajectory.names:
        return [""] * len(trajectory.times)
    return [f"{value:.9g}" for value in values[:, trajectory.names.index(joint)]]


def _motion(motion: PlannedMotion, kind: str, near: CollisionHit | None, margins: MotionMargins) -> Json:
    trajectory = motion.trajectory
    timed = [margin for margin in margins.margins if margin.quantity in ("velocity", "acceleration", "jerk")]
    most = max(timed, key=lambda margin: margin.used, default=None)
    return {
        "step": motion.step_id,
        "verb": motion.verb,
        "motion": motion.label,
        "duration": round(motion.duration, 9),
        "path": kind or None,
        "joints": list(trajectory.names) if trajectory is not None else [],
        "limited_by": None
        if most is None
        else {"joint": most.joint, "quantity": most.quantity, "used": round(most.used, 6)},
        "bound_by": None if margins.binding is None else picked(margins.binding, "joint quantity share"),
        "margins": plain(margins.margins),
        "manipulability": None if margins.manipulability is None else picked(margins.manipulability, "least time"),
        "clearance": _nearest(near),
    }


def _nearest(near: CollisionHit | None) -> Json:
    if near is None:
        return None
    return {"between": [near.a, near.b], "distance": round(near.distance, 6), "time": round(near.time, 6)}
