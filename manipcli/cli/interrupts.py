"""Handling of SIGINT, SIGTERM and SIGHUP: the first signal ends the command cleanly, the second at once.

While nothing is written, the first raises KeyboardInterrupt where it arrives. A run whose log is being written calls
`check` between two ticks instead, so that the log ends with a complete tick.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from types import FrameType
from typing import Self

from manipcli.core.errors import ExitCode

SAME = 0.3
"""[s] A second signal within this time is the same: `timeout` signals the process and its group."""
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Interrupts:
    """A context manager that catches the signals for one command.

    Also where they were inherited as ignored, as in a command that a shell starts in the background; except SIGHUP,
    which `nohup` ignores on purpose.
    """

    def __init__(self) -> None:
        self._asked = False
        self._first = 0.0
        self._deferred = False
        self._before: dict[signal.Signals, object] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            for number in SIGNALS:
                if number is signal.SIGHUP and signal.getsignal(number) is signal.SIG_IGN:
                    continue
                self._before[number] = signal.signal(number, self._caught)
        return self

    def __exit__(self, *raised: object) -> None:
        for number, before in self._before.items():
            # `before` is what signal.signal returned; its declared type is wider than what it takes. None is a handler
            # that was not set from Python and cannot be restored: the default of the system replaces it.
            signal.signal(number, before if before is not None else signal.SIG_DFL)  # type: ignore[arg-type]

    def check(self) -> None:
        """Raises KeyboardInterrupt if a signal has arrived; from now on a first signal waits for this call."""
        self._deferred = True
        if self._asked:
            raise KeyboardInterrupt

    def _caught(self, number: int, frame: FrameType | None) -> None:
        now = time.monotonic()
        if self._asked and now - self._first > SAME:
            os._exit(ExitCode.INTERRUPTED)
        if self._asked:
            return
        self._asked, self._first = True, now
        if not self._deferred:
            raise KeyboardInterrupt
