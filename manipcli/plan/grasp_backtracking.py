"""Backtracking over grasps: another grasp is tried when a later step cannot be planned with the present one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Planner
from manipcli.plan.steps import STEPS

MOST: Final = 7
"""Maximum number of grasps of an object before a task is refused."""


class GraspBacktracking:
    """Grasps with which a later step cannot be planned, by the index of the grasping step: R_WT (3, 3) of the tool."""

    def __init__(self, planner: Planner) -> None:
        self._planner = planner
        self._grasps: dict[int, tuple[Array, ...]] = {}
        self._latest: tuple[int, NotPlannable] | None = None

    def of(self, step: int) -> tuple[Array, ...]:
        """The grasps that a step must not use."""
        return self._grasps.get(step, ())

    def back(self, refusal: NotPlannable, done: Sequence[tuple[str, PlanningState]]) -> int:
        """Index of the step from which to re-plan, when the step after the planned ones is refused.

        Args:
            refusal: of that step.
            done: verb and predicted end of each planned step.

        Raises:
            NotPlannable: no grasp is left to try: the refusal of the latest step in the task. Or the cause is a value
                of the step, which no other grasp changes.
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
        if taken < step and STEPS[done[taken][0]].alternative is not None:
            tried = self._grasps[taken] = (*tried, self._planner.tool_pose(done[taken][1]).R)
            if len(tried) < MOST:
                return taken
        raise _counted(self._latest[1], len(tried))


def _counted(refusal: NotPlannable, tried: int) -> NotPlannable:
    if tried < 2:
        return refusal
    cause = f"{refusal.cause}; {tried} grasps of the object were tried"
    return NotPlannable(cause, step=refusal.step, hint=refusal.hint, place=refusal.place)
