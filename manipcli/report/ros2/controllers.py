"""The controllers of a task as a parameters file of ROS 2's controller manager."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from manipcli.control.controllers import CONTROLLERS
from manipcli.control.controllers.gripper import GOAL_ANGLE, GOAL_DISTANCE, STALL_SPEED, STALL_VELOCITY
from manipcli.control.controllers.joint_trajectory import JointTrajectorySpec
from manipcli.model.robot import RobotModel
from manipcli.spec.controllers import ConstraintsSpec, ControllerSpec
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.resolved import yaml_text
from manipcli.spec.ros.write import Written, written
from manipcli.spec.source.tree import Plain

FOLLOW: Final = "control_msgs/action/FollowJointTrajectory"
GRIP: Final = "control_msgs/action/GripperCommand"
BROADCASTER: Final = "joint_state_broadcaster/JointStateBroadcaster"


@dataclass(frozen=True, slots=True)
class Exported:
    """A controller in ROS 2.

    Attributes:
        name: of the controller.
        joints: as in its file.
        written: its type and parameters.
        action: name and type of its action; None if it serves none.
        started: whether it is active at the start.
        notes: what differs from the controller that the task uses.
    """

    name: str
    joints: tuple[str, ...]
    written: Written
    action: tuple[str, str] | None
    started: bool
    notes: tuple[str, ...]


def exported(spec: ControllersSpec, robot: RobotModel) -> tuple[tuple[Exported, ...], tuple[str, ...]]:
    """The controllers of a file in ROS 2, and notes on those that ROS does not have."""
    found, left = [], []
    for name, own in spec.controllers.items():
        meant, notes = _in_ros(name, own, robot)
        made = written(meant)
        if made is None:
            left.append(f"controller '{name}': type '{own.type}' does not exist in ROS 2: left out")
            continue
        if made.ignored:
            notes += (f"{name}: ROS ignores {', '.join(f'`{key}`' for key in made.ignored)}",)
        found.append(Exported(name, own.joints, made, _action(name, meant), own.active, notes))
    return tuple(found), tuple(left)


def parameters_file(controllers: Sequence[Exported], *, period: float, notes: Sequence[str]) -> str:
    """The parameters file.

    Args:
        controllers: of the robot.
        period: [s] of the controller manager.
        notes: written as comments.
    """
    types: dict[str, Plain] = {own.name: {"type": own.written.type} for own in controllers}
    if all(own.written.type != BROADCASTER for own in controllers):
        types.setdefault("joint_state_broadcaster", {"type": BROADCASTER})
    manager: dict[str, Plain] = {"update_rate": update_rate(period), **types}
    data: dict[str, Plain] = {"controller_manager": {"ros__parameters": manager}}
    data |= {own.name: {"ros__parameters": own.written.parameters} for own in controllers if own.written.parameters}
    comments = [note for own in controllers for note in own.notes]
    return "".join(f"# {line}\n" for line in (*notes, *comments)) + yaml_text(data)


def update_rate(period: float) -> int:
    """[Hz] of the controller manager, a whole number, that comes nearest to a period [s]."""
    return max(1, round(1.0 / period))


def _action(name: str, spec: ControllerSpec) -> tuple[str, str] | None:
    if spec.role == "hand":
        return f"/{name}/gripper_cmd", GRIP
    return (f"/{name}/follow_joint_trajectory", FOLLOW) if spec.role == "follower" else None


def _in_ros(name: str, spec: ControllerSpec, robot: RobotModel) -> tuple[ControllerSpec, tuple[str, ...]]:
    """The controller of ROS that comes nearest, with its defaults written out, and how it differs."""
    if spec.type == "gripper" and len(spec.joints) == 1:
        turns = robot.joint(spec.joints[0]).type != "prismatic"
        usual: Mapping[str, float] = {
            "stall_velocity": STALL_VELOCITY if turns else STALL_SPEED,
            "goal_tolerance": GOAL_ANGLE if turns else GOAL_DISTANCE,
        }
        return spec.model_copy(update={k: v for k, v in usual.items() if getattr(spec, k) is None}), ()
    if spec.role == "hand":
        hand = CONTROLLERS[spec.type].hand
        interface: str = "position" if hand is None else hand(spec).interface
        note = f"{name}: ROS's gripper controller has one joint; this hand of {len(spec.joints)} gets trajectories"
        still = ConstraintsSpec(goal_time=0.0, stopped_velocity_tolerance=0.0)  # an object may stop a finger
        return _follower(spec, interface, gains=getattr(spec, "gains", {}), constraints=still), (note,)
    if spec.role == "follower" and written(spec) is None:
        note = f"{name}: ROS has no `{spec.type}`: a trajectory controller on the position interface instead"
        return _follower(spec, "position", constraints=getattr(spec, "constraints", ConstraintsSpec())), (note,)
    return spec, ()


def _follower(spec: ControllerSpec, interface: str, **more: object) -> JointTrajectorySpec:
    common = {"type": "joint_trajectory", "joints": spec.joints, "active": spec.active, "update_rate": spec.update_rate}
    made = JointTrajectorySpec.model_validate({**common, "command_interfaces": (interface,)})
    return made.model_copy(update=more)
