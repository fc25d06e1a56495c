"""The running robot, as the handlers of commands see it."""

from __future__ import annotations

from dataclasses import dataclass, field

from manipcli.control.manager import ControllerManager
from manipcli.live.command import Goal
from manipcli.live.live_steps import LiveSteps
from manipcli.live.pace import Pace
from manipcli.live.play_state import PlayState
from manipcli.record.write.recorder import Recorder
from manipcli.run.observer import Observer
from manipcli.simulate.session import Session
from manipcli.task.plan_task import Plan
from manipcli.task.task import Task


@dataclass(slots=True)
class LiveRobot:
    """What a command can change.

    Attributes:
        task, plan: of the session.
        session: the simulation.
        recorder: of the session.
        observer: records goals.
        pace: of the control loop.
        steps: does steps of the task and of clients.
        goals: the active goals of clients.
        play: whether it plays, is paused or ends.
    """

    task: Task
    plan: Plan
    session: Session
    recorder: Recorder
    observer: Observer
    pace: Pace
    steps: LiveSteps
    goals: list[Goal] = field(default_factory=list)
    play: PlayState = field(default_factory=PlayState)

    @property
    def manager(self) -> ControllerManager:
        """Its controllers."""
        return self.session.manager

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.session.time

    def event(self, kind: str, text: str, *, outcome: str = "") -> None:
        """Write an event to the log, which is also a line of `/rosout`."""
        self.recorder.event(self.session.ticks, kind=kind, step="", verb="", outcome=outcome, text=text, place="")
