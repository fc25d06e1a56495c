"""How margins combine: the robust semantics of signal temporal logic, against every tick computed one by one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manipcli.conditions.robustness import (
    EDGE,
    Extreme,
    Measured,
    NotEvaluated,
    Robustness,
    greatest,
    least,
    named,
    never,
    opposite,
    robustness,
)  # fmt: skip

T = 5
TIMES = np.arange(T) * 0.1
UNITS = {"m": 0.02, "rad": 0.1, "N": 5.0}
"""With the tolerance of every margin in them."""


@dataclass(frozen=True)
class Leaf:
    """One condition: its name, its unit, its margins, and where it applies."""

    name: str
    unit: str
    margins: tuple[float, ...]
    applies: tuple[bool, ...]


@dataclass(frozen=True)
class Node:
    """`all`, `any` or `not` of others."""

    word: str
    members: tuple[Node | Leaf, ...]


values = st.floats(-1.0, 1.0, allow_subnormal=False).map(lambda x: round(x, 3))
leaves = st.builds(
    Leaf,
    st.sampled_from("abcd"),
    st.sampled_from(sorted(UNITS)),
    st.tuples(*[values] * T),
    st.tuples(*[st.sampled_from([True, True, True, False])] * T),
)
formulas = st.recursive(
    leaves,
    lambda inner: st.one_of(
        st.builds(Node, st.just("not"), st.tuples(inner)),
        st.builds(Node, st.sampled_from(["all", "any"]), st.lists(inner, min_size=1, max_size=3).map(tuple)),
    ),
    max_leaves=8,
)


def of(formula: Node | Leaf) -> Robustness:
    """As the program combines it."""
    if isinstance(formula, Leaf):
        own = robustness(
            np.array(formula.margins),
            TIMES,
            unit=formula.unit,
            scale=UNITS[formula.unit],
            describe=lambda k: f"{formula.margins[k]:g} {formula.unit}",
            applies=np.array(formula.applies),
            idle=f"{formula.name} rests",
        )
        return named(own, formula.name)
    members = [of(one) for one in formula.members]
    if formula.word == "not":
        return opposite(members[0], word="not ")
    return least(members) if formula.word == "all" else greatest(members)


def units_of(formula: Node | Leaf) -> set[str]:
    if isinstance(formula, Leaf):
        return {formula.unit}
    return set().union(*(units_of(one) for one in formula.members))


def by_hand(formula: Node | Leaf, k: int) -> tuple[float, str, bool]:
    """Margin and unit at tick `k`, and whether it applies there; each node orders its members by the rule."""
    if isinstance(formula, Leaf):
        return formula.margins[k], formula.unit, formula.applies[k]
    members = [by_hand(one, k) for one in formula.members]
    applies = all(one[2] for one in members)
    if formula.word == "not":
        return -members[0][0] or -EDGE, members[0][1], applies  # no other is as small
    mixed = len(units_of(formula)) > 1
    pick = min if formula.word == "all" else max
    margin, unit, _ = pick(members, key=lambda one: order(one[0], one[1], mixed))
    return margin, unit, applies


def order(margin: float, unit: str, mixed: bool) -> float:
    """By which margins compare."""
    return margin / UNITS[unit] if mixed and abs(margin) > EDGE else margin


def holds(formula: Node | Leaf, k: int) -> bool:
    """Plain logic, in which a margin of zero is met."""
    if isinstance(formula, Leaf):
        return formula.margins[k] >= 0.0
    members = [holds(one, k) for one in formula.members]
    if formula.word == "not":
        return not members[0]
    return any(members) if formula.word == "any" else all(members)


@pytest.mark.slow
@given(formulas)
@settings(max_examples=150, deadline=None)
def test_every_tick_is_that_of_its_deciding_member(formula: Node | Leaf) -> None:
    found = of(formula)
    assert set(found.units) == units_of(formula)
    for k in range(T):
        margin, unit, applies = by_hand(formula, k)
        told = found.found(k)
        assert (found.margins[k], bool(found.applies[k])) == (margin, applies)
        assert (told.margin, told.unit, told.at) == (margin, unit, TIMES[k])
        assert told.text.endswith(f"{told.unit}")
        assert holds(formula, k) == (margin >= 0.0)


@pytest.mark.slow
@given(formulas, st.sampled_from(["least", "greatest"]), st.sets(st.integers(1, T - 1)))
@settings(max_examples=150, deadline=None)
def test_over_time_it_is_the_extreme_of_what_applies_wherever_it_is_cut(
    formula: Node | Leaf, pick: str, cuts: set[int]
) -> None:
    found = of(formula)
    ticks = [(*by_hand(formula, k), k) for k in range(T)]
    mixed = len(units_of(formula)) > 1
    ranks = [(order(one[0], one[1], mixed), one[3]) for one in ticks if one[2]]
    pieces, whole = Extreme(pick), Extreme(pick)  # type: ignore[arg-type]
    whole.add(found, TIMES)
    for first, last in pairwise(sorted({0, T, *cuts})):
        pieces.add(found, TIMES, first, last)
    assert pieces.found == whole.found
    failing = [k for value, k in ranks if value < 0.0]
    assert (whole.broken, pieces.broken) == 2 * (TIMES[failing[0]] if failing else None,)
    assert pieces.broken_ticks == whole.broken_ticks == len(failing)
    if not ranks:
        assert isinstance(whole.found, NotEvaluated)
        assert whole.found.reason.endswith("rests")
        return
    value = (min if pick == "least" else max)(one[0] for one in ranks)
    first = next(k for one, k in ranks if one == value)
    assert isinstance(whole.found, Measured)
    assert (whole.found.margin, whole.found.at) == (ticks[first][0], TIMES[first])


def test_of_a_condition_without_room_and_its_not_exactly_one_is_met() -> None:
    untouched = robustness(np.array([0.0]), TIMES[:1], unit="N", scale=1.0, describe=lambda k: "never touched")
    against = opposite(untouched)
    for one, met in ((untouched, True), (against, False), (never(untouched), False), (opposite(against), True)):
        assert (one.order >= 0.0).tolist() == [met]
        assert (one.relative >= 0.0).tolist() == [met]
        assert (one.found(0).margin >= 0.0) is met
        assert one.found(0).margin == one.margins[0] == pytest.approx(0.0, abs=EDGE)


@given(st.lists(st.floats(-3 * EDGE, 3 * EDGE), min_size=2, max_size=4))
def test_also_beside_the_edge_not_of_all_is_any_of_nots(margins: list[float]) -> None:
    members = [robustness(np.array([one]), TIMES[:1], unit="N", scale=1.0, describe=str) for one in margins]
    every, against = opposite(least(members)), greatest([opposite(one) for one in members])
    assert every.margins.tolist() == against.margins.tolist() == [every.found(0).margin]
    assert (every.margins[0] >= 0.0) == (min(margins) < 0.0)
    assert abs(every.margins[0]) >= (EDGE if min(margins) >= 0.0 else 0.0)


def test_signs_come_before_sizes_where_units_differ() -> None:
    tilt = robustness(np.array([0.5, -0.001]), TIMES[:2], unit="rad", scale=0.1, describe=lambda k: "tilt")
    near = robustness(np.array([0.01, 0.019]), TIMES[:2], unit="m", scale=0.02, describe=lambda k: "near")
    both = least([tilt, near])
    assert [both.found(k).unit for k in (0, 1)] == ["m", "rad"]
    assert both.relative == pytest.approx([0.5, -0.01])
    extreme = Extreme("least")
    extreme.add(both, TIMES[:2])
    assert extreme.found == Measured(-0.001, "rad", 0.1, "tilt", relative=-0.01)


def test_never_is_told_as_it_was_asked_and_never_not_as_always() -> None:
    def of(text: str) -> Robustness:
        return robustness(np.array([1.0]), np.array([0.0]), unit="m", scale=1.0, describe=lambda k: text)

    assert (
        never(of("'cup' moved by 38 mm; at least 60 mm")).found(0).text == "'cup' moved by 38 mm; never at least 60 mm"
    )
    told = never(opposite(named(of("'hand' moves; below 1 mm/s"), "tool_speed"))).found(0)
    assert (told.text, told.margin) == ("tool_speed: 'hand' moves; below 1 mm/s", 1.0)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_what_is_not_a_number_is_never_lost(bad: float) -> None:
    broken = robustness(np.array([1.0, bad, 1.0]), TIMES[:3], unit="m", scale=1.0, describe=lambda k: "broken")
    fine = robustness(np.full(3, -0.5), TIMES[:3], unit="m", scale=1.0, describe=lambda k: "fine")
    for pick in ("least", "greatest"):
        extreme = Extreme(pick)  # type: ignore[arg-type]
        extreme.add(broken, TIMES[:3], 2)
        extreme.add(broken, TIMES[:3], 0, 2)
        assert extreme.found == NotEvaluated("the recorded state is not finite at t = 0.100 s", "m")
    if math.isnan(bad):
        for combined in (least([fine, broken]), greatest([fine, broken]), opposite(broken)):
            extreme = Extreme("least")
            extreme.add(combined, TIMES[:3])
            assert isinstance(extreme.found, NotEvaluated)


def test_nothing_looked_at_is_nothing_found() -> None:
    extreme = Extreme("least")
    assert extreme.found is None
    extreme.add(robustness(np.ones(2), TIMES[:2], unit="m", scale=1.0, describe=str), TIMES[:2], 1, 1)
    assert extreme.found is None
