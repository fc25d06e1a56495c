"""A process that has imported everything a run needs, and forks a child for each run.

A fork copies a process within milliseconds, where a new interpreter imports for a second. The child has loaded and
planned nothing, except in a template: a server that has loaded one task, forked from the first server. A request of the
parent, with the descriptors of the child's socket and output file, is answered by `Started` with a pidfd of the child,
later by `Exited`, or by `Refused`. A server ends when its parent closes the socket.

Only a process with one thread forks: a lock that another thread holds would stay locked in the child.
"""

from __future__ import annotations

import array
import atexit
import gc
import os
import pickle
import resource
import select
import socket
import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn, TypeAlias

from manipcli.batch.job import Loading
from manipcli.core import collector

if TYPE_CHECKING:
    from manipcli.run.prepared import Prepared

LONGEST_MESSAGE = 1 << 20
"""Bytes of a message; the system refuses to send longer ones."""
PREPARATION_TIME = 300
"""[s] of processor time for a template to load and plan its task, after which the system ends it."""


@dataclass(frozen=True, slots=True)
class Request:
    """A request for a child.

    Attributes:
        number: of the request.
        engine: name of the engine that the run will probably use.
        template: the child becomes a template for this task, and its socket is that of a server.
    """

    number: int
    engine: str = ""
    template: Loading | None = None


@dataclass(frozen=True, slots=True)
class Ready:
    """The server waits for requests; `unsafe`: why it cannot fork, or ""."""

    unsafe: str = ""


@dataclass(frozen=True, slots=True)
class Started:
    """A child runs. The message has a pidfd."""

    number: int
    pid: int


@dataclass(frozen=True, slots=True)
class Refused:
    """No child was started."""

    number: int
    cause: str


@dataclass(frozen=True, slots=True)
class Exited:
    """A child has exited, with its exit code or the negative number of a signal."""

    number: int
    code: int


Answer: TypeAlias = Ready | Started | Refused | Exited
Run: TypeAlias = "Callable[[int, Prepared | None], None]"


def main(descriptor: int, *, run: Run | None = None) -> None:
    """Serves on the socket with this descriptor, until the other side closes it. Each child exits when its run ends.

    Args:
        descriptor: of the socket to the parent, SOCK_SEQPACKET.
        run: called in a child with the descriptor of its socket; default `batch/child.py`.
    """
    collector.spare()
    os.set_inheritable(descriptor, False)
    if run is None:
        run = _imported()
    prepared: Prepared | None = None
    while True:
        gc.freeze()  # a collection in a child would write to these objects, and so copy their memory
        with socket.socket(fileno=descriptor) as channel:
            served = _Server(channel).serve()
        if served is None:
            return
        request, descriptor = served
        if request.template is None:
            _run_and_exit(run, descriptor, prepared)
        prepared = _prepared(request.template)
        if prepared is None:
            return


def _run_and_exit(run: Run, descriptor: int, prepared: Prepared | None) -> NoReturn:
    """Runs, and ends the process as the end of a program does, but without the destruction of all modules.

    That would write to most pages of memory that the child shares with its parent, which copies them: 65 ms a run.
    """
    code = 0
    try:
        run(descriptor, prepared)
    except SystemExit as end:
        if isinstance(end.code, int | None):
            code = end.code or 0
        else:
            sys.stderr.write(f"{end.code}\n")
            code = 1
    except BaseException:  # noqa: BLE001  # ends the process, and is reported as the interpreter does
        traceback.print_exc()
        code = 1
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def send(channel: socket.socket, message: Request | Answer, descriptors: Sequence[int] = ()) -> None:
    """Sends a message, with descriptors of open files.

    Raises:
        OSError: the other side has closed the socket.
    """
    socket.send_fds(channel, [pickle.dumps(message)], descriptors)


def receive(channel: socket.socket) -> tuple[object, list[int]] | None:
    """The next message and its descriptors; None if the other side has closed the socket."""
    try:
        room = socket.CMSG_LEN(4 * array.array("i").itemsize)
        data, ancillary, _, _ = channel.recvmsg(LONGEST_MESSAGE, room, socket.MSG_CMSG_CLOEXEC)
    except ConnectionError:
        return None
    descriptors = array.array("i")
    for level, kind, content in ancillary:
        if (level, kind) == (socket.SOL_SOCKET, socket.SCM_RIGHTS):
            descriptors.frombytes(content[: len(content) - len(content) % descriptors.itemsize])
    return (pickle.loads(data), [*descriptors]) if data else None


def _imported() -> Run:
    """Imports what runs import, and builds the models of the files."""
    from manipcli.batch import baseline, child, failure_report
    from manipcli.run import libraries

    del baseline, failure_report  # a run imports them
    libraries.load_common()
    return child.main


class _Server:
    """Answers the requests on a socket."""

    def __init__(self, channel: socket.socket) -> None:
        self._channel = channel
        self._children: dict[int, tuple[int, int]] = {}  # number and process of the child with this pidfd
        self._poll = select.poll()
        self._poll.register(channel, select.POLLIN)

    def serve(self) -> tuple[Request, int] | None:
        """Returns in each child, with its request and the descriptor of its socket; in the server with None, at its
        end."""
        send(self._channel, Ready(_unsafe()))
        while True:
            for readable, _ in self._poll.poll():
                if readable in self._children:
                    self._reap(readable)
                    continue
                received = receive(self._channel)
                if received is None:
                    return None
                request, (connection, output) = received
                assert isinstance(request, Request)
                if self._forked(request):
                    _separate(output)
                    return request, connection
                os.close(connection)
                os.close(output)

    def _forked(self, request: Request) -> bool:
        """Starts a child, and answers the request; True in the child."""
        _load_engine(request.engine)
        cause = _unsafe()
        if cause:
            send(self._channel, Refused(request.number, cause))
            return False
        try:
            pid = os.fork()
        except OSError as error:
            send(self._channel, Refused(request.number, str(error)))
            return False
        if pid == 0:
            for pidfd in self._children:
                os.close(pidfd)
            return True
        pidfd = os.pidfd_open(pid)
        self._children[pidfd] = (request.number, pid)
        self._poll.register(pidfd, select.POLLIN)
        send(self._channel, Started(request.number, pid), [pidfd])
        return False

    def _reap(self, pidfd: int) -> None:
        number, pid = self._children.pop(pidfd)
        self._poll.unregister(pidfd)
        os.close(pidfd)
        _, status = os.waitpid(pid, 0)
        send(self._channel, Exited(number, os.waitstatus_to_exitcode(status)))


def _separate(output: int) -> None:
    """Gives a forked process its own session, so that signals of a terminal do not reach it, and its own output."""
    os.setsid()
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.close(output)


def _unsafe() -> str:
    """Why this process cannot fork, or ""."""
    try:
        threads = sum(1 for _ in Path("/proc/self/task").iterdir())
        os.close(os.pidfd_open(os.getpid()))
    except OSError as error:
        return str(error)
    return "" if threads == 1 else f"a library started {threads - 1} threads"


def _load_engine(name: str) -> None:
    """Imports the library of an engine; a run reports the error of one that is missing."""
    if not name:
        return
    from manipcli.run import libraries

    with suppress(Exception):
        libraries.load_engine(name)


def _prepared(loading: Loading) -> Prepared | None:
    """The task of a template; None where a run will report an error."""
    from manipcli.core.errors import ManipcliError
    from manipcli.run.prepared import prepare

    soft, hard = resource.getrlimit(resource.RLIMIT_CPU)
    within = PREPARATION_TIME if soft == resource.RLIM_INFINITY else min(PREPARATION_TIME, soft)
    resource.setrlimit(resource.RLIMIT_CPU, (within, hard))
    try:
        return prepare(loading.path, **loading.options)
    except (ManipcliError, OSError):
        return None
    finally:
        resource.setrlimit(resource.RLIMIT_CPU, (soft, hard))
