"""Starts and ends the process of the network; the end of the control loop.

A new interpreter instead of a fork: a fork would copy the locks of other threads, the engine and the open log.
"""

from __future__ import annotations

import json
import os
import pickle
import socket
import struct
import subprocess
import sys
from contextlib import suppress
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final, Self

from manipcli.core.errors import Diagnostic, ExitCode, InvalidInput, ManipcliError
from manipcli.live.link import HEAD, Link, framed, shared_numbers
from manipcli.live.pictures import numbers_for

if TYPE_CHECKING:
    from manipcli.live.network import Setup

PATIENCE: Final = 60.0
"""[s] Longest start of the process, on a busy machine."""
LAST: Final = 5.0
"""[s] Longest end of the process; then it is killed."""
PROGRAM: Final = """\
import sys
sys.path[:] = {path!r}
from manipcli.live.network import main
main({socket}, {numbers})
"""


class NetworkFailed(ManipcliError):
    """The process of the network did not start."""

    code = "LIVE200"
    exit_code = ExitCode.FAILED


class NetworkProcess:
    """The process of the network. A context manager that ends it.

    Args:
        setup: of the session.

    Attributes:
        link: the end of the control loop.
        port: that the WebSocket server listens on.
        notices: of its outlets, for the user.

    Raises:
        InvalidInput: USE131 a port cannot be used; USE132 a library is not installed.
        NetworkFailed: LIVE200 it did not start.
    """

    def __init__(self, setup: Setup) -> None:
        ours, theirs = socket.socketpair()
        descriptor = os.memfd_create("manipcli")
        try:
            os.ftruncate(descriptor, 8 * numbers_for(setup.offer.pictures))
            numbers = shared_numbers(descriptor)
            program = PROGRAM.format(path=sys.path, socket=theirs.fileno(), numbers=descriptor)
            self._process = subprocess.Popen(
                [sys.executable, "-c", program],
                pass_fds=(theirs.fileno(), descriptor),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                start_new_session=True,  # signals of the terminal reach only the control loop
            )
        finally:
            theirs.close()
            os.close(descriptor)
        self._end = ours
        try:
            self.port, self.notices = self._started(setup)
        except BaseException:
            self._kill()
            raise
        self.link = Link(ours, numbers, setup.offer.pictures)

    def _started(self, setup: Setup) -> tuple[int, list[str]]:
        self._end.settimeout(PATIENCE)
        try:
            self._end.sendall(framed(pickle.dumps(setup, 5)))
            with self._end.makefile("rb") as file:
                (length,) = HEAD.unpack(file.read(HEAD.size))
                found: dict[str, Any] = json.loads(file.read(length))
        except (OSError, ValueError, struct.error) as error:
            raise NetworkFailed(f"the process of the network did not start: {error}") from error
        if "findings" in found:
            raise InvalidInput([Diagnostic(code, text, hint=hint) for code, text, hint in found["findings"]])
        return int(found["port"]), [str(notice) for notice in found["notices"]]

    @property
    def lost(self) -> str:
        """Why the process has ended by itself; "" if it has not."""
        code = self._process.poll()
        if code is None:
            return ""
        return (
            f"the process of the network was ended by signal {-code}"
            if code < 0
            else "the process of the network failed"
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.link.close()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(LAST)
        self._kill()

    def _kill(self) -> None:
        self._process.kill()
        self._process.wait()
        self._end.close()
