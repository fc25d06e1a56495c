"""Budgets count work: the same count twice, a bounded count for what is refused, and the diagnosis that it allows."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable
from manipcli.core.work import Work, WorkSpent
from manipcli.plan import search_budget
from manipcli.plan.candidates import SPENT, Candidate, Candidates
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.path_search import NARROWEST
from manipcli.plan.search_budget import DEEPER, DIAGNOSIS, LONGER, STEP, SearchBudget
from manipcli.plan.search_progress import SearchProgress
from manipcli.plan.task_search import search_task
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import plan_task

ROOT = Path(__file__).parents[2]
START = PlanningState(position=np.zeros(1), bodies=())
LARGEST = 1_000
"""No single piece of work is larger; it may be counted beyond a budget."""


def test_work_ends_at_the_smallest_budget_around_it() -> None:
    work = Work()
    with work.within(100), work.within(10):
        work.add(10)
        with pytest.raises(WorkSpent):
            work.add(1)
        with work.beyond(5):
            work.add(5)
            with pytest.raises(WorkSpent):
                work.add(1)
    work.add(10**9)  # no budget is left around it


def fails(work: Work, units: int) -> Callable[[], StepPlan]:
    def plan() -> StepPlan:
        work.add(units)
        raise NotPlannable("the wall is in the way")

    return plan


def test_a_search_ends_one_budget_after_the_last_step_that_was_reached() -> None:
    """The 41st candidate of each step has a plan; none of the last step has, whose candidates do not end."""
    work = Work()
    units, steps = STEP // 100, 4
    reached: dict[int, int] = {}

    def opens(k: int, state: PlanningState) -> Candidates:
        def options() -> Iterator[Candidate]:
            for n in range(50):
                done = k < steps - 1 and n == 40
                yield Candidate((lambda: StepPlan((), state)) if done else fails(work, units))
            while True:
                yield Candidate(fails(work, units))

        return Candidates(options(), what=f"cannot do step {k}", decides="grasp")

    def on_step(k: int, again: bool) -> None:
        reached.setdefault(k, work.spent)

    budget = SearchBudget(work)
    with pytest.raises(NotPlannable) as refused:
        search_task(opens, steps, START, on_step=on_step, budget=budget)
    assert max(reached) == steps - 1
    assert work.spent - reached[steps - 1] <= STEP + DIAGNOSIS + units
    assert work.spent <= steps * STEP + DIAGNOSIS + units
    assert refused.value.cause.startswith(f"cannot do step {steps - 1}, the first 100 candidates failed: the wall")
    assert refused.value.cause.endswith(SPENT)
    assert refused.value.hint == LONGER
    assert 0.4 <= budget.used <= 1.0 + units / STEP


def test_deeper_and_effort_make_the_budget_larger_by_their_factor() -> None:
    def spent(**options: float) -> int:
        work = Work()
        budget = SearchBudget(work, deeper=bool(options.get("deeper")), effort=options.get("effort", 1.0))
        with pytest.raises(WorkSpent), budget.searching():
            while True:
                work.add(1)
        return work.spent - 1

    assert spent() == STEP
    assert spent(effort=2.5) == 2.5 * STEP
    assert spent(deeper=1.0) == DEEPER * STEP


TASK = f"""task: t
robot: {ROOT}/robots/panda/robot.yaml
controllers: {ROOT}/controllers/panda.yaml
scene:
  table: {{box: {{size: [0.6, 0.8, 0.2]}}, pose: {{xyz: [0.55, 0, 0.1]}}, fixed: true}}
  block: {{box: {{size: [4 cm, 4 cm, 10 cm]}}, mass: 80 g, rests_on: table, at: [0.5, -0.15]}}
  roof: {{box: {{size: [0.3, 0.3, 2 cm]}}, pose: {{xyz: [0.5, 0.25, 0.325]}}, fixed: true}}
steps:
  - pick: {{object: block}}
  - lift: {{object: block}}
  - place: {{object: block, at: [0.5, 0.25], onto: table}}
"""


def refused(folder: Path, monkeypatch: pytest.MonkeyPatch, step: int) -> tuple[NotPlannable, int, list[str]]:
    """The refusal of a place under a roof with this budget of a step, all units, and the lines of progress."""
    monkeypatch.setattr(search_budget, "STEP", step)
    monkeypatch.setattr(search_budget, "DIAGNOSIS", step // 2)
    file = folder / "task.yaml"
    file.write_text(TASK)
    works: list[Work] = []
    made = SearchBudget.__init__

    def kept(self: SearchBudget, work: Work, *, deeper: bool = False, effort: float = 1.0) -> None:
        works.append(work)
        made(self, work, deeper=deeper, effort=effort)

    monkeypatch.setattr(SearchBudget, "__init__", kept)
    lines: list[str] = []
    with pytest.raises(NotPlannable) as refusal:
        plan_task(load_task(file, allow_outside=True), on_progress=lines.append)
    return refusal.value, works[0].spent, lines


def test_a_refused_task_counts_the_same_twice_and_no_more_than_its_bound(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    step = 12_000
    (first, units, lines), (again, same, _) = (refused(tmp_path, monkeypatch, step) for _ in range(2))
    assert (units, first.cause, first.hint) == (same, again.cause, again.hint)
    assert units <= 5 * step + NARROWEST + LARGEST
    assert first.step == "place_1" and SPENT in first.cause and "roof" in first.cause
    assert first.place is not None and first.place.line == TASK[: TASK.index("- place")].count("\n") + 1
    assert first.hint is not None and LONGER in first.hint
    assert lines[0] == "planning step 1 of 3, 'pick_1'"
    assert any(line.startswith("planning step 3 of 3, 'place_1': candidate ") for line in lines)


def test_progress_names_step_candidate_and_what_is_done() -> None:
    lines: list[str] = []
    progress = SearchProgress(lines.append, ["a", "b"])
    progress.step(1, again=False)
    progress.candidate(1)
    progress.doing("path search")
    progress.candidate(2)
    progress.step(0, again=True)
    assert lines == [
        "planning step 2 of 2, 'b'",
        "planning step 2 of 2, 'b': candidate 1, path search",
        "planning step 2 of 2, 'b': candidate 2",
        "planning step 1 of 2, 'a': another candidate",
    ]
