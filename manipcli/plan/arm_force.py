"""How hard an arm at rest can push, pull or twist: the effort limits of its joints, after gravity."""

from __future__ import annotations

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.model.motor_limits import EffortLimits
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Planner


def refuse_weak(planner: Planner, state: PlanningState, wrench: Array, label: str) -> None:
    """Check that the tool can give a wrench (6) [N, N m] in the world: |g(q) + J^T w| within each effort limit.

    Raises:
        NotPlannable: it cannot; names the joint and what the arm can give along the same wrench.
    """
    solver, tool, q = planner.solver, planner.robot.tool, state.position
    assert tool is not None  # the solver has one
    columns = planner.robot.indices(solver.joints)
    load = planner.kinematics.jacobian(q, tool.link, tool.X_LT)[:, columns].T @ wrench
    gravity = np.array(planner.kinematics.gravity(q))[columns]
    limits = EffortLimits.of(planner.robot).least[columns]
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = np.where(load == 0.0, np.inf, (limits - np.sign(load) * gravity) / np.abs(load))
    k = int(np.argmin(shares))
    share = max(0.0, float(shares[k]))
    if share >= 1.0:
        return
    size, unit = float(np.linalg.norm(wrench[:3])), "N"
    if size == 0.0:
        size, unit = float(np.linalg.norm(wrench[3:])), "N m"
    joint = planner.robot.joint(solver.joints[k])
    limit = f"joint '{joint.name}' reaches its limit of {limits[k]:.3g} {joint.effort_unit}"
    message = f"{label}: the arm can give {share * size:.3g} {unit} there, not {size:.4g} {unit}: then {limit}"
    raise NotPlannable(message, hint="lower the friction or the spring of the joint, or use a stronger arm")
