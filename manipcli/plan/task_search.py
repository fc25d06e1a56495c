"""Search over the candidates of all steps: depth first, with backjumping to the step that caused a failure.

Each step starts at the predicted end of the one before. Where no candidate of a step has a plan, the search goes back
to the latest step that decided what the failure depends on: the grasp of the carried object, the place of a body that
is in the way, or the configuration in which the arm arrived. That step takes its next candidate, and all later steps
are planned again. A step without further candidates passes the failure on, with what it depends on itself
(conflict-directed backjumping; Prosser, Computational Intelligence 9, 1993).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array
from manipcli.core.work import Work, WorkSpent
from manipcli.plan.candidates import SPENT, Attempts, Candidates, Chosen, Dropped
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.search_budget import LONGER, SearchBudget

EXHAUSTED: Final = "all candidates were tried: a longer search tries no others"
"""The hint, where a deeper search was asked for, of a search that ended before its budget."""
MOST: Final = 7
"""Maximum number of plans of one step before its failure is passed on."""

Opens = Callable[[int, PlanningState], Candidates]
"""The candidates of step k from a state; raises NotPlannable."""
Explain = Callable[[NotPlannable, Sequence[tuple[int, Dropped]]], NotPlannable]
"""The refusal of a task, and all refused candidates with the index of their step, to the refusal that is reported."""


@dataclass(slots=True)
class Node:
    """A step of the search.

    Attributes:
        start: the state before it.
        attempts: its candidates.
        chosen: the one that is taken; None before the first.
        taken: number of plans so far.
        conflicts: earlier steps on which the failures of later steps depend, too.
        left: candidates with a plan, after which a later step has none.
    """

    start: PlanningState
    attempts: Attempts
    chosen: Chosen | None = None
    taken: int = 0
    conflicts: set[int] = field(default_factory=set)
    left: list[Dropped] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Solved:
    """The plan of one step.

    Attributes:
        chosen: its candidate.
        grasps: excluded tool orientations R_WT (3, 3) and places (2,), after which a later step has no plan.
        dropped: the refused candidates, and those after which a later step has no plan.
    """

    chosen: Chosen
    grasps: tuple[Array, ...]
    dropped: tuple[Dropped, ...] = ()


def search_task(
    opens: Opens,
    count: int,
    start: PlanningState,
    *,
    on_step: Callable[[int, bool], None] = lambda *_: None,
    on_candidate: Callable[[int], None] = lambda _: None,
    budget: SearchBudget | None = None,
    optimise: int = 0,
    cost: Callable[[StepPlan], float] = lambda plan: plan.duration,
    explain: Explain = lambda refusal, _: refusal,
) -> tuple[Solved, ...]:
    """The first plan of all `count` steps, or the cheapest of it and `optimise` further ones.

    Args:
        opens: gives the candidates of each step.
        count: number of steps.
        start: the state before the first.
        on_step: called before a step is planned, with its index and whether it takes another candidate.
        on_candidate: called with the number of each candidate of that step, from 1.
        budget: of the work; each further candidate that is compared has the budget of a step.
        optimise: number of further candidates to compare.
        cost: of the plan of a step.
        explain: adds to the refusal what all refused candidates tell.

    Raises:
        NotPlannable: there is none; the refusal of the latest step that was reached.
    """
    budget = SearchBudget(Work()) if budget is None else budget
    nodes = _search(opens, count, start, on_step, budget, explain, on_candidate=on_candidate)
    if optimise:
        nodes = _cheapest(opens, nodes, on_step, budget, optimise, cost)
    with budget.diagnosing():
        return tuple(
            Solved(node.chosen, tuple(node.attempts.excluded), (*node.attempts.dropped, *node.left))
            for node in nodes
            if node.chosen is not None
        )


def _search(
    opens: Opens,
    count: int,
    start: PlanningState,
    on_step: Callable[[int, bool], None],
    budget: SearchBudget,
    explain: Explain = lambda refusal, _: refusal,
    prefer: Sequence[int] = (),
    on_candidate: Callable[[int], None] = lambda _: None,
) -> list[Node]:
    """The first plan of all `count` steps; raises NotPlannable. `prefer`: index of the first candidate, by step."""
    done: list[Node] = []
    opened: list[tuple[int, Attempts]] = []
    latest = -1, NotPlannable("there is no step")
    grasps: dict[int, int] = {}
    resumed: Node | None = None
    reached = -1
    while (k := len(done)) < count:
        state = _end(done[-1]) if done else start
        if k > reached:
            reached = k
            budget.renew()
        on_step(k, resumed is not None)
        node = resumed
        try:
            with budget.searching():
                if node is None:
                    first = prefer[k] if prefer else 0
                    node = Node(state, Attempts(opens(k, state), prefer=first, on_candidate=on_candidate))
                    opened.append((k, node.attempts))
                node.chosen = node.attempts.take()
        except WorkSpent:
            refusal = None if latest[0] < reached else _counted(latest[1], max(grasps.values(), default=0))
            raise _refused(_ended(refusal, node, budget), opened, explain, budget) from None
        except NotPlannable as refusal:
            if refusal.loc:
                raise  # a value of the step, which no earlier step changes
            conflicts = _causes(done, state, refusal) | (set() if node is None else node.conflicts)
            if k > latest[0]:
                latest = k, refusal
                grasps = {j: 0 for j in conflicts if done[j].attempts.decides == "grasp"}
            grasps |= {j: done[j].taken for j in grasps if j < len(done)}
            resumed = _back(done, conflicts, refusal)
            if resumed is None:
                counted = _counted(latest[1], max(grasps.values(), default=0))
                found = _refused(counted, opened, explain, budget)
                raise (_exhausted(found) if budget.deeper else found) from refusal
        else:
            node.taken += 1
            done.append(node)
            resumed = None
    return done


def _ended(refusal: NotPlannable | None, node: Node | None, budget: SearchBudget) -> NotPlannable:
    """The refusal of a search that ended at its budget: that of the latest step, or of its candidates so far."""
    if refusal is not None:
        found = refusal.but(cause=f"{refusal.cause}; {SPENT}")
    elif node is not None:
        with budget.diagnosing():
            found = node.attempts.refusal(cut=True)
    else:
        found = NotPlannable(SPENT)
    return found if budget.deeper else found.but(hint="; ".join(filter(None, (found.hint, LONGER))))


def _exhausted(refusal: NotPlannable) -> NotPlannable:
    """The refusal of a deeper search that ended before its budget: a longer one is of no use."""
    return refusal.but(hint="; ".join(filter(None, (refusal.hint, EXHAUSTED))))


def _refused(
    refusal: NotPlannable, opened: Sequence[tuple[int, Attempts]], explain: Explain, budget: SearchBudget
) -> NotPlannable:
    """The refusal of the task, with all refused candidates."""
    with budget.diagnosing():
        return explain(refusal, tuple((j, one) for j, attempts in opened for one in attempts.dropped))


def _cheapest(
    opens: Opens,
    nodes: list[Node],
    on_step: Callable[[int, bool], None],
    budget: SearchBudget,
    most: int,
    cost: Callable[[StepPlan], float],
) -> list[Node]:
    """The cheapest of a plan and of `most` further ones.

    Each takes the next candidate of one step, in turn from the last to the first, and plans the later steps again, with
    the candidates of the present plan first. A cheaper plan replaces the present one at once: its later steps then have
    candidates of their own.
    """

    def total(plan: Sequence[Node]) -> float:
        return sum(cost(node.chosen.plan) for node in plan if node.chosen is not None)

    spent = [total([node]) for node in nodes]
    left = set(range(len(nodes)))
    looked, k = 0, len(nodes)
    while looked < most and left:
        k = max((j for j in left if j < k), default=max(left))
        node = nodes[k]
        on_step(k, True)
        budget.renew()
        try:
            with budget.searching():
                chosen = node.attempts.take()
        except (NotPlannable, WorkSpent):
            left.discard(k)
            continue
        looked += 1
        other = Node(node.start, node.attempts, chosen)
        after = k + 1

        def later(j: int, state: PlanningState, first: int = after) -> Candidates:
            return opens(first + j, state)

        def on_later(j: int, again: bool, first: int = after) -> None:
            on_step(first + j, again)

        try:
            same = [each.chosen.index for each in nodes[after:] if each.chosen is not None]
            with budget.searching():
                rest = _search(later, len(nodes) - after, chosen.plan.end, on_later, budget, prefer=same)
            tail = [other, *rest]
        except NotPlannable:
            continue
        costs = [total([each]) for each in tail]
        if sum(costs) < sum(spent[k:]) - 1e-9:
            nodes = [*nodes[:k], *tail]
            spent[k:] = costs
            left |= set(range(after, len(nodes)))
    return nodes


def _counted(refusal: NotPlannable, grasps: int) -> NotPlannable:
    if grasps < 2:
        return refusal
    return refusal.but(cause=f"{refusal.cause}; {grasps} grasps of the object were tried")


def _causes(done: Sequence[Node], state: PlanningState, refusal: NotPlannable) -> set[int]:
    """The planned steps that decided what a refusal in this state depends on."""
    return {k for k, node in enumerate(done) if _decided(node, done[k:], state, refusal)}


def _decided(node: Node, since: Sequence[Node], state: PlanningState, refusal: NotPlannable) -> bool:
    """Whether the step of `node` decided what a refusal depends on; `since`: it and all later steps."""
    decides = node.attempts.decides
    if decides == "grasp":
        return state.carried is not None and all(_end(later).carried is not None for later in since)
    if decides == "place":
        return bool(refusal.parts & _set_down(node))
    return decides == "branch" and len(since) == 1 and refusal.reason in ("line", "in_the_way")


def _set_down(node: Node) -> frozenset[str]:
    """The body that a step sets down."""
    carried = node.start.carried
    return frozenset() if carried is None or _end(node).carried is not None else frozenset({carried.body})


def _back(done: list[Node], conflicts: set[int], refusal: NotPlannable) -> Node | None:
    """The latest step among `conflicts` with plans left, which is taken from `done` with all later ones; None if there
    is none."""
    while conflicts:
        k = max(conflicts)
        conflicts.remove(k)
        node = done[k]
        del done[k:]
        conflicts |= node.conflicts
        if node.taken < MOST:
            node.conflicts = set(conflicts)
            if node.chosen is not None:
                node.left.append(Dropped(node.chosen.candidate.name, refusal, node.chosen.plan))
            choice = None if node.chosen is None else node.chosen.candidate.choice
            if choice is not None:
                node.attempts.excluded.append(choice)
            return node
    return None


def _end(node: Node) -> PlanningState:
    assert node.chosen is not None  # only steps with a plan are done
    return node.chosen.plan.end
