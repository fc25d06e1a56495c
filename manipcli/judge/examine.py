"""All expectations asked in one pass over the spans of a recording."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from manipcli.core.registry import Seam
from manipcli.judge.expectation import (
    END_WINDOW,
    Evidence,
    Expectation,
    Measured,
    NotEvaluated,
    Scope,
    outcome,
    worse,
)
from manipcli.judge.verdict import ExpectationOutcome, StepOutcome
from manipcli.model.condition import World
from manipcli.model.robot import RobotModel
from manipcli.model.scene import Scene
from manipcli.record.recording import Recording, Span, joined
from manipcli.spec.base import Model

_ROUNDING = 0.5e-9
"""[s] Recorded times are whole nanoseconds."""


@dataclass(frozen=True, slots=True)
class Examined:
    """One outcome an expectation, and the time [s] of the last recorded state."""

    outcomes: tuple[ExpectationOutcome, ...]
    end: float


def examine(
    recording: Recording,
    expect: Sequence[tuple[str, Model]],
    *,
    robot: RobotModel,
    scene: Scene,
    seam: Seam[Expectation[Any]],
    physics: bool,
    steps: tuple[StepOutcome, ...],
) -> Examined:
    """The worst answer to each of `expect`; the second and later of one word get a number (`near`, `near_2`).

    Every span is read, whatever is asked, so that damage anywhere in the file is noticed.
    """
    questions = [
        _Question(label, seam[name], spec) for label, (name, spec) in zip(_labels(expect), expect, strict=True)
    ]
    order = _Order.of(recording, robot, scene)
    evidence: Evidence | None = None
    ending = _Ending()
    end = 0.0
    for span in recording.spans:
        if span.states.time.size == 0:
            continue
        end = float(span.states.time[-1])
        if isinstance(order, NotEvaluated):
            continue
        ordered = order.applied(span)
        if evidence is None:
            start = ordered.states.map(lambda a: a[0])
            evidence = Evidence(World(robot, scene, start), physics, steps, recording.absent)
        _ask(questions, "always", evidence, ordered)
        ending.add(ordered)
    if evidence is None:
        none = order if isinstance(order, NotEvaluated) else NotEvaluated("the recording holds no state")
        return Examined(tuple(outcome(question.label, none) for question in questions), end)
    _ask(questions, "end", evidence, ending.span())
    return Examined(tuple(outcome(question.label, question.found()) for question in questions), end)


# Any: a seam holds members of different specs; each is only ever called with its own.
@dataclass(slots=True)
class _Question:
    """An expectation, and the worst answer to it so far."""

    label: str
    expectation: Expectation[Any]
    spec: Model
    worst: Measured | NotEvaluated | None = None

    def ask(self, evidence: Evidence, span: Span) -> None:
        answer = self.expectation.evaluate(self.spec, evidence, span)
        self.worst = answer if self.worst is None else worse(self.worst, answer)

    def found(self) -> Measured | NotEvaluated:
        return NotEvaluated("it was never asked") if self.worst is None else self.worst


def _ask(questions: Sequence[_Question], scope: Scope, evidence: Evidence, span: Span) -> None:
    for question in questions:
        if question.expectation.scope == scope:
            question.ask(evidence, span)


def _labels(expect: Sequence[tuple[str, Model]]) -> Iterator[str]:
    seen = Counter[str]()
    for name, _ in expect:
        seen[name] += 1
        yield name if seen[name] == 1 else f"{name}_{seen[name]}"


class _Ending:
    """The last spans, as many as it takes to hold the last `END_WINDOW` seconds."""

    def __init__(self) -> None:
        self._spans: deque[Span] = deque()

    def add(self, span: Span) -> None:
        self._spans.append(span)
        while len(self._spans) > 1 and self._spans[1].states.time[0] <= self._start():
            self._spans.popleft()

    def span(self) -> Span:
        return joined(self._spans).since(self._start())

    def _start(self) -> float:
        return float(self._spans[-1].states.time[-1]) - END_WINDOW - _ROUNDING


@dataclass(frozen=True, slots=True)
class _Order:
    """Where the robot's joints and the scene's movable bodies stand in the recorded arrays."""

    joints: list[int]
    bodies: list[int]

    @staticmethod
    def of(recording: Recording, robot: RobotModel, scene: Scene) -> _Order | NotEvaluated:
        """The order, or what is missing in the recording."""
        bodies = tuple(body.name for body in scene.movable)
        for kind, wanted, there in (
            ("joint", robot.joint_names, recording.joint_names),
            ("body", bodies, recording.body_names),
        ):
            missing = [name for name in wanted if name not in there]
            if missing:
                return NotEvaluated(f"the recording does not hold {kind} '{missing[0]}'")
        return _Order(
            [recording.joint_names.index(name) for name in robot.joint_names],
            [recording.body_names.index(name) for name in bodies],
        )

    def applied(self, span: Span) -> Span:
        """The span with the states in the order of robot and scene."""
        s, joints, bodies = span.states, self.joints, self.bodies
        states = replace(
            s,
            position=s.position[:, joints],
            velocity=s.velocity[:, joints],
            effort=s.effort[:, joints],
            body_position=s.body_position[:, bodies],
            body_quat_xyzw=s.body_quat_xyzw[:, bodies],
            body_linear=s.body_linear[:, bodies],
            body_angular=s.body_angular[:, bodies],
        )
        return replace(span, states=states)
