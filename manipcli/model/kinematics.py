"""Kinematics and dynamics of a robot through Pinocchio.

Joint vectors (n,) follow `RobotModel.moving_joints`; mimic joints are treated as independent. The inertia includes that
of the actuators' rotors on the diagonal. Frames: W world, L link, T a frame fixed in a link.
Source: Featherstone, Rigid Body Dynamics Algorithms (2008), chapters 5 (inverse dynamics) and 6.
"""

from __future__ import annotations

from collections.abc import Iterable
from copy import copy
from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.geometry import Array, Transform, cross, frozen
from manipcli.core.units import EARTH_GRAVITY
from manipcli.core.work import Work
from manipcli.model.drivetrain import reflected_inertia
from manipcli.model.robot import RobotModel

if TYPE_CHECKING:
    import pinocchio


class Kinematics:
    """Forward kinematics, Jacobians and joint-space dynamics; not thread-safe, because it reuses memory.

    Args:
        robot: the robot; its mount `X_WB` is included, so poses are in the world.
        gravity: (3,) [m/s2] in the world.

    Attributes:
        work: counts the planning work done with it.
    """

    def __init__(self, robot: RobotModel, *, gravity: tuple[float, float, float] | Array = EARTH_GRAVITY) -> None:
        import pinocchio as pin

        self._pin = pin
        self.robot = robot
        self.work = Work()
        self._model = model = pin.Model()
        model.gravity = pin.Motion(np.asarray(gravity, dtype=np.float64), np.zeros(3))
        # Joints are added in the robot's order, which is depth first as in Pinocchio: q needs no reordering.
        at: dict[str, tuple[int, pinocchio.SE3]] = {robot.root: (0, self._se3(robot.X_WB))}
        for joint in robot.joints:
            parent, X = at[joint.parent]
            X = X * self._se3(joint.X_PJ)
            if joint.moves:
                axis = np.array(joint.axis)
                linear = joint.type == "prismatic"
                kind = pin.JointModelPrismaticUnaligned(axis) if linear else pin.JointModelRevoluteUnaligned(axis)
                parent, X = model.addJoint(parent, kind, X, joint.name), pin.SE3.Identity()
            at[joint.child] = (parent, X)
        self._frames: dict[str, int] = {}
        self._holders: dict[str, int] = {}
        for link in robot.links:
            parent, X = at[link.name]
            if link.inertial is not None:
                X_I = self._se3(link.inertial.X_LI)
                inertia = pin.Inertia(link.inertial.mass, np.zeros(3), np.array(link.inertial.inertia))
                model.appendBodyToJoint(parent, inertia, X * X_I)
            frame = pin.Frame(link.name, parent, 0, X, pin.FrameType.BODY)
            self._frames[link.name] = model.addFrame(frame, False)
            self._holders[link.name] = parent
        model.armature = reflected_inertia(robot)
        self._data = model.createData()
        self._aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED

    @property
    def model(self) -> pinocchio.Model:
        """Pinocchio's model: joints in the order of joint vectors, a frame per link. Do not modify."""
        return self._model

    def _se3(self, X: Transform) -> pinocchio.SE3:
        return self._pin.SE3(np.array(X.R), np.array(X.p))

    def forward(self, q: Array, link: str) -> Transform:
        """X_WL: pose of `link` in the world at `q`."""
        self._pin.forwardKinematics(self._model, self._data, q)
        X = self._pin.updateFramePlacement(self._model, self._data, self._frames[link])
        return Transform(R=frozen(X.rotation), p=frozen(X.translation))

    def link_poses(self, q: Array) -> tuple[Array, Array]:
        """Poses of all links in the world at `q`, by `robot.links`: rotations (l, 3, 3) and positions (l, 3) [m]."""
        self._pin.framesForwardKinematics(self._model, self._data, q)
        poses = self._data.oMf
        found = [poses[frame] for frame in self._frames.values()]
        return np.array([X.rotation for X in found]), np.array([X.translation for X in found])

    def jacobian(self, q: Array, link: str, offset: Transform | None = None) -> Array:
        """J_WT (6, n): velocity of frame T (linear, then angular), in world axes, per joint velocity.

        Args:
            q: (n,) joint positions.
            link: L.
            offset: X_LT; T is L itself by default.
        """
        return self.pose_and_jacobian(q, link, offset)[2]

    def pose_and_jacobian(self, q: Array, link: str, offset: Transform | None = None) -> tuple[Array, Array, Array]:
        """(R_WT (3, 3), p_WT (3,), J_WT (6, n)) in one pass, as new arrays."""
        pin, model, data = self._pin, self._model, self._data
        frame = self._frames[link]
        # computeFrameJacobian would not update the placements of the joints.
        pin.computeJointJacobians(model, data, q)
        X = pin.updateFramePlacement(model, data, frame)
        J: Array = pin.getFrameJacobian(model, data, frame, self._aligned)
        if J.ndim == 1:  # of a single joint
            J = J.reshape(6, -1)
        R, p = X.rotation, X.translation
        if offset is None:
            return np.array(R), np.array(p), J
        arm = R @ offset.p
        x, y, z = arm.tolist()
        wx, wy, wz = J[3:]
        # v_T = v_L + w x arm
        J[0] += wy * z - wz * y
        J[1] += wz * x - wx * z
        J[2] += wx * y - wy * x
        return R @ offset.R, p + arm, J

    def point_velocity(self, q: Array, v: Array, link: str, offset: Transform | None = None) -> Array:
        """v_WT (3,) [m/s] of the origin of frame T in the world; T is L, or at `offset` X_LT in L."""
        pin, model, data, frame = self._pin, self._model, self._data, self._frames[link]
        pin.forwardKinematics(model, data, q, v)
        X = pin.updateFramePlacement(model, data, frame)
        V = pin.getFrameVelocity(model, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        linear: Array = V.linear
        return linear if offset is None else linear + cross(V.angular, X.rotation @ offset.p)

    def carrying(self, link: str, loads: Iterable[tuple[float, Transform, Array]]) -> Kinematics:
        """The same robot with rigid `loads` on a link: mass [kg], X_LI of its inertial frame, inertia (3, 3) in I."""
        other = copy(self)
        other._model = model = self._model.copy()
        frame = model.frames[self._frames[link]]
        for mass, X_LI, inertia in loads:
            body = self._pin.Inertia(mass, np.zeros(3), np.array(inertia))
            model.appendBodyToJoint(frame.parentJoint, body, frame.placement * self._se3(X_LI))
        other._data = model.createData()
        return other

    def gravity(self, q: Array) -> Array:
        """g(q) (n,) [N m or N], the gravity load of the joints. A view, overwritten by the next call."""
        g: Array = self._pin.computeGeneralizedGravity(self._model, self._data, q)
        return g

    def inverse_dynamics(self, q: Array, v: Array, a: Array) -> Array:
        """tau = M(q) a + C(q, v) v + g(q) (n,) [N m or N]. A view, overwritten by the next call."""
        tau: Array = self._pin.rnea(self._model, self._data, q, v, a)
        return tau

    def momentum(self, q: Array, v: Array) -> tuple[Array, Array]:
        """(p, b) each (n,): the generalised momentum M(q) v, and b = C(q, v)^T v - g(q); p' = b + tau."""
        C = self._pin.computeCoriolisMatrix(self._model, self._data, q, v)
        b = C.T @ v - self._pin.computeGeneralizedGravity(self._model, self._data, q)
        return self.mass_matrix(q) @ v, b

    def mass_matrix(self, q: Array) -> Array:
        """M(q) (n, n), symmetric."""
        upper = np.triu(self._pin.crba(self._model, self._data, q))
        return np.asarray(upper + np.triu(upper, 1).T)
