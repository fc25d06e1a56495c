"""Evaluation of all expectations in one pass over the spans of a recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from manipcli.conditions.condition import World
from manipcli.conditions.formula import Seams, leaves
from manipcli.conditions.robustness import NotEvaluated
from manipcli.conditions.sensed import Sensed
from manipcli.conditions.state_window import ROUNDING, StateWindow
from manipcli.core.geometry import Array
from manipcli.judge.expectation import Expected, labels, outcome
from manipcli.judge.located import Correction, Corrections
from manipcli.judge.margin_curves import MarginTraces
from manipcli.judge.self_contacts import SelfContact, SelfContacts
from manipcli.judge.state_windows import Order, WindowsOfSpans, at_every_tick, unrecorded
from manipcli.judge.verdict import ExpectationOutcome, StepOutcome
from manipcli.model.robot import RobotModel
from manipcli.record.recording import Recording
from manipcli.scene.scene import Scene
from manipcli.spec.condition import ExpectationSpec


@dataclass(frozen=True, slots=True)
class Examined:
    """The outcome of each expectation, the time [s] of the last recorded state, the contacts of the robot with itself,
    and the corrections of what it believes."""

    outcomes: tuple[ExpectationOutcome, ...]
    end: float
    self_contacts: tuple[SelfContact, ...]
    located: tuple[Correction, ...]


def examine(
    recording: Recording,
    expect: Sequence[ExpectationSpec],
    *,
    robot: RobotModel,
    scene: Scene,
    seam: Seams,
    physics: bool,
    steps: tuple[StepOutcome, ...],
    sensors: Mapping[str, Sensed],
    until: float = inf,
    traces: MarginTraces | None = None,
) -> Examined:
    """The outcomes of `expect` before the time `until` [s]; `sensors`: of the task; `traces`: get
    their margins.

    Every span is read, even without expectations, so damage anywhere in the file is detected. Only the last half second
    is kept in memory.
    """
    order = Order.of(recording, robot, scene)
    successive: WindowsOfSpans | None = None
    asked: list[Expected] = []
    stateless = [all(seam[leaf.name].stateless for leaf in leaves(expectation.condition)) for expectation in expect]
    last: StateWindow | None = None
    end = judged = 0.0
    self_contacts, located = SelfContacts(), Corrections(recording)
    for span in recording.spans:
        self_contacts.add(span.contacts)
        located.add(span)
        if span.states.time.size == 0:
            continue
        end = float(span.states.time[-1])
        if isinstance(order, NotEvaluated):
            continue
        if successive is None:
            successive = WindowsOfSpans(order, steps)
            states = order.applied(span.states)
            believed = order.belief(states, span.believed)
            world = World(
                robot,
                scene,
                start=states.map(lambda a: a[0]),
                physics=physics,
                unrecorded=unrecorded(recording),
                referenced=frozenset(name for trace in span.controllers for name in trace.joints),
                steps=tuple(step.id for step in steps),
                period=_period(span.states.time, recording.period),
                sensors={name: sensors[name] for name in recording.sensors},
            )
            if believed is not None:
                world = replace(world, belief=replace(world, start=believed.map(lambda a: a[0])))
            asked = [
                Expected(expectation, world, steps, seam, None if traces is None else traces.next())
                for expectation in expect
            ]
        window = successive.next(span)
        if window.times[0] >= until - ROUNDING:
            continue
        window = window.part(0, int(np.searchsorted(window.times, until - ROUNDING)))
        judged = float(window.times[-1])
        last = every = at_every_tick(window, last, recording.period)
        for expected, uses_no_state in zip(asked, stateless, strict=True):
            expected.look(every if uses_no_state else window)
    names = labels(expect)
    if successive is None:
        missing = order if isinstance(order, NotEvaluated) else NotEvaluated("no tick was recorded")
        return Examined(tuple(outcome(name, missing) for name in names), end, self_contacts.found(), located.found())
    found = (outcome(name, expected.found(judged)) for name, expected in zip(names, asked, strict=True))
    return Examined(tuple(found), end, self_contacts.found(), located.found())


def _period(times: Array, control: float) -> float:
    """[s] between two recorded ticks, which can be more than the control period `control` [s]."""
    return float(times[1] - times[0]) if len(times) > 1 else control
