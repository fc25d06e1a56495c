"""The rotors of actuators in Bullet, whose joints know no inertia of their own.

Each is a flywheel that stands fixed in the world, geared one to one to its joint: it takes part in what the joint
accelerates and in nothing else, no weight and no gyroscopic effect, and being a constraint it is stable whatever its
inertia.
"""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType
from typing import Final

import numpy as np

from manipcli.model.drivetrain import reflected_inertia
from manipcli.model.robot import RobotModel

RIGID: Final = 1e9
"""What the gear of a flywheel may carry [N m or N]."""


def add_rotors(p: ModuleType, client: int, robot: RobotModel, body: int, joints: Sequence[int]) -> None:
    """Gears a flywheel to every joint with reflected inertia.

    Args:
        p: PyBullet.
        client: its world.
        robot: the robot, which `body` is in that world.
        body: Bullet's number of it.
        joints: (n) Bullet's numbers of its moving joints.
    """
    inertia = reflected_inertia(robot)
    driven = [int(joint) for joint in np.flatnonzero(inertia)]
    k = len(driven)
    if k == 0:
        return
    wheels = p.createMultiBody(
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
    for wheel, joint in enumerate(driven):
        p.changeDynamics(
            wheels,
            wheel,
            localInertiaDiagonal=[float(inertia[joint])] * 3,
            linearDamping=0.0,
            angularDamping=0.0,
            jointDamping=0.0,
            physicsClientId=client,
        )
        p.setJointMotorControl2(wheels, wheel, p.VELOCITY_CONTROL, force=0.0, physicsClientId=client)
        gear = p.createConstraint(
            body,
            joints[joint],
            wheels,
            wheel,
            jointType=p.JOINT_GEAR,
            jointAxis=[0.0, 0.0, 1.0],
            parentFramePosition=[0.0, 0.0, 0.0],
            childFramePosition=[0.0, 0.0, 0.0],
            physicsClientId=client,
        )
        p.changeConstraint(gear, gearRatio=-1.0, erp=0.0, maxForce=RIGID, physicsClientId=client)
