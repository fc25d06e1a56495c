"""A plan as a playback: robot and scene as predicted, and dropped candidates as ghosts, before any simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform
from manipcli.plan.candidates import Dropped
from manipcli.plan.motion import Motion
from manipcli.plan.planned_states import PlannedStates, planned_states
from manipcli.plan.sweep import first_hit
from manipcli.replay.ghost import Ghost, ghost_of
from manipcli.replay.playback import RATE, Phase, Playback, PlaybackStep
from manipcli.task.plan_steps import PlannedStep
from manipcli.task.plan_task import Plan, spans

MOST_GHOSTS: Final = 8
"""Ghosts of a page; it has eight colours, and more hide the motion."""
_STILL: Final = 1.0  # s of a page on which nothing moves
NOTE: Final = "planned, not simulated: bodies are where the planner predicts them"


def planned_playback(plan: Plan, name: str, *, rate: float = RATE) -> Playback:
    """The plan sampled at `rate` [Hz]; torques are shown as efforts."""
    notes = [NOTE]
    if len(plan.combinations) > 1:
        first = plan.combinations[0].branch
        notes.append(f"this is the branch {first}, of {len(plan.combinations)} branches")
    plan = plan.merged
    states, steps, clock = [], [], 0.0
    for step in plan.steps:
        begins, phases = clock, []
        for motion, start, end in spans(step.plan.motions, step.start, step.plan.end):
            states.append((clock, planned_states(plan.planner, motion, end, begins=start, period=1.0 / rate)))
            phases.append(Phase(motion.label, clock, clock + motion.duration))
            clock += motion.duration
        steps.append(PlaybackStep(step.id, step.verb, step.id, begins, clock, "done", phases=tuple(phases)))
    return replace(_playback(plan, name, states, tuple(steps)), notes=tuple(notes))


def refused_playback(plan: Plan, name: str, refusal: NotPlannable) -> tuple[Playback, tuple[Ghost, ...]]:
    """A task without a plan: still at its start, with the reason, and a ghost of what was planned of the refused step.

    Args:
        plan: without steps.
        name: of the task.
        refusal: why it has no plan.
    """
    tried = _last_tried(refusal)
    ghost = _run(plan, _motions(tried), tried, 0.0) if tried is not None else None
    times = np.array([0.0, _STILL]) if ghost is None else ghost.times
    n, step = len(plan.start.position), str(refusal.step or "")
    still = np.zeros((len(times), n))
    states = PlannedStates(times, still + plan.start.position, still, still, still, (plan.start.bodies,) * len(times))
    end = float(times[-1])
    shown = _playback(plan, name, [(0.0, states)], (PlaybackStep(step, "", step, 0.0, end, "failed", refusal.cause),))
    groups = (f"{one.count} refused: {one.step}, {one.stage}: {one.cause}" for one in refusal.candidates)
    reasons = (f"no plan: {refusal}", *([f"hint: {refusal.hint}"] if refusal.hint else []), *groups)
    ghosts = () if ghost is None else (ghost_of(f"{step}: refused", ghost, shown),)
    return replace(shown, notes=("not simulated: the start of the task", *reasons)), ghosts


def planned_ghosts(plan: Plan, shown: Playback) -> tuple[tuple[Ghost, ...], int]:
    """Ghosts of the dropped candidates, as far as each was planned, in the time of their steps; and how many more
    there are."""
    found: list[Ghost] = []
    tried = [
        (step, at, one, motions)
        for step, at in zip(plan.merged.steps, shown.steps, strict=True)
        for one in step.dropped
        if (motions := _motions(one))
    ]
    for step, at, one, motions in tried[:MOST_GHOSTS]:
        found.append(ghost_of(_name(step, one), _run(plan, motions, one, at.start), shown))
    return tuple(found), len(tried) - len(found)


@dataclass(frozen=True, slots=True, eq=False)
class TriedPath:
    """A path of the tool that was tried and dropped.

    Attributes:
        step: id of the step.
        points: (T, 3) [m] of the tool in the world.
        at: index of the point at which two parts come nearer than the clearance of planning; None if they do not.
        between: these parts, `hand and wall`.
    """

    step: str
    points: Array
    at: int | None = None
    between: str = ""


def tried_paths(plan: Plan) -> tuple[TriedPath, ...]:
    """The tool paths of the straight motions and the candidates that were tried and dropped; equal ones once."""
    found: list[TriedPath] = []
    for step in plan.merged.steps:
        for motion in step.plan.motions:
            if motion.straight is not None:
                straight = replace(motion, trajectory=motion.straight, grip=None, duration=motion.straight.duration)
                found.append(_tried(plan, step.id, (straight,), Dropped("", NotPlannable(""))))
        found += [_tried(plan, step.id, motions, one) for one in step.dropped if (motions := _motions(one))]
    return _distinct(found)


def refused_path(plan: Plan, refusal: NotPlannable) -> tuple[TriedPath, ...]:
    """The tool path of what was planned of a refused step; none if nothing was."""
    tried = _last_tried(refusal)
    return () if tried is None else (_tried(plan, str(refusal.step or ""), _motions(tried), tried),)


def _tried(plan: Plan, step: str, motions: Sequence[Motion], one: Dropped) -> TriedPath:
    run = _run(plan, motions, one, 0.0)
    last = motions[-1]
    path, begins = run.tool_path(), run.end - last.duration
    state = last.begins
    if state is None:
        return TriedPath(step, path)
    hit = first_hit(plan.planner, state, plan.planner.query(state, last.allowed), last.trajectory, last.grip)
    if hit is None:
        return TriedPath(step, path)
    parts = " and ".join(name.removeprefix("robot/") for name in (hit.a, hit.b))
    return TriedPath(step, path, run.index(begins + hit.time), parts)


def _distinct(paths: Sequence[TriedPath]) -> tuple[TriedPath, ...]:
    kept: list[TriedPath] = []
    for path in paths:
        same = (one for one in kept if one.points.shape == path.points.shape)
        if not any(np.allclose(path.points, one.points, atol=1e-3) for one in same):
            kept.append(path)
    return tuple(kept)


def _last_tried(refusal: NotPlannable) -> Dropped | None:
    """The refusal with the motions that were planned before it: the reported one has none, its cause has."""
    last: BaseException | None = refusal
    while isinstance(last, NotPlannable) and not last.motions:
        last = last.__cause__
    return Dropped("", last) if isinstance(last, NotPlannable) else None


def _name(step: PlannedStep, one: Dropped) -> str:
    return f"{step.id}: {one.name}" if one.name else f"{step.id}: dropped candidate"


def _motions(one: Dropped) -> tuple[Motion, ...]:
    if one.plan is not None:
        return one.plan.motions
    motions = [motion for motion in one.refusal.motions if isinstance(motion, Motion)]
    return tuple(
        replace(motion, duration=max(motion.duration, motion.trajectory.duration)) if motion.trajectory else motion
        for motion in motions
    )


def _run(plan: Plan, motions: Sequence[Motion], one: Dropped, clock: float) -> Playback:
    start = next((motion.begins for motion in motions if motion.begins is not None), plan.start)
    last = motions[-1]
    end = one.plan.end if one.plan is not None else last.begins or start
    if one.plan is None and last.trajectory is not None:
        position = np.array(end.position)
        position[list(plan.planner.robot.indices(last.trajectory.names))] = last.trajectory.positions[-1]
        end = end.moved(position)
    states = []
    for motion, before, after in spans(motions, start, end):
        states.append((clock, planned_states(plan.planner, motion, after, begins=before)))
        clock += motion.duration
    return _playback(plan, one.name, states, ())


def _playback(
    plan: Plan, name: str, states: Sequence[tuple[float, PlannedStates]], steps: tuple[PlaybackStep, ...]
) -> Playback:
    times = np.concatenate([clock + each.times for clock, each in states])
    # The last state of a motion is the first of the next.
    kept = np.append(np.diff(times) > 1e-9, True)
    position, velocity, torque = (
        np.concatenate([getattr(each, of) for _, each in states])[kept] for of in ("position", "velocity", "torque")
    )
    bodies = [row for _, each in states for row in each.bodies]
    rows = [row for row, keep in zip(bodies, kept, strict=True) if keep]
    count = len(plan.start.bodies)

    def stacked(of: str, size: int) -> np.ndarray:
        values = [[_part(X, of) for X in row] for row in rows]
        return np.array(values, dtype=np.float64).reshape(len(rows), count, size)

    return Playback(
        name=name,
        robot=plan.planner.robot,
        scene=plan.planner.scene,
        joint_names=tuple(plan.planner.robot.joint_names),
        times=times[kept],
        position=position,
        velocity=velocity,
        effort=torque,
        reference=np.full_like(position, np.nan),
        body_position=stacked("p", 3),
        body_quat_xyzw=stacked("quat_xyzw", 4),
        contacts=((),) * len(rows),
        contact_times=((),) * len(rows),
        steps=steps,
        notes=(NOTE,),
    )


def _part(X: Transform, of: str) -> np.ndarray:
    return np.asarray(getattr(X, of))
