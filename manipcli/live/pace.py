"""Pace of a live session: simulated time against the wall clock."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

BEHIND: Final = 0.25
"""[s] A session this late does not catch up; `/clock` is then slower than asked."""
NAP: Final = 0.0005
"""[s] Shorter waits are left out: the next tick makes up for them."""


class Pace:
    """Waits between ticks.

    Args:
        period: [s] of the control loop.
        speed: simulated seconds per second; None: as fast as possible.
        lasting: [s] of wall time after which the session is over; None: no limit.
        late: called once with a text when the simulation is slower than asked.
    """

    def __init__(
        self,
        period: float,
        *,
        speed: float | None = 1.0,
        lasting: float | None = None,
        late: Callable[[str], None] = lambda _: None,
    ) -> None:
        self._step = None if speed is None else period / speed
        self._speed = speed
        self._lasting = lasting
        self._late: Callable[[str], None] | None = late
        self._began: float | None = None
        self._next = 0.0

    def start(self) -> None:
        """The next tick is due now: at the start, and after a pause, which is not made up for."""
        self._next = time.perf_counter()
        if self._began is None:
            self._began = self._next

    @property
    def over(self) -> bool:
        """Whether the time from the first start on is over, pauses and resets included."""
        if self._lasting is None or self._began is None:
            return False
        return time.perf_counter() - self._began >= self._lasting

    @property
    def ahead(self) -> bool:
        """Whether the next tick is not due yet."""
        return self._step is not None and time.perf_counter() < self._next + self._step

    def wait(self) -> None:
        """Wait until the next tick is due."""
        if self._step is None:
            return
        self._next += self._step
        ahead = self._next - time.perf_counter()
        if ahead > NAP:
            time.sleep(ahead)
        elif ahead < -BEHIND:
            self._next -= ahead
            if self._late is not None:
                self._late(f"the simulation is slower than --speed {self._speed:g}; /clock shows the simulated time")
                self._late = None


class Share:
    """A small share of wall time, for work that can wait.

    Args:
        share: of the time, in (0, 1).
        clock: wall time [s].
    """

    def __init__(self, share: float, clock: Callable[[], float] = time.perf_counter) -> None:
        self._share, self._clock = share, clock
        self._next = self._began = clock()

    def free(self) -> bool:
        """Whether the share is not used up."""
        return self._clock() >= self._next

    def __enter__(self) -> None:
        self._began = self._clock()

    def __exit__(self, *raised: object) -> None:
        self._next = self._began + (self._clock() - self._began) / self._share
