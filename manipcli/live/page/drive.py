"""What the page sends to move joints: a trajectory of one point, or the goal of a hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from manipcli.core.geometry import Array
from manipcli.live import command as words
from manipcli.live.command import Command
from manipcli.live.offer import Offer, goal_type
from manipcli.model.configuration import position_limits
from manipcli.model.robot import RobotModel
from manipcli.record.channels import ControllerChannel, Recorded
from manipcli.record.json_message import compact, definition, from_json

SHARE: Final = 0.5
"""Of the velocity limits, which a motion of the page uses."""
RISE: Final = 0.25
"""[s] To that velocity, which limits the acceleration."""
SHORTEST: Final = 0.3
"""[s] Of all motions of the page."""
UNLIMITED: Final = 1.0
"""[rad/s or m/s] For joints without a velocity limit."""


@dataclass(frozen=True, slots=True, eq=False)
class Drive:
    """A controller that the page commands: it follows trajectories, or moves a hand.

    Attributes:
        controller: its name.
        index: its place among the controllers.
        joints: (n) names.
        hand: whether it moves a hand.
        columns: (n) indices of its joints in a joint vector of the robot.
        lower, upper: (n) position limits [rad or m].
        speed: (n) largest speed of the page's motions [rad/s or m/s].
    """

    controller: str
    index: int
    joints: tuple[str, ...]
    hand: bool
    columns: tuple[int, ...]
    lower: Array
    upper: Array
    speed: Array

    @classmethod
    def of(cls, robot: RobotModel, controller: ControllerChannel, index: int) -> Self:
        """The drive of a controller with an action."""
        joints = [robot.joint(name) for name in controller.joints]
        lower, upper = position_limits(joints)
        speed = SHARE * np.array([joint.limits.velocity or UNLIMITED for joint in joints])
        columns = tuple(robot.indices(controller.joints))
        hand = controller.action == "gripper_cmd"
        return cls(controller.name, index, controller.joints, hand, columns, lower, upper, speed)

    @property
    def name(self) -> str:
        """The topic of its trajectories, or the action of the hand."""
        return f"/{self.controller}/{'gripper_cmd' if self.hand else 'joint_trajectory'}"

    def target(self, rest: Array, values: Mapping[str, float]) -> Array:
        """(n) the joints in `values` there, within their limits; the others where `rest` (n) has them."""
        found = np.array([values.get(joint, q) for joint, q in zip(self.joints, rest, strict=True)], dtype=np.float64)
        return np.clip(found, self.lower, self.upper)

    def duration(self, here: Array, velocity: Array, target: Array) -> float:
        """[s] of a cubic from `here` (n), moving at `velocity` (n), to rest at `target` (n), within speed and rise.

        The peak velocity of a cubic over a distance d from rest in a time T is 1.5 d / T, its acceleration 6 d / T^2;
        an initial velocity v adds an acceleration of 4 v / T.
        """
        distance, acceleration = np.abs(target - here), self.speed / RISE
        cruise, rise = 1.5 * distance / self.speed, np.sqrt(6.0 * distance / acceleration)
        times = (cruise, rise, 4.0 * np.abs(velocity) / acceleration)
        return max(SHORTEST, float(np.max(times)))

    def command(self, target: Array, seconds: float, offer: Offer, *, id_: str) -> Command:
        """The command that moves all its joints to `target` (n) in a time [s], which a hand chooses itself."""
        if self.hand:
            goal = {"command": {"name": list(self.joints), "position": target.tolist()}}
            message = from_json(definition(goal_type(offer.actions[self.name])), goal)
            return Command(words.SEND_GOAL, self.name, id_, compact(message))
        sec, nanosec = divmod(round(seconds * 1e9), 10**9)
        point = {
            "positions": target.tolist(),
            "velocities": [0.0] * len(self.joints),
            "time_from_start": {"sec": sec, "nanosec": nanosec},
        }
        trajectory = {"joint_names": list(self.joints), "points": [point]}
        message = from_json(definition(offer.received[self.name]), trajectory)
        return Command(words.PUBLISH, self.name, json=compact(message))


def drives_of(robot: RobotModel, recorded: Sequence[Recorded], offer: Offer) -> tuple[Drive, ...]:
    """Those of the controllers with an action that the offer has; `recorded`: channels of all controllers."""
    found = (
        Drive.of(robot, channel, k)
        for k, channel in enumerate(recorded)
        if isinstance(channel, ControllerChannel) and channel.action
    )
    return tuple(drive for drive in found if drive.name in offer.received or drive.name in offer.actions)
