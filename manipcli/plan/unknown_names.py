"""Unknown names in steps: poses, joints and frames, each with the nearest known name."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from manipcli.conditions.condition import Problem
from manipcli.core.errors import Loc
from manipcli.core.text import did_you_mean
from manipcli.model.robot import RobotModel
from manipcli.plan.hand import handless
from manipcli.scene.scene import SEPARATOR, Scene

WORDS: Final = ("world", "base", "tool")
"""Frames that every task has."""
ROBOT: Final = "robot"
"""Before the name of a link: `robot/palm`."""


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


def unknown_frame(robot: RobotModel, scene: Scene, name: str, loc: Loc) -> tuple[Problem, ...]:
    """A problem unless `name` is `world`, `base`, `tool`, `robot/LINK`, a body, a part of one or a named frame."""
    bodies = [body.name for body in scene.bodies]
    if name in (*WORDS, *bodies) or scene.frame(name) is not None:
        return ()
    owner, separator, part = name.rpartition(SEPARATOR)
    if owner == ROBOT and separator:
        links = [link.name for link in robot.links]
        return _unknown(part, links, f"'{part}' is not a link of robot '{robot.name}'", loc)
    if owner in bodies:
        return unknown_part(scene, owner, part, loc)
    parts = [f"{body}{SEPARATOR}{part}" for body in bodies for part in scene.parts(body)] if separator else []
    known = [*WORDS, *bodies, *(frame.name for frame in scene.frames), *parts]
    return _unknown(name, known, f"unknown frame '{name}'", loc)


def unknown_part(scene: Scene, body: str, part: str, loc: Loc) -> tuple[Problem, ...]:
    """A problem if the body, which is in the scene, has no part of this name, else empty."""
    known = scene.parts(body)
    if scene.frame(f"{body}{SEPARATOR}{part}") is not None:
        return ()
    hint = did_you_mean(part, known, kind=f"parts of '{body}'")
    return (Problem(loc=loc, message=f"'{body}' has no part '{part}'", hint=hint),)


def _unknown(name: str, known: Iterable[str], message: str, loc: Loc) -> tuple[Problem, ...]:
    names = tuple(known)
    return () if name in names else (Problem(loc=loc, message=message, hint=did_you_mean(name, names)),)
