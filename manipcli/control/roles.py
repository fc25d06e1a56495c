"""What steps ask of controllers: to follow trajectories, and to close and open a hand; and who reads sensors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, TypeGuard

from manipcli.control.action import GoalHandle, GripperGoal
from manipcli.control.controller import Controller
from manipcli.core.geometry import Array
from manipcli.plan.trajectory import JointTrajectory


class Follower(Controller, Protocol):
    """Follows joint trajectories, whatever it commands."""

    def send_goal(self, trajectory: JointTrajectory) -> GoalHandle:
        """Accepts a trajectory of all its joints, which starts at its next update; a goal before it is aborted.

        Raises:
            InvalidArgument: the trajectory cannot be followed; a goal before it goes on.
        """
        ...


class Hand(Controller, Protocol):
    """Closes and opens a hand."""

    def send_goal(self, goal: GripperGoal) -> GoalHandle:
        """Accepts a goal, which begins at its next update; a goal before it is aborted.

        Raises:
            InvalidArgument: the goal makes no sense for this hand; a goal before it goes on.
        """
        ...


class SensorReader(Controller, Protocol):
    """Reads sensors."""

    def attach(self, readings: Sequence[Array]) -> None:
        """An array for each of its `sensors`, which is up to date at every update from now on."""
        ...


def is_follower(controller: Controller) -> TypeGuard[Follower]:
    """Whether `move` steps may use it."""
    return controller.role == "follower"


def is_hand(controller: Controller) -> TypeGuard[Hand]:
    """Whether `grasp` and `release` steps may use it."""
    return controller.role == "hand"


def reads_sensors(controller: Controller) -> TypeGuard[SensorReader]:
    """Whether it asks for sensors."""
    return bool(controller.sensors)
