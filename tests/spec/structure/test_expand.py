"""Structured steps: what they expand to, ids that are unique, places that stay, and a text that loads to the same."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manipcli.core.units import parse_quantity
from manipcli.spec.load import load_task_text
from manipcli.spec.located import Located
from manipcli.spec.resolved import inline, resolved
from manipcli.spec.retry import expressions, retried
from manipcli.spec.source.tree import Plain
from manipcli.spec.task import TaskSpec
from manipcli.task.vocabulary import task_spec

HEAD = "task: t\nrobot: r.yaml\ncontrollers: c.yaml\n"


def loaded(text: str, *overrides: str) -> Located[TaskSpec]:
    return load_task_text(HEAD + text, "t.yaml", model=task_spec(), overrides=overrides)


def steps_of(items: list[Plain], *, params: str = "{}") -> Located[TaskSpec]:
    return loaded(f"params: {params}\nsteps: {inline(items)}\n")


def ids(task: Located[TaskSpec]) -> list[str]:
    return [str(step.id) for step in task.spec.steps]


def reloaded(task: Located[TaskSpec]) -> Located[TaskSpec]:
    return load_task_text(resolved(task.spec, expressions(task)), "log", model=task_spec())


def test_a_repeat_is_the_list_that_one_would_write_by_hand() -> None:
    repeated = loaded(
        """
params: {up: 5 cm}
steps:
  - repeat:
      each: {block: [a, b], slot: [[0.1, 0.2], [0.3, 40 cm]]}
      steps:
        - pick: {object: $block}
        - lift: {object: $block, by: $up * ($index + 1)}
        - place: {object: $block, onto: desk, at: $slot}
"""
    )
    by_hand = loaded(
        """
steps:
  - pick: {object: a}
  - lift: {object: a, by: 5 cm}
  - place: {object: a, onto: desk, at: [0.1, 0.2]}
  - pick: {object: b}
  - lift: {object: b, by: 10 cm}
  - place: {object: b, onto: desk, at: [0.3, 0.4]}
"""
    )
    assert [step.body for step in repeated.spec.steps] == [step.body for step in by_hand.spec.steps]
    assert ids(repeated)[:4] == [
        f"repeat_1[{k}]/{verb}_1" for k, verb in ((0, "pick"), (0, "lift"), (0, "place"), (1, "pick"))
    ]


def test_ids_of_blocks_branches_and_neighbours() -> None:
    task = loaded(
        """
steps:
  - wait: 1 s
  - id: stack
    repeat:
      times: 2
      steps:
        - {id: own, wait: 1 s}
        - if: {equal: [$index, 0]}
          then: [{wait: 1 s}]
          else: [{wait: 2 s}]
  - if: {at_rest: {object: a}}
    then: [{wait: 1 s}, {sequence: [{wait: 1 s}]}]
    else: [{wait: 2 s}]
  - wait: 1 s
  - {id: wait_3, wait: 1 s}
  - wait: 1 s
"""
    )
    assert ids(task) == [
        "wait_1", "stack[0]/own", "stack[0]/if_1/wait_1", "stack[1]/own", "stack[1]/if_1/else/wait_1", "if_1/wait_1",
        "if_1/sequence_1/wait_1", "if_1/else/wait_1", "wait_2", "wait_3", "wait_4",
    ]  # fmt: skip
    block = next(block for block in task.spec.blocks if block.kind == "if")
    assert (block.first, block.split, block.last) == (5, 7, 8)


def test_values_keep_their_places_in_the_file() -> None:
    task = loaded("steps:\n  - repeat:\n      each: {x: [1 s, 2 s]}\n      steps:\n        - wait: $x\n")
    assert {(task.place("steps", k, "wait").line, task.place("steps", k, "wait").column) for k in (0, 1)} == {(8, 17)}
    finding = task.source.finding(230, ("steps", 1, "wait"), "wrong")
    assert finding.message == "steps[0].repeat.steps[0].wait: wrong"
    assert finding.hint == "the value comes from '$x'; it is given at t.yaml:6:23"


def test_an_override_reaches_all_rounds_or_one_step() -> None:
    text = "steps:\n  - repeat: {times: 2, steps: [{wait: 1 s}]}\n    id: again\n"
    everywhere = loaded(text, "steps.again.repeat.steps.wait_1.wait=3 s")
    assert [step.body.duration for step in everywhere.spec.steps] == [3.0, 3.0]  # type: ignore[attr-defined]
    one = loaded(text, "steps.again[1]/wait_1.wait=3 s", "steps.again.repeat.times=3")
    assert [step.body.duration for step in one.spec.steps] == [1.0, 3.0, 1.0]  # type: ignore[attr-defined]


def test_a_block_under_during_is_all_its_steps() -> None:
    task = loaded(
        "steps: [{sequence: [{wait: 1 s}, {wait: 1 s}], id: both}]\nexpect: [{at_rest: {object: a}, during: both}]\n"
    )
    assert task.spec.expect[0].steps == ("both/wait_1", "both/wait_2")


def test_a_block_under_at_is_its_last_step() -> None:
    text = "steps: [{sequence: [{wait: 1 s}, %s], id: both}]\nexpect: [{at_rest: {object: a}, at: both}]\n"
    assert loaded(text % "{wait: 1 s}").spec.expect[0].at == "both/wait_2"
    branch = "{if: {at_rest: {object: a}}, then: [{wait: 1 s}]}"
    assert loaded(text % branch).spec.expect[0].at == "both"  # refused with all names of steps


NAMES = ("a", "b", "wait_1", "wait_2", "sequence_1", "repeat_1", "repeat_2", "if_1", "stack")
STEP: st.SearchStrategy[Plain] = st.fixed_dictionaries({"wait": st.just(0)})


def block(inner: st.SearchStrategy[Plain]) -> st.SearchStrategy[Plain]:
    steps = st.lists(inner, min_size=1, max_size=3)
    dynamic: Plain = {"at_rest": {"object": "a"}}
    condition = st.sampled_from([True, False, {"equal": ["$n", 2]}, dynamic, {"not": dynamic}])
    return st.one_of(
        st.fixed_dictionaries({"sequence": steps}),
        st.fixed_dictionaries({"repeat": st.fixed_dictionaries({"times": st.integers(1, 3), "steps": steps})}),
        st.fixed_dictionaries({"if": condition, "then": steps, "else": steps}),
        st.fixed_dictionaries({"parallel": st.tuples(STEP, STEP).map(list)}),
    )


def named(items: list[Plain], draw: st.DrawFn) -> list[Plain]:
    """The items, some with ids that no other item of the same list has."""
    free = draw(st.permutations(NAMES))
    return [
        {**item, "id": free[k]} if isinstance(item, dict) and draw(st.booleans()) else item
        for k, item in enumerate(items)
    ]


@st.composite
def nested(draw: st.DrawFn) -> list[Plain]:
    items = draw(st.lists(st.recursive(STEP, block, max_leaves=6), min_size=1, max_size=4))
    return named(items, draw)


@settings(max_examples=60, deadline=None)
@given(nested())
def test_ids_are_unique_blocks_are_nested_and_the_log_loads_to_the_same(items: list[Plain]) -> None:
    task = steps_of(items, params="{n: 2}")
    assert len({*ids(task), *(block.id for block in task.spec.blocks)}) == len(task.spec.steps) + len(task.spec.blocks)
    for k, block in enumerate(task.spec.blocks):
        assert 0 <= block.first < block.last <= len(task.spec.steps)
        assert all(
            step_id.startswith(f"{block.id}/") or f"{block.id}[" in step_id
            for step_id in ids(task)[block.first : block.last]
        )
        if block.parent is not None:
            around = task.spec.blocks[block.parent]
            assert block.parent < k and around.first <= block.first and block.last <= around.last
    for a, b in pairwise(task.spec.blocks):
        assert a.first <= b.first
    given_ids = [item["id"] for item in items if isinstance(item, dict) and "id" in item and "wait" in item]
    assert all(own in ids(task) for own in given_ids)
    assert reloaded(task).spec == task.spec


@given(st.floats(0.01, 99), st.sampled_from(["m", "cm", "mm", "km"]), st.sampled_from(["m", "cm", "mm"]))
@settings(max_examples=40, deadline=None)
def test_equal_compares_lengths_in_any_units(size: float, unit: str, other: str) -> None:
    si = parse_quantity(f"{size!r} {unit}").value
    written = si / parse_quantity(f"1 {other}").value
    task = loaded(
        f"params: {{a: {size!r} {unit}, b: {written!r} {other}}}\n"
        "steps: [{if: {all: [{equal: [$a, $b]}, {not: {equal: [$a, 2 * $b]}}]}, then: [{wait: 0}],\n"
        "         else: [{wait: 1}]}]\n"
    )
    assert ids(task) == ["if_1/wait_1"]


def test_what_is_decided_of_a_condition_is_left_out() -> None:
    choice = "{if: {all: [{equal: [$arm, left]}, {at_rest: {object: a}}]}, then: [{wait: 0}]}"
    task = loaded(f"params: {{arm: left}}\nsteps: [{choice}]\n")
    condition = task.spec.blocks[0].condition
    assert condition is not None and len(condition.members) == 1 and condition.members[0].name == "at_rest"
    decided = loaded(f"params: {{arm: right}}\nsteps: [{{wait: 1}}, {choice}]\n")
    assert ids(decided) == ["wait_1"] and decided.spec.blocks == ()


def test_a_retry_changes_a_parameter_of_the_round_also_from_the_log() -> None:
    task = loaded(
        """
params: {up: 5 cm, twice: 2 * $up}
steps:
  - repeat:
      each: {block: [a, b], far: [1 cm, 2 cm]}
      steps:
        - lift: {object: $block, by: $far + $twice}
          on_fail: {retry: 1, with: {far: 3 cm, up: 10 cm}}
"""
    )
    for file in (task, reloaded(task)):
        bodies = [retried(file, k).body for k in (0, 1)]
        assert [body.by[0] for body in bodies] == [0.23, 0.23]  # type: ignore[attr-defined]
        assert [body.object for body in bodies] == ["a", "b"]  # type: ignore[attr-defined]
    assert [step.body.by[0] for step in task.spec.steps] == pytest.approx([0.11, 0.12])  # type: ignore[attr-defined]
