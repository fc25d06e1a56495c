"""What a run says in numbers: closed forms of energy, error, limits; known slips; the same however spans are cut."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Joint, JointLimits, Link
from manipcli.judge.measures.facts import RunFacts, run_facts
from manipcli.judge.verdict import StepOutcome
from manipcli.model.robot import RobotModel, Tool
from manipcli.model.state import Contact, WorldState
from manipcli.plan.motion import CLOSING
from manipcli.record.recording import ContactSnapshot, ControllerTrace, Recording, Span, TaskEvent
from manipcli.scene.scene import Body, Scene
from manipcli.shapes.primitives import Box, Geometry

PERIOD = 0.001
OMEGA = 0.5
"""[rad/s] of the joint that turns."""


def _robot() -> RobotModel:
    links = tuple(Link(name, None, (), ()) for name in ("base", "arm", "hand"))
    joints = (
        Joint("turn", "revolute", "base", "arm", Transform.identity(), np.array([0.0, 0, 1]),
              JointLimits(-1.0, 3.0, 2.0, 4.0)),
        Joint("slide", "prismatic", "arm", "hand", Transform.of(xyz=(0.3, 0, 0)), np.array([0.0, 0, 1]),
              JointLimits(-1.0, 1.0, None, 100.0)),
    )  # fmt: skip
    return RobotModel(
        "two", "base", links, joints, (), (), (), Transform.identity(), "<robot/>", Tool("hand", Transform.identity())
    )


def _scene() -> Scene:
    def body(name: str, *, fixed: bool) -> Body:
        return Body(
            name=name, kind="box", geometries=(Geometry(Transform.identity(), Box((0.1, 0.1, 0.1))),), mass=1.0,
            X_OI=Transform.identity(), inertia=frozen(np.eye(3)), friction=1.0, rolling_friction=0.0,
            spinning_friction=0.0, restitution=0.0, fixed=fixed, X_WO=Transform.identity(), interior=None,
            size=frozen([0.1] * 3), centre=frozen([0.0, 0.0, 0.02]),
        )  # fmt: skip

    return Scene((body("desk", fixed=True), body("cup", fixed=False)), (), frozen([0.0, 0.0, -9.8]))


def _span(times: np.ndarray, slip: np.ndarray, angle: np.ndarray, contacts: tuple[ContactSnapshot, ...]) -> Span:
    """The first joint turns with `OMEGA` under 2 N m, the second swings with 0.1 m under 10 N; the cup is held.

    `slip` [m] along z and `angle` [rad] about z: of the cup in the tool frame.
    """
    zero = np.zeros_like(times)
    q = np.stack([OMEGA * times, 0.1 * np.sin(times)], axis=1)
    v = np.stack([np.full_like(times, OMEGA), 0.1 * np.cos(times)], axis=1)
    yaw = q[:, 0] + angle
    quat = np.stack([zero, zero, np.sin(yaw / 2.0), np.cos(yaw / 2.0)], axis=1)
    place = np.stack([0.3 * np.cos(q[:, 0]), 0.3 * np.sin(q[:, 0]), q[:, 1] + slip], axis=1)
    states = WorldState(
        times, q, v, np.tile([2.0, 10.0], (len(times), 1)), place[:, None], quat[:, None],
        np.zeros((len(times), 1, 3)), np.zeros((len(times), 1, 3)),
    )  # fmt: skip
    reference = q[:, :1] + 0.01 * times[:, None]
    trace = ControllerTrace("arm", ("turn",), times, reference, v[:, :1], q[:, :1], zero[:, None])
    return Span(states, (trace,), contacts)


STANDS = Contact("cup", "desk", 9.8, 0.0)
FINGERS = (Contact("cup", "robot/hand", 4.0, 0.0), Contact("cup", "robot/arm", 2.0, 0.0))
TOUCHES = (
    ContactSnapshot(0.0, (STANDS,)),
    ContactSnapshot(0.5, (*FINGERS, STANDS)),
    ContactSnapshot(1.0, FINGERS),
    ContactSnapshot(2.0, (FINGERS[0],)),
    ContactSnapshot(2.5, (*FINGERS, STANDS)),
    ContactSnapshot(2.8, (STANDS,)),
)
STEPS = (
    StepOutcome("a", "pick", "done", 0.0, 0.8, 0.8),
    StepOutcome("b", "lift", "done", 0.8, 2.0, 1.0),
    StepOutcome("c", "place", "failed", 2.0, None, 1.0),
    StepOutcome("d", "wait", "not_run", None, None, 1.0),
)


def _recording(parts: int = 1, contacts: tuple[ContactSnapshot, ...] = TOUCHES) -> Recording:
    times = PERIOD * np.arange(3001)
    slip = np.where(times > 1.5, 0.004, 0.0) + np.where(times > 2.4, -0.003, 0.0)
    angle = 0.1 * np.clip(times - 1.0, 0.0, 0.5)
    spans = []
    for ticks in np.array_split(np.arange(len(times)), parts):
        low, high = times[ticks[0]], times[ticks[-1]]
        mine = tuple(one for one in contacts if low <= one.time <= high)
        spans.append(_span(times[ticks], slip[ticks], angle[ticks], mine))
    events = (
        TaskEvent(0.4, "phase_started", "a", "pick", "", CLOSING, ""),
        TaskEvent(0.8, "step_ended", "a", "pick", "done", "", ""),
        TaskEvent(2.0, "step_ended", "b", "lift", "done", "", ""),
    )
    saturated = {"saturated joints": {"turn": "12"}, "saturated actuators": {"motor": "3"}}
    return Recording(("turn", "slide"), ("cup",), tuple(spans), events, saturated, {}, None, PERIOD)


@pytest.fixture(scope="module")
def facts() -> RunFacts:
    return run_facts(_recording(), _robot(), _scene(), STEPS)


def test_the_energy_of_a_constant_torque_is_torque_times_angle(facts: RunFacts) -> None:
    turn = facts.joints[0]
    assert turn.given == pytest.approx(2.0 * OMEGA * 3.0, rel=1e-12)
    assert turn.taken == 0.0
    assert turn.power.value == pytest.approx(2.0 * OMEGA)


def test_what_goes_back_is_counted_apart(facts: RunFacts) -> None:
    """10 N along 0.1 sin t: given up to pi / 2, taken back from there to 3 s."""
    slide = facts.joints[1]
    assert slide.given == pytest.approx(1.0, abs=1e-6)
    assert slide.taken == pytest.approx(1.0 - math.sin(3.0), abs=1e-6)
    assert slide.power.value == pytest.approx(1.0) and slide.power.at == 0.0


def test_steps_share_the_energy_of_the_run(facts: RunFacts) -> None:
    assert [step.id for step in facts.steps] == ["a", "b", "c"]
    for k, joint in enumerate(facts.joints):
        assert sum(step.given[k] for step in facts.steps) == pytest.approx(joint.given, rel=1e-12)
        assert sum(step.taken[k] for step in facts.steps) == pytest.approx(joint.taken, rel=1e-9)
    assert facts.steps[1].given[0] == pytest.approx(2.0 * OMEGA * 1.2, rel=2e-3)  # to a tick at each end
    assert facts.steps[0].total.value == pytest.approx(2.0 * OMEGA + 1.0)
    assert facts.steps[2].power[1] == pytest.approx(abs(math.cos(3.0)))


def test_errors_are_those_of_the_joints_that_have_a_reference(facts: RunFacts) -> None:
    turn, slide = facts.joints
    assert turn.error is not None and turn.error_rms is not None
    assert (turn.error.value, turn.error.at) == pytest.approx((0.03, 3.0))
    assert turn.error_rms == pytest.approx(0.03 / math.sqrt(3.0), rel=1e-3)
    assert (slide.error, slide.error_rms) == (None, None)
    assert facts.errors.shape == (240, 2) and np.isnan(facts.errors[:, 1]).all()
    np.testing.assert_allclose(facts.errors[:, 0], 0.01 * facts.times, atol=0.01 * 3.0 / 240)


def test_limits_are_used_as_far_as_the_nearest_approach(facts: RunFacts) -> None:
    turn, slide = facts.joints
    assert turn.position is not None and turn.velocity is not None and turn.effort is not None
    # The middle of -1 to 3 is 1: the joint begins half way to its lower limit and ends a quarter of the way up.
    assert (turn.position.share, turn.position.limit, turn.position.at) == pytest.approx((0.5, -1.0, 0.0))
    assert turn.velocity.share == pytest.approx(OMEGA / 2.0)
    assert turn.effort.share == pytest.approx(0.5)
    assert slide.velocity is None
    assert slide.position is not None
    assert (slide.position.value, slide.position.at) == pytest.approx((0.1, math.pi / 2.0), abs=1e-3)
    assert (turn.saturated, slide.saturated, facts.actuators) == (12, 0, (("motor", 3),))


def test_a_slip_is_that_of_the_middle_of_the_body_in_the_tool_frame(facts: RunFacts) -> None:
    (held,) = facts.holds
    hold = held.hold
    assert (hold.body, hold.grasped, hold.lifted, hold.until, hold.ended) == ("cup", 0.8, 1.0, 2.5, "set down")
    assert held.slip is not None and held.rotation is not None
    assert held.slip.most == pytest.approx(0.004, abs=1e-9) and held.slip.at == pytest.approx(1.501)
    assert held.slip.last == pytest.approx(0.001, abs=1e-9)
    assert (held.rotation.most, held.rotation.last) == pytest.approx((0.05, 0.05), abs=1e-6)


def test_contact_forces_are_weighted_by_time(facts: RunFacts) -> None:
    (held,) = facts.holds
    assert (held.force.least, held.force.most) == (4.0, 6.0)
    assert held.force.mean == pytest.approx((1.2 * 6.0 + 0.5 * 4.0) / 1.7)
    assert (held.touching.least, held.touching.most) == (1, 2)
    assert held.links == ("hand", "arm")


def test_it_does_not_matter_where_spans_are_cut(facts: RunFacts) -> None:
    cut = run_facts(_recording(7), _robot(), _scene(), STEPS)
    assert cut.holds == facts.holds
    for one, other in zip(cut.joints, facts.joints, strict=True):
        assert (one.given, one.taken) == pytest.approx((other.given, other.taken), rel=1e-12)
        assert (one.error, one.position, one.velocity, one.effort) == (
            other.error, other.position, other.velocity, other.effort,
        )  # fmt: skip
    np.testing.assert_array_equal(cut.errors, facts.errors)


@pytest.mark.parametrize(
    ("contacts", "lifted", "until", "ended"),
    [
        (TOUCHES[:3], 1.0, 3.0, "held to the end"),
        ((*TOUCHES[:3], ContactSnapshot(2.0, ())), 1.0, 2.0, "lost"),
        ((*TOUCHES[:2], ContactSnapshot(2.0, (STANDS,))), None, 2.0, "let go"),
        # 30 ms without a touch, and 30 ms on the desk, are no end.
        (
            (*TOUCHES[:3], ContactSnapshot(1.2, ()), ContactSnapshot(1.23, (*FINGERS, STANDS)),
             ContactSnapshot(1.26, FINGERS), ContactSnapshot(2.0, ())),
            1.0, 2.0, "lost",
        ),
    ],
)  # fmt: skip
def test_how_a_hold_ends(contacts: tuple[ContactSnapshot, ...], lifted: float | None, until: float, ended: str) -> None:
    (held,) = run_facts(_recording(3, contacts), _robot(), _scene(), STEPS).holds
    assert (held.hold.lifted, held.hold.until, held.hold.ended) == (lifted, until, ended)


def test_what_the_hand_did_not_close_on_and_is_never_lifted_is_pushed_and_not_held() -> None:
    pushed = (
        ContactSnapshot(0.0, (STANDS,)),
        ContactSnapshot(1.0, (*FINGERS, STANDS)),
        ContactSnapshot(2.0, (STANDS,)),
    )
    recording = _recording(3, pushed)
    assert run_facts(recording, _robot(), _scene(), STEPS).holds == ()
    (held,) = run_facts(replace(recording, events=()), _robot(), _scene(), ()).holds  # no step says what the hand did
    assert held.hold.lifted is None


def test_a_brush_is_no_hold_and_what_stands_on_what_stands_is_supported() -> None:
    brush = (ContactSnapshot(1.0, FINGERS), ContactSnapshot(1.06, ()))
    assert run_facts(_recording(2, brush), _robot(), _scene(), STEPS).holds == ()
    stacked = (
        ContactSnapshot(0.5, (*FINGERS, Contact("cup", "plate", 1.0, 0.0), Contact("desk", "plate", 1.0, 0.0))),
        ContactSnapshot(1.5, ()),
    )
    (held,) = run_facts(_recording(2, stacked), _robot(), _scene(), STEPS).holds
    assert held.hold.lifted is None


def test_a_body_of_which_no_pose_is_recorded_has_no_slip() -> None:
    recording = _recording()
    (span,) = recording.spans
    unknown = replace(span.states, body_position=np.full_like(span.states.body_position, np.nan))
    found = run_facts(replace(recording, spans=(replace(span, states=unknown),)), _robot(), _scene(), STEPS)
    assert [(one.slip, one.rotation) for one in found.holds] == [(None, None)]
    assert found.holds[0].force.most == 6.0
