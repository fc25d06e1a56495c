"""Branches of a task: which are planned, what they share, and in which order they are tried."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import frozen
from manipcli.plan.block_tree import MOST, Item, Outcomes, Unit, block_tree, choices, named, steps_of, stretch
from manipcli.plan.branches import Solved, plan_branches
from manipcli.plan.motion import PlanningState
from manipcli.spec.block import BlockSpec

START = PlanningState(frozen([0.0]), ())


def block(kind: str, first: int, last: int, *, split: int = -1, parent: int | None = None) -> BlockSpec:
    return BlockSpec(
        id=f"{kind}_{first}",
        kind=kind,
        word=kind,
        first=first,
        last=last,
        split=split,
        parent=parent,  # type: ignore[arg-type]
    )


def row_of_choices(count: int) -> tuple[Item, ...]:
    """`count` choices one after the other, each with a step in both branches, then one step."""
    return block_tree(2 * count + 1, [block("if", 2 * k, 2 * k + 2, split=2 * k + 1) for k in range(count)])


def walked(blocks: Sequence[BlockSpec], count: int, outcomes: Sequence[bool]) -> list[int]:
    """The steps that are done with these outcomes, by stepping through the flat list."""
    done, left = [], [*outcomes]
    k, asked = 0, set[int]()
    while k < count:
        ahead = [n for n, one in enumerate(blocks) if one.kind == "if" and one.first == k and n not in asked]
        if ahead:
            asked.add(ahead[0])
            if not left.pop(0):
                k = blocks[ahead[0]].split
        else:
            done.append(k)
            k += 1
        while ends := [one for one in blocks if one.kind == "if" and one.split == k and blocks.index(one) in asked
                       and done and one.first <= done[-1] < one.split]:  # fmt: skip
            k = ends[0].last
    return done


def test_every_path_has_the_steps_that_a_walk_through_the_flat_list_finds() -> None:
    """A choice in a sequence, with another one in its `then` that ends with it, and one behind."""
    blocks = [
        block("sequence", 1, 7),
        block("if", 1, 6, split=5, parent=0),
        block("if", 3, 5, split=4, parent=1),
        block("if", 7, 9, split=8),
    ]
    items = block_tree(10, blocks)
    assert steps_of(items) == tuple(range(10))
    for outcomes in product((True, False), repeat=3):
        keys: list[Outcomes] = [()]
        while stretch(items, keys[-1]).asked is not None:
            keys.append((*keys[-1], outcomes[len(keys) - 1]))
        found = [k for key in keys for unit in stretch(items, key).units for k in unit]
        assert found == walked(blocks, 10, outcomes)


def test_two_steps_of_a_parallel_are_one_unit() -> None:
    items = block_tree(4, [block("parallel", 1, 3)])
    assert stretch(items, ()).units == ((0,), (1, 2), (3,))


@pytest.mark.parametrize("count", range(6))
def test_at_most_eight_combinations_are_planned(count: int) -> None:
    found = choices(row_of_choices(count))
    assert MOST == 8
    assert (found.beyond is None) == (2**count <= 8)
    assert len(found.followed) == 2 ** min(count, 3) - 1
    if found.beyond is not None:
        assert found.beyond.spec.id == "if_6"


def solver(calls: list[tuple[Outcomes, tuple[Unit, ...]]], refused: Sequence[tuple[Outcomes, float]]) -> object:
    """Plans that count steps: the state is that before plus the step's number; the first call of a path doubles it.

    `refused`: a stretch has no plan if it ends with these outcomes, and its path begins at that state.
    """

    def solve(units: Sequence[Unit], start: PlanningState, outcomes: Outcomes) -> Solved[tuple[int, float]]:
        calls.append((outcomes, tuple(units)))
        if any(outcomes == one and float(start.position[0]) == at for one, at in refused):
            raise NotPlannable("there is no plan")
        state, steps, ends = float(start.position[0]), [], []
        for (k,) in units:
            state += 1.0 + k + 0.1 * (outcomes[:1] == (False,) and start is START)
            steps.append(((k, state),))
            ends.append(PlanningState(frozen([state]), ()))
        return Solved(tuple(steps), tuple(ends))

    return solve


def test_all_branches_share_the_plan_of_their_beginning_and_each_stretch_is_planned_once() -> None:
    items = block_tree(8, [block("if", 1, 3, split=2), block("if", 4, 6, split=5)])
    calls: list[tuple[Outcomes, tuple[Unit, ...]]] = []
    plans = plan_branches(items, START, solver(calls, []))  # type: ignore[arg-type]
    assert set(plans) == {key for k in range(3) for key in product((True, False), repeat=k)}
    assert calls[0] == ((True, True), ((0,), (1,), (3,), (4,), (6,), (7,)))
    assert sum(len(units) for _, units in calls) == sum(len(steps) for steps in plans.values())
    for key, steps in plans.items():
        before = plans[key[:-1]][-1][1] if key else 0.0
        assert steps[0][1] == pytest.approx(before + 1 + steps[0][0])


def test_a_branch_without_a_plan_from_the_common_beginning_is_planned_first() -> None:
    """`else` has no plan from where `then` arrives at the choice (1), but from where its own plan does (1.1)."""
    items = block_tree(4, [block("if", 1, 3, split=2)])
    calls: list[tuple[Outcomes, tuple[Unit, ...]]] = []
    plans = plan_branches(items, START, solver(calls, [((False,), 1.0)]))  # type: ignore[arg-type]
    assert [outcomes for outcomes, _ in calls] == [(True,), (False,), (False,), (True,)]
    assert plans[()][-1][1] == pytest.approx(1.1)
    assert np.allclose([plans[True,][0][1], plans[False,][0][1]], [3.1, 1.1 + 3.1])


def test_the_refusal_names_the_branch() -> None:
    items = block_tree(4, [block("if", 1, 3, split=2)])
    solve = solver([], [((False,), 1.0), ((False,), 0.0)])
    with pytest.raises(NotPlannable, match=r"there is no plan \(in the branch if_1: else\)"):
        plan_branches(items, START, solve)  # type: ignore[arg-type]
    assert named(row_of_choices(2), (False, True)) == "if_0: else, if_2: then"
