"""Planning state of a run that begins with the state of another run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from manipcli.core.geometry import Transform, frozen
from manipcli.model.collision import Carried
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Planner
from manipcli.record.start_state import StartState
from manipcli.spec.reactions import ReplanSpec


def restored_start(state: StartState, planner: Planner) -> PlanningState:
    """The planning state of a recorded state.

    Joints of the arm are at their reference if they are near it, as in re-planning, so that the first trajectory begins
    without a jump; what the hand holds and its contents are shifted with them.
    """
    robot, hand = planner.robot, planner.gripper_joints
    arm = np.array([name not in hand for name in robot.joint_names])
    near = arm & (np.abs(state.reference - state.position) <= ReplanSpec().joints)
    lower, upper = np.transpose([joint.limits.range for joint in robot.moving_joints])
    position = frozen(np.clip(np.where(near, state.reference, state.position), lower, upper))
    bodies = tuple(Transform.of(xyz=pose[:3], quat_xyzw=pose[3:]) for pose in state.planned)
    start = PlanningState(position, bodies, closed=state.closed, at_start=False)
    if not state.held:
        return start
    X_WL = planner.kinematics.forward(state.position, planner.tool_link)
    shift = planner.kinematics.forward(position, planner.tool_link) @ X_WL.inverse()
    moving = {state.held, *planner.contents(start, state.held)}
    carried = Carried(state.held, planner.tool_link, X_WL.inverse() @ planner.body_pose(start, state.held))
    moved = tuple(shift @ X if name in moving else X for name, X in zip(state.bodies, bodies, strict=True))
    return replace(start, bodies=moved, carried=carried)
