"""Frames by name: where they are over time, and unknown names."""

from __future__ import annotations

from typing import Final

import numpy as np

from manipcli.conditions.condition import Problem, World
from manipcli.conditions.touch import ROBOT
from manipcli.core.errors import Loc
from manipcli.core.geometry import Transform, quat_product, rotate
from manipcli.core.text import did_you_mean
from manipcli.model.batch_motion import frames
from manipcli.model.robot import RobotModel
from manipcli.model.state import BodyPose, WorldState, body_pose
from manipcli.scene.scene import SEPARATOR, Scene
from manipcli.spec.counted import one_of_many

WORDS: Final = ("world", "base", "tool")
"""Frames that every task has."""


def frame_pose(world: World, states: WorldState, name: str) -> BodyPose:
    """Pose of `world`, `base`, `tool`, `robot/LINK`, a body, a part of one or a named frame, in the world.

    Poses of fixed frames have no leading axes.
    """
    robot = world.robot
    frame = world.scene.frame(name)
    if frame is not None:
        X_WP = frame_pose(world, states, frame.parent)
        p = X_WP.position + rotate(X_WP.quat_xyzw, frame.X_PF.p)
        return BodyPose(p, np.asarray(quat_product(X_WP.quat_xyzw, frame.X_PF.quat_xyzw)))
    if name in ("world", "base"):
        X = Transform.identity() if name == "world" else robot.X_WB
        return BodyPose(np.asarray(X.p), np.asarray(X.quat_xyzw))
    if name == "tool" and robot.tool is not None:
        return _of_link(robot, states, robot.tool.link, robot.tool.X_LT)
    if name.startswith(f"{ROBOT}/"):
        return _of_link(robot, states, name.removeprefix(f"{ROBOT}/"), Transform.identity())
    return body_pose(world.scene, states, name)


def _of_link(robot: RobotModel, states: WorldState, link: str, X_LF: Transform) -> BodyPose:
    q = states.position
    p, quat = frames(robot, q.reshape(-1, q.shape[-1]), link, X_LF)
    return BodyPose(p.reshape(*q.shape[:-1], 3), quat.reshape(*q.shape[:-1], 4))


def carrier(scene: Scene, name: str) -> str:
    """The body that a frame is fixed to, or the name itself."""
    frame = scene.frame(name)
    return name if frame is None else frame.parent


def unknown_frame(robot: RobotModel, scene: Scene, name: str, loc: Loc) -> tuple[Problem, ...]:
    """A problem unless the name is one that `frame_pose` knows."""
    bodies = [body.name for body in scene.bodies]
    if name == "tool" and robot.tool is None:
        message, hint = f"robot '{robot.name}' has no tool frame", "add `tool: {link: ...}` to the robot file"
        return (Problem(loc, message, hint),)
    if name in (*WORDS, *bodies) or scene.frame(name) is not None:
        return ()
    owner, separator, part = name.rpartition(SEPARATOR)
    if (several := one_of_many(owner if separator else name, bodies)) is not None:
        return (Problem(loc, *several),)
    if owner == ROBOT and separator:
        links = [link.name for link in robot.links]
        if part in links:
            return ()
        return (Problem(loc, f"'{part}' is not a link of robot '{robot.name}'", did_you_mean(part, links)),)
    if owner in bodies:
        return unknown_part(scene, owner, part, loc)
    dotted = separator or "." in name  # `cup.rim` is `cup/rim`
    parts = [f"{body}{SEPARATOR}{part}" for body in bodies for part in scene.parts(body)] if dotted else []
    known = [*WORDS, *bodies, *(frame.name for frame in scene.frames), *parts]
    return (Problem(loc, f"unknown frame '{name}'", did_you_mean(name, known)),)


def unknown_part(scene: Scene, body: str, part: str, loc: Loc) -> tuple[Problem, ...]:
    """A problem if the body, which is in the scene, has no part of this name."""
    if scene.frame(f"{body}{SEPARATOR}{part}") is not None:
        return ()
    hint = did_you_mean(part, scene.parts(body), kind=f"parts of '{body}'")
    return (Problem(loc, f"'{body}' has no part '{part}'", hint),)


def fixed_frame(robot: RobotModel, scene: Scene, name: str, loc: Loc) -> tuple[Problem, ...]:
    """A problem if the frame is unknown, or moves with the robot."""
    if name == "tool" or (name.startswith(f"{ROBOT}{SEPARATOR}") and not unknown_frame(robot, scene, name, loc)):
        message = f"'{name}' moves with the robot; expected a frame that does not"
        return (Problem(loc, message, "use `base`, a body, a part of one or a named frame"),)
    return unknown_frame(robot, scene, name, loc)
