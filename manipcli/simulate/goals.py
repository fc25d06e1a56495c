"""Goals of controllers from the motions of a plan, and switches in words."""

from __future__ import annotations

from manipcli.control.action import GripperGoal
from manipcli.control.lifecycle import SwitchResult
from manipcli.control.roles import Hand
from manipcli.control.trajectory_goal import TrajectoryGoal
from manipcli.plan.motion import GoalTolerances, Grip
from manipcli.plan.trajectory import JointTrajectory


def arm_goal(trajectory: JointTrajectory, own: GoalTolerances) -> TrajectoryGoal:
    """A trajectory with its own tolerances."""
    return TrajectoryGoal(
        trajectory, path_tolerance=own.path, goal_tolerance=own.goal, goal_time_tolerance=own.goal_time
    )


def gripper_goal(gripper: Hand, grip: Grip) -> GripperGoal:
    """A grip, with the joints in the order of its controller."""
    target = grip.target[[grip.joints.index(name) for name in gripper.joints]]
    return GripperGoal(target=target, force=grip.force, reflex=grip.reflex)


def switch_text(switched: SwitchResult) -> str:
    """What a switch of controllers has done."""
    parts = [f"activated {', '.join(switched.activated)}"] if switched.activated else []
    parts += [f"deactivated {', '.join(switched.deactivated)}"] if switched.deactivated else []
    return "; ".join((*parts, *switched.messages)) or "nothing to switch"
