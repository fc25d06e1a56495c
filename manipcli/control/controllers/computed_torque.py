"""`computed_torque`: controller that follows joint trajectories by inverse dynamics, with decoupled unit masses.

    controllers:
      arm_controller:
        type: computed_torque
        joints: [joint_1, joint_2]
        bandwidth: 15 Hz
        damping_ratio: 1
        constraints: {goal_time: 2 s, joints: {joint_1: {trajectory: 0.1, goal: 0.02}}}

    u = M(q) (a_r + d (v_r - v) + p (q_r - q)) + C(q, v) v + g(q) + D v_r

so that, with an exact model, every error obeys e'' + d e' + p e = 0, with p = (2 pi f)^2 and d = 4 pi f ratio of
the bandwidth f [Hz] and the damping ratio; the damping D of the joints adds to d. Siciliano et al.,
Robotics: Modelling, Planning and Control (2009), 8.5.2.
The manager's feed-forward multiplies by the inertia and adds the rest (see `ModelFeedForward`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, ClassVar, Final, Literal

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import Problem
from manipcli.control.action import GoalHandle
from manipcli.control.control_loop import ControlLoop, InverseDynamicsLoop, error_gains
from manipcli.control.controller import BuildContext, ControllerMember, ControllerOutput, FeedForward, JointState
from manipcli.control.controllers.joint_trajectory import JointTrajectoryController
from manipcli.control.gains import strangers
from manipcli.control.jog import JogTarget
from manipcli.control.stopping import StopPlanner
from manipcli.control.trajectory_goal import TrajectoryGoal
from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array
from manipcli.description.elements import JointLimits, JointType
from manipcli.description.transmission import Compat
from manipcli.model.robot import RobotModel
from manipcli.plan.trajectory import JointTrajectory
from manipcli.spec.controllers import ConstraintsSpec, ControllerSpec, GainsSpec, Interface, Role
from manipcli.spec.quantity import Frequency

DEFAULT_BANDWIDTH: Final = 15.0
"""[Hz]"""


class ComputedTorqueSpec(ControllerSpec):
    """Follows joint trajectories by inverse dynamics: every joint's error obeys e'' + d e' + p e = 0."""

    role: ClassVar[Role] = "follower"

    type: Literal["computed_torque"] = Field(description="`computed_torque`.")
    joints: tuple[str, ...] = Field(description="The joints that it claims.")
    bandwidth: Annotated[Frequency, Field(gt=0)] = Field(
        15.0, description="Natural frequency of the error [Hz], above 0: p = (2 pi f)^2. Default 15 Hz."
    )
    damping_ratio: Annotated[float, Field(gt=0)] = Field(
        1.0, description="Of the error, above 0: d = 4 pi f ratio. Default 1."
    )
    gains: dict[str, GainsSpec] = Field(
        {}, description="By joint, instead of the two: p [1/s2], i [1/s3], d [1/s]. They act on accelerations."
    )
    constraints: ConstraintsSpec = Field(ConstraintsSpec(), description="Tolerances and goal time.")

    @property
    def interfaces(self) -> tuple[Interface, ...]:
        """What it commands of each of its joints."""
        return ("effort",)


class ComputedTorqueController:
    """A joint trajectory controller whose PID computes accelerations, which inverse dynamics converts to efforts.

    Goals, tolerances, results and holding are those of `JointTrajectoryController`. Its own command is 0: all of the
    effort comes from the feed-forward, so nothing moves without it.

    Args:
        name: of the controller.
        joints: (n) distinct names.
        bandwidth: [Hz] natural frequency of the errors.
        damping_ratio: of the errors.
        gains: by joint, instead of the two: p [1/s2], i [1/s3], d [1/s].
        constraints, limits, types, compat: see `JointTrajectoryController`.

    Raises:
        InvalidArgument: no or duplicate joints, gains of an unknown joint, gains or a bandwidth of zero.
    """

    role: Role = "follower"
    senses_contact = False
    sensors = ()
    interfaces: tuple[Interface, ...] = ("effort",)
    feed_forward: FeedForward = "inverse_dynamics"

    def __init__(
        self,
        *,
        name: str,
        joints: Sequence[str],
        bandwidth: float = DEFAULT_BANDWIDTH,
        damping_ratio: float = 1.0,
        gains: Mapping[str, GainsSpec] | None = None,
        constraints: ConstraintsSpec | None = None,
        limits: Sequence[JointLimits] | None = None,
        types: Sequence[JointType] | None = None,
        compat: Compat | None = None,
        stop_planner: StopPlanner | None = None,
    ) -> None:
        if not bandwidth > 0.0:
            raise InvalidArgument("CTRL180", f"controller '{name}': bandwidth is {bandwidth} Hz; expected more than 0")
        common = error_gains(bandwidth, damping_ratio)
        self._follower = JointTrajectoryController(
            name=name,
            joints=joints,
            command_interfaces=("effort",),
            gains={**dict.fromkeys(joints, common), **(gains or {})},
            constraints=constraints,
            limits=limits,
            types=types,
            compat=compat,
            stop_planner=stop_planner,
        )
        self.name, self.joints = self._follower.name, self._follower.joints
        self.scaling, self.gains = self._follower.scaling, self._follower.gains
        followed = self._follower.output
        self._correction = followed.command
        self._wanted = np.zeros(len(self.joints))
        self.output = ControllerOutput(
            rows=followed.rows,
            position=followed.position,
            velocity=followed.velocity,
            acceleration=followed.acceleration,
            commands=followed.commands,
            wanted_acceleration=self._wanted,
            speed=followed.speed,
        )

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
        """Accept a trajectory; see `JointTrajectoryController.send_goal`."""
        return self._follower.send_goal(trajectory, constraints=constraints)

    def jog(self, target: JogTarget, *, until: float) -> None:
        """Follow velocities until `until` [s]; see `JointTrajectoryController.jog`."""
        self._follower.jog(target, until=until)

    def deactivate(self, time: float, reason: str = "the controller was deactivated") -> None:
        """Abort its goal and reset its state; the next update re-activates it."""
        self._follower.deactivate(time, reason)

    def update(
        self, time: float, period: float, measured: JointState, *, contact_force: Array | None = None
    ) -> ControllerOutput:
        """One control tick at `time` [s] of the length `period` [s]; `contact_force` is ignored."""
        self._follower.update(time, period, measured)
        np.add(self.output.acceleration, self._correction, out=self._wanted)
        self._correction[:] = 0.0
        return self.output


def build(name: str, spec: ComputedTorqueSpec, context: BuildContext) -> ComputedTorqueController:
    """The controller of a spec."""
    joints = [context.robot.joint(joint) for joint in spec.joints]
    return ComputedTorqueController(
        name=name,
        joints=spec.joints,
        bandwidth=spec.bandwidth,
        damping_ratio=spec.damping_ratio,
        gains=spec.gains,
        constraints=spec.constraints,
        limits=[joint.limits for joint in joints],
        types=[joint.type for joint in joints],
        compat=context.compat,
        stop_planner=context.stop_planner,
    )


def check(spec: ComputedTorqueSpec, robot: RobotModel) -> Iterator[Problem]:
    """Gains and tolerances of other joints, and gains all zero."""
    yield from strangers(robot, spec.joints, spec.gains, ("gains",), "gains", "CTRL102")
    yield from strangers(
        robot, spec.joints, spec.constraints.joints, ("constraints", "joints"), "tolerances", "CTRL104"
    )
    for joint, gains in spec.gains.items():
        if joint in spec.joints and gains.p == gains.i == gains.d == 0.0:
            hint = f"give gains.{joint}.p [1/s2] and d [1/s], or remove them to use the bandwidth"
            message = f"joint '{joint}' has gains that are all zero; it would not return to its reference"
            yield Problem(("gains", joint), message, hint, "CTRL103")


def loop(spec: ComputedTorqueSpec) -> ControlLoop:
    """Inverse dynamics with a prescribed error."""
    return InverseDynamicsLoop(spec.bandwidth, spec.damping_ratio, spec.gains)


MEMBER = ControllerMember(name="computed_torque", spec=ComputedTorqueSpec, build=build, check=check, loop=loop)
