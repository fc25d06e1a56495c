"""Parts of English sentences that several steps share."""

from __future__ import annotations

from manipcli.core.prose import amount, named, share
from manipcli.model.robot import RobotModel


def at_share(scaling: float, default: float) -> str:
    """A `velocity_scaling`; "" for the default."""
    return "" if scaling == default else f", at {share(scaling)} of the velocity, acceleration and jerk limits"


def joint_value(robot: RobotModel, name: str, value: float) -> str:
    """A joint position: `'joint_1' to 30 deg`."""
    return f"{named(name)} to {amount(value, robot.joint(name).unit)}"


def approached(from_: str | None, pitch: float | None, yaw: float | None, frame: str | None) -> str:
    """From where the hand comes; "" where the planner chooses."""
    side = {"side": " from the side", "top": " from above"}.get(from_ or "", "")
    if pitch is not None:
        side = f" at {amount(pitch, 'rad')} below the horizontal"
    axis = "" if frame is None else f" from the x axis of {named(frame)}"
    return side if yaw is None else f"{side} with a yaw of {amount(yaw, 'rad')}{axis}"
