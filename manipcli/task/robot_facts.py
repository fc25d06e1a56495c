"""What the file of a robot results in, beyond what it states: inertials that were made, the hand at the tool frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from manipcli.model.hand.tool_hand import ToolHand, tool_hand
from manipcli.model.robot import LinkInertial, Tool
from manipcli.task.load_view import load_sight


@dataclass(frozen=True, slots=True)
class RobotFacts:
    """What a robot file results in, beyond what it states.

    Attributes:
        inertials: where the inertials of links come from, if not from the description.
        tool: the tool frame as stated.
        hand: the hand at the tool frame; None without fingers.
    """

    inertials: tuple[LinkInertial, ...]
    tool: Tool | None
    hand: ToolHand | None


def robot_facts(path: Path, *, package_path: Sequence[Path] = (), allow_outside: bool = False) -> RobotFacts:
    """The facts about the robot of a file.

    Raises:
        InvalidInput: all errors of the file.
    """
    robot = load_sight(path, package_path=package_path, allow_outside=allow_outside).robot
    return RobotFacts(robot.inertials, robot.tool, tool_hand(robot))
