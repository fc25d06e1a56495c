"""What all points of a map have in common, and what planning at one of them gave."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from manipcli.task.load_task import FileOptions

Outcome = Literal["planned", "refused", "invalid", "crashed", "hung"]


@dataclass(frozen=True, slots=True)
class Question:
    """What every point of a map has in common.

    Attributes:
        path: the task file.
        options: how it is loaded.
        step: id of the last step that is planned.
        body: the object that is moved, as in the file.
    """

    path: Path
    options: FileOptions
    step: str
    body: str


@dataclass(frozen=True, slots=True)
class PointResult:
    """What planning at one point gave.

    Attributes:
        number: of the point in its grid.
        outcome: `invalid`: the scene is impossible; `crashed`, `hung`: the process that planned it.
        clearance: [m] least distance of the robot and what it carries from other bodies, in all planned motions; None
            where there are none.
        between: the two parts.
        manipulability: least singular value of the tool's Jacobian where the tool is led, see `plan_point`.
        code, step, reason, cause: of the refusal; `reason` has no numbers.
    """

    number: int
    outcome: Outcome
    clearance: float | None = None
    between: str = ""
    manipulability: float | None = None
    code: str = ""
    step: str = ""
    reason: str = ""
    cause: str = ""

    @property
    def planned(self) -> bool:
        return self.outcome == "planned"
