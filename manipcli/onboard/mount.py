"""How high the root of a robot is above the floor."""

from __future__ import annotations

from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.core.units import readable
from manipcli.model.hand.closure import Closure, HandShape
from manipcli.model.hand.parts import RobotParts
from manipcli.model.hand.shape_points import ShapePoints
from manipcli.model.kinematics import Kinematics
from manipcli.onboard.writer import Entry

HAND_HEIGHT: Final = 0.1
"""[m] A hand alone, and a robot that no start keeps off the floor, are held so high above it."""
ABOVE_FLOOR: Final = 0.006
"""[m] Links that could move, as wheels, are so high above the floor: more than the clearance of plans."""


def guess_mount(
    kinematics: Kinematics,
    points: ShapePoints,
    parts: RobotParts,
    shape: HandShape | None,
    closure: Closure | None,
    zero: Array,
) -> tuple[Transform, Entry | None]:
    """X_WB above the floor: of a hand alone, and of a robot whose lowest point is below its root."""
    robot = kinematics.robot
    arm = parts.arm
    if arm is None and shape is not None and closure is not None:
        every = [
            shape.whole(closure.opened),
            shape.whole((closure.opened + closure.closed) / 2),
            shape.whole(closure.closed),
        ]
        low = min(float(points.at(q, [link.name for link in robot.links])[:, 2].min(initial=0.0)) for q in every)
        up, why = HAND_HEIGHT - low, "the hand alone is held above the floor"
    else:
        first = robot.joint(arm.joints[0]).child if arm is not None else ""
        still = [link.name for link in robot.links if not first or link.name not in robot.descendants(first)]
        low = float(points.at(zero, still)[:, 2].min(initial=0.0))
        moving = {name for joint in robot.joints if joint.moves for name in robot.descendants(joint.child)}
        wheels = float(points.at(zero, [name for name in still if name in moving])[:, 2].min(initial=1.0)) - ABOVE_FLOOR
        up, why = (-min(low, wheels), "its lowest link is on the floor") if min(low, wheels) < -2e-3 else (0.0, "")
    if up <= 0.0:
        return Transform.identity(), None
    up = round(float(np.ceil(up * 1000.0) / 1000.0), 3)
    return Transform.of(xyz=(0.0, 0.0, up)), Entry(
        {"xyz": [0.0, 0.0, up]}, f"{why}: {readable(up, 'm')} above the root"
    )


def hung_up(kinematics: Kinematics, points: ShapePoints, *configurations: Array) -> tuple[Transform, Entry]:
    """X_WB, above the floor in all of these configurations (n)."""
    links = [link.name for link in kinematics.robot.links]
    X_BW = kinematics.robot.X_WB.inverse()
    low = min(float(points.at(q, links, X_BW)[:, 2].min(initial=0.0)) for q in configurations)
    return raised(HAND_HEIGHT - low, "no start on the floor is free of collision, so the robot is held above it")


def raised(up: float, why: str) -> tuple[Transform, Entry]:
    """X_WB with the root at a height [m], rounded up to millimetres."""
    up = round(float(np.ceil(up * 1000.0) / 1000.0), 3)
    return Transform.of(xyz=(0.0, 0.0, up)), Entry({"xyz": [0.0, 0.0, up]}, f"{why}: {readable(up, 'm')}")
