"""Joint-space load of driven joints: inertia, gravity and friction.

A mimic joint moves with its driver, q = S q_driven + constant, and joints that are held (by a brake, or on another
interface) do not move: M_driven = S^T M S, g_driven = S^T g.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.kinematics import Kinematics
from manipcli.model.motor_limits import motor_effort_limits
from manipcli.model.robot import RobotModel


@dataclass(frozen=True, slots=True, eq=False)
class Configurations:
    """Joint positions, velocities and accelerations, arrays (T, n) of all joints; at rest, the last two are 0."""

    position: Array
    velocity: Array
    acceleration: Array

    @classmethod
    def at_rest(cls, position: Array) -> Configurations:
        """Configurations (T, n) at rest."""
        return cls(position, np.zeros_like(position), np.zeros_like(position))


@dataclass(frozen=True, slots=True, eq=False)
class JointSpaceLoad:
    """Load of k driven joints in T configurations.

    Attributes:
        joints: (k) names.
        mass: (T, k, k) kg m2 or kg.
        gravity: (T, k) N m or N, the effort that holds them at rest.
        needed: (T, k) N m or N, the effort of the motion, gravity included.
        damping: (k) of the joints, viscous [N m s/rad or N s/m].
        effort: (k) the limit of joints and actuators; infinite where unlimited.
        latency: (k) control ticks from a command to its effort.
    """

    joints: tuple[str, ...]
    mass: Array
    gravity: Array
    needed: Array
    damping: Array
    effort: Array
    latency: tuple[int, ...]

    @property
    def own_inertia(self) -> Array:
        """(T, k) 1 / (M^-1)_jj: inertia of each joint while the others are free; its lower bound."""
        return np.asarray(1.0 / np.diagonal(np.linalg.inv(self.mass), axis1=1, axis2=2))

    @property
    def held_inertia(self) -> Array:
        """(T, k) M_jj: inertia of each joint while the others are held; its upper bound."""
        return np.asarray(np.diagonal(self.mass, axis1=1, axis2=2))


def load_of(
    robot: RobotModel, kinematics: Kinematics, joints: Sequence[str], configurations: Configurations
) -> JointSpaceLoad:
    """The load of these independent joints when no other joint is driven."""
    S = _drives(robot, joints)
    moving = robot.moving_joints
    damping = np.array([joint.damping for joint in moving])
    mass, gravity, needed = [], [], []
    for q, v, a in zip(configurations.position, configurations.velocity, configurations.acceleration, strict=True):
        mass.append(S.T @ kinematics.mass_matrix(q) @ S)
        gravity.append(S.T @ kinematics.gravity(q))
        needed.append(S.T @ (kinematics.inverse_dynamics(q, v, a) + damping * v))
    columns = robot.indices(tuple(joints))
    latency = {actuator.name: actuator.latency for actuator in robot.actuators}
    late = {
        joint: max((latency.get(name, 0) for name in tag.actuators), default=0)
        for tag in robot.transmissions
        for joint in tag.joints
    }
    return JointSpaceLoad(
        joints=tuple(joints),
        mass=np.array(mass),
        gravity=np.array(gravity),
        needed=np.array(needed),
        damping=np.diag(S.T @ np.diag(damping) @ S).copy(),
        effort=motor_effort_limits(robot)[columns],
        latency=tuple(late.get(joint, 0) for joint in joints),
    )


def _drives(robot: RobotModel, joints: Sequence[str]) -> Array:
    """S (n, k): velocities of all joints per velocity of the driven ones."""
    ratio: dict[str, tuple[str, float]] = {}
    for joint in robot.moving_joints:
        driver, factor, mimic = joint.name, 1.0, joint.mimic
        while mimic is not None:
            driver, factor = mimic.joint, factor * mimic.multiplier
            mimic = robot.joint(driver).mimic
        ratio[joint.name] = (driver, factor)
    S = np.zeros((len(robot.joint_names), len(joints)))
    for row, name in enumerate(robot.joint_names):
        driver, factor = ratio[name]
        if driver in joints:
            S[row, list(joints).index(driver)] = factor
    return S
