"""The fork servers of a batch, seen from the parent; see `batch/fork_server.py`.

Where no process can be forked (another system than Linux, a library with threads, a server that has died), runs are
started as new processes. A server that dies takes no run with it.
"""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack, suppress
from socket import AF_UNIX, SOCK_SEQPACKET, socket, socketpair
from tempfile import TemporaryFile
from typing import IO, Final, cast

from manipcli.batch.fork_server import Answer, Exited, Ready, Refused, Request, Started, receive, send
from manipcli.batch.job import Job, Loading
from manipcli.report.suite.suite import signal_name

SERVER = """
import json, sys
sys.path[:] = json.loads(sys.argv[1])
from manipcli.batch.fork_server import main
main(int(sys.argv[2]))
"""
"""The server has the module path of its parent, and not the working directory (`-P`)."""
ONE_THREAD: Final = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
"""Default environment: with one run per core, threads of libraries would compete for the cores."""
START_TIME: Final = 120.0
"""[s] limit for the imports of a server."""
ANSWER_TIME: Final = 20.0
"""[s] limit for the start of a child, including the import of an engine."""
EXIT_TIME: Final = 5.0
"""[s] limit for the exit code of a child that has exited."""
WORTHWHILE: Final = 3
"""Number of runs of one task that are left, from which a template is made."""


class NoFork(Exception):
    """A server does not start children; str() is the cause."""


class Died(NoFork):
    """The server has died."""


class Forked:
    """A forked process, with the interface of `subprocess.Popen`.

    Attributes:
        pid: its number.
        returncode: exit code, or the negative number of a signal; None before `wait`, and if it is unknown because the
            server has died.
    """

    def __init__(self, server: ForkServer, number: int, pid: int, pidfd: int) -> None:
        self.pid = pid
        self.returncode: int | None = None
        self._server, self._number, self._pidfd = server, number, pidfd

    def send_signal(self, number: int) -> None:
        """Sends a signal, unless it has been waited for."""
        if self._pidfd >= 0:
            with suppress(ProcessLookupError):
                signal.pidfd_send_signal(self._pidfd, number)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)

    def wait(self, timeout: float | None = None) -> int | None:
        """Waits for its exit.

        Raises:
            subprocess.TimeoutExpired: it runs for longer than `timeout` [s].
        """
        if self._pidfd >= 0:
            if not _readable(self._pidfd, timeout):
                raise subprocess.TimeoutExpired(f"process {self.pid}", timeout or 0.0)
            os.close(self._pidfd)
            self._pidfd = -1
            self.returncode = self._server.exit_code(self._number)
        return self.returncode


class ForkServer:
    """A fork server: the first one, or a template that was forked from it."""

    def __init__(self, process: subprocess.Popen[bytes] | Forked, channel: socket, errors: IO[bytes]) -> None:
        """
        Args:
            process: its process.
            channel: the socket to it.
            errors: its output.
        """
        self._process, self._channel, self._errors = process, channel, errors
        self._ready: Ready | None = None
        self._codes: dict[int, int] = {}
        self._requests = 0
        self._closed = ""  # why, if it is

    def ready(self, timeout: float) -> bool:
        """Whether it has sent that it is ready, after at most `timeout` [s].

        Raises:
            NoFork: it has died, or cannot fork.
        """
        deadline = time.monotonic() + timeout
        while self._ready is None and self._receive(deadline) is not None:
            pass
        if self._closed:
            raise Died(self._closed)
        if self._ready is not None and self._ready.unsafe:
            raise NoFork(self._ready.unsafe)
        return self._ready is not None

    def fork(self, channel: int, output: int, *, engine: str = "", template: Loading | None = None) -> Forked:
        """Starts a child.

        Args:
            channel: descriptor of the child's socket.
            output: descriptor of the file for its output.
            engine, template: see `Request`.

        Raises:
            NoFork: it was not started.
        """
        self._requests += 1
        number = self._requests
        if self._closed:
            raise Died(self._closed)
        with suppress(ConnectionError):  # the next message is the end
            send(self._channel, Request(number, engine, template), [channel, output])
        deadline = time.monotonic() + ANSWER_TIME
        while (received := self._receive(deadline)) is not None:
            match received:
                case Started(_, pid), [pidfd]:
                    return Forked(self, number, pid, pidfd)
                case Started(_, pid), _:  # this process has too many open files
                    os.kill(pid, signal.SIGKILL)
                    raise NoFork("too many open files")
                case Refused(_, cause), _:
                    raise NoFork(cause)
        self.close("the fork server did not answer")
        raise Died(self._closed)

    def exit_code(self, number: int) -> int | None:
        """The exit code of a child that has exited; None if this server has died."""
        deadline = time.monotonic() + EXIT_TIME
        with suppress(NoFork):
            while number not in self._codes and self._receive(deadline) is not None:
                pass
        return self._codes.pop(number, None)

    def close(self, why: str = "the fork server was closed") -> None:
        """Ends the server, but not its children."""
        if not self._closed:
            self._closed = why
            self._process.kill()
            self._process.wait()
            self._channel.close()
            self._errors.close()

    def _receive(self, deadline: float) -> tuple[Answer, list[int]] | None:
        """The next message; None at the deadline, a value of `time.monotonic()`.

        Raises:
            Died: the server has died.
        """
        if self._closed:
            raise Died(self._closed)
        if not _readable(self._channel.fileno(), max(0.0, deadline - time.monotonic())):
            return None
        received = receive(self._channel)
        if received is None:
            self._end()
            raise Died(self._closed)
        answer, descriptors = received
        match answer:
            case Ready():
                self._ready = answer
            case Exited():
                self._codes[answer.number] = answer.code
        return cast("Answer", answer), descriptors

    def _end(self) -> None:
        """Closes a server that has died."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(EXIT_TIME)
        code = self._process.returncode
        self._errors.seek(0)
        last = self._errors.read().decode("utf-8", "replace").strip().rpartition("\n")[2]
        how = f"was ended by {signal_name(-code)}" if code is not None and code < 0 else f"ended with exit code {code}"
        self.close(f"the fork server {how}{f': {last}' if last else ''}")


class ForkPool:
    """The fork servers of a batch: one that has imported what runs need, and one for each task with many samples."""

    def __init__(self, jobs: Iterable[Job], *, command: Sequence[str] = ()) -> None:
        """
        Args:
            jobs: the runs of the batch.
            command: another program than `SERVER`, which gets the descriptor of its socket as last argument.
        """
        self._left = Counter(job.loading for job in jobs if not job.case.findings)
        self._command = command or (sys.executable, "-P", "-c", SERVER, json.dumps(sys.path))
        self._servers: list[ForkServer] = []  # all of them: also one that is not used any more has children
        self._first: ForkServer | None = None
        self._templates: dict[Loading, ForkServer | None] = {}
        self._note = ""

    def open(self, *, least: int = 2) -> None:
        """Starts the first server, where it can save time, and waits until it is ready; `least`: number of runs."""
        if not available() or self._left.total() < least:
            return
        try:
            self._first = _server(self._new_process)
            self._servers.append(self._first)
            if not self._first.ready(START_TIME):
                raise Died(f"the fork server was not ready within {START_TIME:g} s")
        except (NoFork, OSError) as cause:
            self._lose(cause)

    def start(self, job: Job, channel: int, output: int) -> Forked | None:
        """Forks the process of a job.

        Args:
            job: the job.
            channel: descriptor of the socket of its process.
            output: descriptor of its output file.

        Returns:
            The process; None where it must be started otherwise.
        """
        self._left[job.loading] -= 1
        template = self._templates.get(job.loading)
        if template is not None:
            try:
                if template.ready(0.0):
                    return template.fork(channel, output)
            except (NoFork, OSError):
                self._templates[job.loading] = None
        if self._first is None:
            return None
        first = self._first
        engine = job.case.engine
        try:
            forked = first.fork(channel, output, engine=engine)
        except (NoFork, OSError) as cause:
            self._lose(cause)
            return None
        if job.loading not in self._templates and self._left[job.loading] >= WORTHWHILE:
            self._templates[job.loading] = None
            with suppress(NoFork, OSError):
                template = _server(lambda *files: first.fork(*files, engine=engine, template=job.loading))
                self._servers.append(template)
                self._templates[job.loading] = template
        return forked

    def take_note(self) -> str:
        """A note for the report of the run that was just started; "" without one."""
        note, self._note = self._note, ""
        return note

    def close(self) -> None:
        """Ends the servers."""
        for server in reversed(self._servers):  # the first one reaps the templates
            server.close()

    def _new_process(self, channel: int, output: int) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [*self._command, str(channel)],
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            pass_fds=(channel,),
            start_new_session=True,  # signals of the terminal reach only the parent
            env={**ONE_THREAD, **os.environ},
        )

    def _lose(self, cause: NoFork | OSError) -> None:
        """Does without the first server from now on."""
        if isinstance(cause, Died):
            self._note = f"{cause}; runs are started without it"
        self._first = None


def available() -> bool:
    """Whether this system has what fork servers need."""
    return sys.platform == "linux" and hasattr(os, "pidfd_open")


def _server(start: Callable[[int, int], subprocess.Popen[bytes] | Forked]) -> ForkServer:
    """A server, started with the descriptors of its socket and its output.

    Raises:
        NoFork, OSError: it was not started.
    """
    channel, servers = socketpair(AF_UNIX, SOCK_SEQPACKET)
    with servers, ExitStack() as failed:
        failed.callback(channel.close)
        errors = failed.enter_context(TemporaryFile())
        process = start(servers.fileno(), errors.fileno())
        failed.pop_all()
    return ForkServer(process, channel, errors)


def _readable(descriptor: int, timeout: float | None) -> bool:
    """Whether a descriptor is readable after at most `timeout` [s]; None: without limit."""
    poll = select.poll()
    poll.register(descriptor, select.POLLIN)
    return bool(poll.poll(None if timeout is None else 1e3 * timeout))
