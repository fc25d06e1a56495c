"""`cartesian_impedance`: controller that holds the tool on its reference like a spring and damper, for contact tasks.

    controllers:
      arm_controller:
        type: cartesian_impedance
        joints: [joint_1, joint_2, joint_3, joint_4, joint_5, joint_6, joint_7]
        stiffness: {translation: [800, 800, 200], rotation: 40}
        damping_ratio: 1
        axes: tool
        posture: {stiffness: 10}

The law: see `impedance_controller.py`. At rest, a force F on the tool displaces it by K^-1 F.

With `force: {sensor: wrist, axis: z, target: 10 N}` and `axes: tool` the tool presses along its axis z: R is shifted
along it until the sensor measures the target, at `speed` before contact, and in stiff contact with a time constant of
1 / (2 pi `bandwidth`). The tool stays a spring in all directions. The sensor is zeroed for 0.1 s when the controller is
activated: do that at rest and before contact, with `active: false` and the step `switch_controllers`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Literal

from pydantic import Field

from manipcli.conditions.condition import Problem
from manipcli.control.control_loop import ControlLoop, NoLoop
from manipcli.control.controller import (
    BuildContext,
    ControllerMember,
)
from manipcli.control.force_reference import AXES, ForceReferenceSpec
from manipcli.control.gains import strangers
from manipcli.control.impedance_controller import CartesianImpedanceController
from manipcli.core.geometry import Transform
from manipcli.core.text import did_you_mean, listed
from manipcli.model.robot import RobotModel
from manipcli.spec.controllers import ConstraintsSpec, ControllerSpec, Interface, Role
from manipcli.spec.impedance import NotNegative, PostureSpec, TaskSpaceSpec, six


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
    if not any(six(spec.stiffness)) and spec.posture.stiffness == 0.0:
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
