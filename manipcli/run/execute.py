"""Execution of a plan in an engine: open the world, let it settle, run the steps."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from manipcli.conditions.condition import World
from manipcli.control.factory import build_controllers
from manipcli.control.manager import ControllerManager
from manipcli.core.errors import SimulationFailed
from manipcli.core.stopwatch import Stopwatch
from manipcli.judge.steps import RunStatus
from manipcli.model.kinematics import Kinematics
from manipcli.plan.from_motion import stopped
from manipcli.record.channels import SENSORS
from manipcli.record.write.recorder import Recorder
from manipcli.run.belief import Belief
from manipcli.run.blocks import BlockLoop
from manipcli.run.engine_settings import engine_settings
from manipcli.run.live_conditions import Live
from manipcli.run.observer import Observer, Progress
from manipcli.run.restore import restore_belief, restore_controllers, scene_at
from manipcli.run.saturation_counts import saturations_of
from manipcli.run.settling import settle
from manipcli.run.step_loop import StepLoop
from manipcli.simulate.engines import ENGINES
from manipcli.simulate.quiet import stdout_to_stderr
from manipcli.simulate.sensor import Picture
from manipcli.simulate.sensor_layout import sensed_by_name
from manipcli.simulate.session import Session
from manipcli.task.felt import complies, felt, wrist_sensor
from manipcli.task.plan_task import Plan
from manipcli.task.task import Task

S = TypeVar("S", bound=Session)


def build_manager(task: Task, kinematics: Kinematics | None = None) -> ControllerManager:
    """The task's controllers, for its robot, gravity and control period.

    Args:
        task: its files define the robot and the gravity that controllers assume; a drawn sample changes neither.
        kinematics: of the robot under that gravity; None: build them here.
    """
    file = task.true.controllers
    period = task.spec.simulation.control_period
    compat = task.robot_file.spec.compat or file.spec.compat
    kinematics = kinematics or Kinematics(task.robot, gravity=task.scene.gravity)
    return build_controllers(
        file.spec, task.robot, period, place=lambda loc: file.place(*loc), kinematics=kinematics, compat=compat,
        stop_planner=stopped, wrist=wrist_sensor(task.robot, task.controllers, task.sensors),
        compliant=complies(task.spec) and ENGINES[task.spec.simulation.engine].physics == "full",
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class SimulationEnd:
    """How a simulation ended, and its cause; `replanning`: wall time [s] of re-planning."""

    status: RunStatus
    cause: str
    replanning: float


def simulate(
    task: Task, plan: Plan, manager: ControllerManager, recorder: Recorder, progress: Progress
) -> SimulationEnd:
    """Run the plan in the task's engine until its end, a failure of the simulation or an interruption.

    The recorder then holds the whole run.
    """
    replanning = Stopwatch()
    status, cause = RunStatus.COMPLETE, ""
    try:
        _run_steps(task, plan, manager, recorder, progress, replanning)
    except SimulationFailed as failure:
        status, cause = RunStatus.FAILED, str(failure)
    except KeyboardInterrupt:
        status, cause = RunStatus.INTERRUPTED, "interrupted by the user"
    return SimulationEnd(status, cause, replanning.seconds)


def _run_steps(
    task: Task,
    plan: Plan,
    manager: ControllerManager,
    recorder: Recorder,
    progress: Progress,
    replanning: Stopwatch,
) -> None:
    """Open the world, let it settle, and run every step.

    Raises:
        SimulationFailed: the world does not settle before the start, or the simulation diverges.
    """
    with open_session(task, plan, manager, Session) as session:
        belief = belief_of(task, plan, session)
        live = Live(live_world(task, session, belief), manager.controllers, session.period, session.sensors)
        observer = Observer(recorder, live, progress, session.period, belief)
        session.restart_clock(observer)
        record_sensors(session, recorder, live)
        record_belief(belief, recorder)
        run = StepLoop(
            task, plan, session, recorder, live, progress, on_goal=observer.goal, replanning=replanning, belief=belief
        )
        try:
            BlockLoop(plan, run).run()
        finally:
            record_saturations(session, recorder)


@contextmanager
def open_session(task: Task, plan: Plan, manager: ControllerManager, kind: type[S]) -> Iterator[S]:
    """The world of a task in its engine, settled or in the state in which a part of the task begins.

    Args:
        task, plan, manager: of the run.
        kind: the class of the session.

    Raises:
        SimulationFailed: the world does not settle before the start.
    """
    simulation, true = task.spec.simulation, task.true
    settings = engine_settings(task, plan)
    state = task.part.state
    scene = true.scene if state is None else scene_at(true.scene, state)
    engine = ENGINES[simulation.engine].open(true.robot, scene, settings)
    try:
        with stdout_to_stderr():
            session = kind(
                robot=true.robot,
                scene=true.scene,
                engine=engine,
                manager=manager,
                period=simulation.control_period,
                sensors=true.sensors,
                seed=simulation.seed,
            )
            if state is None:
                settle(task, session)
            else:
                restore_controllers(session, state)
            yield session
    finally:
        engine.close()


def record_sensors(session: Session, recorder: Recorder, live: Live) -> None:
    """Record what the sensors of a session measure from now on; conditions get the pictures."""

    def deliver(tick: int, taken: int, name: str, picture: Picture) -> None:
        live.picture(tick, name, picture)
        recorder.measured(tick, taken, f"{SENSORS}/{name}{picture.suffix}", picture.fields)

    recorder.attach(session.sensors.numbers)
    session.sensors.deliver = deliver


def belief_of(task: Task, plan: Plan, session: Session) -> Belief:
    """What the robot believes at the start of a run, or of a part of it."""
    planner, state = plan.planner, task.part.state
    belief = Belief(task.scene, task.true.scene, planner.kinematics, session.sensors.positions)
    if state is not None:
        restore_belief(belief, state, planner, session)
    return belief


def record_belief(belief: Belief, recorder: Recorder) -> None:
    """Record what the robot believes from now on."""
    if belief.names:
        recorder.believe(belief.poses)
        for name in belief.uncertain:
            recorder.believed(0, name, belief.pose(name), belief.covariance(name))


def record_saturations(session: Session, recorder: Recorder) -> None:
    """Write the saturated ticks of each joint into the metadata of the log, at the end of a run."""
    for kind, counts in saturations_of(session).to_metadata().items():
        recorder.metadata(kind, counts)


def live_world(task: Task, session: Session, belief: Belief) -> World:
    """The world of live conditions, equal to the believed one that judging builds from the log; now is time 0."""
    return World(
        task.robot,
        task.true.scene,
        start=belief.look(session.engine.read()).map(np.copy),
        physics=ENGINES[task.spec.simulation.engine].physics == "full",
        referenced=frozenset(name for c in session.manager.controllers if c.interfaces for name in c.joints),
        steps=tuple(str(step.id) for step in task.spec.steps),
        period=task.spec.simulation.control_period,
        sensors={**felt(task.spec), **sensed_by_name(task.sensors, task.true.robot, task.true.scene)},
    )
