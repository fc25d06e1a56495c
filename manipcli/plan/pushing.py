"""Pushing a joint of the scene with the closed hand: the tool points along the path of the joint, at its handle.

The hand goes straight on until it meets the link, then along the path of the joint, and back.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Transform, matrix_from_axis_angle
from manipcli.core.units import readable
from manipcli.model.collision import Carried
from manipcli.model.configuration import with_joints
from manipcli.plan.candidates import Candidate
from manipcli.plan.jointed import LEVER, position_of, tool_twist
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.operating import FEW, Handling, follow, refuse_force, withdrawn
from manipcli.plan.path import linear_path
from manipcli.plan.planner import Planner
from manipcli.plan.pose_error import pointed
from manipcli.plan.ranges import spread

ROLLS_DEG: Final = (0.0, 90.0, -90.0, 180.0)
"""Candidate rotations of the hand about the direction in which it pushes, from the nearest to the present one."""
HALVINGS: Final = 8
OVER: Final = 0.02
"""[m] The hand goes this far through the middle of the handle in search of the contact."""
TOUCHING: Final = 5e-4
"""[m] Gap between hand and link that counts as contact."""


def pushes(handling: Handling, planner: Planner, state: PlanningState) -> Iterator[Candidate]:
    """The ways to push the handle; none where its motion is a rotation in place."""
    joint = handling.joint
    X_WP = planner.body_pose(state, joint.child) @ handling.handle.X_PF
    twist = tool_twist(planner, state, joint, X_WP)
    lever = float(np.linalg.norm(twist[:3]))
    if lever < LEVER * float(np.linalg.norm(twist[3:])):
        return
    sense = float(np.sign(handling.goal.position - position_of(planner, state, joint)))
    towards = sense * twist[:3] / lever
    R = pointed(planner.tool_pose(state).R, towards)

    def attempt(roll: float, distance: float) -> StepPlan:
        turned = matrix_from_axis_angle(np.array([0.0, 0.0, 1.0]), math.radians(roll))
        through = Transform.of(xyz=X_WP.p + OVER * towards, R=R @ turned)
        builder = MotionBuilder(planner, state, verb=handling.label, allowed=planner.touching(state, joint.child))
        with planner.solver.trying(FEW):
            back = Transform.of(xyz=-(distance + OVER) * towards) @ through
            builder.reach("reach", back, speed=1.0, hand=handling.posture)
        _meet(handling, planner, builder, through)
        link = planner.tool_link
        X_LW = planner.kinematics.forward(builder.now.position, link).inverse()
        pushed = Carried(joint.child, link, X_LW @ planner.body_pose(builder.now, joint.child))
        builder.adopt(builder, replace(builder.now, carried=pushed))
        refuse_force(handling, planner, builder.now, gripped=False)
        follow(handling, planner, builder)
        builder.adopt(builder, replace(builder.now, carried=None))
        return withdrawn(handling, planner, builder)

    for roll in ROLLS_DEG:
        for distance in spread(handling.approach):
            name = f"pushed by the closed hand, turned {roll:g} deg, approach of {readable(distance, 'm')}"
            yield Candidate(partial(attempt, roll, distance), name=name)


def _meet(handling: Handling, planner: Planner, builder: MotionBuilder, through: Transform) -> None:
    """Move the closed hand straight on until it meets the link."""
    state, body = builder.now, handling.joint.child
    path = linear_path(planner.solver, state.position, through)
    query = planner.grasping(state, body, margin=TOUCHING)
    whole = with_joints(planner.robot, state.position, planner.solver.joints, path)
    met = next((k for k, q in enumerate(whole) if query.touches(q)), None)
    if met is None or met == 0:
        raise NotPlannable(f"approach: the closed hand does not meet '{body}' on its way", reason="line")
    free, touching = whole[met - 1], whole[met]
    for _ in range(HALVINGS):
        middle = (free + touching) / 2.0
        free, touching = (free, middle) if query.touches(middle) else (middle, touching)
    allowed = planner.hand_contacts(body)
    builder.straight("approach", planner.solver.forward(touching), speed=handling.speed, allowed=allowed)
