"""Restructuring of our parameters of a controller to those of ROS 2: the inverse of `reshape.py`."""

from __future__ import annotations

import math
from typing import Final

from manipcli.spec.controllers import GainsSpec, JointConstraintSpec
from manipcli.spec.ros.table import Data
from manipcli.spec.source.tree import Plain

NO_EXTRA_TIME: Final = 1e-9
"""[s] Written for a `goal_time` of 0, which in ROS 2 means no time limit."""
_CLAMPS: Final = frozenset({"i_clamp", "i_clamp_min", "i_clamp_max"})


def to_joint_trajectory(data: Data) -> Data:
    """Tolerances of joints directly under `constraints`; references of another controller in `command_joints`."""
    single = data.pop("command_interface", None)
    data["command_interfaces"] = data.get("command_interfaces") or [single or "effort"]
    target = data.pop("chained_to", None)
    joints = data.get("joints")
    if target is not None and isinstance(joints, list):
        data["command_joints"] = [f"{target}/{joint}" for joint in joints]
    constraints = data.get("constraints")
    if isinstance(constraints, dict):
        own = constraints.pop("joints", {})
        if constraints.get("goal_time") == 0.0:
            constraints["goal_time"] = NO_EXTRA_TIME
        if isinstance(own, dict):
            data["constraints"] = constraints | {
                joint: stated(block, JointConstraintSpec().model_dump()) for joint, block in own.items()
            }
    return with_gains(data)


def to_gripper(data: Data) -> Data:
    """ROS's gripper controller has one `joint`. Stalling is allowed by default here, but not in ROS."""
    joints = data.pop("joints", None)
    data.pop("command_interface", None)  # the type implies it
    first = {"joint": joints[0]} if isinstance(joints, list) and joints else {}
    return with_gains(first | data)


def to_forward(data: Data) -> Data:
    """References of another controller as its joints."""
    return _above(data, "joints")


def to_pid(data: Data) -> Data:
    """References of another controller as the names of its degrees of freedom."""
    return with_gains(_above(data, "joints"))


def to_wrench(data: Data) -> Data:
    """ROS needs a frame, and the name of a sensor in the description."""
    frame = data.get("frame_id") or data.get("link")
    return data | {"frame_id": frame, "sensor_name": frame}


def _above(data: Data, key: str) -> Data:
    target, names = data.pop("chained_to", None), data.get(key)
    if target is None or not isinstance(names, list):
        return data
    gains = data.get("gains")
    if isinstance(gains, dict):
        data["gains"] = {f"{target}/{joint}": block for joint, block in gains.items()}
    return data | {key: [f"{target}/{name}" for name in names]}


def with_gains(data: Data) -> Data:
    """Gains without defaults, but always p, i and d; an integral without a clamp is unclamped in ROS, too."""
    gains = data.get("gains")
    if not isinstance(gains, dict) or not gains:
        data.pop("gains", None)
        return data
    usual = {key: value for key, value in GainsSpec().model_dump().items() if key not in ("p", "i", "d")}
    usual |= {"feedforward_gain": 0.0, "angle_wraparound": None, "save_i_term": True}
    made: dict[str, Plain] = {}
    for joint, block in gains.items():
        left = stated(block, usual)
        if isinstance(left, dict) and left.get("i") and not _CLAMPS & left.keys():
            left = left | {"i_clamp": math.inf}
        made[joint] = left
    return data | {"gains": made}


def stated(block: Plain, usual: dict[str, object]) -> Plain:
    """The block without values that are the usual ones."""
    if not isinstance(block, dict):
        return block
    return {key: value for key, value in block.items() if key not in usual or value != usual[key]}
