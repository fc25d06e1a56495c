"""Friction of contacts: coefficients multiply in manipcli, while MuJoCo takes the larger of two geoms.

Between the robot and a body, MuJoCo uses the coefficients of the geom with the higher priority: those of the body's
geoms, which contain the robot's. Between bodies, each pair of geoms has its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import Any

from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Body, Scene

SLIDING, SPINNING, ROLLING = 3, 4, 6
"""Dimensions of a contact: normal force and sliding friction, also the spinning torque, also the rolling torques."""


def towards_robot(robot: RobotModel, body: Body) -> dict[str, Any]:
    """Attributes of the geoms of a body for its contacts with the robot, which has no rolling or spinning friction."""
    rolling, spinning = body.rolling_friction * robot.friction, body.spinning_friction * robot.friction
    return {"friction": [robot.friction * body.friction, spinning, rolling], "condim": _dimension(rolling, spinning)}


def friction_pairs(scene: Scene) -> Iterator[tuple[str, str, list[float], int]]:
    """Names, friction coefficients (5) and contact dimension of all pairs of bodies that can touch each other.

    Two sliding, one spinning and two rolling coefficients. As in Bullet, the sliding friction of a body multiplies the
    rolling and spinning friction [m] of the other one, and both are summed.
    """
    joined = {frozenset((joint.parent, joint.child)) for joint in scene.joints}
    for a, b in combinations(scene.bodies, 2):
        if (a.fixed and b.fixed) or (joined and frozenset((a.name, b.name)) in joined):
            continue
        sliding = a.friction * b.friction
        rolling = a.rolling_friction * b.friction + b.rolling_friction * a.friction
        spinning = a.spinning_friction * b.friction + b.spinning_friction * a.friction
        yield a.name, b.name, [sliding, sliding, spinning, rolling, rolling], _dimension(rolling, spinning)


def _dimension(rolling: float, spinning: float) -> int:
    if rolling > 0.0:
        return ROLLING
    return SPINNING if spinning > 0.0 else SLIDING
