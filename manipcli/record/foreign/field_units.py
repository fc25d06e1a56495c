"""Units of numbers in ROS messages by their field (REP 103: SI, angles in rad), and of joints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from manipcli.core.errors import InvalidInput
from manipcli.description.located_xml import parse_document
from manipcli.record.foreign.topic_fields import Way

JointUnits = Mapping[str, str]
"""Position unit of each joint of known type: rad or m."""

OF_JOINTS: Final = {
    "sensor_msgs/JointState": {"position": "", "velocity": "/s", "effort": "force"},
    "trajectory_msgs/JointTrajectoryPoint": {
        "positions": "", "velocities": "/s", "accelerations": "/s²", "effort": "force",
    },
}  # fmt: skip
_FORCE = {"rad": "N m", "m": "N"}
BY_NAME: Final = {
    "manipcli_msgs/Contact": {"force": "N", "distance": "m"},
    "manipcli_msgs/ContactPoint": {"force": "N"},
    "sensor_msgs/Temperature": {"temperature": "°C"},
    "sensor_msgs/FluidPressure": {"fluid_pressure": "Pa"},
    "sensor_msgs/BatteryState": {"voltage": "V", "current": "A", "temperature": "°C"},
    "sensor_msgs/Range": {"field_of_view": "rad", "min_range": "m", "max_range": "m", "range": "m", "variance": "m²"},
    "sensor_msgs/LaserScan": {
        "angle_min": "rad",
        "angle_max": "rad",
        "angle_increment": "rad",
        "time_increment": "s",
        "scan_time": "s",
        "range_min": "m",
        "range_max": "m",
        "ranges": "m",
    },
    "manipcli_msgs/ContactSwitch": {"force": "N", "threshold": "N"},
    "manipcli_msgs/Taxels": {"width": "m", "height": "m", "force": "N"},
    "manipcli_msgs/TaxelShear": {"width": "m", "height": "m", "x": "N", "y": "N"},
    "builtin_interfaces/Time": {"sec": "s"},
}
VECTORS: Final = {
    "translation": "m", "position": "m", "linear": "m/s", "angular": "rad/s", "force": "N", "torque": "N m",
    "friction": "N",
    "angular_velocity": "rad/s", "linear_acceleration": "m/s²", "magnetic_field": "T",
}  # fmt: skip
_ACCELERATIONS = {"linear": "m/s²", "angular": "rad/s²"}
_OF_VECTORS = frozenset({"geometry_msgs/Vector3", "geometry_msgs/Point", "geometry_msgs/Point32"})


def unit_of(way: Way, label: str, joints: JointUnits) -> str:
    """The unit of a number; "" if it has none or it is unknown.

    Args:
        way: path of the number.
        label: its array element, such as the name of a joint.
        joints: units of the joints.
    """
    holder, last = way.holder.name, way.parts[-1].name
    if holder in OF_JOINTS:
        kind = OF_JOINTS[holder].get(last)
        unit = joints.get(label.rpartition(" ")[2])
        if kind is None or unit is None:
            return ""
        return _FORCE.get(unit, "") if kind == "force" else f"{unit}{kind}"
    if holder in _OF_VECTORS and len(way.parts) > 1:
        above = [part.name for part in way.parts[:-1]]
        accelerates = any(name in ("accel", "acceleration", "accelerations") for name in above)
        return (_ACCELERATIONS if accelerates else VECTORS).get(above[-1], "")
    if way.is_time:
        return "s"
    return BY_NAME.get(holder, {}).get(last, "")


def joint_units(urdf: bytes) -> JointUnits:
    """Position unit of each joint of a URDF; empty if it is not a URDF."""
    try:
        joints = parse_document(urdf, "robot_description").getElementsByTagName("joint") if urdf else []
    except InvalidInput:
        return {}
    units = {"prismatic": "m", "revolute": "rad", "continuous": "rad"}
    # <joint> elements inside a <transmission> have no type.
    return {
        joint.getAttribute("name"): units[joint.getAttribute("type")]
        for joint in joints
        if joint.getAttribute("type") in units
    }
