"""What users write of the controllers beside joint trajectories and grippers."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from manipcli.spec.base import Model
from manipcli.spec.controllers import ConstraintsSpec, ControllerSpec, GainsSpec, Interface, Role
from manipcli.spec.quantity import Frequency

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Axes3 = tuple[NotNegative, NotNegative, NotNegative]


class ComputedTorqueSpec(ControllerSpec):
    """Follows joint trajectories by inverse dynamics: every joint's error obeys e'' + d e' + p e = 0."""

    role: ClassVar[Role] = "follower"

    type: Literal["computed_torque"] = Field(description="`computed_torque`.")
    joints: tuple[str, ...] = Field(description="The joints that it claims.")
    bandwidth: Annotated[Frequency, Field(gt=0)] = Field(
        15.0, description="Natural frequency of the error [Hz], above 0: p = (2 pi f)^2. Default 15 Hz."
    )
    damping_ratio: Positive = Field(1.0, description="Of the error, above 0: d = 4 pi f ratio. Default 1.")
    gains: dict[str, GainsSpec] = Field(
        {}, description="By joint, instead of the two: p [1/s2], i [1/s3], d [1/s]. They act on accelerations."
    )
    constraints: ConstraintsSpec = Field(ConstraintsSpec(), description="Tolerances and goal time.")

    @property
    def interfaces(self) -> tuple[Interface, ...]:
        """What it commands of each of its joints."""
        return ("effort",)


class TaskSpaceSpec(Model):
    """Along and about three axes: one number for all three, or a list of x, y, z."""

    translation: NotNegative | Axes3 = Field(description="Stiffness [N/m] or damping [N s/m], 0 or more.")
    rotation: NotNegative | Axes3 = Field(description="Stiffness [N m/rad] or damping [N m s/rad], 0 or more.")


class PostureSpec(Model):
    """What draws the joints to those of the reference where that does not move the tool."""

    stiffness: NotNegative = Field(10.0, description="Of each joint [N m/rad or N/m], 0 or more. Default 10.")
    damping_ratio: NotNegative = Field(
        1.0, description="Damping 2 ratio sqrt(stiffness x inertia) of each joint, 0 or more. Default 1."
    )


class CartesianImpedanceSpec(ControllerSpec):
    """Holds the tool on its reference as a spring and a damper would; for work in contact."""

    role: ClassVar[Role] = "follower"

    type: Literal["cartesian_impedance"] = Field(description="`cartesian_impedance`.")
    joints: tuple[str, ...] = Field(description="The joints that it claims: all between the base and the tool.")
    link: str | None = Field(None, description="The link whose frame is led. Default: the robot's tool frame.")
    stiffness: TaskSpaceSpec = Field(description="Of the spring [N/m, N m/rad].")
    damping_ratio: NotNegative = Field(
        1.0, description="Damping 2 ratio sqrt(stiffness x effective mass), 0 or more. Default 1."
    )
    damping: TaskSpaceSpec | None = Field(None, description="Instead of the ratio [N s/m, N m s/rad]. Default: none.")
    axes: Literal["world", "tool"] = Field("world", description="Whose axes stiffness and damping mean. Default world.")
    posture: PostureSpec = Field(PostureSpec(), description="Of the joints that the tool leaves free.")
    inverse_dynamics: bool = Field(
        False, description="Add the effort that the reference's acceleration needs, to gravity. Default false."
    )
    constraints: ConstraintsSpec = Field(
        ConstraintsSpec(),
        description="Tolerances of the joints and goal time; a contact brings a joint off its reference.",
    )

    @property
    def interfaces(self) -> tuple[Interface, ...]:
        """What it commands of each of its joints."""
        return ("effort",)


class ForwardCommandSpec(ControllerSpec):
    """Passes on what it is told with `set_command`; until then it holds: the position, no velocity, no effort."""

    type: Literal["forward_command"] = Field(description="`forward_command`.")
    joints: tuple[str, ...] = Field(description="The joints that it claims.")
    command_interface: Literal["position", "velocity", "effort"] = Field(description="What it commands.")
    gravity_compensation: bool = Field(
        False, description="Add the effort that holds against gravity, to efforts. Default false."
    )

    @property
    def interfaces(self) -> tuple[Interface, ...]:
        """What it commands of each of its joints."""
        return (self.command_interface,)


class PidGainsSpec(GainsSpec):
    """PID gains of one joint of a `pid` controller."""

    feedforward_gain: float = Field(
        0.0, description="Factor on the reference (on its derivative, where there are two), added. Default 0."
    )
    angle_wraparound: bool | None = Field(
        None, description="The error of a position is the shortest angle. Default: where the joint is continuous."
    )
    save_i_term: bool = Field(True, description="Keep the integral term while it is not active. Default true.")


class PidSpec(ControllerSpec):
    """Leads each joint to a reference with a PID of its own; `set_reference` says which."""

    type: Literal["pid"] = Field(description="`pid`.")
    joints: tuple[str, ...] = Field(description="The joints that it claims.")
    command_interface: Literal["velocity", "effort"] = Field("effort", description="What it commands. Default effort.")
    reference_and_state_interfaces: Annotated[
        tuple[Literal["position", "velocity"], ...],
        Field(min_length=1, max_length=2, description="What is led: [position], [position, velocity], or [velocity]."),
    ] = ("position",)
    gains: dict[str, PidGainsSpec] = Field(description="PID gains by joint.")
    gravity_compensation: bool = Field(
        False, description="Add the effort that holds against gravity, to efforts. Default false."
    )
    set_current_state_as_first_setpoint: bool = Field(
        True, description="Hold what is measured until a reference is set; otherwise command 0. Default true."
    )

    @property
    def interfaces(self) -> tuple[Interface, ...]:
        """What it commands of each of its joints."""
        return (self.command_interface,)


class JointStateBroadcasterSpec(ControllerSpec):
    """Claims nothing; offers measured joints to Python. The log has all joints in /joint_states, with or without it."""

    type: Literal["joint_state_broadcaster"] = Field(description="`joint_state_broadcaster`.")
    joints: tuple[str, ...] = Field((), description="The joints that it reads. Default: all that move.")
    state_interfaces: Annotated[
        tuple[Literal["position", "velocity", "effort"], ...],
        Field(min_length=1, description="What of them. Default [position, velocity, effort]."),
    ] = ("position", "velocity", "effort")


class ForceTorqueBroadcasterSpec(ControllerSpec):
    """Claims nothing; measures the wrench that a link puts on its parent; the log has it in `/NAME/wrench`."""

    type: Literal["force_torque_broadcaster"] = Field(description="`force_torque_broadcaster`.")
    link: str = Field(description="Measured where this link meets its parent, in this link's frame [N, N m].")
