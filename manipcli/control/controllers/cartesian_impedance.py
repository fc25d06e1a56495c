"""`cartesian_impedance`: controller that holds the tool on its reference like a spring and damper, for contact tasks.

    controllers:
      arm_controller:
        type: cartesian_impedance
        joints: [joint_1, joint_2, joint_3, joint_4, joint_5, joint_6, joint_7]
        stiffness: {translation: [800, 800, 200], rotation: 40}
        damping_ratio: 1
        axes: tool
        posture: {stiffness: 10}

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

With `force: {sensor: wrist, axis: z, target: 10 N}` and `axes: tool` the tool presses along its axis z: R is shifted
along it until the sensor measures the target, at `speed` before contact, and in stiff contact with a time constant of
1 / (2 pi `bandwidth`). The tool stays a spring in all directions. The sensor is zeroed for 0.1 s when the controller is
activated: do that at rest and before contact, with `active: false` and the step `switch_controllers`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import ClassVar, Final, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field

from manipcli.conditions.condition import Problem
from manipcli.control.action import GoalHandle
from manipcli.control.control_loop import ControlLoop, NoLoop
from manipcli.control.controller import (
    BuildContext,
    ControllerMember,
    ControllerOutput,
    FeedForward,
    JointState,
    SensorRequest,
)
from manipcli.control.controllers.joint_trajectory import JointTrajectoryController
from manipcli.control.force_reference import AXES, ForceReference, ForceReferenceSpec
from manipcli.control.gains import strangers
from manipcli.control.jog import JogTarget
from manipcli.control.stopping import StopPlanner
from manipcli.control.trajectory_goal import TrajectoryGoal
from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array, Transform
from manipcli.core.text import did_you_mean, listed
from manipcli.description.elements import JointLimits, JointType
from manipcli.description.transmission import Compat
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.plan.pose_error import rotation_vector
from manipcli.plan.trajectory import JointTrajectory
from manipcli.spec.controllers import ConstraintsSpec, ControllerSpec, Interface, Role
from manipcli.spec.impedance import NotNegative, PostureSpec, TaskSpaceSpec, six

SINGULAR: Final = 1e-3
"""s: tool directions in which the joints move less than this [m or rad per rad] belong to the null space."""
LIGHTEST: Final = 1e-9
"""[1/kg] or [1/(kg m2)] Lower bound for mobilities."""
WEIGHED: Final = 10
"""Updates between two computations of the masses, which only scale the damping and change slowly."""


class CartesianImpedanceSpec(ControllerSpec):
    """Holds the tool on its reference like a spring and damper, for contact tasks."""

    role: ClassVar[Role] = "follower"

    type: Literal["cartesian_impedance"] = Field(description="`cartesian_impedance`.")
    joints: tuple[str, ...] = Field(description="The joints that it claims: all between base and tool.")
    link: str | None = Field(None, description="The link whose frame is controlled. Default: the robot's tool frame.")
    stiffness: TaskSpaceSpec = Field(description="Of the spring [N/m, N m/rad].")
    damping_ratio: NotNegative = Field(
        1.0, description="Damping 2 ratio sqrt(stiffness x effective mass), 0 or more. Default 1."
    )
    damping: TaskSpaceSpec | None = Field(
        None, description="Damping, instead of the ratio [N s/m, N m s/rad]. Default: none."
    )
    axes: Literal["world", "tool"] = Field("world", description="Axes of stiffness and damping. Default world.")
    posture: PostureSpec = Field(PostureSpec(), description="Stiffness of the joints in the null space of the tool.")
    force: ForceReferenceSpec | None = Field(
        None, description="Force that the tool exerts along one of its axes; needs `axes: tool`. Default: none."
    )
    inverse_dynamics: bool = Field(
        False, description="Add the effort of the reference's acceleration, besides gravity. Default false."
    )
    constraints: ConstraintsSpec = Field(
        ConstraintsSpec(),
        description="Tolerances of the joints and goal time; contacts displace joints from their references.",
    )

    @property
    def interfaces(self) -> tuple[Interface, ...]:
        """What it commands of each of its joints."""
        return ("effort",)


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
        self._task_damping = np.zeros(6) if self._damping is None else self._damping
        self._posture_damping = np.zeros(len(self.joints))
        self._updates, self._time = 0, 0.0
        self._pose: Transform | None = None
        self._held: Array | None = None
        self._shift: Array | None = None  # (3,) of the reference along its axes [m]
        self.tool: Array = np.full(3, np.nan)  # in the world, at the last update

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
        R_WT, self.tool, J = kinematics.pose_and_jacobian(q, self._link, self._offset)
        J = J[:, self._columns]
        error, slip = self._error, output.velocity - measured.velocity
        error[:3] = p_WR - self.tool
        if self._force is not None:
            error[:3] += self._force.update(period) * (R_WR @ self._force.axis)
        error[:3] += 0.0 if self._shift is None else R_WR @ self._shift
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


def build(name: str, spec: CartesianImpedanceSpec, context: BuildContext) -> CartesianImpedanceController:
    """The controller of a spec."""
    joints = [context.robot.joint(joint) for joint in spec.joints]
    link, offset = _frame(spec, context.robot)
    return CartesianImpedanceController(
        name=name,
        joints=spec.joints,
        kinematics=context.kinematics(),
        link=link,
        offset=offset,
        stiffness=six(spec.stiffness),
        damping_ratio=spec.damping_ratio,
        damping=None if spec.damping is None else six(spec.damping),
        axes=spec.axes,
        posture_stiffness=spec.posture.stiffness,
        posture_damping_ratio=spec.posture.damping_ratio,
        force=spec.force,
        feed_forward="inverse_dynamics" if spec.inverse_dynamics else "gravity",
        constraints=spec.constraints,
        limits=[joint.limits for joint in joints],
        types=[joint.type for joint in joints],
        compat=context.compat,
        stop_planner=context.stop_planner,
    )


def _frame(spec: CartesianImpedanceSpec, robot: RobotModel) -> tuple[str, Transform | None]:
    """The link that carries the tool frame, and X_LT."""
    if spec.link is not None:
        return spec.link, None
    return ("", None) if robot.tool is None else (robot.tool.link, robot.tool.X_LT)


def check(spec: CartesianImpedanceSpec, robot: RobotModel) -> Iterator[Problem]:
    """Tolerances of other joints; a missing tool, a tool that other joints move, too, or that one of its joints does
    not move; zero stiffness; a force without a spring along its axis."""
    yield from strangers(
        robot, spec.joints, spec.constraints.joints, ("constraints", "joints"), "tolerances", "CTRL104"
    )
    if not six(spec.stiffness).any() and spec.posture.stiffness == 0.0:
        yield Problem(
            ("stiffness",), "all stiffnesses are 0; it would not move", "give stiffness.translation", "CTRL185"
        )
    if spec.force is not None:
        if spec.axes != "tool":
            hint = "set `axes: tool`: stiffness and force then have the same axes"
            yield Problem(("force",), "a force needs `axes: tool`", hint, "CTRL187")
        elif six(spec.stiffness)[AXES[spec.force.axis]] == 0.0:
            message = f"stiffness along {spec.force.axis} is 0; the force is that of this spring"
            yield Problem(("force", "axis"), message, "give stiffness.translation along it", "CTRL187")
    link, _ = _frame(spec, robot)
    names = [own.name for own in robot.links]
    if link not in names:
        if spec.link is None:
            hint = "set `link`, or add `tool: {link: ...}` to the robot file"
            yield Problem((), f"robot '{robot.name}' has no tool frame", hint, "CTRL186")
        else:
            hint = did_you_mean(link, names, kind="links") or ""
            yield Problem(("link",), f"link '{link}' is not in robot '{robot.name}'", hint, "CTRL186")
        return
    movers = [joint.name for joint in robot.moving_joints if link in robot.descendants(joint.child)]
    missing = [name for name in movers if name not in spec.joints]
    if missing:
        message = f"{listed(missing)} {'moves' if len(missing) == 1 else 'move'} link '{link}', too"
        yield Problem(("joints",), message, "list all joints between base and tool", "CTRL186")
    for k, name in enumerate(spec.joints):
        if name in robot.joint_names and name not in movers:
            message = f"joint '{name}' does not move link '{link}'"
            yield Problem(("joints", k), message, f"use joints that do: {listed(movers)}", "CTRL186")


def loop(spec: CartesianImpedanceSpec) -> ControlLoop:
    """No loop to examine: its damping follows the inertia, and its stiffness is chosen for the contact."""
    return NoLoop("its damping follows the inertia, and its stiffness is chosen for the contact")


MEMBER = ControllerMember(name="cartesian_impedance", spec=CartesianImpedanceSpec, build=build, check=check, loop=loop)
