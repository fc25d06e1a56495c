"""The connection between the control loop and the process of the network: a socket and a few shared numbers.

The loop waits for nothing: a shared number shows whether commands have arrived, and what the socket does not take at
once waits in queues that drop their oldest message. Each message is its length and a body: of the loop a pickled tuple,
of the network, which reads what strangers send, JSON.
"""

from __future__ import annotations

import json
import mmap
import pickle
import select
import socket
import struct
import time
from collections import deque
from collections.abc import Iterator, Sequence
from typing import Final

from manipcli.live.command import SEND_GOAL, Answer, Command, nobody
from manipcli.live.lanes import left_after, stop_first
from manipcli.live.pictures import MAX_PICTURE, PictureQueue

HEAD: Final = struct.Struct("<I")
TICK, TAKEN, SENT, WANTED, SENSED = range(5)
"""Shared numbers: the last tick and the commands taken, of the loop; the commands sent, and whether somebody wants
samples, and in them the measurements of sensors, of the network. See also `pictures.py`."""
WAITING: Final = 1000
"""Most commands that wait for the next tick, besides those that change nothing."""
KEPT_SAMPLES: Final = 50
KEPT_MESSAGES: Final = 1000
"""Samples, and messages of events, that wait for the socket; the oldest are dropped."""
SAMPLE, EVENT, ANSWER, CLOSE, DROPPED = "sample", "event", "answer", "close", "dropped"
PICTURE, TOO_LARGE = "picture", "too large"


def shared_numbers(descriptor: int) -> memoryview:
    """The shared numbers in the file of a descriptor, all of it."""
    return memoryview(mmap.mmap(descriptor, 0)).cast("q")


def framed(body: bytes) -> bytes:
    """A message."""
    return HEAD.pack(len(body)) + body


def complete(received: bytearray) -> Iterator[bytes]:
    """The bodies of the complete messages, which are removed."""
    start = 0
    while len(received) - start >= HEAD.size:
        end = start + HEAD.size + HEAD.unpack_from(received, start)[0]
        if len(received) < end:
            break
        yield bytes(received[start + HEAD.size : end])
        start = end
    del received[:start]


class Link:
    """The end of the control loop, which is also its source of commands.

    Args:
        end: of the socket.
        numbers: see `shared_numbers`.
        pictures: topics of cameras.

    Attributes:
        lost: whether the process of the network has ended.
        dropped: samples and messages that the network did not take in time.
    """

    def __init__(self, end: socket.socket, numbers: memoryview, pictures: Sequence[str] = ()) -> None:
        end.setblocking(False)
        self.numbers = numbers
        self.lost = False
        self.dropped = self._reported = 0
        self._end = end
        self._answers: deque[bytes] = deque()
        self._events: deque[bytes] = deque()
        self._samples: deque[bytes] = deque()
        self._pictures = PictureQueue(pictures, numbers)
        self._rest = memoryview(b"")
        self._waits = False
        self._received = bytearray()
        self._taken = 0
        self._given_back: list[Command] = []
        self._batch: list[Command] = []
        self._reads: deque[Command] = deque()

    def sample(self, tick: int, numbers: object, outputs: Sequence[object], sensed: object = None) -> None:
        """Send the state of a tick: see `Sample`."""
        self._put(self._samples, KEPT_SAMPLES, (SAMPLE, tick, numbers, outputs, sensed))

    def picture(self, topic: str, ns: int, data: bytes) -> None:
        """Send a message of a camera, as `event`, if the network asked for it and it is not too large."""
        if not self._pictures.wants(topic, ns):
            return
        if len(data) > MAX_PICTURE:
            self._put(self._events, KEPT_MESSAGES, (TOO_LARGE, topic, len(data)))
            return
        self._pictures.put(topic, ns, data)
        self._waits = True

    def event(self, topic: str, ns: int, data: bytes) -> None:
        """Send a message of the log; `ns`: simulated time [ns]; `data`: CDR.

        Before it, how many samples and messages were dropped since the last one.
        """
        if self.dropped != self._reported:
            self._put(self._events, None, (DROPPED, self.dropped - self._reported))
            self._reported = self.dropped
        self._put(self._events, KEPT_MESSAGES, (EVENT, topic, ns, data))

    def close(self) -> None:
        """Let the process of the network end; what waits but for pictures is sent before, for one second."""
        self._pictures.clear()
        self._put(self._events, KEPT_MESSAGES, (CLOSE,))
        until = time.monotonic() + 1.0
        while self._waits and not self.lost and time.monotonic() < until:
            time.sleep(0.01)
            self._flush()

    def take(self, tick: int) -> Sequence[Command]:
        """The commands that have arrived, but for those that change nothing; see `stop_first`."""
        if self._waits:
            self._flush()
        if not self._given_back and self.numbers[SENT] == self._taken:
            return ()
        found, self._given_back = self._given_back, []
        if self.numbers[SENT] != self._taken and not self.lost:
            self._receive()
            for body in complete(self._received):
                command, reads = self._command(body)
                (self._reads if reads else found).append(command)
                self._taken += 1
            self.numbers[TAKEN] = self._taken
        self._batch = found
        return stop_first(found)

    def read(self) -> Command | None:
        """The next command that changes nothing."""
        return self._reads.popleft() if self._reads else None

    def wait(self, seconds: float) -> bool:
        """Wait for commands, at most this wall time."""
        if not (self._given_back or self._reads):
            if self._waits:
                self._flush()
            select.select([self._end], [self._end] if self._waits else [], [], seconds)
        return True

    def give_back(self, commands: Sequence[Command]) -> None:
        """Take these again, before all others."""
        self._given_back[:0] = commands

    def end(self, command: Command) -> None:
        """A command has ended the session: those after it are for the next one."""
        self.give_back(left_after(self._batch, command))

    def _receive(self) -> None:
        try:
            while True:
                data = self._end.recv(1 << 16)
                if not data:
                    self.lost = True
                    return
                self._received += data
        except BlockingIOError:
            pass
        except OSError:
            self.lost = True

    def _command(self, body: bytes) -> tuple[Command, bool]:
        """A command, and whether it changes nothing."""
        number, op, name, id_, text, reads = json.loads(body)

        def answer(found: Answer) -> None:
            feedback = op == SEND_GOAL and found.status is None
            if not feedback or len(self._answers) < KEPT_MESSAGES:
                self._put(self._answers, None, (ANSWER, number, found))

        return Command(op, name, id_, text, answer if number else nobody), reads

    def _put(self, queue: deque[bytes], kept: int | None, message: tuple[object, ...]) -> None:
        if len(queue) == kept:
            queue.popleft()
            self.dropped += 1
        queue.append(framed(pickle.dumps(message, 5)))
        self._flush()

    def _flush(self) -> None:
        """Send what the socket takes: answers, events, samples, one part of a picture."""
        self._waits, parts = True, 1
        try:
            while not self.lost:
                if not self._rest:
                    queue = self._answers or self._events or self._samples
                    if queue:
                        self._rest = memoryview(queue.popleft())
                    elif parts and self._pictures:
                        parts -= 1
                        self._rest = memoryview(framed(pickle.dumps((PICTURE, *self._pictures.part()), 5)))
                    else:
                        self._waits = bool(self._pictures)
                        return
                self._rest = self._rest[self._end.send(self._rest, socket.MSG_NOSIGNAL) :]
        except BlockingIOError:
            pass
        except OSError:
            self.lost = True
