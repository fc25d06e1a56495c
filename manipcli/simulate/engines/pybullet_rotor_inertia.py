"""Rotor inertia of actuators, and stiff joint damping, in Bullet: its joints have no inertia of their own.

Each rotor is a separate body, fixed in the world and geared one to one to its joint. It adds to what accelerates the
joint and to nothing else: no weight, no gyroscopic effect. As a constraint it is stable for any inertia.

Bullet takes the damping B of joints from the velocity v before a step h, which diverges where h B exceeds the inertia.
Instead, with v' after the step,

    M v' = M v + h tau - h B v'    or    (M + h B) v' = (M v + h tau) + (h B v - h B v):

a rotor of inertia h b whose own damping b stops it in every step. It is stable for any b, and reaches the same speed
under a constant effort (Hairer, Wanner, Solving Ordinary Differential Equations II, IV.3: implicit Euler).
"""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, frozen
from manipcli.model.damping import STIFF, damping_share
from manipcli.model.drivetrain import reflected_inertia
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel

RIGID: Final = 1e9
"""Maximum force of the gear constraint [N m or N]."""
CONFIGURATIONS: Final = 60
"""Number of configurations at which damping is checked for stiffness, always the same."""
WIDE: Final = 3.2
"""Range [rad or m] on both sides of zero for joints without limits."""


def stiff_damping(robot: RobotModel, step: float) -> Array:
    """(n) the damping [N m s/rad or N s/m] of joints whose damping is stiff for a physics step [s], 0 for the others.

    It counts as stiff if it is stiff in any checked configuration within the limits.
    """
    moving = robot.moving_joints
    damping = np.array([joint.damping for joint in moving])
    if not damping.any():
        return frozen(damping)
    kinematics = Kinematics(robot)
    low = [-WIDE if joint.limits.lower is None else joint.limits.lower for joint in moving]
    high = [WIDE if joint.limits.upper is None else joint.limits.upper for joint in moving]
    share = np.zeros(len(moving))
    for q in np.random.default_rng(0).uniform(low, high, (CONFIGURATIONS, len(moving))):
        share = np.maximum(share, damping_share(kinematics.mass_matrix(q), damping, step))
    return frozen(np.where(share > STIFF, damping, 0.0))


def add_rotor_inertia(
    p: ModuleType, client: int, robot: RobotModel, body: int, joints: Sequence[int], *, step: float
) -> None:
    """Gear a rotor to every joint with reflected inertia or stiff damping.

    Args:
        p: PyBullet.
        client: its world.
        robot: the robot.
        body: Bullet's number of the robot.
        joints: (n) Bullet's numbers of its moving joints.
        step: [s] of the physics.
    """
    damping = stiff_damping(robot, step)
    inertia = reflected_inertia(robot) + step * damping
    driven = [int(joint) for joint in np.flatnonzero(inertia)]
    k = len(driven)
    if k == 0:
        return
    rotors = p.createMultiBody(
        baseMass=0.0,
        linkMasses=[1.0] * k,
        linkCollisionShapeIndices=[-1] * k,
        linkVisualShapeIndices=[-1] * k,
        linkPositions=[[0.0, 0.0, 0.0]] * k,
        linkOrientations=[[0.0, 0.0, 0.0, 1.0]] * k,
        linkInertialFramePositions=[[0.0, 0.0, 0.0]] * k,
        linkInertialFrameOrientations=[[0.0, 0.0, 0.0, 1.0]] * k,
        linkParentIndices=[0] * k,
        linkJointTypes=[p.JOINT_REVOLUTE] * k,
        linkJointAxis=[[0.0, 0.0, 1.0]] * k,
        physicsClientId=client,
    )
    for rotor, joint in enumerate(driven):
        p.changeDynamics(
            rotors,
            rotor,
            localInertiaDiagonal=[float(inertia[joint])] * 3,
            linearDamping=0.0,
            angularDamping=0.0,
            jointDamping=float(damping[joint]),
            physicsClientId=client,
        )
        if damping[joint]:
            p.changeDynamics(body, joints[joint], jointDamping=0.0, physicsClientId=client)
        p.setJointMotorControl2(rotors, rotor, p.VELOCITY_CONTROL, force=0.0, physicsClientId=client)
        gear = p.createConstraint(
            body,
            joints[joint],
            rotors,
            rotor,
            jointType=p.JOINT_GEAR,
            jointAxis=[0.0, 0.0, 1.0],
            parentFramePosition=[0.0, 0.0, 0.0],
            childFramePosition=[0.0, 0.0, 0.0],
            physicsClientId=client,
        )
        p.changeConstraint(gear, gearRatio=-1.0, erp=0.0, maxForce=RIGID, physicsClientId=client)
