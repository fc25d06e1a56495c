"""Grasp frames of an arm of few joints: it has hardly a choice of the yaw from which its hand comes.

With four or five joints the hand lies in a plane through, or beside, the axis of the base: where it is decides its yaw.
So the yaw is left to the inverse kinematics, pitch by pitch.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.plan.grasp_frames import GraspFrame, GraspFrames
from manipcli.plan.inverse_kinematics import InverseKinematics


def reached_frames(
    frames: GraspFrames, solver: InverseKinematics, seed: Array, rng: np.random.Generator
) -> Iterator[GraspFrame]:
    """The frames of an object that the arm reaches, each at the yaw that is nearest to `seed` (n), all moving joints.

    None for an arm that can choose the yaw, or whose yaw is stated.
    """
    if not solver.few or frames.yaw is not None:
        return
    open_ = solver.leaving("yaw")
    for frame in frames.pitches():
        try:
            q = open_.solve(frame.X_WT, seed, rng)
        except NotPlannable:
            continue
        yield frames.turned(frame, Transform.of(xyz=frame.X_WT.p, R=solver.forward(q).R))
