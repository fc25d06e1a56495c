"""The shift of a compliant reference: the numbers of the motion, its force, and how it changes between motions.

A new `Compliance` makes no step in the force along the axis: the shift is carried over in proportion to the stiffness;
without a new force it is given up smoothly.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from manipcli.control.felt_force import FeltForce
from manipcli.control.pressing import PressingReference, Relaxing
from manipcli.core.geometry import Array
from manipcli.plan.compliance import Compliance

LOOSEST = 1e-9
"""[N/m] Lower bound of a stiffness that divides."""


class CompliantShift:
    """The shift (3,) [m] along the axes of the compliant frame.

    Args:
        felt: the felt force, updated before it.

    Attributes:
        compliance: of the motion.
        pressing: its force; None without one.
        value: (3,) the shift [m], changed in place.
    """

    def __init__(self, felt: FeltForce) -> None:
        self.compliance = Compliance.of()
        self.pressing: PressingReference | None = None
        self.value: Array = np.zeros(3)
        self._felt = felt
        self._relaxing: Relaxing | None = None
        self._fresh = True

    def reset(self) -> None:
        """Back to no shift; the next motion feels what it feels at its beginning as zero."""
        self._fresh, self.pressing, self._relaxing = True, None, None
        self.value[:] = 0.0

    def obey(self, compliance: Compliance) -> bool:
        """Take the numbers of a motion; whether they are others than before."""
        before, self.compliance = self.compliance, compliance
        if compliance is before and not self._fresh:
            return False
        if self._fresh:
            self._felt.tare()
        stiffness = compliance.stiffness[:3]
        self.value *= before.stiffness[:3] / np.maximum(stiffness, LOOSEST)
        force, last, self._relaxing, self._fresh = compliance.force, self.pressing, None, False
        self.pressing = None
        if force is not None:
            along, shift = float(np.abs(force.axis) @ stiffness), float(force.axis @ self.value)
            contact = shift if last is not None and last.touching else None
            self.pressing = PressingReference(force, along, shift=shift, contact=contact)
        elif self.value.any():
            self._relaxing = Relaxing(self.value.copy())
        return True

    def relax(self) -> None:
        """Give up the force, smoothly; without one nothing changes."""
        if self.pressing is not None:
            self.obey(replace(self.compliance, force=None))

    def wrench(self) -> Array:
        """(6,) what the tool exerts, in the axes of the compliant frame [N, N m]."""
        X, felt = self.compliance.X_TC, self._felt.wrench
        return felt if X is None else (felt.reshape(2, 3) @ X.R).reshape(6)

    def update(self, period: float, stretch: Array) -> None:
        """One update of the length `period` [s]; `stretch` (3,): of the spring along its axes [m]."""
        if self._relaxing is not None:
            self.value[:] = self._relaxing.update(period)
        elif self.pressing is not None and not self._felt.taring:
            axis = self.pressing.pressing.axis
            felt = float(axis @ self.wrench()[:3])
            self.value[:] = self.pressing.update(period, felt, float(axis @ stretch)) * axis
