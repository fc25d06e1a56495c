"""Ctrl-C and its kin (SIGINT, SIGTERM, SIGHUP): the first asks the command to end well, the second ends it.

While nothing is written, the first raises KeyboardInterrupt where it arrives. A run whose log is being written calls
`check` between two ticks instead, so that the log ends with a whole tick and not in the middle of one.
"""

from __future__ import annotations

import os
import signal
import threading
from types import FrameType
from typing import Self

from manipcli.core.errors import ExitCode

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Interrupts:
    """A context manager that catches the signals for one command.

    They are caught even where they were inherited as ignored, as by a command that a shell starts in the background;
    except SIGHUP, which `nohup` ignores on purpose.
    """

    def __init__(self) -> None:
        self._asked = False
        self._deferred = False
        self._before: dict[signal.Signals, object] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            for one in SIGNALS:
                if one is signal.SIGHUP and signal.getsignal(one) is signal.SIG_IGN:
                    continue
                self._before[one] = signal.signal(one, self._caught)
        return self

    def __exit__(self, *raised: object) -> None:
        for one, before in self._before.items():
            # `before` is what signal.signal returned; its declared type is wider than what it takes. None stands for a
            # handler that was not set from Python and cannot be put back: the system's own follows.
            signal.signal(one, before if before is not None else signal.SIG_DFL)  # type: ignore[arg-type]

    def check(self) -> None:
        """Raises KeyboardInterrupt if somebody asked to end; from now on asking does nothing but wait for this call."""
        self._deferred = True
        if self._asked:
            raise KeyboardInterrupt

    def _caught(self, number: int, frame: FrameType | None) -> None:
        if self._asked:
            os._exit(ExitCode.INTERRUPTED)
        self._asked = True
        if not self._deferred:
            raise KeyboardInterrupt
