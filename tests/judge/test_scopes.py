"""When expectations are looked at: every scope against slices of the margins, whatever spans the recording comes in."""

from __future__ import annotations

import json
import tracemalloc
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from manipcli.conditions.condition import CheckContext
from manipcli.conditions.members import CONDITIONS
from manipcli.core.geometry import Array, Transform
from manipcli.description.elements import Link
from manipcli.judge.expectation import expectation_problems, labels
from manipcli.judge.judge import judge
from manipcli.judge.verdict import ExpectationOutcome, broken_at
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact, WorldState
from manipcli.record.recording import ContactSnapshot, Recording, Span, TaskEvent
from manipcli.scene.build_scene import build_scene
from manipcli.spec.base import Model
from manipcli.spec.condition import ExpectationSpec
from manipcli.spec.scene import BodySpec
from manipcli.spec.task import TaskSpec
from manipcli.task.vocabulary import task_spec

PERIOD, T = 0.01, 201
TIMES = np.round(np.arange(T) * PERIOD, 9)
STEPS = (("a", 0.0, 0.6), ("b", 0.6, 1.1), ("c", 1.1, 1.3))
ROBOT = RobotModel("r", "base", (Link("base", None, (), ()),), (), (), (), (), Transform.identity(), "")
BODIES: dict[str, Any] = {"cube": {"box": {"size": [0.1, 0.1, 0.1]}, "mass": 1.0, "pose": {"xyz": [0, 0, 0.05]}}}
SCENE = build_scene(
    TaskSpec.model_construct(
        task="t", floor=False, scene={name: BodySpec.model_validate(body) for name, body in BODIES.items()}
    )
)
NEAR = {"near": {"object": "cube", "to": [0, 0, 0.05], "within": "0.5 m"}}
WALK = 0.5 - np.abs(np.concatenate([[0.0], np.cumsum(np.random.default_rng(3).normal(scale=0.1, size=T - 1))]))
"""Margins of `NEAR`."""


def recording(margins: Array = WALK, cuts: tuple[int, ...] = (), **changes: Any) -> Recording:
    """A cube that is `0.5 m - margin` from where it should be."""
    p = np.tile(SCENE.movable[0].X_WO.p, (T, 1, 1))
    p[:, 0, 0] += 0.5 - margins
    nothing = np.zeros((T, 0))
    zeros = np.zeros((T, 1, 3))
    quat = np.tile([0.0, 0.0, 0.0, 1.0], (T, 1, 1))
    states = WorldState(TIMES, nothing, nothing, nothing, p, quat, zeros, zeros)
    contacts = tuple(ContactSnapshot(float(t), (Contact("cube", "floor", float(t), 0.0),)) for t in TIMES[50::20])
    spans = [
        Span(
            states.map(lambda a, a_=a, b_=b: a[a_:b_]),  # type: ignore[misc]
            (),
            tuple(one for one in contacts if TIMES[a] <= one.time <= TIMES[b - 1]),
        )
        for a, b in pairwise((0, *cuts, T))
    ]
    events = [
        TaskEvent(time, kind, name, "move", "done" if kind == "step_ended" else "", "", "")
        for name, start, end in STEPS
        for time, kind in ((start, "step_started"), (end, "step_ended"))
    ]
    planned = [{"id": name, "verb": "move", "planned_duration": 1.0} for name in ("a", "b", "c", "d")]
    made = Recording(
        joint_names=(),
        body_names=("cube",),
        spans=spans,
        events=tuple(events),
        metadata={"run": {"physics": "full", "status": "complete"}},
        attachments={"plan.json": json.dumps({"steps": planned}).encode()},
        lost=None,
        period=PERIOD,
    )
    return replace(made, **changes)


def expectations(*expect: dict[str, Any]) -> tuple[ExpectationSpec, ...]:
    task = {"task": "t", "robot": "r", "controllers": "c", "steps": [{"wait": "1 s"}], "expect": list(expect)}
    return task_spec().model_validate(task).expect


def judged(made: Recording, expect: dict[str, Any]) -> ExpectationOutcome:
    (found,) = judge(made, expect=expectations(expect), robot=ROBOT, scene=SCENE).expectations
    return found


def during(*names: str) -> Any:
    return np.logical_or.reduce([(start <= TIMES) & (end > TIMES) for name, start, end in STEPS if name in names])


END = TIMES >= 1.5
SCOPES: list[tuple[dict[str, Any], Any, str]] = [
    (NEAR, END, "least"),
    ({**NEAR, "at": "end"}, END, "least"),
    ({**NEAR, "at": "a"}, np.arange(T) == 59, "least"),
    ({**NEAR, "at": "c"}, np.arange(T) == 129, "least"),
    ({**NEAR, "during": "b"}, during("b"), "least"),
    ({**NEAR, "during": ["a", "c"]}, during("a", "c"), "least"),
    ({"always": NEAR}, np.full(T, True), "least"),
    ({"always": NEAR, "during": "b"}, during("b"), "least"),
    ({"never": NEAR}, np.full(T, True), "greatest"),
    ({"never": NEAR, "during": "c"}, during("c"), "greatest"),
    ({"eventually": NEAR}, np.full(T, True), "greatest"),
    ({"eventually": NEAR, "within": "0.7 s"}, TIMES <= 0.7, "greatest"),
    ({"eventually": NEAR, "during": "b"}, during("b"), "greatest"),
    ({"eventually": NEAR, "during": "b", "within": "200 ms"}, during("b") & (TIMES <= 0.8), "greatest"),
    ({"eventually": {"not": NEAR}, "during": "b"}, during("b"), "least"),
]


@pytest.mark.parametrize(("expect", "counts", "pick"), SCOPES)
@pytest.mark.parametrize("seed", range(6))
def test_the_extreme_of_what_counts_decides(expect: dict[str, Any], counts: Any, pick: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    margins = rng.integers(-400, 400, size=T) / (1000 if seed % 2 else 1e5)
    cuts = tuple(sorted({int(cut) for cut in rng.integers(1, T, size=seed)}))
    found = judged(recording(margins, cuts), expect)
    value = (np.min if pick == "least" else np.max)(margins[counts])
    k = int(np.flatnonzero(counts & (margins == value))[0])
    opposite = "never" in expect or "not" in expect.get("eventually", {})
    assert found.margin == pytest.approx(-value if opposite else value, abs=1e-12)
    assert found.outcome == ("passed" if (found.margin or 0.0) >= 0.0 else "failed")
    ties = np.isclose(margins, value, atol=1e-12)
    assert found.at in TIMES[counts & ties] if np.sum(counts & ties) > 1 else found.at == TIMES[k]


@pytest.mark.parametrize("cuts", [(1,), (50, 51), (59, 60, 61), (110, 129, 130, 131), tuple(range(1, T))])
def test_spans_of_any_length_give_the_same(cuts: tuple[int, ...]) -> None:
    """Also where something is counted from the start of a step, and of what rests on a contact."""
    more = [
        {"moved": {"object": "cube", "by": "5 cm"}, "during": "b"},
        {"duration": {"below": "1 s"}, "during": ["b", "c"]},
        {"contact_force": {"of": "cube", "below": "1 N"}},
        {"at_rest": {"object": "cube", "below": "10 m/s"}, "at": "b"},
        {"always": {"any": [NEAR, {"contact_force": {"of": "cube", "above": "1 N"}}]}},
        {"step_done": {"step": "a"}, "at": "b"},
    ]
    expect = expectations(*(one for one, _, _ in SCOPES), *more)
    one, many = (judge(recording(WALK, c), expect=expect, robot=ROBOT, scene=SCENE) for c in ((), cuts))
    assert one == many


def test_memory_does_not_grow_with_the_length_of_a_recording() -> None:
    """Spans of half a second are made when they are asked for; every scope is asked."""
    expect = expectations(*(one for one, _, _ in SCOPES))

    def peak(spans: int) -> int:
        (first,) = recording().spans
        late = (
            replace(first, states=replace(first.states, time=TIMES + k * T * PERIOD).map(np.copy)) for k in range(spans)
        )
        tracemalloc.start()
        judge(recording(spans=late), expect=expect, robot=ROBOT, scene=SCENE)
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return most

    peak(2)
    assert peak(24) < 1.3 * peak(6)


def test_what_counts_from_a_start_counts_from_that_of_the_step() -> None:
    found = judged(recording(), {"duration": {"below": "1 s"}, "during": "b"})
    assert found.margin == 0.5
    assert found.text == "during 'b': 0.500 s; below 1 s"
    ramp = np.minimum(0.5, 0.5 - (TIMES - 0.6))  # it leaves at 1 m/s when b begins
    moved = judged(recording(ramp), {"moved": {"object": "cube", "by": "20 cm"}, "at": "b"})
    assert moved.margin == pytest.approx(0.49 - 0.2)


@pytest.mark.parametrize("every", [1, 2, 5, 7])
def test_a_step_takes_as_long_as_its_events_say_however_few_ticks_the_log_holds(every: int) -> None:
    few = recording(spans=[replace(one, states=one.states.map(lambda a: a[::every])) for one in recording().spans])
    for name, started, ended in STEPS:
        first = TIMES[::every][np.searchsorted(TIMES[::every], started - 1e-9)]
        for scope in ("at", "during"):
            found = judged(few, {"duration": {"below": "1 s"}, scope: name})
            assert found.margin == pytest.approx(1.0 - (ended - first), abs=1e-12)
    whole = judged(few, {"duration": {"below": "9 s"}})
    assert whole.margin == pytest.approx(9.0 - TIMES[::every][-1], abs=1e-12)


@pytest.mark.parametrize(
    ("expect", "text"),
    [
        ({**NEAR, "during": "d"}, "step 'd' never ran"),
        ({**NEAR, "at": "d"}, "step 'd' never ran"),
        ({"eventually": NEAR, "during": ["a", "d"]}, "step 'd' never ran"),
        (
            {"always": {"slip": {"object": "cube", "within": "1 mm", "link": "base"}}},
            "'cube' was never held by two links",
        ),
        (
            {"never": {"slip": {"object": "cube", "within": "1 mm", "link": "base"}}},
            "'cube' was never held by two links",
        ),
        (
            {"any": [NEAR, {"slip": {"object": "cube", "within": 1, "link": "base"}}], "at": "end"},
            "'cube' was never held",
        ),
    ],
)
def test_what_was_never_looked_at_has_not_passed(expect: dict[str, Any], text: str) -> None:
    found = judged(recording(), expect)
    assert (found.outcome, found.margin) == ("not_evaluated", None)
    assert text in found.text


def test_a_step_that_never_ended_has_no_end_but_a_time() -> None:
    made = recording()
    cut = replace(made, events=made.events[:-1])
    assert judged(cut, {**NEAR, "at": "c"}).text == "step 'c' never ended"
    assert judged(cut, {**NEAR, "during": "c"}).margin == pytest.approx(np.min(WALK[110:]))


def test_no_member_of_a_combination_saves_one_that_cannot_be_evaluated() -> None:
    made = recording(metadata={"run": {"physics": "none", "status": "complete"}})
    found = judged(made, {"any": [{"duration": {"below": "9 s"}}, {"grasped": {"object": "cube"}}]})
    assert (found.outcome, found.text) == ("not_evaluated", "the engine has no physics, so there are no contacts")


def test_the_deciding_member_is_named_with_its_own_margin_and_moment() -> None:
    found = judged(
        recording(),
        {"always": {"all": [{"upright": {"object": "cube", "within": "10 deg"}}, {"not": {"duration": {"below": 1}}}]}},
    )
    assert (found.name, found.outcome, found.unit, found.at) == ("all", "failed", "s", 0.0)
    assert found.text == "not duration: 0.010 s; below 1 s; broken for 1 s"
    assert found.margin == -0.99


def test_what_never_may_hold_and_what_never_came_true_say_how_close_it_was() -> None:
    never = judged(recording(), {"never": NEAR, "during": "b"})
    assert never.name == "never_near"
    assert never.text.startswith("during 'b': 'cube' is ")
    assert never.text.endswith("; never within 500 mm; broken for 140 ms")
    ramp = np.linspace(-0.4, -0.1, T)
    late = judged(recording(np.concatenate([[0.5], ramp[1:]])), {"eventually": NEAR, "during": "b", "within": "200 ms"})
    assert (late.outcome, late.at) == ("failed", 0.8)
    where = "'cube' is 780 mm from the point: it is at [0.78, 0, 0.05] m, the target at [0, 0, 0.05] m; within 500 mm"
    assert late.text == f"during 'b', within 200 ms, at best: {where}"


def test_labels_are_the_words_numbered_or_the_ids() -> None:
    collision = {"collision": ["robot", "cube"]}
    expect = expectations(
        NEAR, {**NEAR, "during": "a"}, {"always": NEAR, "id": "near_3"}, {"eventually": NEAR},
        {"never": collision}, {"never": collision}, {"all": [NEAR]}, {"always": {"any": [NEAR]}}, {"not": NEAR},
    )  # fmt: skip
    assert list(labels(expect)) == [
        "near", "near_2", "near_3", "near_4", "never_collision", "never_collision_2", "all", "any", "not",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("expect", "loc", "message", "hint"),
    [
        ({**NEAR, "at": "bb"}, ("at",), "the task has no step 'bb'", None),
        ({**NEAR, "at": "ennd"}, ("at",), "the task has no step 'ennd'", "did you mean 'end'?"),
        ({**NEAR, "during": "lift1"}, ("during",), "the task has no step 'lift1'", "did you mean 'lift_1'?"),
        ({"always": NEAR, "during": ["a", "lift1"]}, ("during", 1), "the task has no step 'lift1'", None),
        ({"never": {"near": {**NEAR["near"], "object": "cub"}}}, ("never", "near", "object"), "'cub' is not in", None),
        (
            {"eventually": {"all": [NEAR, {"not": {"at_rest": {"object": "cub"}}}]}},
            ("eventually", "all", 1, "not", "at_rest", "object"), "'cub' is not in", "did you mean 'cube'?",
        ),
        (
            {"all": [NEAR, {"unmoved": {"object": "cube", "within": 1}}]},
            ("all",), "`near` defaults to the end, `unmoved` to the whole run", "add `at: end`",
        ),
    ],
)  # fmt: skip
def test_what_an_expectation_speaks_of_and_is_not_there_is_told(
    expect: dict[str, Any], loc: tuple[str | int, ...], message: str, hint: str | None
) -> None:
    (spec,) = expectations(expect)
    (problem,) = expectation_problems(spec, CheckContext(ROBOT, SCENE, ("a", "b", "lift_1")), CONDITIONS)
    assert problem.loc == loc
    assert message in problem.message
    assert hint is None or hint in (problem.hint or "")


def test_the_hint_for_an_unknown_round_names_the_rounds() -> None:
    (spec,) = expectations({**NEAR, "during": "b[7]"})
    context = CheckContext(ROBOT, SCENE, ("b[0]/a", "b[1]/a"), blocks=("b", "b[0]", "b[0]/c[0]", "b[1]"))
    (problem,) = expectation_problems(spec, context, CONDITIONS)
    assert problem.hint == "rounds: b[0], b[1]"


def test_where_the_steps_are_not_known_none_is_missed() -> None:
    (spec,) = expectations({**NEAR, "at": "bb"})
    assert expectation_problems(spec, CheckContext(ROBOT, SCENE), CONDITIONS) == ()


def test_the_condition_itself_is_a_value_of_a_model() -> None:
    (spec,) = expectations({"always": {"not": NEAR}, "during": "a"})
    assert (spec.quantifier, spec.condition.name, [one.name for one in spec.condition.members]) == (
        "always", "not", ["near"],
    )  # fmt: skip
    assert isinstance(spec.condition.members[0].body, Model)


@pytest.mark.parametrize(("worst", "told"), [(40, ""), (90, "; broken at t = 0.400 s")])
def test_a_watch_that_is_broken_at_its_worst_moment_tells_it_once(worst: int, told: str) -> None:
    margins = np.where(np.arange(T) < 40, 0.5, -0.1)
    margins[worst] = -0.3
    task = {"task": "t", "robot": "r", "controllers": "c", "steps": [{"wait": "1 s"}], "watch": [{"always": NEAR}]}
    (found,) = judge(
        recording(margins), expect=task_spec().model_validate(task).watch, robot=ROBOT, scene=SCENE
    ).expectations
    assert (found.outcome, found.at, found.margin) == ("failed", TIMES[worst], pytest.approx(-0.3))
    assert found.text.endswith(told) and found.text.count("broken at") == bool(told)


@pytest.mark.parametrize(
    ("expect", "told"),
    [
        ({"always": NEAR}, "; broken for 300 ms, first at t = 0.200 s"),
        ({"never": NEAR}, "; broken for 1.71 s"),
        ({"always": {"not": {"any": [NEAR, {"not": NEAR}]}}}, "; broken for 2 s"),
        ({**NEAR, "during": "a"}, "; broken for 200 ms, first at t = 0.200 s"),
        ({**NEAR, "during": "c"}, "; broken for 100 ms"),
        ({**NEAR, "at": "end"}, None),
        ({"eventually": NEAR, "during": "c"}, None),
    ],
)
def test_what_was_to_hold_for_a_time_tells_for_how_long_it_did_not(expect: dict[str, Any], told: str | None) -> None:
    margins = np.full(T, 0.5)
    margins[20:40], margins[115:125] = -0.1, -0.1
    margins[30] = -0.3
    found = judged(recording(margins), expect)
    assert found.text.endswith(told) if told else "broken" not in found.text


def test_a_watch_that_ended_the_run_is_not_passed_by_a_log_that_lacks_its_tick() -> None:
    task = {"task": "t", "robot": "r", "controllers": "c", "steps": [{"wait": "1 s"}], "watch": [{"always": NEAR}]}
    watch = task_spec().model_validate(task).watch
    made = recording(np.full(T, 0.5))
    (seen,) = judge(made, expect=watch, robot=ROBOT, scene=SCENE).expectations
    assert seen.outcome == "passed"
    text = f"{broken_at(seen.name)}t = 0.401 s by 3 mm: 'cube' is far"
    broken = TaskEvent(0.401, "watch_broken", "a", "move", "failed", text, "")
    verdict = judge(replace(made, events=(*made.events, broken)), expect=watch, robot=ROBOT, scene=SCENE)
    (known,) = verdict.expectations
    assert (verdict.verdict, known.outcome) == ("failed", "not_evaluated")
    assert known.text == "broken at t = 0.401 s by 3 mm: 'cube' is far; the log does not contain this tick"
