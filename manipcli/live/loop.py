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
from manipcli.live.obey import Obedience
from manipcli.live.pace import Pace
from manipcli.live.play_state import Reset
from manipcli.live.source import Source
from manipcli.record.write.recorder import Recorder
from manipcli.run.execute import SimulationEnd, live_world, open_session, record_saturations
from manipcli.run.live_conditions import Live
from manipcli.run.observer import SILENT, Observer
from manipcli.task.plan_task import Plan
from manipcli.task.task import Task

END_COMMAND: Final = Command(END, "")
POLL: Final = 0.05
"""[s] of wall time between two looks for an interruption while the session is paused."""
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
        ready: called before the scene is opened; commands wait until it has settled.
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

    def before_tick(self) -> None:
        play, source, tick = self._robot.play, self._outside.source, self._robot.session.ticks
        if not play.over:
            self._obey(tick)
        while not (play.moves or play.over):
            if not source.wait(POLL):
                break  # simulated from a log: it went on
            self._outside.pace.start()
            self._obey(tick)
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
        for k, command in enumerate(commands):
            if not self._obedience.obey(command):
                play.end()
            if play.over:
                outside.source.give_back(commands[k + 1 :])
                return

    def after_tick(self) -> None:
        self._robot.play.ticked()
        self._obedience.after_tick()
        self._outside.pace.wait()


def simulate_live(
    task: Task, plan: Plan, manager: ControllerManager, recorder: Recorder, outside: Outside
) -> SimulationEnd:
    """Open the scene and hold, obeying commands, until the session ends or the simulation fails.

    A session that ends as asked, also by a signal, is complete.
    """
    outside.ready()  # before the scene is open: from there on stdout is stderr, for the engine
    try:
        with open_session(task, plan, manager, LiveSession) as session:
            live = Live(live_world(task, plan, session), manager.controllers, session.period)
            observer = Observer(recorder, live, SILENT, session.period)
            outside.feed.observer = observer
            session.restart_clock(outside.feed)
            recorder.listener = outside.feed.message
            recorder.event(0, kind="session_started", step="", verb="", outcome="", text=STARTED, place="")
            robot = LiveRobot(task, plan, session, recorder, observer, outside.pace)
            obedience = Obedience(robot, endpoints_of(task, manager.controllers))
            session.begin(_Turn(robot, obedience, outside))
            outside.begun()
            outside.pace.start()
            try:
                while True:
                    session.tick()
            except SessionOver:
                outside.reset = robot.play.reset
                obedience.abort("the session ended" if outside.reset is None else "the simulation was reset")
            finally:
                record_saturations(session, recorder)
    except SimulationFailed as failure:
        outside.failure = str(failure)
        return SimulationEnd(RunStatus.FAILED, outside.failure, 0.0)
    return SimulationEnd(RunStatus.COMPLETE, "", 0.0)
