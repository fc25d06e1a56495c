"""Tracking error of a controller: reference minus measurement, for all its joints."""

from __future__ import annotations

import math

import numpy as np

from manipcli.control.compiled import Run, bind
from manipcli.control.controller import JointState
from manipcli.control.trajectory_goal import JointFacts, shortest
from manipcli.core.geometry import Array


class TrackingError:
    """Errors of position and velocity.

    Args:
        reference: (2, n) positions and velocities, read at every `update`.
        facts: of the joints; the error of an endless joint is the shortest rotation. None: no joint is endless.

    Attributes:
        errors: (2, n), overwritten at every `update`.
    """

    def __init__(self, reference: Array, facts: JointFacts | None = None) -> None:
        self._reference = reference
        self._position, self._velocity = reference
        self._facts = facts if facts is not None and facts.wraps else None
        self.errors: Array = np.zeros(reference.shape)
        self._error, self._error_rate = self.errors
        self._flat = self.errors.reshape(-1)
        self._measured: JointState | None = None
        self._compiled: Run | None = None

    def update(self, measured: JointState, bound: float) -> bool:
        """Compute the errors; returns whether all are below `bound`, by a quick test: True is always right.

        NaN and infinity are below no bound.
        """
        if measured is not self._measured:
            self._look(measured)
        if self._compiled is not None:
            return bool(self._compiled(bound))
        np.subtract(self._position, measured.position, self._error)
        np.subtract(self._velocity, measured.velocity, self._error_rate)
        if self._facts is not None:
            shortest(self._error, self._facts)
        # The largest error is at most their norm.
        return math.hypot(*self._flat.tolist()) < bound

    def _look(self, measured: JointState) -> None:
        """Bind the compiled law to the arrays of `measured`, which are overwritten at every tick."""
        self._measured = measured
        if self._facts is None:
            n = len(self._position)
            self._compiled = bind("errors", n, self._reference, measured.position, measured.velocity, self.errors)
