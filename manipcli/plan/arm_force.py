"""How hard an arm at rest can push, pull or twist: the effort limits of its joints, after gravity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.model.motor_limits import EffortLimits
from manipcli.plan.planner import Planner


@dataclass(frozen=True, slots=True)
class Strongest:
    """The largest share of a wrench that an arm can give, and the joint that limits it; infinite without limits."""

    share: float
    joint: str
    effort: float


def leverage(planner: Planner, q: Array, wrench: Array) -> Array:
    """J^T w: the effort of each joint of the arm, without gravity, for a wrench (6) of the tool in the world."""
    solver, tool = planner.solver, planner.robot.tool
    J = planner.kinematics.jacobian(q, solver.link, None if tool is None else tool.X_LT)
    return np.asarray(J[:, list(solver.columns)].T @ wrench)


def strongest(planner: Planner, q: Array, wrench: Array) -> Strongest:
    """The largest s with |g(q) + s J^T w| within the effort of each joint, for a wrench (6) [N, N m] in the world."""
    solver, load = planner.solver, leverage(planner, q, wrench)
    columns = list(solver.columns)
    gravity = np.array(planner.kinematics.gravity(q))[columns]
    limits = EffortLimits.of(planner.robot).least[columns]
    with np.errstate(divide="ignore", invalid="ignore"):
        most = np.where(load == 0.0, np.inf, (limits - np.sign(load) * gravity) / np.abs(load))
    k = int(np.argmin(most))
    return Strongest(max(0.0, float(most[k])), solver.joints[k], float(limits[k]))


def refuse_too_strong(planner: Planner, q: Array, axis: Array, force: float) -> None:
    """
    Raises:
        NotPlannable: the arm cannot press with `force` [N] along `axis` (3,); names the joint and what it can give.
    """
    most = strongest(planner, q, np.append(axis, np.zeros(3)))
    if force <= most.share:
        return
    limit = f"joint '{most.joint}' reaches its limit of {most.effort:g} {planner.robot.joint(most.joint).effort_unit}"
    message = f"the arm cannot press with {force:g} N here: at {most.share:.3g} N {limit}, after gravity"
    raise NotPlannable(message, hint=f"press with less than {most.share:.3g} N, or where the arm has more leverage")


def refuse_weak(planner: Planner, q: Array, wrench: Array, label: str) -> None:
    """Check that the tool can give a wrench (6) [N, N m] in the world.

    Raises:
        NotPlannable: it cannot; names the joint and what the arm can give along the same wrench.
    """
    most = strongest(planner, q, wrench)
    if most.share >= 1.0:
        return
    size, unit = float(np.linalg.norm(wrench[:3])), "N"
    if size == 0.0:
        size, unit = float(np.linalg.norm(wrench[3:])), "N m"
    joint = planner.robot.joint(most.joint)
    limit = f"joint '{joint.name}' reaches its limit of {most.effort:.3g} {joint.effort_unit}"
    message = f"{label}: the arm can give {most.share * size:.3g} {unit} there, not {size:.4g} {unit}: then {limit}"
    raise NotPlannable(message, hint="lower the friction or the spring of the joint, or use a stronger arm")
