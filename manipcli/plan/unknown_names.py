"""Unknown names in steps: poses and joints, each with the nearest known name."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from manipcli.conditions.condition import Problem
from manipcli.core.errors import Loc
from manipcli.core.text import did_you_mean
from manipcli.model.robot import RobotModel
from manipcli.plan.hand import handless


def unknown_pose(robot: RobotModel, name: str, loc: Loc) -> tuple[Problem, ...]:
    """A problem if the robot has no pose of this name, else empty."""
    return _unknown(name, (pose.name for pose in robot.poses), f"robot '{robot.name}' has no pose '{name}'", loc)


@dataclass(frozen=True, slots=True)
class UnknownPosture(Problem):
    """An unknown pose of a hand."""


def unknown_posture(robot: RobotModel, name: str, loc: Loc) -> tuple[Problem, ...]:
    """A problem if the robot has no pose of this name for its hand, else empty."""
    if handless(robot, name):
        return ()
    return tuple(UnknownPosture(loc, found.message, found.hint) for found in unknown_pose(robot, name, loc))


def unknown_joint(robot: RobotModel, name: str, loc: Loc) -> tuple[Problem, ...]:
    """A problem if the robot has no independent joint of this name, else empty."""
    known = (joint.name for joint in robot.joints if joint.independent)
    return _unknown(name, known, f"joint '{name}' is not a movable joint of robot '{robot.name}'", loc)


def _unknown(name: str, known: Iterable[str], message: str, loc: Loc) -> tuple[Problem, ...]:
    names = tuple(known)
    return () if name in names else (Problem(loc=loc, message=message, hint=did_you_mean(name, names)),)
