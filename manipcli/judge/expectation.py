"""The contract of expectations: what a task may expect of its recording, each answered with a signed margin.

An expectation is asked about spans of the recording and the worst answer counts; its scope says about which spans, so
that a recording of any length is judged in bounded memory. Every condition is an expectation too: it must hold at the
end (`at_end`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, Literal, TypeVar

import numpy as np

from manipcli.core.geometry import Array
from manipcli.core.units import readable
from manipcli.judge.verdict import ExpectationOutcome, StepOutcome
from manipcli.model.condition import Condition, Problem, World, needs_physics
from manipcli.model.robot import RobotModel
from manipcli.model.scene import Scene
from manipcli.record.channels import TF
from manipcli.record.recording import Span
from manipcli.spec.base import Model
from manipcli.spec.quantity import Unit

END_WINDOW = 0.5
"""How long [s] a condition must hold up to the end of the recording: passing through is not being there."""

Scope = Literal["always", "end"]
"""What an expectation is asked about: every span of the recording, or one span of its last `END_WINDOW` seconds (all
of it when it is shorter)."""

S = TypeVar("S", bound=Model)


@dataclass(frozen=True, slots=True)
class Evidence:
    """What expectations are judged by, besides the span they are asked about.

    Attributes:
        world: robot, scene, and the first recorded state as the start.
        physics: False when the engine moved no bodies and knew no contacts.
        steps: how the steps went.
        absent: topics that the task told not to record.
    """

    world: World
    physics: bool
    steps: tuple[StepOutcome, ...]
    absent: tuple[str, ...] = ()

    def lacks(self, topic: str) -> str | None:
        """Why nothing can be said that needs this topic; None where it is there."""
        if topic not in self.absent:
            return None
        return f"the log holds no {topic}: `record:` of the task leaves it out"


@dataclass(frozen=True, slots=True)
class Measured:
    """What an expectation found: the worst `margin` (>= 0 passes) in `unit`, when [s], and about what."""

    margin: float
    unit: str
    at: float | None
    text: str = ""


@dataclass(frozen=True, slots=True)
class NotEvaluated:
    """Why an expectation could not be judged; that is never a pass."""

    reason: str
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Expectation(Generic[S]):
    """A member of the seam.

    Attributes:
        name: the word in YAML.
        spec: what the user writes under that word.
        scope: which spans it is asked about.
        evaluate: (spec, evidence, span) -> the worst margin in the span, or why there is none. The span has at least
            one tick; its states follow robot and scene of the evidence.
        check: (spec, robot, scene, ids of the task's steps) -> what in the spec these do not know.
    """

    name: str
    spec: type[S]
    scope: Scope
    evaluate: Callable[[S, Evidence, Span], Measured | NotEvaluated]
    check: Callable[[S, RobotModel, Scene, tuple[str, ...]], tuple[Problem, ...]]


def at_end(condition: Condition[Any]) -> Expectation[Any]:
    """The expectation that a condition holds at the end: its smallest margin there, which bounds the last state's."""

    def evaluate(spec: Model, evidence: Evidence, span: Span) -> Measured | NotEvaluated:
        scene = evidence.world.scene
        if not evidence.physics and needs_physics(condition, spec, scene):
            movable = {body.name for body in scene.movable}
            names = ", ".join(f"'{name}'" for name in condition.bodies(spec, scene) if name in movable)
            return NotEvaluated(f"the engine has no physics, so {names} never moved", condition.unit)
        reason = evidence.lacks(TF)
        if reason is not None and needs_physics(condition, spec, scene):
            return NotEvaluated(reason, condition.unit)
        margins = condition.margin(spec, evidence.world, span.states)
        return worst(margins, span.states.time, condition.unit, describe(spec))

    def check(spec: Model, robot: RobotModel, scene: Scene, steps: tuple[str, ...]) -> tuple[Problem, ...]:
        return condition.check(spec, robot, scene)

    return Expectation(name=condition.name, spec=condition.spec, scope="end", evaluate=evaluate, check=check)


def worst(margins: Array, times: Array, unit: str, text: str) -> Measured | NotEvaluated:
    """The smallest of `margins` (T,) and the first moment it was met."""
    if not np.all(np.isfinite(margins)):
        at = float(times[int(np.argmin(np.isfinite(margins)))])
        return NotEvaluated(f"the recorded state is not finite at t = {at:.3f} s", unit)
    k = int(np.argmin(margins))
    return Measured(margin=float(margins[k]), unit=unit, at=float(times[k]), text=text)


def worse(one: Measured | NotEvaluated, other: Measured | NotEvaluated) -> Measured | NotEvaluated:
    """The answer that counts of two, the first of equal ones: what could not be evaluated once, never passes."""
    if isinstance(one, NotEvaluated):
        return one
    return other if isinstance(other, NotEvaluated) or other.margin < one.margin else one


def describe(spec: Model) -> str:
    """What was written, in one line and in the units of people: `object: cup, within: 5 deg`."""
    written = spec.model_dump(exclude_defaults=True)
    return ", ".join(f"{key}: {_described(value, type(spec), key)}" for key, value in written.items())


def _described(value: object, spec: type[Model], key: str) -> str:
    """A value of the field `key`; a number of one dimension gets its unit."""
    if isinstance(value, float):
        units = [unit for unit in spec.model_fields[key].metadata if isinstance(unit, Unit)]
        if len(units) == 1 and len(units[0].dimensions) == 1:
            return readable(value, units[0].dimensions[0].symbol)
        return f"{value:.6g}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(f'{v:.6g}' if isinstance(v, float) else str(v) for v in value)}]"
    return str(value)


def outcome(name: str, found: Measured | NotEvaluated) -> ExpectationOutcome:
    """The outcome of an expectation called `name`: met from a margin of zero on."""
    if isinstance(found, NotEvaluated):
        return ExpectationOutcome(
            name=name, outcome="not_evaluated", margin=None, unit=found.unit, at=None, text=found.reason
        )
    return ExpectationOutcome(
        name=name,
        outcome="passed" if found.margin >= 0.0 else "failed",
        margin=found.margin,
        unit=found.unit,
        at=found.at,
        text=found.text,
    )
