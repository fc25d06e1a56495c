"""Impedance of a tool: the law of `cartesian_impedance` and of the arms of compliant steps.

With the tool frame T at the measured joints q, its reference R (at the joints' reference q_r, or from `set_pose`), and
the Jacobian J of T:

    u = J^T (K e + D J (v_r - v)) + N (k (q_r - q) + d (v_r - v)) + g(q)
    e = (p_R - p_T, the rotation vector of R_WR R_WT^T)

K [N/m, N m/rad] and D [N s/m, N m s/rad] are diagonal along the axes of the world or of R. By a damping ratio z,
D_ii = 2 z sqrt(K_ii m_i) with the effective mass m_i = 1 / (J M^-1 J^T)_ii of the tool along that axis. The null space
of the tool is drawn to the configuration q_r through N = 1 - J^T (J J^T + s^2)^-1 J, which removes the part that pushes
the tool. No singular matrix is inverted: s bounds one inverse, and m_i only scales the damping.

At rest, a force F on the tool displaces it by K^-1 F. Hogan, Impedance control (1985); Ott,
Cartesian Impedance Control of Redundant and Flexible-Joint Robots (2008), chapters 3 and 4.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from manipcli.control.action import GoalHandle
from manipcli.control.controller import ControllerOutput, FeedForward, JointState, SensorRequest
from manipcli.control.force_reference import AXES, ForceReference, ForceReferenceSpec
from manipcli.control.jog import JogTarget
from manipcli.control.stopping import StopPlanner
from manipcli.control.trajectory_controller import JointTrajectoryController
from manipcli.control.trajectory_goal import TrajectoryGoal
from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array, Transform
from manipcli.description.elements import JointLimits, JointType
from manipcli.description.transmission import Compat
from manipcli.model.kinematics import Kinematics
from manipcli.plan.pose_error import rotation_vector
from manipcli.plan.trajectory import JointTrajectory
from manipcli.spec.controllers import ConstraintsSpec, Interface, Role

SINGULAR: Final = 1e-3
"""s: tool directions in which the joints move less than this [m or rad per rad] belong to the null space."""
LIGHTEST: Final = 1e-9
"""[1/kg] or [1/(kg m2)] Lower bound for mobilities."""
WEIGHED: Final = 10
"""Updates between two computations of the masses, which only scale the damping and change slowly."""


class CartesianImpedanceController:
    """Serves trajectories of joints (goals, tolerances, results: see `JointTrajectoryController`), and poses.

    Args:
        name: of the controller.
        joints: (n) distinct names.
        kinematics: of the robot.
        link, offset: the tool frame T is at `offset` X_LT in the link.
        stiffness: (6) along and about the axes [N/m, N m/rad].
        damping_ratio: see the module.
        damping: (6) [N s/m, N m s/rad], instead of the ratio.
        axes: of stiffness and damping.
        posture_stiffness: of each joint [N m/rad or N/m].
        posture_damping_ratio: d = 2 ratio sqrt(k M_jj).
        force: force of the tool along one of its axes, with `axes` of the tool and a stiffness along it.
        feed_forward: `gravity`; `inverse_dynamics` adds the effort of the reference's acceleration.
        constraints, limits, types, compat: see `JointTrajectoryController`.

    Raises:
        InvalidArgument: no or duplicate joints, numbers that are negative or not finite, zero stiffness.
    """

    role: Role = "follower"
    senses_contact = False
    interfaces: tuple[Interface, ...] = ("effort",)

    def __init__(
        self,
        *,
        name: str,
        joints: Sequence[str],
        kinematics: Kinematics,
        link: str,
        offset: Transform | None = None,
        stiffness: npt.ArrayLike,
        damping_ratio: float = 1.0,
        damping: npt.ArrayLike | None = None,
        axes: Literal["world", "tool"] = "world",
        posture_stiffness: float = 10.0,
        posture_damping_ratio: float = 1.0,
        force: ForceReferenceSpec | None = None,
        feed_forward: FeedForward = "gravity",
        constraints: ConstraintsSpec | None = None,
        limits: Sequence[JointLimits] | None = None,
        types: Sequence[JointType] | None = None,
        compat: Compat | None = None,
        stop_planner: StopPlanner | None = None,
    ) -> None:
        self._follower = JointTrajectoryController(
            name=name, joints=joints, command_interfaces=("position",), constraints=constraints, limits=limits,
            types=types, compat=compat, stop_planner=stop_planner,
        )  # fmt: skip
        self.name, self.joints = self._follower.name, self._follower.joints
        self.scaling = self._follower.scaling
        self.feed_forward: FeedForward = feed_forward
        self._stiffness = self._six("stiffness", stiffness)
        self._damping = None if damping is None else self._six("damping", damping)
        for what, value in (
            ("damping_ratio", damping_ratio), ("posture stiffness", posture_stiffness),
            ("posture damping_ratio", posture_damping_ratio),
        ):  # fmt: skip
            if not 0.0 <= value < np.inf:
                raise InvalidArgument("CTRL185", f"controller '{name}': {what} is {value}; expected 0 or more")
        if not self._stiffness.any() and posture_stiffness == 0.0:
            raise InvalidArgument("CTRL185", f"controller '{name}': all stiffnesses are 0; it would not move")
        self._scale = 2.0 * damping_ratio * np.sqrt(self._stiffness)
        self._posture = posture_stiffness
        self._posture_scale = 2.0 * posture_damping_ratio * np.sqrt(posture_stiffness)
        self.sensors = () if force is None else (SensorRequest(force.sensor, sensor=force.sensor),)
        self._force: ForceReference | None = None
        if force is not None:
            along = self._stiffness[AXES[force.axis]]
            if axes != "tool" or along == 0.0:
                message = f"controller '{name}': a force needs axes of the tool and a stiffness along {force.axis}"
                raise InvalidArgument("CTRL187", message)
            self._force = ForceReference(force, float(along))
        self._kinematics, self._link, self._offset = kinematics, link, offset
        self._turns = axes == "tool"
        self._columns = kinematics.robot.indices(self.joints)
        self._block = np.ix_(self._columns, self._columns)
        self._q = np.zeros(len(kinematics.robot.joint_names))
        self._singular = SINGULAR**2 * np.eye(6)
        self.output = ControllerOutput.of(len(self.joints), 1, speed=self._follower.output.speed)
        self._error = self._stretch = np.zeros(6)
        self.tool: Array = np.full(3, np.nan)  # in the world, at the last update
        self._task_damping = np.zeros(6) if self._damping is None else self._damping
        self._posture_damping = np.zeros(len(self.joints))
        self._updates = 0
        self._pose: Transform | None = None
        self._held: Array | None = None
        self._shift: Array | None = None  # (3,) of the reference along its axes [m]
        self._time = 0.0

    def _six(self, what: str, values: npt.ArrayLike) -> Array:
        given = np.array(values, dtype=np.float64)
        if given.shape != (6,) or not (np.isfinite(given).all() and (given >= 0.0).all()):
            message = f"controller '{self.name}': {what} is {given.tolist()}; expected 6 numbers of 0 or more"
            raise InvalidArgument("CTRL185", message)
        return given

    @property
    def error(self) -> Array:
        """(6) e of the last update, in world axes: from the tool to its reference [m, rad]."""
        return self._error.copy()

    def attach(self, readings: Sequence[Array]) -> None:
        """Attach the reading (6) of its force/torque sensor."""
        if self._force is not None:
            (self._force.reading,) = readings

    @property
    def accepts_goals(self) -> bool:
        """False while its manager has it inactive."""
        return self._follower.accepts_goals

    @accepts_goals.setter
    def accepts_goals(self, active: bool) -> None:
        self._follower.accepts_goals = active

    def send_goal(
        self, trajectory: JointTrajectory | TrajectoryGoal, *, constraints: ConstraintsSpec | None = None
    ) -> GoalHandle:
        """Accept a trajectory, see `JointTrajectoryController.send_goal`; a pose that was set is cleared."""
        if self._pose is None:
            return self._follower.send_goal(trajectory, constraints=constraints)
        self._follower.deactivate(self._time)
        handle = self._follower.send_goal(trajectory, constraints=constraints)
        self._pose = self._held = None
        return handle

    def jog(self, target: JogTarget, *, until: float) -> None:
        """Follow velocities until `until` [s], see `JointTrajectoryController.jog`; a pose that was set is cleared."""
        if self._pose is not None:
            self._follower.deactivate(self._time)
        self._follower.jog(target, until=until)
        self._pose = self._held = None

    def set_pose(self, X_WT: Transform) -> None:
        """Set the reference pose of the tool from the next update on; an active goal is aborted.

        The spring pulls at once, in proportion to the distance: use trajectories for long distances. The present
        configuration is held as the joints' reference.

        Raises:
            InvalidArgument: numbers that are not finite.
        """
        if not (np.isfinite(X_WT.R).all() and np.isfinite(X_WT.p).all()):
            raise InvalidArgument("CTRL185", f"controller '{self.name}': the pose is not finite")
        self._follower.deactivate(self._time, "preempted by a pose")
        self._pose = X_WT

    def deactivate(self, time: float, reason: str = "the controller was deactivated") -> None:
        """Abort its goal and reset its state; the next update re-activates it."""
        self._follower.deactivate(time, reason)
        self._pose = self._held = None
        self._updates = 0
        if self._force is not None:
            self._force.reset()

    def update(
        self, time: float, period: float, measured: JointState, *, contact_force: Array | None = None
    ) -> ControllerOutput:
        """One control tick at `time` [s] of the length `period` [s]; `contact_force` is ignored."""
        self._time = time
        output, q, kinematics = self.output, self._q, self._kinematics
        self._refer(time, period, measured)
        if self._pose is None:
            q[self._columns] = output.position
            R_WR, p_WR, _ = kinematics.pose_and_jacobian(q, self._link, self._offset)
        else:
            R_WR, p_WR = self._pose.R, self._pose.p
        q[self._columns] = measured.position
        R_WT, p_WT, jacobian = kinematics.pose_and_jacobian(q, self._link, self._offset)
        J = jacobian[:, self._columns]
        self.tool = p_WT
        error, slip = self._error, output.velocity - measured.velocity
        error[:3] = p_WR - p_WT
        if self._force is not None:
            error[:3] += self._force.update(period) * (R_WR @ self._force.axis)
        if self._shift is not None:
            error[:3] += R_WR @ self._shift
        error[3:] = rotation_vector(R_WR @ R_WT.T)
        along = error
        if self._turns:
            along = (error.reshape(2, 3) @ R_WR).reshape(6)
            J = (R_WR.T @ J.reshape(2, 3, -1)).reshape(6, -1)
        if self._updates % WEIGHED == 0:
            self._weigh(J, kinematics.mass_matrix(q)[self._block])
        self._updates += 1
        self._stretch = along
        wrench = self._stiffness * along + self._task_damping * (J @ slip)
        free = self._posture * (output.position - measured.position) + self._posture_damping * slip
        wrench -= np.linalg.solve(J @ J.T + self._singular, J @ free)
        np.add(free, wrench @ J, out=output.command)
        return output

    def _refer(self, time: float, period: float, measured: JointState) -> None:
        """Write the reference of the joints."""
        output = self.output
        if self._pose is None:
            output.rows[:3] = self._follower.update(time, period, measured).rows[:3]
            return
        if self._held is None:
            self._held = np.array(measured.position)
        output.position[:] = self._held
        output.rows[1:3] = 0.0

    def _weigh(self, J: Array, mass: Array) -> None:
        """The damping along the axes of `J`, and of the joints."""
        self._posture_damping = self._posture_scale * np.sqrt(mass.diagonal())
        if self._damping is None:
            mobility = np.einsum("ij,ji->i", J, np.linalg.solve(mass, J.T))
            self._task_damping = self._scale / np.sqrt(np.maximum(mobility, LIGHTEST))
