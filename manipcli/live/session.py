"""A live session put together: its server, its source of commands and its pace."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Final

from manipcli.control.manager import ControllerManager
from manipcli.judge.steps import RunStatus
from manipcli.live.access import Access, query
from manipcli.live.feed import FAST_PERIOD, Feed
from manipcli.live.interface import endpoints_of, offer_of
from manipcli.live.loop import Outside
from manipcli.live.names import DEFAULT_PORT
from manipcli.live.network_process import NetworkProcess
from manipcli.live.offer import CLOCK
from manipcli.live.pace import Pace
from manipcli.live.source import recorded_commands
from manipcli.record.recording import Recording
from manipcli.run.run_log import measured_channels, recorded
from manipcli.simulate.sensor_layout import sensor_frames
from manipcli.task.task import Task

if TYPE_CHECKING:
    from manipcli.live.outlet import OutletOptions

WATCHED: Final = 500
"""Ticks between two looks at the process of the network."""


@dataclass(frozen=True, slots=True)
class LiveOptions:
    """How a session is served.

    Attributes:
        access: who may connect, and the address.
        port: 0: any free port.
        speed: simulated seconds per second; None: as fast as possible.
        lasting: [s] of wall time; None: until it is interrupted.
        run: also do the steps of the task.
        outlets: what shows the session besides the WebSocket server.
    """

    access: Access
    port: int = DEFAULT_PORT
    speed: float | None = 1.0
    lasting: float | None = None
    run: bool = False
    outlets: Sequence[OutletOptions] = ()

    def url(self, port: int) -> str:
        """The address for clients, with the token."""
        return f"ws://{self.access.address}:{port}{query(self.access.token)}"


@contextmanager
def served(
    task: Task,
    manager: ControllerManager,
    options: LiveOptions,
    *,
    between: Callable[[], None],
    announce: Callable[[str], None],
    late: Callable[[str], None],
) -> Iterator[Outside]:
    """A session that clients can connect to; after a reset the same `Outside` is that of the next one (`again`).

    Args:
        task, manager: of the session.
        options: see there.
        between: called before each tick; raises KeyboardInterrupt to end the session.
        announce: called with the URL when clients can connect.
        late: called with texts for the user: notices of outlets, and once if the simulation is slower than asked.

    Raises:
        InvalidInput: the port cannot be used, or a library is missing.
        NetworkFailed: LIVE200 the process of the network did not start.
    """
    from manipcli.live.network import Setup  # asyncio, which nothing else needs
    from manipcli.live.publisher import begin_messages, clock_message

    period = task.spec.simulation.control_period
    robot, scene = task.robot, task.true.scene
    channels = [recorded(controller) for controller in manager.controllers]
    sensors = measured_channels(task.true.sensors, task.true.robot, period)
    frames = sensor_frames(task.true.sensors, task.true.robot)
    offer = offer_of(endpoints_of(task, manager.controllers), channels, sensors)
    title = " · ".join(dict.fromkeys((task.spec.task, robot.name)))
    setup = Setup(
        offer, robot, scene, channels, period, options.access, options.port, options.outlets, title, sensors, frames
    )
    pace = Pace(period, speed=options.speed, lasting=options.lasting, late=late)
    with NetworkProcess(setup) as network:
        least = FAST_PERIOD if options.speed is None else 0.0
        again = (*begin_messages(robot, scene, channels, frames), (CLOCK, clock_message(0)))
        feed = Feed(period, network.link, topics=offer.published, sensors=sensors, again=again, least=least)
        left = 0

        def ready() -> None:
            for notice in network.notices:
                late(notice)
            announce(options.url(network.port))

        outside = Outside(network.link, feed, pace, ready=ready)

        def check() -> None:
            nonlocal left
            between()
            left -= 1
            if left < 0 or network.link.lost:
                left = WATCHED
                if network.lost:
                    outside.failure = network.lost
                    raise KeyboardInterrupt

        outside.between = check
        yield outside


def session_logs(first: Path, *, overwrite: bool, named: bool) -> Iterator[Path]:
    """The log of each session between resets: `runs/pour@live.mcap`, `runs/pour@live-2.mcap`, ...

    A session cannot be repeated by hand: unless logs may be replaced, numbers whose log exists or is being written are
    left out. If the first log is `named` by the user, it is refused when it is opened.
    """
    for number in count(1):
        path = first if number == 1 else first.with_name(f"{first.stem}-{number}{first.suffix}")
        taken = path.exists() or path.with_name(f"{path.name}.partial").exists()
        if overwrite or not taken or (named and number == 1):
            yield path


def recorded_session(recording: Recording, log: Path) -> Outside:
    """The commands of a recorded session, without a network and as fast as possible.

    Raises:
        InvalidInput: a command in the log is damaged.
    """
    failed = recording.end.get("status") == RunStatus.FAILED
    source = recorded_commands(log, recording.period, failed=failed)
    return Outside(source, Feed(recording.period), Pace(recording.period, speed=None))
