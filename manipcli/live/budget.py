"""Limits of what clients may spend: of one client as operations, of all offenders together as processor time."""

from __future__ import annotations

import time
from typing import Final

RATE: Final = 500.0
BURST: Final = 1000.0
"""Operations per second of wall time, and those at once."""
OPERATION: Final = 4096
"""[byte] A frame counts as one operation for each of these that it has begun: long messages take long to check."""
REFUSED_RATE: Final = 10.0
REFUSED_BURST: Final = 1000.0
"""Refused operations per second of wall time, and those at once; with more the connection is closed."""
SHARE: Final = 0.2
"""Of the processor's time, for the refused and the long frames of all clients together."""


class Budget:
    """What a client may still spend; full at the start.

    Args:
        rate: operations per second of wall time.
        burst: operations at once.
    """

    def __init__(self, rate: float = RATE, burst: float = BURST) -> None:
        self._rate, self._burst = rate, burst
        self._left, self._filled = burst, time.monotonic()

    def spend(self, now: float, size: int = 0) -> bool:
        """Whether one more frame of this size [byte] is allowed at `now` [s of the monotonic clock]."""
        cost = 1.0 + size // OPERATION
        self._left = min(self._burst, self._left + (now - self._filled) * self._rate)
        self._filled = now
        if self._left < cost:
            return False
        self._left -= cost
        return True


class Share:
    """A share of the time that several clients take in turn: who has used it waits until it is paid for."""

    def __init__(self) -> None:
        self._paid = 0.0

    def wait(self, now: float, used: float) -> float:
        """How long to wait [s] at `now` [s of the monotonic clock] after having `used` that much time [s]."""
        self._paid = max(self._paid, now) + used / SHARE
        return self._paid - now
