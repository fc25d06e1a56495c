"""Pictures and point clouds for clients: large messages, one exposure of a camera at a time, and only on request.

The network asks for the next exposure of a camera when it has handed on the one before, and not faster than `RATE`
allows. The control loop sends it in parts after everything else, one per tick; exposures that nobody asked for are not
sent. So neither waits, and no more than one exposure of each camera is on its way.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Final

FIRST: Final = 8
"""The first of the shared numbers for pictures: a count of requests for each camera, then a flag for each topic."""
MAX_PICTURE: Final = 8 << 20
"""Largest message of a camera that clients get [byte]: a cloud of 640x480 has 4.9 MB."""
PART: Final = 1 << 16
"""[byte] of a picture that are sent at once."""
RATE: Final = 20e6
"""[byte/s] of wall time, of all pictures to all clients."""


def numbers_for(topics: Sequence[str]) -> int:
    """How many shared numbers a session with these topics of pictures needs."""
    return FIRST + len(_cameras(topics)) + len(topics)


def _camera(topic: str) -> str:
    return topic.rpartition("/")[0]


def _cameras(topics: Sequence[str]) -> list[str]:
    return [*dict.fromkeys(map(_camera, topics))]


@dataclass(slots=True)
class _Exposures:
    """Of a camera: index of its count, requests fulfilled, time [ns] of the last exposure, whether that is sent, and
    its messages that wait."""

    index: int
    given: int = 0
    ns: int = -1
    sent: bool = False
    waiting: int = 0


class PictureQueue:
    """The end of the control loop.

    Args:
        topics: of pictures.
        numbers: shared with the network.
    """

    def __init__(self, topics: Sequence[str], numbers: memoryview) -> None:
        cameras = _cameras(topics)
        self._numbers = numbers
        self._of = {camera: _Exposures(FIRST + k) for k, camera in enumerate(cameras)}
        self._flags = {topic: FIRST + len(cameras) + k for k, topic in enumerate(topics)}
        self._queue: deque[tuple[_Exposures, str, int, bytes]] = deque()
        self._sent = 0

    def __bool__(self) -> bool:
        return bool(self._queue)

    def wants(self, topic: str, ns: int) -> bool:
        """Whether the network asked for this topic of the exposure that arrives at `ns`, once for each message."""
        own = self._of[_camera(topic)]
        if own.ns != ns:
            asked = self._numbers[own.index]
            own.ns, own.sent = ns, asked != own.given and not own.waiting
            if own.sent:
                own.given = asked
        return own.sent and bool(self._numbers[self._flags[topic]])

    def put(self, topic: str, ns: int, data: bytes) -> None:
        """Queue a message."""
        own = self._of[_camera(topic)]
        own.waiting += 1
        self._queue.append((own, topic, ns, data))

    def part(self) -> tuple[str, int, bytes, bool]:
        """The next part: topic, time [ns], bytes, and whether they are the last of their message."""
        own, topic, ns, data = self._queue[0]
        part = data[self._sent : self._sent + PART]
        self._sent += len(part)
        last = self._sent == len(data)
        if last:
            self._sent = 0
            own.waiting -= 1
            self._queue.popleft()
        return topic, ns, part, last

    def clear(self) -> None:
        """Drop what waits."""
        self._queue.clear()


class PictureRequests:
    """The end of the network.

    Args:
        topics: of pictures.
        numbers: shared with the control loop.
        now: [s] wall time.
        later: calls a function after some seconds.
    """

    def __init__(
        self,
        topics: Sequence[str],
        numbers: memoryview,
        now: Callable[[], float],
        later: Callable[[float, Callable[[], None]], object],
    ) -> None:
        cameras = _cameras(topics)
        self._numbers, self._now, self._later = numbers, now, later
        self._counts = {camera: FIRST + k for k, camera in enumerate(cameras)}
        self._flags = {topic: FIRST + len(cameras) + k for k, topic in enumerate(topics)}
        self._wanted: frozenset[str] = frozenset()
        self._waiting: set[str] = set()
        self._free = 0.0

    def want(self, topics: Collection[str]) -> None:
        """These topics are subscribed from now on."""
        wanted = frozenset(self._flags.keys() & topics)
        for topic in wanted ^ self._wanted:
            self._numbers[self._flags[topic]] = topic in wanted
            self._ask(_camera(topic))
        self._wanted = wanted

    def handled(self, topic: str, size: int) -> None:
        """A message has been handed on, `size` [byte] to all that take it: ask for the next exposure."""
        self._free = max(self._free, self._now()) + size / RATE
        if topic in self._wanted:
            self._ask(_camera(topic))

    def _ask(self, camera: str) -> None:
        if camera not in self._waiting:
            self._waiting.add(camera)
            self._turn(camera)

    def _turn(self, camera: str) -> None:
        left = self._free - self._now()
        if left > 0.0:
            self._later(left, lambda: self._turn(camera))
        else:
            self._waiting.discard(camera)
            self._numbers[self._counts[camera]] += 1
