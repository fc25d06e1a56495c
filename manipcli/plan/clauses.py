"""Parts of English sentences that several steps share."""

from __future__ import annotations

from collections.abc import Sequence

from manipcli.core.prose import amount, listing, named, share
from manipcli.model.robot import RobotModel


def at_share(scaling: float, default: float) -> str:
    """A `velocity_scaling`; "" for the default."""
    return "" if scaling == default else f", at {share(scaling)} of the velocity, acceleration and jerk limits"


def joint_values(robot: RobotModel, names: Sequence[str], values: Sequence[float]) -> str:
    """Joint positions: `'joint_1' is at 30 deg and 'joint_2' is at 0 deg`."""
    texts = [amount(value, robot.joint(name).unit) for name, value in zip(names, values, strict=True)]
    if len(texts) > 2 and len(set(texts)) == 1:
        return f"{listing([named(name) for name in names])} are at {texts[0]}"
    return listing([f"{named(name)} is at {text}" for name, text in zip(names, texts, strict=True)])


def approached(from_: str | None, pitch: float | None, yaw: float | None, frame: str | None) -> str:
    """From where the hand comes; "" where the planner chooses."""
    side = {"side": " from the side", "top": " from above"}.get(from_ or "", "")
    if pitch is not None:
        side = f" at {amount(pitch, 'rad')} below the horizontal"
    axis = "" if frame is None else f" from the x axis of {named(frame)}"
    return side if yaw is None else f"{side} with a yaw of {amount(yaw, 'rad')}{axis}"
