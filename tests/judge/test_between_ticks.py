"""Contacts that change between the ticks of a thinned log are judged as they are of a whole one."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manipcli.core.geometry import Transform
from manipcli.description.elements import Link
from manipcli.judge.judge import judge
from manipcli.judge.verdict import ExpectationOutcome
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact, WorldState
from manipcli.record.recording import ContactSnapshot, Recording, Span, TaskEvent
from manipcli.scene.build_scene import build_scene
from manipcli.spec.scene import BodySpec
from manipcli.spec.task import TaskSpec
from manipcli.task.vocabulary import task_spec

PERIOD, EVERY, T = 0.001, 10, 101
TIMES = np.round(np.arange(T) * PERIOD, 9)
ROBOT = RobotModel("r", "base", (Link("base", None, (), ()),), (), (), (), (), Transform.identity(), "")
BODIES: dict[str, Any] = {
    name: {"box": {"size": [0.1, 0.1, 0.1]}, "mass": 1.0, "pose": {"xyz": [x, 0, 0.05]}}
    for name, x in (("cube", 0.0), ("block", 0.5))
}
SCENE = build_scene(
    TaskSpec.model_construct(
        task="t", floor=False, scene={name: BodySpec.model_validate(body) for name, body in BODIES.items()}
    )
)
FORCE = {"pair": ["cube", "block"]}
SINGLE: list[dict[str, Any]] = [
    {"contact_force": {**FORCE, "below": 50.0}},
    {"contact_force": {**FORCE, "above": 50.0}},
    {"no_collision": {"pairs": [FORCE["pair"]], "below": 20.0}},
    {"collision": {"pairs": [FORCE["pair"]], "above": 20.0}},
    {"not": {"contact_force": {**FORCE, "above": 50.0}}},
]


def recording(changes: list[tuple[int, float]], every: int, cuts: tuple[int, ...] = ()) -> Recording:
    """Two still boxes that press on each other so hard from these ticks on; every so many ticks of the states stay."""
    ticks = TIMES[::every]
    still = np.tile([np.asarray(body.X_WO.p) for body in SCENE.movable], (len(ticks), 1, 1))
    nothing, zeros = np.zeros((len(ticks), 0)), np.zeros((len(ticks), 2, 3))
    states = WorldState(
        ticks, nothing, nothing, nothing, still, np.tile([0.0, 0.0, 0.0, 1.0], (len(ticks), 2, 1)), zeros, zeros
    )
    snapshots = [ContactSnapshot(float(TIMES[k]), (Contact("block", "cube", force, 0.0),)) for k, force in changes]
    spans, told = [], -1.0
    for a, b in pairwise(sorted({0, len(ticks), *(cut for cut in cuts if cut < len(ticks))})):
        until = float(ticks[b - 1])
        mine = tuple(one for one in snapshots if told < one.time <= until)
        spans.append(Span(states.map(lambda x, a=a, b=b: x[a:b]), (), mine))  # type: ignore[misc]
        told = until
    steps = [("a", 0.0, 0.1), ("b", 0.033, 0.057)]
    events = [
        TaskEvent(time, kind, name, "wait", "done" if kind == "step_ended" else "", "", "")
        for name, start, end in steps
        for time, kind in ((start, "step_started"), (end, "step_ended"))
    ]
    planned = [{"id": name, "verb": "wait", "planned_duration": 0.1} for name, _, _ in steps]
    return Recording(
        joint_names=(),
        body_names=("cube", "block"),
        spans=spans,
        events=tuple(events),
        metadata={"run": {"physics": "full", "status": "complete"}},
        attachments={"plan.json": json.dumps({"steps": planned}).encode()},
        lost=None,
        period=PERIOD,
    )


def judged(made: Recording, expect: dict[str, Any]) -> ExpectationOutcome:
    task = {"task": "t", "robot": "r", "controllers": "c", "steps": [{"wait": "1 s"}], "expect": [expect]}
    (found,) = judge(made, expect=task_spec().model_validate(task).expect, robot=ROBOT, scene=SCENE).expectations
    return found


changing = st.lists(
    st.tuples(st.integers(0, T - 1), st.sampled_from([0.0, 5.0, 30.0, 49.0, 80.0, 300.0])), min_size=1, max_size=12
).map(lambda all_: sorted(dict(all_).items()))


@given(
    changing,
    st.lists(st.sampled_from(SINGLE), min_size=1, max_size=3),
    st.sampled_from(["all", "any"]),
    st.sampled_from(["always", "never", "eventually"]),
    st.sampled_from([{}, {"during": "a"}, {"during": "b"}]),
    st.sets(st.integers(1, 9)),
)
@settings(max_examples=150, deadline=None)
def test_a_thinned_log_is_judged_as_a_whole_one(
    changes: list[tuple[int, float]],
    members: list[dict[str, Any]],
    word: str,
    quantifier: str,
    when: dict[str, str],
    cuts: set[int],
) -> None:
    """To the last word: margin, moment, text; step b begins and ends between two ticks."""
    expect = {quantifier: members[0] if len(members) == 1 else {word: members}, **when}
    whole, thin = (judged(recording(changes, every, tuple(cuts)), expect) for every in (1, EVERY))
    assert thin == whole


def test_a_log_that_says_it_has_a_million_ticks_is_not_believed() -> None:
    made = replace(recording([(0, 1.0)], EVERY), period=1e-12)
    assert judged(made, {"always": SINGLE[0]}).outcome == "passed"


def test_a_knock_between_two_ticks_is_told_with_who_knocked() -> None:
    knock = [(0, 1.0), (55, 300.0), (56, 1.0)]
    found = judged(recording(knock, EVERY), {"no_collision": {"pairs": [FORCE["pair"]], "below": 20.0}})
    assert found.outcome == "failed" and found.margin == pytest.approx(-280.0)
    assert "'block' and 'cube' touch with 300 N" in found.text and found.at == pytest.approx(0.055)
    found = judged(recording(knock, EVERY), {"contact_force": {**FORCE, "below": 50.0}, "during": "a"})
    assert (found.outcome, found.margin) == ("failed", pytest.approx(-250.0))
    assert (
        judged(recording(knock, EVERY), {"eventually": {"contact_force": {**FORCE, "above": 250.0}}}).outcome
        == "passed"
    )
