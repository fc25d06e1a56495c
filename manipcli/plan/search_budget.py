"""Budgets of the search over the steps of a task: how much work a refusal may take, and its diagnosis.

A search has one budget for each step further: the work since it first reached the step that it has not planned yet,
with all that it plans again before it. So n steps take at most n budgets, and a refusal comes one budget after the last
step that was reached. A unit of work is about 0.035 ms on a quiet machine (`core.work`).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Final

from manipcli.core.work import Work

STEP: Final = 125_000
"""Units of a search for each step further: about 4 s."""
DIAGNOSIS: Final = 30_000
"""Units of the diagnosis of a refusal: the reasons of its candidates, and the change that would help."""
DEEPER: Final = 15
"""How many times as much both are where a deeper search is asked for."""
LONGER: Final = "`manipcli plan TASK --why` searches longer; `plan: {effort: 4}` in the task does so for every command"
"""The hint for a search that ended at its budget."""


class SearchBudget:
    """The budgets of one search.

    Attributes:
        work: what is counted.
        deeper: whether the budgets are `DEEPER` times as large.
        used: the largest share of a step's budget, without `deeper`, that a step needed so far.

    Args:
        work: of the planner.
        deeper: see above.
        effort: how many times as large the budget of a step is.
    """

    def __init__(self, work: Work, *, deeper: bool = False, effort: float = 1.0) -> None:
        self.work = work
        self.deeper = deeper
        self.used = 0.0
        self._step = effort * STEP
        self._most = DEEPER if deeper else 1
        self._began = work.spent

    def renew(self) -> None:
        """The search reached a step further: its budget begins here."""
        self._began = self.work.spent

    @contextmanager
    def searching(self) -> Iterator[None]:
        """Inside, work beyond what is left of the step's budget raises `WorkSpent`."""
        with self.work.within(self._began + self._most * self._step - self.work.spent):
            yield
        self.used = max(self.used, (self.work.spent - self._began) / self._step)

    def diagnosing(self) -> AbstractContextManager[None]:
        """Inside, work beyond the budget of a diagnosis raises `WorkSpent`."""
        return self.work.within(self._most * DIAGNOSIS)
