"""Rate of operations of one client: a bucket that fills with time."""

from __future__ import annotations

import time
from typing import Final

RATE: Final = 500.0
BURST: Final = 1000.0
"""Operations per second of wall time, and those at once."""
OPERATION: Final = 4096
"""[byte] A frame counts as one operation for each of these that it has begun: long messages take long to check."""


class Budget:
    """What a client may still spend; full at the start."""

    def __init__(self) -> None:
        self._left, self._filled = BURST, time.monotonic()

    def spend(self, now: float, size: int = 0) -> bool:
        """Whether one more frame of this size [byte] is allowed at `now` [s of the monotonic clock]."""
        cost = 1.0 + size // OPERATION
        self._left = min(BURST, self._left + (now - self._filled) * RATE)
        self._filled = now
        if self._left < cost:
            return False
        self._left -= cost
        return True
