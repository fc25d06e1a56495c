"""Rate of the messages of a topic, as `ros2 topic hz` computes it."""

from __future__ import annotations

from collections import deque

import numpy as np


class Rate:
    """Intervals between messages.

    Args:
        window: number of the last messages that count.
    """

    def __init__(self, window: int) -> None:
        self._times: deque[float] = deque(maxlen=window)
        self._new = False

    def arrived(self, now: float) -> None:
        """A message arrived at `now` [s]."""
        self._times.append(now)
        self._new = True

    def report(self) -> str:
        """Mean rate [1/s], shortest and longest interval and standard deviation [s], messages in the window."""
        new, self._new = self._new, False
        if not new or len(self._times) < 2:
            return "no new messages"
        steps = np.diff(np.array(self._times))
        rate = 1.0 / max(float(steps.mean()), 1e-9)
        return (
            f"average rate: {rate:.3f}\n"
            f"  min: {steps.min():.3f}s max: {steps.max():.3f}s std dev: {steps.std():.5f}s window: {len(self._times)}"
        )
