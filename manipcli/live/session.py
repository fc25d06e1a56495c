"""A live session put together: its server, its source of commands and its pace."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from manipcli.control.manager import ControllerManager
from manipcli.judge.steps import RunStatus
from manipcli.live.access import Access
from manipcli.live.feed import Feed
from manipcli.live.interface import endpoints_of, offer_of
from manipcli.live.loop import Outside
from manipcli.live.pace import Pace
from manipcli.live.publisher import Publisher, begin_messages
from manipcli.live.source import Inbox, recorded_commands
from manipcli.record.recording import Recording
from manipcli.run.run_log import recorded
from manipcli.task.task import Task

DEFAULT_PORT: Final = 9090
"""rosbridge's."""


@dataclass(frozen=True, slots=True)
class LiveOptions:
    """How a session is served.

    Attributes:
        access: who may connect, and the address.
        port: 0: any free port.
        speed: simulated seconds per second; None: as fast as possible.
        lasting: [s] of wall time; None: until it is interrupted.
        page: whether there is a page for browsers.
        page_port: see `LocalServer`.
    """

    access: Access
    port: int = DEFAULT_PORT
    speed: float | None = 1.0
    lasting: float | None = None
    page: bool = False
    page_port: int | None = None

    def url(self, port: int) -> str:
        """The address for clients, with the token."""
        token = f"/?token={self.access.token}" if self.access.token is not None else ""
        return f"ws://{self.access.host}:{port}{token}"


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
        announce: called with each URL when clients can connect.
        late: called once with a text if the simulation is slower than asked.

    Raises:
        InvalidInput: the port cannot be used, or a library is missing.
    """
    from manipcli.live.server import LiveServer  # asyncio, which nothing else needs

    period = task.spec.simulation.control_period
    channels = [recorded(controller) for controller in manager.controllers]
    offer = offer_of(endpoints_of(task, manager.controllers), channels)
    feed = Feed(period, begin_messages(task.robot, task.true.scene, channels))
    inbox = Inbox()
    publisher = Publisher(offer, task.robot, task.true.scene, channels, period)
    pace = Pace(period, speed=options.speed, lasting=options.lasting, late=late)
    with ExitStack() as opened:
        server = opened.enter_context(LiveServer(publisher, feed, inbox.put, access=options.access, port=options.port))
        addresses = [options.url(server.port)]
        if options.page:
            from manipcli.live.page.page import LivePage

            page = LivePage(
                task.robot, task.true.scene, manager.controllers, offer, feed, inbox.put,
                access=options.access, port=options.page_port,
            )  # fmt: skip
            addresses.append(opened.enter_context(page).address)

        def ready() -> None:
            for address in addresses:
                announce(address)

        yield Outside(inbox, feed, pace, between, ready)


def next_log(first: Path, number: int, *, overwrite: bool) -> tuple[Path, int]:
    """The log of the session after number `number`, `runs/pour@live-2.mcap` after `runs/pour@live.mcap`; its number.

    Unless they may be replaced, numbers whose log exists are left out.
    """
    while True:
        number += 1
        path = first.with_name(f"{first.stem}-{number}{first.suffix}")
        if overwrite or not path.exists():
            return path, number


def recorded_session(recording: Recording, log: Path) -> Outside:
    """The commands of a recorded session, without a network and as fast as possible.

    Raises:
        InvalidInput: a command in the log is damaged.
    """
    failed = recording.metadata.get("run", {}).get("status") == RunStatus.FAILED
    source = recorded_commands(log, recording.period, failed=failed)
    return Outside(source, Feed(recording.period), Pace(recording.period, speed=None))
