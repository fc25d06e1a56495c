"""Whether a body of the scene can be put elsewhere while the robot works."""

from __future__ import annotations

from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.live.live_robot import LiveRobot
from manipcli.model.collision import Carried, CollisionChecker
from manipcli.model.kinematics import Kinematics
from manipcli.simulate.session import BODY_SPEED, FALLEN

OVERLAP: Final = 0.001
"""[m] Overlap that contacts of the physics have too."""
FAR: Final = 100.0
"""[m] Farthest position along each axis."""
SPIN: Final = 100.0
"""[rad/s] Greatest angular speed; Bullet's."""
UNIT: Final = 1e-3
"""Largest difference of the norm of a quaternion to 1."""


def misplaced(robot: LiveRobot, name: str, position: Array, quat_xyzw: Array, twist: Array) -> str:
    """Why an entity cannot be put at a pose in the world, with a (6) velocity; "" if it can."""
    session = robot.session
    if name not in (body.name for body in session.scene.movable):
        return "only movable bodies can be put elsewhere"
    if session.holder is not None and session.holder.attached == name:
        return "the robot holds it; release it before"
    norm = float(np.linalg.norm(quat_xyzw))
    if not abs(norm - 1.0) < UNIT:
        return f"the orientation is not a unit quaternion: its norm is {norm:.4g}"
    if not np.abs(position).max() <= FAR or not position[2] > FALLEN:
        return f"the position is outside: more than {FAR:g} m from the origin, or below {FALLEN:g} m"
    if session.engine.ideal and twist.any():
        return "it cannot move: the engine has no physics"
    speed, spin = float(np.linalg.norm(twist[:3])), float(np.linalg.norm(twist[3:]))
    if not (speed < BODY_SPEED and spin < SPIN):
        return f"{speed:.4g} m/s and {spin:.4g} rad/s are too fast; limits: {BODY_SPEED:g} m/s, {SPIN:g} rad/s"
    return _overlap(robot, name, Transform.of(xyz=position, quat_xyzw=quat_xyzw))


def _overlap(robot: LiveRobot, name: str, X_WO: Transform) -> str:
    """What a body at a pose would overlap, by its true shapes and poses."""
    session, checker = robot.session, _checker(robot)
    poses = [X_WO if body.name == name else session.engine.body_state(body.name)[0] for body in session.scene.movable]
    base = session.robot
    fixed = Carried(body=name, link=base.root, X_LO=base.X_WB.inverse() @ X_WO)
    # The robot against the body, then the body, as if the base carried it, against the other bodies.
    queries = (
        checker.at(poses, only=name, margin=-OVERLAP),
        checker.at(poses, only=name, margin=-OVERLAP, carried=fixed),
    )
    hits = [hit for query in queries for hit in query.every(session.state.position)]
    return f"there, {min(hits, key=lambda hit: hit.distance)}" if hits else ""


def _checker(robot: LiveRobot) -> CollisionChecker:
    """Of the true robot and scene, which a sample can change."""
    own, session = robot.plan.planner, robot.session
    if own.scene is session.scene and own.robot is session.robot:
        return own.checker
    return CollisionChecker(Kinematics(session.robot, gravity=session.scene.gravity), session.scene)
