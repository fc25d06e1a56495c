"""Speed of the trajectories of one controller while it runs: slower, faster, and a stop on the path."""

from __future__ import annotations

import math
from collections.abc import Callable

from manipcli.control.active_trajectory import VELOCITY, Reference


class SpeedScaling:
    """Trajectory seconds per second. Stops are not scaled.

    Args:
        reference: that is scaled.
        initial: 0 or more: 0 stops, 1 is nominal.
        now: returns the time [s] of the last update of the controller.
        ask: called when the next update has to look at `wanted`.

    Attributes:
        factor: as set last.
        paused: whether `pause` was called last, not `resume`.
    """

    def __init__(
        self, reference: Reference, initial: float, *, now: Callable[[], float], ask: Callable[[], None]
    ) -> None:
        self._reference, self._initial, self._now, self._ask = reference, initial, now, ask
        self.reset()

    def reset(self) -> None:
        """As at the start."""
        self.factor = self._initial
        self.paused = False

    @property
    def wanted(self) -> float:
        """The speed that the controller approaches."""
        return 0.0 if self.paused else self.factor

    @property
    def actual(self) -> float:
        """The speed at the last update."""
        return self.pace(self._now())[0]

    def pace(self, time: float) -> tuple[float, float]:
        """The speed at `time` [s], and its rate [1/s]."""
        reference = self._reference
        return reference.speed(time) if reference.moving and reference.scales else (self.wanted, 0.0)

    def begin(self, time: float) -> tuple[float, float]:
        """As `pace`, for a new trajectory: in a pause, one that begins in motion stops on its path."""
        speed = self.pace(time)
        return (1.0, 0.0) if speed[0] == 0.0 and self._reference.row(time)[VELOCITY].any() else speed

    def set(self, factor: float, *, at_once: bool = False) -> bool:
        """Change to this factor from the next update on, within the acceleration limits: see `TrajectoryClock`.

        `at_once`: from the last update on, without a transition: the reference's velocity is multiplied by it, its
        acceleration by the square.

        Returns:
            False for a negative or non-finite factor, which has no effect.
        """
        if not 0.0 <= factor < math.inf:
            return False
        self.factor = float(factor)
        if at_once:
            self._reference.rescale(self.wanted, time=self._now())
        self._ask()
        return True

    def pause(self) -> None:
        """Stop on the path within the acceleration limits, and rest there. The goal stays active."""
        self.paused = True
        self._ask()

    def resume(self) -> None:
        """Continue from the stop on the path, with the factor that is set."""
        self.paused = False
        self._ask()

    def approach(self, time: float, period: float) -> None:
        """At the update at `time` [s]: begin a change to the wanted speed, if it is another."""
        self._reference.change_speed(self.wanted, time=time, period=period)
