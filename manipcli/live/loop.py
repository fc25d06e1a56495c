"""Control loop of a live session: commands of a source, one tick, the wait for the next.

The same loop serves clients and simulates a session again from its log; only the source of commands differs. What
enters between two ticks depends on nothing else, so both give the same messages.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from manipcli.control.manager import ControllerManager
from manipcli.core.errors import SimulationFailed
from manipcli.judge.steps import RunStatus
from manipcli.live.command import END, Command
from manipcli.live.feed import Feed
from manipcli.live.interface import endpoints_of
from manipcli.live.live_robot import LiveRobot
from manipcli.live.live_session import LiveSession, SessionOver
from manipcli.live.live_steps import LiveSteps
from manipcli.live.obey import Obedience
from manipcli.live.pace import Pace, Share
from manipcli.live.play_state import Reset
from manipcli.live.source import Source
from manipcli.record.write.recorder import Recorder
from manipcli.run.execute import (
    SimulationEnd,
    belief_of,
    live_world,
    open_session,
    record_belief,
    record_saturations,
    record_sensors,
)
from manipcli.run.live_conditions import Live
from manipcli.run.observer import SILENT, Observer, Progress
from manipcli.simulate.quiet import original_stdout
from manipcli.task.plan_task import Plan
from manipcli.task.task import Task

END_COMMAND: Final = Command(END, "")
POLL: Final = 0.05
"""[s] of wall time between two looks for an interruption while the session is paused."""
READING: Final = 0.1
"""Share of wall time for commands that change nothing, while the simulation is slower than asked."""
STARTED: Final = "the controllers hold, and obey commands"


def _never() -> None: ...


@dataclass(slots=True)
class Outside:
    """What a session has outside of the simulation.

    Attributes:
        source: of its commands.
        feed: takes what clients see.
        pace: of the loop.
        between: called before each tick; raises KeyboardInterrupt to end the session.
        ready: called when the scene of the first session has settled; before, clients can connect, and commands wait.
        begun: called when the scene is open and has settled.
        failure: why the simulation failed; "" if it did not.
        reset: the session that comes next, if it ended by a reset.
    """

    source: Source
    feed: Feed
    pace: Pace
    between: Callable[[], None] = field(default=_never)
    ready: Callable[[], None] = field(default=_never)
    begun: Callable[[], None] = field(default=_never)
    failure: str = ""
    reset: Reset | None = None

    def again(self) -> bool:
        """Prepare the next session after a reset; False if there is none."""
        reset, self.reset = self.reset, None
        if reset is None:
            return False
        first = reset.command()
        self.source.give_back([] if first is None else [first])
        self.ready, self.begun = _never, reset.begun
        self.feed.restart()
        return True


class _Turn:
    """Obeys the commands of each tick; waits, obeying, while the session is paused. It has at least one tick."""

    def __init__(self, robot: LiveRobot, obedience: Obedience, outside: Outside) -> None:
        self._robot, self._obedience, self._outside = robot, obedience, outside
        self._reading = Share(READING)

    def before_tick(self) -> None:
        play, source, tick = self._robot.play, self._outside.source, self._robot.session.ticks
        if not play.over:
            self._obey(tick)
        while not (play.moves or play.over):
            if not source.wait(POLL):
                break  # simulated from a log: it went on
            self._outside.pace.start()
            self._obey(tick)
            self._read()
        if play.over and tick > 0:
            raise SessionOver

    def _obey(self, tick: int) -> None:
        play, outside = self._robot.play, self._outside
        interrupted = False
        if tick > 0 or not play.moves:
            try:
                outside.between()
                interrupted = outside.pace.over
            except KeyboardInterrupt:
                interrupted = True
        commands = (END_COMMAND,) if interrupted else outside.source.take(tick)
        for command in commands:
            if not self._obedience.obey(command):
                play.end()
            if play.over:
                outside.source.end(command)
                return

    def after_tick(self) -> None:
        self._robot.play.ticked()
        self._obedience.after_tick()
        if self._outside.pace.ahead or self._reading.free():
            self._read()
        self._outside.pace.wait()

    def _read(self) -> None:
        """Answer one command that changes nothing: who only reads does not delay the tick by more."""
        command = self._outside.source.read()
        if command is not None:
            with self._reading:
                self._obedience.obey(command)


def simulate_live(
    task: Task,
    plan: Plan,
    manager: ControllerManager,
    recorder: Recorder,
    outside: Outside,
    progress: Progress = SILENT,
) -> SimulationEnd:
    """Open the scene, do the steps if the session runs them, and hold, until it ends or the simulation fails.

    Commands are obeyed all the time. A session that ends as asked, also by a signal, is complete.
    """
    replanning = 0.0
    try:
        with open_session(task, plan, manager, LiveSession) as session:
            belief = belief_of(task, plan, session)
            live = Live(live_world(task, session, belief), manager.controllers, session.period, session.sensors)
            runs = task.part.last is None
            observer = Observer(recorder, live, progress if runs else SILENT, session.period, belief)
            outside.feed.observer = observer
            session.restart_clock(outside.feed)
            record_sensors(session, recorder, live)
            record_belief(belief, recorder)
            outside.feed.attach(session.sensors.numbers)
            recorder.listener = outside.feed.message
            recorder.event(0, kind="session_started", step="", verb="", outcome="", text=STARTED, place="")
            steps = LiveSteps(task, plan, session, recorder, live, observer, progress, outside.pace)
            robot = LiveRobot(task, plan, session, recorder, observer, outside.pace, steps)
            obedience = Obedience(robot, endpoints_of(task, manager.controllers))
            session.begin(_Turn(robot, obedience, outside))
            with original_stdout():
                outside.ready()
            outside.begun()
            outside.pace.start()
            try:
                if runs:
                    steps.run()
                while True:
                    steps.rest()
            except SessionOver:
                outside.reset = robot.play.reset
                why = "the session ended" if outside.reset is None else "the simulation was reset"
                steps.abandon(why)
                obedience.after_tick()
                obedience.abort(why)
                outside.feed.over(session.time, resets=outside.reset is not None)
            finally:
                replanning = steps.planning.seconds
                record_saturations(session, recorder)
    except SimulationFailed as failure:
        outside.failure = str(failure)
        return SimulationEnd(RunStatus.FAILED, outside.failure, replanning)
    return SimulationEnd(RunStatus.COMPLETE, "", replanning)
