"""The plan carried out: the loop over steps, between the engine that moves and the recorder that sees."""

from __future__ import annotations

import time as wall_clock
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from manipcli.control.action import GoalHandle
from manipcli.control.controller import ControllerOutput
from manipcli.control.factory import build_controllers
from manipcli.control.manager import ControllerManager
from manipcli.core.errors import Finding, SimulationFailed
from manipcli.flow.live import Live
from manipcli.flow.load import Task
from manipcli.flow.plan import Plan, PlannedStep
from manipcli.judge.verdict import StepOutcome
from manipcli.model.condition import World
from manipcli.model.kinematics import Kinematics
from manipcli.model.state import Contact, WorldState
from manipcli.record.recorder import Recorder
from manipcli.simulate.engine import EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.simulate.executor import DONE, Executor, MotionEnd, Until
from manipcli.simulate.quiet import stdout_to_stderr
from manipcli.simulate.session import Session
from manipcli.spec.task import StepSpec

DEFAULT_UNTIL_TIME: Final = 30.0
"""How long [s] an `until` without `timeout` is waited for."""
SETTLED_SPEED: Final = 0.02
"""Bodies slower than this [m/s] have settled."""
SETTLED_SHIFT: Final = 0.01
"""A body that moves further than this [m] while settling was put where it cannot stay."""
AFTERMATH: Final = 0.6
"""How long [s] the world is watched after the last step, so that "at rest" can be judged."""
LEFT_BEHIND: Final = 0.05
"""A held object further than this [m] from where it was planned is no longer held."""
MOST_CUT: Final = 3
"""Joints that are named as cut at their limits."""
FEEDBACK_PERIOD: Final = 0.05
"""[s] between two records of how far a goal is, as ROS's action servers tell it."""
PROGRESS_TICKS: Final = 50
"""Control ticks between two times that are told to whoever shows the progress."""


class Progress(Protocol):
    """Whoever shows how far a run is."""

    def warned(self, findings: Sequence[Finding]) -> None:
        """What may go wrong, known before the first step."""
        ...

    def step_started(self, step: PlannedStep, index: int, total: int) -> None:
        """Step `index` (from 0) of `total` begins."""
        ...

    def tick(self, simulated_time: float, wall: float) -> None:
        """Now and then; both [s] from the start."""
        ...

    def step_ended(self, outcome: StepOutcome) -> None:
        """A step is over, well or not."""
        ...


@dataclass(frozen=True, slots=True)
class _Goal:
    """A goal on its way, and the number by which the log knows it."""

    controller: str
    number: int
    handle: GoalHandle


class Watch:
    """Hands every tick to the recorder and to live conditions, and now and then the time to who shows the progress."""

    def __init__(self, recorder: Recorder, progress: Progress | None, period: float, live: Live) -> None:
        self._recorder = recorder
        self._live = live
        self._progress = progress
        self._period = period
        self._began = wall_clock.perf_counter()
        self._feedback_ticks = max(1, round(FEEDBACK_PERIOD / period))
        self._next_tick = 0
        self._goals: list[_Goal] = []

    def tick(self, tick: int, state: WorldState, outputs: Sequence[ControllerOutput | None]) -> None:
        self._recorder.tick(tick, state, outputs)
        self._live.tick(tick, state, outputs)
        self._next_tick = tick + 1
        if self._goals:
            self._follow(tick)
        if self._progress is not None and tick % PROGRESS_TICKS == 0:
            self._progress.tick(tick * self._period, wall_clock.perf_counter() - self._began)

    def contacts(self, tick: int, contacts: tuple[Contact, ...]) -> None:
        self._recorder.contacts(tick, contacts)
        self._live.contacts(tick, contacts)

    def goal(self, controller: str, handle: GoalHandle) -> None:
        """A controller has a new goal; one that it had before may have ended by that."""
        self._follow(self._next_tick)
        self._goals.append(_Goal(controller, self._recorder.goal_sent(self._next_tick, controller), handle))

    def _follow(self, tick: int) -> None:
        """Records the ends of goals, and now and then how far they are."""
        for goal in [*self._goals]:
            result = goal.handle.result
            if result is not None:
                self._recorder.goal_ended(tick, goal.controller, goal.number, result, goal.handle.feedback())
                self._goals.remove(goal)
            elif tick % self._feedback_ticks == 0 and tick < self._next_tick:
                self._recorder.goal_feedback(tick, goal.controller, goal.number, goal.handle.feedback())


def controllers(task: Task, kinematics: Kinematics | None = None) -> ControllerManager:
    """The task's controllers, for its robot (and its `kinematics`, if they are at hand) and control period."""
    file = task.controllers_file
    period = task.spec.simulation.control_period
    compat = task.robot_file.spec.compat
    return build_controllers(
        file.spec, task.robot, period, place=lambda loc: file.place(*loc), kinematics=kinematics, compat=compat
    )


def simulate(task: Task, plan: Plan, manager: ControllerManager, recorder: Recorder, progress: Progress | None) -> None:
    """Run the plan in the task's engine; what happens is in the recorder afterwards, also when it raises.

    Raises:
        SimulationFailed: the world does not stand still before the start, or leaves the plausible.
    """
    simulation = task.spec.simulation
    settings = EngineSettings(
        step=simulation.step,
        substeps=round(simulation.control_period / simulation.step),
        start=plan.start.position,
    )
    engine = ENGINES[simulation.engine].open(task.robot, task.scene, settings)
    try:
        with stdout_to_stderr():
            session = Session(
                robot=task.robot,
                scene=task.scene,
                engine=engine,
                manager=manager,
                period=simulation.control_period,
            )
            _settle(task, session)
            live = Live(_world(task, plan, session), manager.controllers, simulation.control_period)
            watch = Watch(recorder, progress, simulation.control_period, live)
            session.restart_clock(watch)
            try:
                _Run(task, plan, session, recorder, progress, watch, live).steps()
            finally:
                for kind, ticks in _saturated_ticks(session).items():
                    counts = {name: str(count) for name, count in ticks.items() if count}
                    if counts:
                        recorder.metadata(kind, counts)
    finally:
        engine.close()


def _saturated_ticks(session: Session) -> dict[str, dict[str, int]]:
    """In how many ticks each joint's command was cut at its limits, and each actuator had no more to give."""
    joints = dict(zip(session.robot.joint_names, map(int, session.saturations), strict=True))
    actuators = dict(zip(session.actuation.names, map(int, session.actuation.saturations), strict=True))
    return {"saturated joints": joints, "saturated actuators": actuators}


def _world(task: Task, plan: Plan, session: Session) -> World:
    """What live conditions are asked in; the present state is that at time 0."""
    return World(
        task.robot,
        task.scene,
        start=session.engine.read().map(np.copy),
        physics=ENGINES[task.spec.simulation.engine].physics == "full",
        referenced=frozenset(name for one in session.manager.controllers if one.interfaces for name in one.joints),
        steps=tuple(step.id for step in plan.steps),
    )


def _settle(task: Task, session: Session) -> None:
    """Let everything come to rest, and refuse a start from which something slides, falls or is thrown.

    Raises:
        SimulationFailed: names the body, and how far or how fast it moved.
    """
    Executor(session).hold(task.spec.simulation.settle)
    state = session.engine.read()
    for k, body in enumerate(task.scene.movable):
        shift = float(np.linalg.norm(state.body_position[k] - body.X_WO.p))
        speed = float(np.linalg.norm(state.body_linear[k]))
        if not shift < SETTLED_SHIFT:
            raise SimulationFailed(
                f"'{body.name}' overlaps something, or stands on nothing: it moved by {1000 * shift:.1f} mm "
                "while the world came to rest",
                time=0.0,
            )
        if not speed < SETTLED_SPEED:
            raise SimulationFailed(f"'{body.name}' does not come to rest ({speed:.3g} m/s before the start)", time=0.0)


def _cut_since(before: dict[str, dict[str, int]], session: Session, tick: int) -> str:
    """What had nothing left to give since `tick`, the worst first; nothing where everything had."""
    counts = {
        f"{kind.removeprefix('saturated ').removesuffix('s')} '{name}'": count - before[kind][name]
        for kind, ticks in _saturated_ticks(session).items()
        for name, count in ticks.items()
    }
    worst = sorted((name for name, count in counts.items() if count), key=lambda name: -counts[name])[:MOST_CUT]
    cut = ", ".join(f"{name} in {counts[name]}" for name in worst)
    return f"; cut at its limits: {cut} of {session.ticks - tick} ticks" if cut else ""


class _Run:
    """One pass over the steps."""

    def __init__(
        self,
        task: Task,
        plan: Plan,
        session: Session,
        recorder: Recorder,
        progress: Progress | None,
        watch: Watch,
        live: Live,
    ) -> None:
        self._task = task
        self._live = live
        self._plan = plan
        self._session = session
        self._recorder = recorder
        self._progress = progress
        self._physics = ENGINES[task.spec.simulation.engine].physics == "full"
        self._executor = Executor(session, touch=self._physics, told=watch.goal)

    def steps(self) -> None:
        """Every step in order, until one is not done."""
        total = len(self._plan.steps)
        for index, (step, planned) in enumerate(zip(self._task.spec.steps, self._plan.steps, strict=True)):
            if self._progress is not None:
                self._progress.step_started(planned, index, total)
            outcome = self._step(index, step, planned)
            if self._progress is not None:
                self._progress.step_ended(outcome)
            if outcome.outcome != "done":
                break
        self._executor.hold(AFTERMATH)

    def _step(self, index: int, step: StepSpec, planned: PlannedStep) -> StepOutcome:
        place = self._task.log_place("steps", index)
        started, ticks = self._session.time, self._session.ticks
        saturated = _saturated_ticks(self._session)
        self._event("step_started", planned, "", "", place)
        self._live.step_started(planned.id)
        try:
            end = self._motions(step, planned, started, place)
        except SimulationFailed as failure:
            text = str(failure) + _cut_since(saturated, self._session, ticks)
            self._event("step_ended", planned, "failed", text, place)
            raise
        if end.outcome != "done":
            end = MotionEnd(end.outcome, end.text + _cut_since(saturated, self._session, ticks))
        self._event("step_ended", planned, end.outcome, end.text, place)
        self._live.step_ended(planned.id, end.outcome)
        return StepOutcome(
            id=planned.id,
            verb=planned.verb,
            outcome=end.outcome,
            started=started,
            ended=self._session.time,
            planned_duration=planned.plan.duration,
            text=end.text,
        )

    def _motions(self, step: StepSpec, planned: PlannedStep, started: float, place: str) -> MotionEnd:
        until = self._until(step)
        deadline = None if step.timeout is None else started + step.timeout
        awaited = until is not None
        texts = []
        for motion in planned.plan.motions:
            self._event("phase_started", planned, "", motion.label, place)
            over = deadline
            if motion.awaits and until is not None and over is None:
                over = self._session.time + motion.duration + DEFAULT_UNTIL_TIME
            end = self._executor.run(motion, until=until, deadline=over)
            if end.outcome != "done":
                return MotionEnd(end.outcome, f"{motion.label}: {end.text}")
            awaited = awaited and not motion.awaits
            texts += [end.text] if end.text else []
        if awaited and until is not None:
            if deadline is None:
                deadline = self._session.time + DEFAULT_UNTIL_TIME
            end = self._executor.wait(until, deadline=deadline)
            if end.outcome != "done":
                return end
        return self._left_behind(planned) or (MotionEnd("done", "; ".join(texts)) if texts else DONE)

    def _left_behind(self, planned: PlannedStep) -> MotionEnd | None:
        """A failure where the object that the step ends with in the hand is not there; None where it is."""
        carried = planned.plan.end.carried
        if carried is None or not self._physics:
            return None
        scene = self._task.scene
        k = scene.movable.index(scene.body(carried.body))
        away = float(np.linalg.norm(self._session.state.body_position[k] - planned.plan.end.bodies[k].p))
        if away <= LEFT_BEHIND:
            return None
        where = f"'{carried.body}' is {1000 * away:.0f} mm from where the hand was to hold it"
        return MotionEnd("failed", f"{where}: it slipped, or was never held")

    def _until(self, step: StepSpec) -> Until | None:
        """The step's condition, asked until it ends; None where there is none, or only physics could answer it."""
        if step.until is None or self._live.absent(step.until) is not None:
            return None
        probe = self._live.open(step.until, step=step.id)
        return lambda _: probe.holds

    def _event(self, kind: str, step: PlannedStep, outcome: str, text: str, place: str) -> None:
        self._recorder.event(
            self._session.ticks, kind=kind, step=step.id, verb=step.verb, outcome=outcome, text=text, place=place
        )
