"""The ghost of a plan: the robot and the bodies as planned before the run, at the times of the run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.plan.block_tree import Outcomes
from manipcli.plan.motion import PlanningState
from manipcli.plan.planned_states import planned_states
from manipcli.record.recording import TaskEvent
from manipcli.replay.ghost import Ghost
from manipcli.replay.playback import Playback
from manipcli.task.plan_steps import PlannedStep
from manipcli.task.plan_task import Plan, spans

NAME: Final = "planned"
_PERIOD: Final = 0.01
"""Of the planned states [s], between which joints are interpolated; the last is up to 1.5 periods later."""
_ROUNDING: Final = 1e-6  # [s] of the times of a log


def planned_ghost(plan: Plan, shown: Playback) -> Ghost | None:
    """The ghost of the plan in the replay of its run.

    The planned motions of a step begin at the recorded start of each attempt at it, without the waits between them; at
    the planned end, the ghost waits for the next step. It is not drawn before the first step, and during steps that
    were not planned before the run.

    Args:
        plan: of the task of the run, made from its files.
        shown: the run, with its events.

    Returns:
        None if no step of the plan began.
    """
    position = shown.stance.copy()
    body = np.concatenate([shown.body_position, shown.body_quat_xyzw], axis=2)
    visible: list[tuple[float, float]] = []
    for (start, step), (end, _) in pairwise([*_attempts(plan, shown.events), (math.inf, None)]):
        rows = np.flatnonzero((shown.times > start - _ROUNDING) & (shown.times < end - _ROUNDING))
        if step is None or not len(rows):
            continue
        position[rows], body[rows] = _track(plan, step).at(shown.times[rows] - start)
        visible.append((start, min(end, shown.end)))
    return Ghost(NAME, position, body, kind="planned", visible=tuple(visible)) if visible else None


def _attempts(plan: Plan, events: Sequence[TaskEvent]) -> list[tuple[float, PlannedStep | None]]:
    """The start [s] of every attempt at a step, with its plan along the branches that were taken; None without one."""
    outcomes: Outcomes = ()
    entered: dict[str, Outcomes] = {}  # by block, in the order of their first start
    planned = _by_id(plan.along(outcomes))
    found: list[tuple[float, PlannedStep | None]] = []
    for event in events:
        if event.kind == "step_started":
            step = planned.get(event.step)
            if found and found[-1][0] == event.time and found[-1][1] is step:
                continue  # done at the same time as the step before: both have one plan
            found.append((event.time, step))
        elif event.kind == "block_started" and event.step in entered:
            # Another attempt makes its choices again, and so do the blocks in it.
            names = [*entered]
            entered = {name: entered[name] for name in names[: names.index(event.step) + 1]}
            outcomes = entered[event.step]
            planned = _by_id(plan.along(outcomes))
        elif event.kind == "block_started":
            entered[event.step] = outcomes
        elif event.kind == "branch":
            outcomes = (*outcomes, event.outcome == "then")
            planned = _by_id(plan.along(outcomes))
    return found


def _by_id(plan: Plan) -> dict[str, PlannedStep]:
    """The steps by id; two at the same time have one plan, for both ids."""
    merged = iter(plan.merged.steps)
    found: dict[str, PlannedStep] = {}
    step: PlannedStep | None = None
    for each in plan.steps:
        step = step if each.beside and step is not None else next(merged)
        found[each.id] = step
    return found


@dataclass(frozen=True, slots=True, eq=False)
class _Track:
    """Planned states of a step at times (T,) [s] from its start; `rows`: (T, n + 7 m), n `joints`, then m bodies."""

    times: Array
    rows: Array
    joints: int

    def at(self, times: Array) -> tuple[Array, Array]:
        """Joint positions (k, n) and poses of the bodies (k, m, 7), interpolated; after the end, the last ones."""
        n = self.joints
        values = np.stack([np.interp(times, self.times, column) for column in self.rows.T], axis=1)
        body = values[:, n:].reshape(len(times), -1, 7)
        body[..., 3:] /= np.linalg.norm(body[..., 3:], axis=-1, keepdims=True)
        return values[:, :n], body


def _track(plan: Plan, step: PlannedStep) -> _Track:
    clock, times, rows = 0.0, [], []
    for motion, begins, ends in spans(step.plan.motions, step.start, step.plan.end):
        states = planned_states(plan.planner, motion, ends, begins=begins, period=_PERIOD)
        times += (clock + states.times).tolist()
        rows += [
            _row(replace(begins, position=q, bodies=bodies))
            for q, bodies in zip(states.position, states.bodies, strict=True)
        ]
        clock += motion.duration
    if not rows:
        times, rows = [0.0], [_row(step.plan.end)]
    table = np.array(rows)
    n = len(step.start.position)
    quats = table[:, n:].reshape(len(table), -1, 7)[..., 3:]
    # A quaternion and its negative are one rotation; interpolation needs the nearer one.
    signs = np.where((quats[1:] * quats[:-1]).sum(axis=-1) < 0.0, -1.0, 1.0)
    quats[1:] *= np.cumprod(signs, axis=0)[..., None]
    return _Track(np.array(times), table, n)


def _row(state: PlanningState) -> Array:
    return np.concatenate([state.position, *([*X_WO.p, *X_WO.quat_xyzw] for X_WO in state.bodies)])
