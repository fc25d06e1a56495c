"""Verdicts on small synthetic recordings."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from manipcli.conditions.condition import CheckContext
from manipcli.conditions.members import CONDITIONS
from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Joint, JointLimits, Link
from manipcli.judge.expectation import expectation_problems, until_problems
from manipcli.judge.judge import judge
from manipcli.judge.verdict import ExpectationOutcome, Verdict
from manipcli.model.robot import Group, RobotModel
from manipcli.model.state import Contact, WorldState
from manipcli.record.recording import ContactSnapshot, ControllerTrace, Recording, Span, TaskEvent
from manipcli.scene.build_scene import build_scene
from manipcli.spec.condition import ExpectationSpec
from manipcli.spec.scene import BodySpec
from manipcli.spec.task import TaskSpec
from manipcli.task.vocabulary import task_spec

PERIOD = 0.01
T = 201  # 2 s


def joint(name: str, parent: str, child: str, sliding: bool = False) -> Joint:
    kind = "prismatic" if sliding else "revolute"
    return Joint(name, kind, parent, child, Transform.identity(), frozen([0, 0, 1]), JointLimits())  # type: ignore[arg-type]


ROBOT = RobotModel(
    name="arm",
    root="base",
    links=tuple(Link(name, None, (), ()) for name in ("base", "one", "finger")),
    joints=(joint("j1", "base", "one"), joint("slide", "one", "finger", sliding=True)),
    groups=(Group("arm", ("j1",)), Group("all", ("j1", "slide"))),
    poses=(),
    transmissions=(),
    X_WB=Transform.identity(),
    urdf="",
)
BODIES: dict[str, Any] = {
    "desk": {"box": {"size": [1, 1, 0.4]}, "pose": {"xyz": [0, 0, 0.2]}, "fixed": True},
    "ball": {"sphere": {"radius": 0.02}, "mass": 0.01, "rests_on": "desk", "at": [0.3, 0.0]},
    "cube": {"box": {"size": [0.1, 0.1, 0.1]}, "mass": 1.0, "rests_on": "desk", "at": [0.0, 0.0]},
}
SCENE = build_scene(
    TaskSpec.model_construct(
        task="t", floor=False, scene={name: BodySpec.model_validate(body) for name, body in BODIES.items()}
    )
)


def recording(**changes: Any) -> Recording:
    """2 s of everything at rest; two steps, both done."""
    movable = SCENE.movable
    times = np.arange(T) * PERIOD
    states = WorldState(
        time=times,
        position=np.zeros((T, 2)),
        velocity=np.zeros((T, 2)),
        effort=np.zeros((T, 2)),
        body_position=np.tile([body.X_WO.p for body in movable], (T, 1, 1)),
        body_quat_xyzw=np.tile([body.X_WO.quat_xyzw for body in movable], (T, 1, 1)),
        body_linear=np.zeros((T, 2, 3)),
        body_angular=np.zeros((T, 2, 3)),
    )
    trace = ControllerTrace(
        name="arm_controller",
        joints=("j1", "slide"),
        times=times,
        reference_position=np.zeros((T, 2)),
        reference_velocity=np.zeros((T, 2)),
        position=np.zeros((T, 2)),
        output=np.zeros((T, 2)),
    )
    plan = {"steps": [{"id": "go", "verb": "move", "planned_duration": 0.9}, _planned("wait_1")]}
    made = Recording(
        joint_names=("j1", "slide"),
        body_names=("ball", "cube"),
        spans=(Span(states, (trace,), (ContactSnapshot(0.0, (Contact("cube", "desk", 9.81, -1e-5),)),)),),
        events=(*step("go", 0.0, 1.0), *step("wait_1", 1.0, 2.0)),
        metadata={
            "run": {
                "task": "t",
                "seed": "7",
                "engine": "pybullet",
                "physics": "full",
                "period": "0.01",
                "status": "complete",
            }
        },
        attachments={"plan.json": json.dumps(plan).encode()},
        lost=None,
        period=PERIOD,
    )
    return changed(made, **changes)


def changed(made: Recording, **changes: Any) -> Recording:
    """The recording with other fields, of its own or of its one span."""
    (span,) = made.spans
    within = {name: changes.pop(name) for name in ("states", "controllers", "contacts") if name in changes}
    return replace(made, spans=(replace(span, **within),), **changes)


def _planned(name: str) -> dict[str, object]:
    return {"id": name, "verb": "wait", "planned_duration": 1.0}


def step(name: str, start: float, end: float, outcome: str = "done", text: str = "") -> tuple[TaskEvent, TaskEvent]:
    return (
        TaskEvent(start, "step_started", name, "move", "", "", "t.yaml:9"),
        TaskEvent(end, "step_ended", name, "move", outcome, text, "t.yaml:9"),
    )


def run(**metadata: str) -> dict[str, dict[str, str]]:
    return {"run": recording().metadata["run"] | metadata}


SETTING = CheckContext(ROBOT, SCENE, ("go", "wait_1"))


def expectations(*expect: dict[str, Any]) -> tuple[ExpectationSpec, ...]:
    """As they are written under `expect:`."""
    task = {"task": "t", "robot": "r", "controllers": "c", "steps": [{"wait": "1 s"}], "expect": list(expect)}
    return task_spec().model_validate(task).expect


def judged(made: Recording, *expect: tuple[str, Any] | dict[str, Any]) -> Verdict:
    specs = expectations(*(written if isinstance(written, dict) else {written[0]: written[1]} for written in expect))
    for spec in specs:
        assert expectation_problems(spec, SETTING, CONDITIONS) == ()
    return judge(made, expect=specs, robot=ROBOT, scene=SCENE)


def one(made: Recording, name: str, **written: Any) -> ExpectationOutcome:
    (found,) = judged(made, (name, written)).expectations
    return found


def moved(body: int, from_tick: int, by: tuple[float, float, float], to_tick: int = T) -> Recording:
    """The recording with a body elsewhere from one tick to another."""
    made = recording()
    position = made.states.body_position.copy()
    position[from_tick:to_tick, body] += by
    return changed(made, states=replace(made.states, body_position=position))


def test_a_task_without_expectations_passes_when_its_steps_are_done_and_says_so() -> None:
    verdict = judged(recording())
    assert verdict.verdict == "passed"
    assert verdict.text == "all 2 steps done; the task has no expectations"
    assert (verdict.task, verdict.seed, verdict.engine) == ("t", 7, "pybullet")
    assert verdict.simulated_time == pytest.approx(2.0)
    assert [(s.id, s.verb, s.outcome, s.started, s.ended, s.planned_duration) for s in verdict.steps] == [
        ("go", "move", "done", 0.0, 1.0, 0.9),
        ("wait_1", "wait", "done", 1.0, 2.0, 1.0),
    ]


def test_met_expectations_pass_with_their_margins() -> None:
    verdict = judged(
        recording(),
        ("near", {"object": "cube", "to": "start", "within": 0.02}),
        ("upright", {"object": "cube", "within": 0.1}),
        ("duration", {"below": 60}),
        ("tracking", {"group": "all", "within": 0.05}),
        ("no_collision", {"pairs": [["robot", "desk"]]}),
        ("step_done", {"step": "go"}),
    )
    assert verdict.verdict == "passed"
    assert [(e.name, e.outcome, e.margin, e.unit) for e in verdict.expectations] == [
        ("near", "passed", 0.02, "m"),
        ("upright", "passed", 0.1, "rad"),
        ("duration", "passed", 58.0, "s"),
        ("tracking", "passed", 0.05, "rad"),
        ("no_collision", "passed", 0.0, "N"),
        ("step_done", "passed", 1.0, ""),
    ]


def test_what_holds_at_the_end_must_have_held_for_half_a_second() -> None:
    near = {"object": "cube", "to": "start", "within": 0.02}
    away_early = one(moved(1, 0 + 1, (0.05, 0, 0), 150), "near", **near)
    assert (away_early.outcome, away_early.margin) == ("passed", pytest.approx(0.02))
    for first, last in ((150, 151), (160, 170), (200, 201)):
        found = one(moved(1, first, (0.05, 0, 0), last), "near", **near)
        assert (found.outcome, found.unit) == ("failed", "m")
        assert found.margin == pytest.approx(-0.03)
        assert found.at == pytest.approx(first * PERIOD)


def test_a_recording_shorter_than_the_window_is_judged_whole() -> None:
    made = recording()
    short = changed(made, states=made.states.map(lambda a: a[:3]))
    assert one(short, "at_rest", object="cube").outcome == "passed"


def test_bodies_and_joints_are_matched_by_name() -> None:
    made = recording()
    swapped = changed(
        made,
        body_names=("cube", "ball"),
        states=replace(made.states, body_position=made.states.body_position[:, ::-1].copy()),
    )
    assert one(swapped, "near", object="ball", to=[0.3, 0.0, 0.42], within=0.01).margin == pytest.approx(0.01)


def test_the_word_of_a_second_expectation_is_numbered() -> None:
    near = ("near", {"object": "cube", "to": "start", "within": 0.02})
    assert [e.name for e in judged(recording(), near, near, ("duration", {"below": 3})).expectations] == [
        "near",
        "near_2",
        "duration",
    ]


@pytest.mark.parametrize("column", [0, 1])
def test_tracking_names_the_worst_joint_its_unit_and_its_moment(column: int) -> None:
    made = recording()
    trace = made.controllers[0]
    reference = trace.reference_position.copy()
    reference[70, column] = -0.08
    reference[90, 1 - column] = 0.06
    found = one(
        changed(made, controllers=(replace(trace, reference_position=reference),)), "tracking", group="all", within=0.05
    )
    assert found.outcome == "failed"
    assert found.margin == pytest.approx(-0.03)
    assert found.at == pytest.approx(0.7)
    assert (found.unit, found.text) == (
        ("rad", "joint 'j1' is 4.58 deg from its reference; within 2.86 deg; broken for 20 ms"),
        ("m", "joint 'slide' is 80 mm from its reference; within 50 mm; broken for 20 ms"),
    )[column]


def test_tracking_without_a_reference_is_not_evaluated() -> None:
    found = one(recording(controllers=()), "tracking", group="arm", within=0.05)
    assert (found.outcome, found.margin) == ("not_evaluated", None)
    assert "joint 'j1'" in found.text


def touches(*contacts: tuple[float, str, str, float]) -> Recording:
    return recording(contacts=tuple(ContactSnapshot(t, (Contact(a, b, f, -1e-4),)) for t, a, b, f in contacts))


def test_no_collision_gives_the_hardest_touch() -> None:
    made = touches((0.3, "desk", "robot/one", 2.0), (0.5, "desk", "robot/finger", 5.0), (0.7, "ball", "desk", 9.0))
    found = one(made, "no_collision", pairs=[["robot", "desk"]])
    assert (found.outcome, found.margin, found.unit, found.at) == ("failed", -5.0, "N", 0.5)
    assert "'robot/finger'" in found.text
    assert one(made, "no_collision", pairs=[["desk", "robot/one"]]).margin == -2.0
    assert str(one(made, "no_collision", pairs=[["robot", "ball"], ["cube", "ball"]]).margin) == "0.0"  # and not -0
    assert one(made, "no_collision", pairs=[["robot", "desk"]], below=6.0).margin == 1.0


def test_parts_that_are_near_without_pressing_do_not_count() -> None:
    assert one(touches((0.1, "desk", "robot/one", 0.0)), "no_collision", pairs=[["robot", "desk"]]).outcome == "passed"


def test_without_physics_nothing_that_moves_by_physics_is_evaluated_and_the_verdict_is_failed() -> None:
    ideal = recording(metadata=run(engine="kinematic", physics="none"))
    for name, written in (
        ("near", {"object": "cube", "to": "start", "within": 0.02}),
        ("upright", {"object": "cube", "within": 0.1}),
        ("no_collision", {"pairs": [["robot", "desk"]]}),
        ("tracking", {"group": "arm", "within": 0.1}),
    ):
        verdict = judged(ideal, (name, written))
        assert verdict.expectations[0].outcome == "not_evaluated"
        assert verdict.expectations[0].margin is None
        assert verdict.verdict == "failed"
        assert "not evaluated" in verdict.text
    fixed = judged(ideal, ("upright", {"object": "desk", "within": 0.1}), ("duration", {"below": 60}))
    assert fixed.verdict == "passed"


def test_a_recording_without_states_evaluates_nothing() -> None:
    made = recording()
    empty = changed(made, states=made.states.map(lambda a: a[:0]))
    verdict = judged(empty, ("duration", {"below": 60}), ("near", {"object": "cube", "to": "start", "within": 1}))
    assert [e.outcome for e in verdict.expectations] == ["not_evaluated", "not_evaluated"]
    assert verdict.verdict == "failed"
    assert verdict.simulated_time == 0.0


def test_a_body_that_was_not_recorded_is_named() -> None:
    made = recording(body_names=("ball", "other"))
    found = one(made, "near", object="cube", to="start", within=1)
    assert (found.outcome, found.text) == ("not_evaluated", "the recording has no body 'cube'")


def test_a_state_that_is_not_finite_is_never_a_pass() -> None:
    found = one(moved(1, 180, (np.nan, 0, 0)), "near", object="cube", to="start", within=1)
    assert found.outcome == "not_evaluated"
    assert "t = 1.800 s" in found.text


@pytest.mark.parametrize("outcome", ["failed", "timeout"])
def test_a_step_that_is_not_done_fails_the_run_before_any_expectation(outcome: str) -> None:
    events = (*step("go", 0.0, 1.0), *step("wait_1", 1.0, 2.0, outcome, "no contact"))
    verdict = judged(recording(events=events), ("duration", {"below": 1}))
    assert verdict.verdict == "failed"
    assert verdict.text == f"step 'wait_1' {outcome.replace('timeout', 'timed out')}: no contact"
    assert [s.outcome for s in verdict.steps] == ["done", outcome]
    assert one(recording(events=events), "step_done", step="wait_1").margin == -1.0


def test_steps_that_never_ran_or_never_ended_are_told_apart() -> None:
    started = step("go", 0.0, 1.0)[:1]
    failed = judged(recording(events=started, metadata=run(status="failed")))
    assert [s.outcome for s in failed.steps] == ["failed", "not_run"]
    assert [s.outcome for s in judged(recording(events=())).steps] == ["not_run", "not_run"]
    stopped = judged(recording(events=started, metadata=run(status="interrupted")))
    assert [s.outcome for s in stopped.steps] == ["interrupted", "not_run"]


def test_a_complete_run_whose_events_are_missing_is_not_judged_as_if_it_were_whole() -> None:
    """A run that came to its end has begun a step, and has ended every step that it began."""
    events = (*step("go", 0.0, 1.0), step("wait_1", 1.0, 2.0)[0])
    cut = judged(recording(events=events))
    assert (cut.verdict, cut.errors[0].code) == ("error", "RUN104")
    assert "the end of step 'wait_1' is missing" in cut.text
    assert cut.steps[1].outcome == "interrupted"
    silent = judged(recording(events=(), silent=("/task/events",)))
    assert (silent.verdict, silent.errors[0].code) == ("error", "RUN104")
    assert "no message of /task/events" in silent.text


@pytest.mark.parametrize(("until", "verdict"), [("3.0", "error"), ("nan", "passed"), ("", "passed"), (None, "passed")])
def test_a_copy_without_its_last_ticks_is_not_judged_as_if_it_were_whole(until: str | None, verdict: str) -> None:
    """A filter of messages leaves the metadata behind them; `until` is where the run that stored its verdict ended."""
    whole = recording()
    end = judged(whole).simulated_time
    stored = {"verdict": {"verdict": "passed", "until": repr(end) if until is None else until}}
    found = judged(recording(metadata=run() | stored))
    assert (end, found.verdict) == (2.0, verdict)
    if verdict == "error":
        assert found.text == "the log is incomplete: it ends at 2.000 s, the run at 3.000 s"


def test_what_needs_contacts_is_not_evaluated_without_any_message_of_them() -> None:
    never: tuple[str, Any] = ("no_collision", {"pairs": [["ball", "desk"]]})
    assert judged(recording(), never).verdict == "passed"
    verdict = judged(recording(contacts=(), silent=("/contacts",)), never)
    assert (verdict.verdict, verdict.expectations[0].outcome) == ("failed", "not_evaluated")
    assert "no message of /contacts" in verdict.expectations[0].text


def test_a_log_without_plan_knows_the_steps_that_started_and_one_without_steps_fails() -> None:
    assert [s.id for s in judged(recording(attachments={})).steps] == ["go", "wait_1"]
    assert [s.id for s in judged(recording(attachments={"plan.json": b"]"})).steps] == ["go", "wait_1"]
    assert judged(recording(attachments={}, events=())).verdict == "failed"


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"metadata": run(status="interrupted")}, "RUN101"),
        ({"metadata": run(status="crashed")}, "RUN103"),
        ({"metadata": run(status="running")}, "RUN103"),
        ({"metadata": {}}, "RUN103"),
        ({"lost": "the file ends in a record"}, "RUN104"),
    ],
)
def test_a_run_that_did_not_come_to_its_end_is_an_error_whatever_else_is_true(
    changes: dict[str, Any], code: str
) -> None:
    verdict = judged(recording(**changes), ("duration", {"below": 1}))
    assert verdict.verdict == "error"
    assert [finding.code for finding in verdict.errors] == [code]


def test_a_run_that_physics_ended_is_failed_and_not_an_error() -> None:
    events = (*step("go", 0.0, 1.0), *step("wait_1", 1.0, 1.5, "failed", "'cube' explodes at t = 1.500 s"))
    verdict = judged(recording(events=events, metadata=run(status="failed")))
    assert (verdict.verdict, verdict.errors) == ("failed", ())


def test_what_ended_a_run_before_its_first_step_or_after_its_last_is_the_reason() -> None:
    ended = run(status="failed", cause="'ball' moved by 90 mm before the start")
    before = judged(recording(events=(), metadata=ended))
    assert (before.verdict, before.text) == ("failed", "'ball' moved by 90 mm before the start")
    after = judged(recording(metadata=ended))
    assert {one.outcome for one in after.steps} == {"done"}
    assert (after.verdict, after.text) == ("failed", "'ball' moved by 90 mm before the start")


@pytest.mark.parametrize("length", [1, 7, 50, 51, 200])
def test_a_recording_is_judged_the_same_in_spans_of_any_length(length: int) -> None:
    """Bodies move all the time, and every kind of expectation has its worst moment somewhere else."""
    made = moved(1, 160, (0.0, 0.015, 0.0), 170)
    trace = made.controllers[0]
    reference = trace.reference_position.copy()
    reference[70, 1] = -0.04
    touching = touches((0.2, "desk", "robot/one", 2.0), (0.9, "desk", "robot/finger", 5.0)).contacts
    made = changed(made, controllers=(replace(trace, reference_position=reference),), contacts=touching)
    cut = replace(made, spans=[_ticks(made, k, k + length) for k in range(0, T, length)])
    expect: tuple[tuple[str, dict[str, Any]], ...] = (
        ("near", {"object": "cube", "to": "start", "within": 0.02}),
        ("at_rest", {"object": "ball"}),
        ("tracking", {"group": "all", "within": 0.05}),
        ("no_collision", {"pairs": [["robot", "desk"]], "below": 10}),
        ("duration", {"below": 60}),
        ("step_done", {"step": "go"}),
    )
    assert judged(cut, *expect) == judged(made, *expect)
    assert [e.at for e in judged(cut, *expect).expectations[:4]] == pytest.approx([1.6, 1.5, 0.7, 0.9])


def _ticks(made: Recording, start: int, end: int) -> Span:
    (span,) = made.spans
    times = span.states.time[start:end]
    return Span(
        span.states.map(lambda a: a[start:end]),
        tuple(trace.map(lambda a: a[start:end]) for trace in span.controllers),
        tuple(c for c in span.contacts if times[0] <= c.time <= times[-1]),
    )


def test_spans_are_gone_through_once_whatever_is_asked() -> None:
    """A file of an hour is read once."""

    class Counted:
        times = 0

        def __iter__(self) -> Any:
            self.times += 1
            return iter(recording().spans)

    spans = Counted()
    judged(replace(recording(), spans=spans), ("duration", {"below": 60}), ("tracking", {"group": "all", "within": 1}))
    judged(replace(recording(), spans=spans, body_names=("ball",)))
    assert spans.times == 2


def test_the_same_recording_gives_the_same_verdict() -> None:
    expect = [
        ("near", {"object": "cube", "to": "start", "within": 0.02}),
        ("tracking", {"group": "all", "within": 0.1}),
    ]
    assert judged(recording(), *expect) == judged(recording(), *expect)


def test_a_step_is_not_done_before_its_end() -> None:
    for scope in ({"at": "wait_1"}, {"during": ["go", "wait_1"]}):
        (spec,) = expectations({"step_done": {"step": "wait_1"}, **scope})
        (problem,) = expectation_problems(spec, SETTING, CONDITIONS)
        assert problem.message == "step 'wait_1' is not done yet when this is evaluated"
    (spec,) = expectations({"step_done": {"step": "wait_1"}, "at": "go"})
    (problem,) = expectation_problems(spec, SETTING, CONDITIONS)
    assert problem.message == "step 'wait_1' is not done yet when this is evaluated"
    (either,) = expectations({"eventually": {"step_done": {"step": "go"}}, "during": ["go", "wait_1"]})
    assert expectation_problems(either, SETTING, CONDITIONS) == ()
    (later,) = expectations({"step_done": {"step": "go"}, "at": "wait_1"})
    assert expectation_problems(later, SETTING, CONDITIONS) == ()


def test_a_step_does_not_wait_for_itself_or_a_later_one() -> None:
    (spec,) = expectations({"all": [{"step_done": {"step": "wait_1"}}, {"duration": {"below": 60}}]})
    for step, late in (("go", True), ("wait_1", True), (None, False)):
        assert bool(until_problems(spec.condition, step, SETTING, CONDITIONS)) is late
    (earlier,) = expectations({"step_done": {"step": "go"}})
    assert until_problems(earlier.condition, "wait_1", SETTING, CONDITIONS) == ()
    (either,) = expectations({"any": [{"step_done": {"step": "wait_1"}}, {"duration": {"below": 60}}]})
    assert until_problems(either.condition, "wait_1", SETTING, CONDITIONS) == ()


@pytest.mark.parametrize(
    ("name", "written", "loc", "hint"),
    [
        ("tracking", {"group": "ram", "within": 1}, ("group",), "did you mean 'arm'?"),
        ("no_collision", {"pairs": [["robot", "deks"]]}, ("pairs", 0, 1), "did you mean 'desk'?"),
        ("no_collision", {"pairs": [["robot/fingr", "desk"]]}, ("pairs", 0, 0), "did you mean 'robot/finger'?"),
        ("step_done", {"step": "wait_2"}, ("step",), "did you mean 'wait_1'?"),
        ("near", {"object": "cub", "to": "start", "within": 1}, ("object",), "did you mean 'cube'?"),
    ],
)
def test_unknown_names_are_told_before_anything_runs(
    name: str, written: dict[str, Any], loc: tuple[str | int, ...], hint: str
) -> None:
    (spec,) = expectations({name: written})
    (problem,) = expectation_problems(spec, SETTING, CONDITIONS)
    assert (problem.loc, problem.hint) == ((name, *loc), hint)
