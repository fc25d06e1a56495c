"""Paths (geometry without time): joint waypoints, and straight lines of a tool frame in the world.

A straight line of the tool interpolates position linearly and orientation on the shortest arc (slerp: a constant
rotation vector), and is turned into joint positions point by point: each from the one before, without restarts, so that
the arm stays on one branch of its inverse kinematics.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform, frozen, matrix_from_axis_angle
from manipcli.plan.base_move import base_advice
from manipcli.plan.inverse_kinematics import ANGLE_TOLERANCE, InverseKinematics
from manipcli.plan.pose_error import rotation_vector

LINEAR_STEP = 0.005  # m between two points of a straight line
LONGEST = 100.0  # m of a straight line
ANGULAR_STEP = 0.02  # rad between two points of a straight line
MAX_JUMP = 0.35  # rad or m of one joint between two points: more is a change of branch, or nearly singular
_STARTS = 4  # further configurations from which the end of a line is tried
_REFINED = 3  # the steps towards a far goal are short: the nearest point needs more of them
_OTHERWISE = "start {} from another arm configuration (after a `pick`: another `yaw` of its `approach`)"


def joint_path(waypoints: npt.ArrayLike) -> Array:
    """A path through `waypoints` (k, n), k >= 1: (m, n), equal neighbours merged.

    The retimer chooses the curve between them.
    """
    points = np.array(waypoints, dtype=np.float64)
    keep = np.ones(len(points), dtype=bool)
    keep[1:] = np.max(np.abs(np.diff(points, axis=0)), axis=1) > 1e-9
    return frozen(points[keep])


def interpolate(X_WA: Transform, X_WB: Transform) -> tuple[Transform, ...]:
    """Poses from A to B, both included: p(u) = p_A + u (p_B - p_A), R(u) = R_A exp(u log(R_A^T R_B)), u in [0, 1].

    Args:
        X_WA, X_WB: first and last pose; neighbours between them differ by at most `LINEAR_STEP` and `ANGULAR_STEP`.

    Raises:
        NotPlannable: it is longer than `LONGEST`.
    """
    distance = X_WB.p - X_WA.p
    rotation = rotation_vector(X_WA.R.T @ X_WB.R)
    whole = float(np.linalg.norm(rotation))
    axis = rotation / whole if whole > 1e-12 else np.array([0.0, 0.0, 1.0])
    steps = max(math.hypot(*distance) / LINEAR_STEP, whole / ANGULAR_STEP)
    if not steps < LONGEST / LINEAR_STEP:
        raise NotPlannable(f"the straight line is {math.hypot(*distance):.3g} m long", hint=f"at most {LONGEST:g} m")
    count = max(1, int(np.ceil(steps - 1e-9)))
    between = [
        Transform(
            R=frozen(X_WA.R @ matrix_from_axis_angle(axis, k / count * whole)),
            p=frozen(X_WA.p + k / count * distance),
        )
        for k in range(1, count)
    ]
    return (X_WA, *between, X_WB)


def rotated(X_WT: Transform, axis: Array, angle: float) -> tuple[Transform, ...]:
    """Poses from T on while it rotates in place about an `axis` (3,) of the world by `angle` [rad], of any size."""
    count = max(2, int(np.ceil(abs(angle) / ANGULAR_STEP)))
    turns = [matrix_from_axis_angle(axis, k / count * angle) for k in range(count + 1)]
    return tuple(Transform.of(xyz=X_WT.p, R=turn @ X_WT.R) for turn in turns)


def linear_path(
    solver: InverseKinematics, q: npt.ArrayLike, X_WT: Transform, visit: Callable[[Array], None] = lambda _: None
) -> Array:
    """The straight line of the tool from where `q` (n) has it to `X_WT`; `visit` is called as in `follow_poses`.

    Raises:
        NotPlannable: see `follow_poses`.
    """
    return follow_poses(solver, q, interpolate(solver.forward(q), X_WT), visit, shape="straight line")


def follow_poses(
    solver: InverseKinematics,
    q: npt.ArrayLike,
    poses: Sequence[Transform],
    visit: Callable[[Array], None] = lambda _: None,
    *,
    shape: str = "tool's path",
) -> Array:
    """Joint positions that move the tool through `poses`; the first is the tool pose at `q` (n).

    Args:
        solver: of the joints that move.
        q: (n) positions of all moving joints of the robot at the start.
        poses: `X_WT`, near neighbours (see `interpolate`).
        visit: called with the positions (n) of all joints at each pose but the first, as soon as they are found.
        shape: what the path is, for refusals.

    Returns:
        One waypoint per pose, of the solver's joints.

    Raises:
        NotPlannable: a pose cannot be reached from the one before; names the distance along the path, and the cause.
    """
    q = np.array(q, dtype=np.float64)
    columns = list(solver.columns)
    waypoints = [q[columns]]
    otherwise = _OTHERWISE.format("the line" if shape == "straight line" else "it")
    walked = turned = 0.0
    for before, X_WT in pairwise(poses):
        walked += float(np.linalg.norm(X_WT.p - before.p))
        turned += float(np.linalg.norm(rotation_vector(before.R.T @ X_WT.R)))
        found = solver.near(X_WT, q)
        rotated = f" and {np.degrees(turned):.0f} deg" if turned > ANGLE_TOLERANCE else ""
        where = f"after {walked * 1000.0:.0f} mm{rotated}"
        if not (found.converged or found.within(solver.tolerance)):
            if shape == "straight line" and (beyond := _end_beyond_reach(solver, poses[-1], q)) is not None:
                raise beyond
            raise NotPlannable(
                f"the {shape} is unreachable {where}: {found.explain(solver.tolerance)}",
                hint=f"{otherwise}, make it shorter, or use `path: free`",
                reason="line",
            )
        jump = np.abs(found.q[columns] - q[columns])
        worst = int(np.argmax(jump))
        if jump[worst] > MAX_JUMP:
            raise NotPlannable(
                f"joint '{solver.joints[worst]}' would jump by {jump[worst]:.2f} {solver.unit(worst)} {where}, from "
                f"one point to the next (near singular: {solver.singularity(q)})",
                hint=f"{otherwise}, or use `path: free`",
                reason="line",
            )
        q = found.q
        visit(q)
        waypoints.append(q[columns])
    return joint_path(waypoints)


def _end_beyond_reach(solver: InverseKinematics, X_WT: Transform, q: Array) -> NotPlannable | None:
    """The refusal of a line whose end no arm configuration reaches, in any orientation; None if one may."""
    anyhow = solver.leaving("rotation")
    starts = (q, *solver.random_configurations(q, np.random.default_rng(0), _STARTS))
    tried = []
    for start in starts:
        tried.append(anyhow.near(X_WT, start))
        if tried[-1].converged or tried[-1].within(solver.tolerance):
            return None
    best = min(tried, key=lambda found: found.position_error)
    for _ in range(_REFINED):
        best = anyhow.near(X_WT, best.q)
    place = ", ".join(f"{value:.3f}" for value in X_WT.p)
    distance = float(np.linalg.norm(X_WT.p - solver.base.p))
    return NotPlannable(
        f"the end of the straight line, ({place}) m, is out of reach: {distance:.3f} m from the robot's base, the "
        f"nearest point is {1000.0 * best.position_error:.1f} mm off",
        hint="move the goal nearer",
        reason="line",
        remedy=partial(base_advice, solver, X_WT, q),
    )
