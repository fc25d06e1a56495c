"""The unit of a number in a ROS message, by where it stands (REP 103: SI, and angles in rad), and of joints."""

from __future__ import annotations

from collections.abc import Mapping

from manipcli.core.errors import InvalidInput
from manipcli.description.located_xml import parse_document
from manipcli.record.foreign.fields import Way

JointUnits = Mapping[str, str]
"""Unit of the position of each joint whose kind is known: rad or m."""

_OF_JOINTS = {
    "sensor_msgs/JointState": {"position": "", "velocity": "/s", "effort": "force"},
    "trajectory_msgs/JointTrajectoryPoint": {
        "positions": "", "velocities": "/s", "accelerations": "/s²", "effort": "force",
    },
}  # fmt: skip
_FORCE = {"rad": "N m", "m": "N"}
_BY_NAME = {
    "manipcli_msgs/Contact": {"force": "N", "distance": "m"},
    "sensor_msgs/Temperature": {"temperature": "°C"},
    "sensor_msgs/FluidPressure": {"fluid_pressure": "Pa"},
    "sensor_msgs/BatteryState": {"voltage": "V", "current": "A", "temperature": "°C"},
    "sensor_msgs/Range": {"range": "m"},
    "builtin_interfaces/Time": {"sec": "s"},
}
_VECTORS = {
    "translation": "m", "position": "m", "linear": "m/s", "angular": "rad/s", "force": "N", "torque": "N m",
    "angular_velocity": "rad/s", "linear_acceleration": "m/s²", "magnetic_field": "T",
}  # fmt: skip
_ACCELERATIONS = {"linear": "m/s²", "angular": "rad/s²"}
_OF_VECTORS = frozenset({"geometry_msgs/Vector3", "geometry_msgs/Point", "geometry_msgs/Point32"})


def unit_of(way: Way, label: str, joints: JointUnits) -> str:
    """The unit of a number; "" where it has none, or none is known.

    Args:
        way: where it stands.
        label: which element of an array it is, as the name of a joint.
        joints: what is known of the joints.
    """
    holder, last = way.holder.name, way.parts[-1].name
    if holder in _OF_JOINTS:
        kind = _OF_JOINTS[holder].get(last)
        unit = joints.get(label.rpartition(" ")[2])
        if kind is None or unit is None:
            return ""
        return _FORCE.get(unit, "") if kind == "force" else f"{unit}{kind}"
    if holder in _OF_VECTORS and len(way.parts) > 1:
        above = [part.name for part in way.parts[:-1]]
        accelerates = any(name in ("accel", "acceleration", "accelerations") for name in above)
        return (_ACCELERATIONS if accelerates else _VECTORS).get(above[-1], "")
    if way.is_time:
        return "s"
    return _BY_NAME.get(holder, {}).get(last, "")


def joint_units(urdf: bytes) -> JointUnits:
    """Unit of the position of each joint of a description; of none where it is no description."""
    try:
        joints = parse_document(urdf, "robot_description").getElementsByTagName("joint") if urdf else []
    except InvalidInput:
        return {}
    units = {"prismatic": "m", "revolute": "rad", "continuous": "rad"}
    # Those inside a <transmission> have no type.
    return {
        one.getAttribute("name"): units[one.getAttribute("type")] for one in joints if one.getAttribute("type") in units
    }
