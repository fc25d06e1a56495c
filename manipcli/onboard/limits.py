"""Limits of joints that a description leaves out: velocities, efforts and accelerations, from sizes and weights."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.core.text import digits
from manipcli.core.units import EARTH_GRAVITY, readable
from manipcli.description.elements import Joint
from manipcli.model.configuration import with_mimics
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.spec.robot import LimitsSpec

SAMPLES: Final = 200
FASTEST: Final = math.pi
"""[rad/s] Proposed at most."""
TIP_SPEED: Final = 1.0
"""[m/s] of the farthest point of the robot, from one joint alone."""
SLIDE: Final = 0.25
"""[m/s] Proposed for a prismatic joint."""
FINGER_FORCE: Final = 40.0
"""[N] at a finger tip."""
LOAD: Final = 0.05
"""Share of the arm's mass that a joint can hold `LEVER` from its axis, however little is behind it now: a flange gets a
tool."""
LEVER: Final = 0.1
"""[m]"""
CLOSING: Final = 0.5
"""[s] in which a finger crosses its range."""
TINY: Final = 1e-6
"""[N m or N] Below this, a weight is rounding."""
MOST_ACCELERATION: Final = 10.0
LEAST_ACCELERATION: Final = 0.5


@dataclass(frozen=True, slots=True)
class ProposedLimits:
    """Limits of a joint, and why; `missing`: the description lacks some of them."""

    spec: LimitsSpec
    evidence: str
    missing: tuple[str, ...]


def propose_limits(
    kinematics: Kinematics, arm: Sequence[str], hand: Sequence[str], lengths: dict[str, float], *, seed: int = 0
) -> dict[str, ProposedLimits]:
    """By joint, for all joints that a controller moves.

    Args:
        kinematics: of the robot.
        arm, hand: names of the joints.
        lengths: [m] distance of the farthest point from the axis of each joint.
        seed: of the sampled configurations.
    """
    gravity, inertia = _loads(kinematics, seed)
    robot = kinematics.robot
    least = LOAD * -EARTH_GRAVITY[2] * _mass(robot, arm)
    found = {}
    for name in (*arm, *hand):
        joint, k = robot.joint(name), robot.joint_names.index(name)
        length = max(lengths[name], 0.02)
        found[name] = _finger(joint, length) if name in hand else _arm(joint, length, gravity[k], inertia[k], least)
    return found


def _arm(joint: Joint, length: float, gravity: float, inertia: float, load: float) -> ProposedLimits:
    """`load` [N]: weight that the joint can hold in any case."""
    velocity, effort = joint.limits.velocity, joint.limits.effort
    missing, why, update = [], [], {}
    if velocity is None:
        velocity = SLIDE if joint.unit == "m" else rounded(min(FASTEST, TIP_SPEED / length))
        missing.append("velocity")
        update["velocity"] = velocity
        why.append(f"velocity: {_reach(joint, length)}")
    if effort is None:
        moving = 2.0 * gravity + inertia * velocity / 0.5
        least = load if joint.unit == "m" else load * LEVER
        effort = rounded_up(max(moving, least))
        missing.append("effort")
        update["effort"] = effort
        why.append(
            f"effort: a load of {LOAD:.0%} of the arm's mass{'' if joint.unit == 'm' else _lever(LEVER)}"
            if moving < least
            else f"effort: twice the weight, {digits(gravity) if gravity > TINY else 0} {joint.effort_unit}, and full "
            "speed in 0.5 s"
        )
    elif effort < 1.2 * gravity:
        update["effort"] = rounded_up(2.0 * gravity)
        missing.append("effort")
        why.append(
            f"effort: {digits(effort)} {joint.effort_unit} of the description is too little for the weight, "
            f"{digits(gravity)}; twice that"
        )
        effort = update["effort"]
    spare = (effort - gravity) / max(inertia, 1e-9)
    acceleration = rounded(min(MOST_ACCELERATION, max(LEAST_ACCELERATION, 0.5 * spare)))
    update["acceleration"] = acceleration
    why.append(
        "acceleration: the usual 10" if acceleration == MOST_ACCELERATION
        else f"acceleration: half of what the effort leaves, inertia {digits(inertia)} {joint.inertia_unit}"
    )  # fmt: skip
    return ProposedLimits(LimitsSpec(**update), "; ".join(why), tuple(missing))


def _finger(joint: Joint, length: float) -> ProposedLimits:
    velocity, effort = joint.limits.velocity, joint.limits.effort
    missing, why, update = [], [], {}
    lower, upper = joint.limits.range
    travel = upper - lower if math.isfinite(upper - lower) else 1.0
    if velocity is None:
        velocity = rounded(max(travel, 1e-3) / CLOSING)
        missing.append("velocity")
        update["velocity"] = velocity
        why.append(f"velocity: its range in {CLOSING:g} s")
    if effort is None:
        missing.append("effort")
        update["effort"] = rounded_up(FINGER_FORCE * (1.0 if joint.unit == "m" else length))
        why.append(f"effort: {FINGER_FORCE:g} N at the finger tip{'' if joint.unit == 'm' else _lever(length)}")
    update["acceleration"] = rounded(max(10.0 * velocity, 0.5))
    why.append("acceleration: full speed in 0.1 s")
    return ProposedLimits(LimitsSpec(**update), "; ".join(why), tuple(missing))


def _mass(robot: RobotModel, arm: Sequence[str]) -> float:
    """[kg] that the first joint of the arm moves."""
    if not arm:
        return 0.0
    moved = robot.descendants(robot.joint(arm[0]).child)
    return sum(link.inertial.mass for link in robot.links if link.name in moved and link.inertial is not None)


def _lever(length: float) -> str:
    return f", {readable(length, 'm')} from its axis"


def _reach(joint: Joint, length: float) -> str:
    if joint.unit == "m":
        return "a usual one"
    return f"at most {TIP_SPEED:g} m/s, {readable(length, 'm')} from its axis"


def _loads(kinematics: Kinematics, seed: int) -> tuple[Array, Array]:
    """(n) largest gravity load [N m or N], and (n) largest inertia [kg m2 or kg], in random configurations."""
    robot, rng = kinematics.robot, np.random.default_rng(seed)
    ranges = [joint.limits.within_soft for joint in robot.moving_joints]
    lower = np.array([low if math.isfinite(low) else -math.pi for low, _ in ranges])
    upper = np.array([high if math.isfinite(high) else math.pi for _, high in ranges])
    gravity, inertia = np.zeros(len(lower)), np.zeros(len(lower))
    for q in rng.uniform(lower, upper, (SAMPLES, len(lower))):
        q = np.array(with_mimics(robot, q))
        gravity = np.maximum(gravity, np.abs(kinematics.gravity(q)))
        inertia = np.maximum(inertia, np.diag(kinematics.mass_matrix(q)))
    return gravity, inertia


def rounded(value: float) -> float:
    """To two digits."""
    return float(f"{value:.2g}")


def rounded_up(value: float) -> float:
    """To two digits, not below the value."""
    if value <= 0.0:
        return 1.0
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.ceil(value / unit - 1e-9) * unit:.2g}")
