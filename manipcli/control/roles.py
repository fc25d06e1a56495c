"""Roles of controllers for steps, trajectory follower and hand, and what else some of them can do."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, TypeGuard

import numpy.typing as npt

from manipcli.control.action import GoalHandle, GripperGoal
from manipcli.control.controller import Controller
from manipcli.control.grip_reflex import GripReflex
from manipcli.control.jog import JogTarget
from manipcli.control.speed_scaling import SpeedScaling
from manipcli.control.trajectory_goal import TrajectoryGoal
from manipcli.core.geometry import Array
from manipcli.plan.trajectory import JointTrajectory


class Follower(Controller, Protocol):
    """Follows joint trajectories, on any interface."""

    def send_goal(self, trajectory: JointTrajectory | TrajectoryGoal) -> GoalHandle:
        """Accept a trajectory of all its joints, which starts at the next update; the previous goal is aborted.

        Raises:
            InvalidArgument: the trajectory cannot be followed; the previous goal continues.
        """
        ...


class Hand(Controller, Protocol):
    """Closes and opens a hand."""

    def send_goal(self, goal: GripperGoal) -> GoalHandle:
        """Accept a goal, which begins at the next update; the previous goal is aborted.

        Raises:
            InvalidArgument: the goal is invalid for this hand; the previous goal continues.
        """
        ...

    def halt(self, time: float, reason: str) -> None:
        """Abort its goal, and keep the grip as it is."""
        ...


class GoalTaker(Controller, Protocol):
    """Executes goals; `accepts_goals` is False while its manager has it inactive."""

    accepts_goals: bool


class Jogged(Controller, Protocol):
    """Follows velocities that change at any time; see `jog.py`."""

    def jog(self, target: JogTarget, *, until: float) -> None:
        """Follow the velocities of `target` until the time `until` [s], then stop; an active goal is aborted.

        Raises:
            GoalRejected: the controller is inactive.
        """
        ...


class Commanded(Controller, Protocol):
    """A controller that takes one value per joint."""

    def set_command(self, values: npt.ArrayLike) -> None:
        """Set the command from the next update on.

        Raises:
            InvalidArgument: not one finite number per joint.
        """
        ...


class Referenced(Controller, Protocol):
    """A controller with one reference per joint, and its rate."""

    def set_reference(self, values: npt.ArrayLike, rates: npt.ArrayLike | None = None) -> None:
        """Set the reference from the next update on.

        Raises:
            InvalidArgument: not one finite number per joint, or rates where it has none.
        """
        ...


class Scaled(Controller, Protocol):
    """A controller whose trajectories have a speed."""

    scaling: SpeedScaling


class Reflexive(Controller, Protocol):
    """A hand with a reflex against slip."""

    reflex: GripReflex


class SensorReader(Controller, Protocol):
    """Reads sensors."""

    def attach(self, readings: Sequence[Array]) -> None:
        """Attach one array per sensor in `sensors`; it is up to date at every update."""
        ...


def is_follower(controller: Controller) -> TypeGuard[Follower]:
    """Whether it follows trajectories, for `move` steps."""
    return controller.role == "follower"


def is_hand(controller: Controller) -> TypeGuard[Hand]:
    """Whether it moves a hand, for `grasp` and `release` steps."""
    return controller.role == "hand"


def takes_goals(controller: Controller) -> TypeGuard[GoalTaker]:
    """Whether it executes goals."""
    return hasattr(controller, "accepts_goals")


def is_jogged(controller: Controller) -> TypeGuard[Jogged]:
    """Whether it can be jogged."""
    return hasattr(controller, "jog")


def is_referenced(controller: Controller) -> TypeGuard[Referenced]:
    """Whether it has a topic for references."""
    return hasattr(controller, "set_reference")


def is_commanded(controller: Controller) -> TypeGuard[Commanded]:
    """Whether it has a topic for commands."""
    return hasattr(controller, "set_command")


def has_reflex(controller: Controller) -> TypeGuard[Reflexive]:
    """Whether it can press more against slip."""
    return hasattr(controller, "reflex")


def is_scaled(controller: Controller) -> TypeGuard[Scaled]:
    """Whether its trajectories have a speed."""
    return hasattr(controller, "scaling")


def reads_sensors(controller: Controller) -> TypeGuard[SensorReader]:
    """Whether it reads sensors."""
    return bool(controller.sensors)
