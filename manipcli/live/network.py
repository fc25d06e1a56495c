"""The process of the network: takes samples and events from the control loop, and serves them to clients.

It is a fresh interpreter that imports neither an engine nor a planner. It ends with the control loop: when that
says so, or when its end of the socket is closed, however it ended.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import pickle
import socket
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import AsyncExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from manipcli.core.errors import InvalidInput
from manipcli.core.geometry import Transform
from manipcli.live.access import Access
from manipcli.live.command import Command
from manipcli.live.connection import Services
from manipcli.live.drops import drop_line
from manipcli.live.link import (
    ANSWER,
    DROPPED,
    EVENT,
    HEAD,
    PICTURE,
    SAMPLE,
    SENSED,
    TICK,
    TOO_LARGE,
    WANTED,
    complete,
    framed,
    shared_numbers,
)
from manipcli.live.offer import Offer
from manipcli.live.outlet import Network, Outlet, OutletOptions
from manipcli.live.pending import Pending
from manipcli.live.pictures import MAX_PICTURE, PictureRequests
from manipcli.live.publisher import Publisher
from manipcli.live.rosapi import Rosapi
from manipcli.live.sample import Event, Sample
from manipcli.live.server import LiveServer
from manipcli.model.robot import RobotModel
from manipcli.record.channels import ROSOUT, MeasuredChannel, Recorded
from manipcli.scene.scene import Scene

KEPT: Final = 20
"""Samples that wait to be encoded; the oldest are dropped."""


@dataclass(frozen=True, slots=True)
class Setup:
    """What the process needs to know of a session; plain data. See `Publisher`, `Access`, `LiveServer`, `Outlet`."""

    offer: Offer
    robot: RobotModel
    scene: Scene
    recorded: Sequence[Recorded]
    period: float
    access: Access
    port: int
    outlets: Sequence[OutletOptions] = ()
    title: str = ""
    sensors: Sequence[MeasuredChannel] = ()
    frames: Sequence[tuple[str, str, Transform]] = ()


class _Stream(asyncio.Protocol):
    """Messages of the control loop, sorted; never read too late: the loop would drop new ones."""

    def __init__(self) -> None:
        self.events: deque[Event] = deque()
        self.samples: deque[Sample] = deque(maxlen=KEPT)
        self.pictures: deque[Event] = deque()
        self.too_large: dict[str, int] = {}
        self.something = asyncio.Event()
        self.over = asyncio.Event()
        self.dropped = 0
        self.answered: Callable[..., None] = lambda *_: None
        self._received, self._picture = bytearray(), bytearray()

    def data_received(self, data: bytes) -> None:
        self._received += data
        for body in complete(self._received):
            kind, *values = pickle.loads(body)  # of the process that started this one
            if kind == SAMPLE:
                self.dropped += len(self.samples) == KEPT
                self.samples.append(Sample(*values))
            elif kind == EVENT:
                self.events.append(Event(*values))
            elif kind == PICTURE:
                self._part(*values)
            elif kind == TOO_LARGE:
                self.too_large[values[0]] = values[1]
            elif kind == DROPPED:
                self.dropped += values[0]
            elif kind == ANSWER:
                with reported("an answer was lost"):
                    self.answered(*values)
            else:
                self.over.set()
        self.something.set()

    def _part(self, topic: str, ns: int, part: bytes, last: bool) -> None:
        self._picture += part
        if last:
            self.pictures.append(Event(topic, ns, bytes(self._picture)))
            self._picture.clear()

    def connection_lost(self, error: Exception | None) -> None:
        self.over.set()


@contextmanager
def reported(consequence: str, drop: Callable[[], object] = lambda: None) -> Iterator[None]:
    """Report an exception in one line on stderr instead of ending the session; `drop` is called then."""
    try:
        yield
    except Exception as error:  # noqa: BLE001 (of whatever an outlet is made of)
        sys.stderr.write(f"manipcli: {consequence}: {type(error).__name__}: {str(error)[:200]}\n")
        drop()


class Hub:
    """Hands samples and events to the server and the outlets; an outlet that raises is dropped."""

    def __init__(self, publisher: Publisher, stream: _Stream, numbers: memoryview, requests: PictureRequests) -> None:
        self._publisher, self._stream, self._numbers = publisher, stream, numbers
        self._texts = {topic: publisher.text(topic, data) for topic, data in publisher.latched.items()}
        self.server: LiveServer | None = None
        self.outlets: list[Outlet] = []
        self._wanted: set[str] = set()
        self._requests = requests

    def latched(self, topic: str) -> str | None:
        """The last text of a latched topic; None before its first message."""
        return self._texts.get(topic)

    def subscribed(self) -> None:
        """Somebody subscribes to more or less than before."""
        self._wanted = set() if self.server is None else self.server.wanted()
        watches: list[bool] = []

        def ask(outlet: Outlet) -> None:
            self._wanted.update(outlet.wanted())
            watches.append(outlet.watches())

        self._for_outlets(ask)
        self._numbers[WANTED] = any(watches) or not self._publisher.sampled.isdisjoint(self._wanted)
        self._numbers[SENSED] = not self._publisher.sensed.topics.isdisjoint(self._wanted)
        self._requests.want(self._wanted)

    async def run(self) -> None:
        """Make each message once, for all who take it."""
        stream = self._stream
        while True:
            await stream.something.wait()
            stream.something.clear()
            if stream.events:
                self._report_drops()
            while stream.events:
                self._event(stream.events.popleft())
            while stream.samples:
                self._sample(stream.samples.popleft())
                await asyncio.sleep(0)
            if stream.pictures:
                self._picture(stream.pictures.popleft())
                stream.something.set()
            if stream.too_large:
                self._refuse(*stream.too_large.popitem())
                stream.something.set()

    def _picture(self, event: Event) -> None:
        """A message of a camera, for those who take it now."""
        topic, takers = event.topic, 0
        if self.server is not None and topic in self.server.due():
            takers = self.server.publish(topic, self._publisher.text(topic, event.data))

        def hand(outlet: Outlet) -> None:
            nonlocal takers
            if topic in outlet.wanted():
                takers += 1
                outlet.message(topic, event.ns, event.data)

        self._for_outlets(hand)
        self._requests.handled(topic, max(1, takers) * len(event.data))

    def _refuse(self, topic: str, size: int) -> None:
        """Report a message of a camera that nobody gets."""
        text = f"{topic}: {1e-6 * size:.1f} MB are too large for clients, more than {1e-6 * MAX_PICTURE:.1f} MB"
        self._report(f"{text}; lower the resolution, or read the log")
        self._requests.handled(topic, size)

    def _report(self, text: str) -> None:
        if self.server is not None:
            self.server.publish(ROSOUT, drop_line(text, self._publisher.clock(self._numbers[TICK])))

    def _report_drops(self) -> None:
        """With the next event: what the network was too slow to take."""
        count, self._stream.dropped = self._stream.dropped, 0
        if count:
            self._report(f"{count} samples and messages of the session were dropped: the server is too slow")

    def _event(self, event: Event) -> None:
        topic, latched = event.topic, event.topic in self._publisher.offer.latched
        if latched:
            self._publisher.latched[topic] = event.data
        if self.server is not None and (latched or topic in self._wanted):
            text = self._publisher.text(topic, event.data)
            if latched:
                self._texts[topic] = text
            self.server.publish(topic, text)

        def hand(outlet: Outlet) -> None:
            if latched or topic in outlet.wanted():
                outlet.message(topic, event.ns, event.data)

        self._for_outlets(hand)

    def _sample(self, sample: Sample) -> None:
        found = self._publisher.sample(sample, self._wanted)
        if self.server is not None:
            due = self.server.due()
            for topic in found.keys() & due:
                self.server.publish(topic, self._publisher.text(topic, found[topic]))
        ns = self._publisher.ns(sample.tick)

        def hand(outlet: Outlet) -> None:
            for topic in found.keys() & outlet.wanted():
                outlet.message(topic, ns, found[topic])
            if outlet.watches():
                outlet.state(sample.tick, self._publisher.state)

        self._for_outlets(hand)

    def _for_outlets(self, call: Callable[[Outlet], None]) -> None:
        for outlet in [*self.outlets]:
            with reported(f"{outlet.notice or 'an outlet'} is closed", partial(self.drop, outlet)):
                call(outlet)

    def drop(self, outlet: Outlet) -> None:
        """Close an outlet, unless it is closed already."""
        if outlet in self.outlets:
            self.outlets.remove(outlet)
            with reported("an outlet was not closed properly"):
                outlet.close()


def main(socket_descriptor: int, numbers_descriptor: int) -> None:
    """Serve until the control loop ends; the descriptors are inherited."""
    end = socket.socket(fileno=socket_descriptor)
    numbers = shared_numbers(numbers_descriptor)
    with end.makefile("rb") as file:
        (length,) = HEAD.unpack(file.read(HEAD.size))
        setup = pickle.loads(file.read(length))
    with contextlib.suppress(BrokenPipeError, ConnectionResetError):
        asyncio.run(_serve(setup, end, numbers))


async def _serve(setup: Setup, end: socket.socket, numbers: memoryview) -> None:
    loop = asyncio.get_running_loop()
    publisher = Publisher(
        setup.offer, setup.robot, setup.scene, setup.recorded, setup.period, setup.sensors, setup.frames
    )
    stream = _Stream()
    requests = PictureRequests(setup.offer.pictures, numbers, time.monotonic, loop.call_later)
    hub = Hub(publisher, stream, numbers, requests)
    transport, _ = await loop.create_unix_connection(lambda: stream, sock=end)
    pending = Pending(numbers, transport.write, setup.offer.readers)
    stream.answered = pending.answer

    def soon(call: Callable[[], object]) -> None:
        with contextlib.suppress(RuntimeError):  # the loop is closed
            loop.call_soon_threadsafe(call)

    def put(command: Command) -> bool:
        return pending.put_soon(command, soon)

    rosapi = Rosapi(setup.offer, lambda: publisher.clock(numbers[TICK]))
    services = Services(setup.offer, hub.latched, rosapi, pending.put, soon, hub.subscribed)
    network = Network(publisher, put, lambda: soon(hub.subscribed), setup.title)
    server = LiveServer(services, setup.access)
    async with AsyncExitStack() as stack:
        try:
            port = await stack.enter_async_context(server.listening(setup.port))
            for options in setup.outlets:
                hub.outlets.append(options.open(network))
                stack.callback(hub.drop, hub.outlets[-1])
        except InvalidInput as error:
            _report(transport, {"findings": [[each.code, each.message, each.hint] for each in error.findings]})
            return
        hub.server = server
        hub.subscribed()
        _report(transport, {"port": port, "notices": [outlet.notice for outlet in hub.outlets if outlet.notice]})
        running = asyncio.create_task(hub.run())
        over = asyncio.create_task(stream.over.wait())
        await asyncio.wait((running, over), return_when=asyncio.FIRST_COMPLETED)
        if running.done():
            running.result()
        running.cancel()


def _report(transport: asyncio.WriteTransport, found: dict[str, Any]) -> None:
    transport.write(framed(json.dumps(found).encode()))
