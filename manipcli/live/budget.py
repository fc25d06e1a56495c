"""Rate of operations of one client: a bucket that fills with time."""

from __future__ import annotations

import time
from typing import Final

RATE: Final = 500.0
BURST: Final = 1000.0
"""Operations per second of wall time, and those at once."""


class Budget:
    """What a client may still spend; full at the start."""

    def __init__(self) -> None:
        self._left, self._filled = BURST, time.monotonic()

    def spend(self, now: float) -> bool:
        """Whether one more operation is allowed at `now` [s of the monotonic clock]."""
        self._left = min(BURST, self._left + (now - self._filled) * RATE)
        self._filled = now
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True
