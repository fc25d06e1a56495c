"""The oracle is Pinocchio's forward kinematics of second order."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio
import pytest

from manipcli.core.geometry import Transform, matrix_from_quat
from manipcli.model.batch_motion import frames, point_motion
from manipcli.model.kinematics import Kinematics
from manipcli.task.load_task import load_task

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("task", ["pour", "pour_iiwa", "pick_place"])
def test_motion_of_a_point_is_that_of_pinocchio(task: str) -> None:
    robot = load_task(ROOT / f"tasks/{task}.yaml").robot
    kinematics = Kinematics(robot)
    model, data = kinematics.model, kinematics.model.createData()
    rng = np.random.default_rng(1)
    q, v, a = rng.uniform(-1.0, 1.0, (3, 20, len(robot.joint_names)))
    X_LF = Transform.of(xyz=(0.1, -0.2, 0.3), rpy=(0.3, 0.2, 0.1))
    for link in (robot.root, robot.moving_joints[3].child, robot.moving_joints[-1].child):
        quat, velocity, acceleration = point_motion(robot, q, v, a, link, X_LF)
        p, same = frames(robot, q, link, X_LF)
        np.testing.assert_allclose(same, quat, atol=1e-12)
        frame = model.getFrameId(link)
        at = pinocchio.SE3(np.array(X_LF.R), np.array(X_LF.p))
        for k in range(len(q)):
            pinocchio.forwardKinematics(model, data, q[k], v[k], a[k])
            placed = pinocchio.updateFramePlacement(model, data, frame) * at
            np.testing.assert_allclose(p[k], placed.translation, atol=1e-12)
            np.testing.assert_allclose(matrix_from_quat(quat[k]), placed.rotation, atol=1e-12)
            own = model.frames[frame]
            moved = pinocchio.getVelocity(model, data, own.parentJoint)
            V = (own.placement * at).actInv(moved)
            A = (own.placement * at).actInv(pinocchio.getAcceleration(model, data, own.parentJoint))
            np.testing.assert_allclose(velocity[k], placed.rotation @ V.linear, atol=1e-12)
            classical = A.linear + np.cross(V.angular, V.linear)
            np.testing.assert_allclose(acceleration[k], placed.rotation @ classical, atol=1e-11)
