"""Grasp frames of a suction cup: the tool on the centre of a face of the object, its +z against the normal."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform, matrix_from_axis_angle
from manipcli.core.units import readable
from manipcli.model.holding import FACING, surface
from manipcli.model.robot import RobotModel
from manipcli.plan.grasp_frames import BELOW, GraspFrame, GraspFrames
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Planner

ROLLS_DEG: Final = (0.0, 90.0, -90.0, 180.0, 45.0, -45.0, 135.0, -135.0)
"""Candidate rotations about the normal, relative to the present orientation of the tool."""
LEVEL: Final = 0.3
"""Largest vertical component of an approach from the side."""
PRESSED: Final = 1e-3
"""[m] The robot may be this deep in the object that it holds: the lip of a cup yields."""


def face_frames(frames: GraspFrames, robot: RobotModel) -> tuple[GraspFrame, ...]:
    """The frames at the faces of the object's bounding box, moved onto its surface; from above first.

    With a pitch, the tool comes at that angle to the faces within 30 deg of it. Those from below are left out, and so
    are faces whose surface is not in front of the tool, as over the opening of a cup. The gap is half the reach of a
    suction cup; a weld touches.

    Raises:
        NotPlannable: no face can be held from the direction that is asked for.
    """
    body, holding = frames.body, robot.holding
    assert holding is not None  # of robots that hold without fingers
    gap = holding.reach / 2 if holding.kind == "suction" else 0.0
    found: list[tuple[float, GraspFrame]] = []
    for k in range(3):
        for sign in (1.0, -1.0):
            normal = frames.X_WO.R[:, k] * sign
            if -normal[2] > BELOW or not _from_here(frames, normal):
                continue
            towards = _approach(frames, normal)
            if towards @ -normal < FACING:
                continue
            at = np.array(body.centre)
            at[k] += sign * body.size[k] / 2
            if abs(normal[2]) < LEVEL and frames.height is not None:
                at[2] = frames.bottom + frames.height
            on = Transform.of(xyz=frames.X_WO.apply(at), R=_facing(frames, -towards))
            seen = surface(body, frames.X_WO, on)
            if seen.facing < FACING:
                continue
            on = on @ Transform.of(xyz=(0.0, 0.0, seen.gap - gap))
            if abs(surface(body, frames.X_WO, on).gap - gap) > gap + 1e-4:
                continue
            found += [(-float(normal[2]), _rolled(on, roll, at[2] - frames.bottom)) for roll in _rolls(frames, normal)]
    if not found:
        if frames.pitch is not None:
            asked = f"an approach at {math.degrees(frames.pitch):.0f} deg below the horizontal"
            message = f"no face of '{body.name}' is within 30 deg of {asked}, which {holding.kind} needs"
            raise NotPlannable(message, hint="set another `approach: {pitch: ...}`, or `from: top` or `from: side`")
        message = f"no face of '{body.name}' can be held from there by {holding.kind}"
        raise NotPlannable(message, hint="set another `approach: {from: ...}`")
    return tuple(frame for _, frame in sorted(found, key=lambda each: round(each[0], 3)))


def clear_of(planner: Planner, state: PlanningState, body: str) -> None:
    """Check that the robot is not deeper in the body than a cup yields.

    Raises:
        NotPlannable: names the deepest link.
    """
    hit = planner.grasping(state, body, margin=-PRESSED).check(state.position)
    if hit is not None:
        link = hit.a if hit.b == body else hit.b
        depth = readable(-hit.distance, "m")
        raise NotPlannable(
            f"'{link}' is {depth} deep in '{body}' at the grasp",
            hint="set the tool frame to the lip of the cup: `tool: {link: ..., pose: ...}` in the robot file",
        )


def _from_here(frames: GraspFrames, normal: Array) -> bool:
    """Whether the face with this outward normal (3,) is on the side that is asked for."""
    level = abs(normal[2]) < LEVEL
    if frames.direction is not None and level != (frames.direction == "side"):
        return False
    if not level or frames.yaw is None:
        return True
    towards = np.array([math.cos(frames.yaw), math.sin(frames.yaw), 0.0])
    return bool(-normal @ towards > FACING)


def _approach(frames: GraspFrames, normal: Array) -> Array:
    """(3,) The direction in which the tool comes to a face: against its normal, or at the pitch that is asked for."""
    if frames.pitch is None:
        return -normal
    level = -normal[:2]
    if abs(normal[2]) >= 1.0 - LEVEL:  # a face on top has no side of its own
        level = (frames.X_WO.p - frames.X_WB.p)[:2]
        if frames.yaw is not None:
            level = np.array([math.cos(frames.yaw), math.sin(frames.yaw)])
    level = level / max(1e-9, float(np.linalg.norm(level)))
    return np.array([*(math.cos(frames.pitch) * level), -math.sin(frames.pitch)])


def _facing(frames: GraspFrames, normal: Array) -> Array:
    """(3, 3) The orientation with z against the normal that is nearest to the present one."""
    z = -normal
    x = frames.R_WT[:, 0] - z * float(frames.R_WT[:, 0] @ z)
    if np.linalg.norm(x) < 0.1:
        x = frames.R_WT[:, 1] - z * float(frames.R_WT[:, 1] @ z)
    if abs(normal[2]) >= LEVEL and frames.yaw is not None:
        x = np.array([math.cos(frames.yaw), math.sin(frames.yaw), 0.0])
        x -= z * float(x @ z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _rolls(frames: GraspFrames, normal: Array) -> tuple[float, ...]:
    asked = abs(normal[2]) >= LEVEL and frames.yaw is not None
    return ROLLS_DEG[:1] if asked else ROLLS_DEG


def _rolled(on: Transform, roll: float, height: float) -> GraspFrame:
    R = on.R @ matrix_from_axis_angle(np.array([0.0, 0.0, 1.0]), math.radians(roll))
    where = "on the top face" if on.R[2, 2] < -LEVEL else "on a side face"
    return GraspFrame(Transform.of(xyz=on.p, R=R), height, f"{where}, rolled by {roll:.0f} deg")
