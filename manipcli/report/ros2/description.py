"""The URDF of a robot with the `<ros2_control>` block that ROS 2's controller manager reads."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Final
from xml.sax.saxutils import quoteattr

from manipcli.core.geometry import Array
from manipcli.model.normalised_urdf import number
from manipcli.model.robot import RobotModel
from manipcli.spec.controllers_file import ControllersSpec

PLUGIN: Final = "mock_components/GenericSystem"
"""Hardware that reports its commands as its state: everywhere available, to be replaced by that of the arm."""
_AXES: Final = [f"{kind}.{axis}" for kind in ("force", "torque") for axis in "xyz"]


def ros2_urdf(robot: RobotModel, q: Array, controllers: ControllersSpec | None) -> str:
    """The expanded URDF, meshes as `package://`, and a `<ros2_control>` block of all moving joints.

    Args:
        robot: the robot.
        q: (n) configuration at the start [rad or m].
        controllers: whose interfaces the joints offer; None: positions.
    """
    offered = _offered(robot, controllers)
    lines = [f'  <ros2_control name={quoteattr(robot.name)} type="system">']
    lines += ["    <hardware>", f"      <plugin>{PLUGIN}</plugin>", "    </hardware>"]
    for joint, at in zip(robot.moving_joints, q.tolist(), strict=True):
        lines.append(f"    <joint name={quoteattr(joint.name)}>")
        # A mimic joint has states and no commands; its <mimic> is in the joint itself.
        lines += [f'      <command_interface name="{name}"/>' for name in offered.get(joint.name, ())]
        lines.append('      <state_interface name="position">')
        lines.append(f'        <param name="initial_value">{number(at)}</param>')
        lines += ["      </state_interface>", '      <state_interface name="velocity"/>']
        if "effort" in offered.get(joint.name, ()):
            lines.append('      <state_interface name="effort"/>')
        lines.append("    </joint>")
    for frame in _sensors(controllers):
        lines.append(f"    <sensor name={quoteattr(frame)}>")
        lines += [f'      <state_interface name="{name}"/>' for name in _AXES]
        lines.append("    </sensor>")
    head, end, _ = robot.urdf.rpartition("</robot>")
    return "\n".join([head.rstrip("\n"), *lines, "  </ros2_control>", f"{end}\n"])


def packages(urdf: str) -> tuple[str, ...]:
    """The packages with the meshes of a URDF."""
    return tuple(sorted(set(re.findall(r'filename="package://([^/"]+)/', urdf))))


def _offered(robot: RobotModel, controllers: ControllersSpec | None) -> Mapping[str, Sequence[str]]:
    """The command interfaces of each independent joint: those of its controllers, else position."""
    own = () if controllers is None else controllers.controllers.values()
    found: dict[str, list[str]] = {joint.name: [] for joint in robot.moving_joints if joint.independent}
    for spec in own:
        if getattr(spec, "chained_to", None) is None:
            for name in spec.joints:
                found.get(name, []).extend(spec.interfaces)
    return {name: tuple(dict.fromkeys(interfaces)) or ("position",) for name, interfaces in found.items()}


def _sensors(controllers: ControllersSpec | None) -> tuple[str, ...]:
    """The sensors that force-torque broadcasters read."""
    own = () if controllers is None else controllers.controllers.values()
    frames = (getattr(spec, "frame_id", None) or getattr(spec, "link", None) for spec in own if _is_sensor(spec.type))
    return tuple(dict.fromkeys(str(frame) for frame in frames if frame is not None))


def _is_sensor(type_: str) -> bool:
    return type_ == "force_torque_broadcaster"
