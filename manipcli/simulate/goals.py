"""Goals of controllers from the motions of a plan."""

from __future__ import annotations

from manipcli.control.action import GripperGoal
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
