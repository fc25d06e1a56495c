"""The search for a grasp with which all can be done: what cannot be placed as it is held may be held otherwise."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Planner
from manipcli.plan.steps import STEPS

MOST: Final = 7
"""Grasps of an object that are tried before a task is refused."""


class GraspBacktracking:
    """Which grasps lead nowhere, by the step that takes the object: R_WT (3, 3) of the tool."""

    def __init__(self, planner: Planner) -> None:
        self._planner = planner
        self._grasps: dict[int, tuple[Array, ...]] = {}
        self._latest: tuple[int, NotPlannable] | None = None

    def of(self, step: int) -> tuple[Array, ...]:
        """Those that a step is not to use."""
        return self._grasps.get(step, ())

    def back(self, refusal: NotPlannable, done: Sequence[tuple[str, PlanningState]]) -> int:
        """From which step on to plan again, where the one after those that are planned is refused.

        Args:
            refusal: its own.
            done: of each of the others its verb and its predicted end.

        Raises:
            NotPlannable: no grasp is left to try; of the refusals the one that came latest in the task. Or a value of
                the step is the cause, with which no grasp helps.
        """
        if refusal.loc:
            raise refusal
        step = len(done)
        if self._latest is None or step > self._latest[0]:
            self._latest = step, refusal
        taken = step
        while taken and done[taken - 1][1].carried is not None:
            taken -= 1
        tried = self.of(taken)
        if taken < step and STEPS[done[taken][0]].regrasp is not None:
            tried = self._grasps[taken] = (*tried, self._planner.tool_pose(done[taken][1]).R)
            if len(tried) < MOST:
                return taken
        raise _of_all(self._latest[1], len(tried))


def _of_all(refusal: NotPlannable, tried: int) -> NotPlannable:
    """The refusal, telling how many grasps were `tried`."""
    if tried < 2:
        return refusal
    cause = f"{refusal.cause}; {tried} grasps were tried"
    return NotPlannable(cause, step=refusal.step, hint=refusal.hint, place=refusal.place)
