"""A controller's place in a manager: what is measured of its joints, and when it is its turn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from manipcli.control.controller import Controller, JointState
from manipcli.control.lifecycle import ControllerState
from manipcli.core.geometry import Array

Index = slice | npt.NDArray[np.intp]
"""Where joints stand in a joint vector."""


class Slot:
    """A loaded controller, where its joints stand in a joint vector, and what is measured there.

    `measured` and `contact_force` are read-only parts of the vectors that the manager was given, or, where the joints
    do not stand side by side, copies that are taken anew every tick (`gathered`: copy, vector). It is updated at the
    tick `first`, at which it was activated, and at every `every`-th one from there.
    """

    __slots__ = (
        "contact_force", "controller", "copies", "every", "first", "gathered", "index", "measured", "period",
        "scattered", "state",
    )  # fmt: skip

    def __init__(self, controller: Controller, index: Index, every: int, period: float) -> None:
        self.controller = controller
        self.index = index
        self.scattered = not isinstance(index, slice)
        self.every = every
        self.first = 0
        self.period = every * period
        self.state: ControllerState = "unconfigured"
        none = np.zeros(0)
        self.measured = JointState(none, none, none)
        self.contact_force: Array | None = None
        self.copies: tuple[tuple[Array, Index, Array], ...] = ()
        self.gathered: list[tuple[Array, Array]] = []

    def look(self, vectors: Sequence[Array], contact_force: Array | None) -> None:
        """From now on at these vectors: position, velocity, effort."""
        self.gathered = []
        self.measured = JointState(*map(self._part, vectors))
        self.contact_force = None if contact_force is None else self._part(contact_force)

    def _part(self, vector: Array) -> Array:
        part = vector[self.index]
        if self.scattered:
            self.gathered.append((part, vector))
            part = part.view()
        part.flags.writeable = False
        return part

    def gather(self) -> None:
        """Copies what is measured now."""
        for part, vector in self.gathered:
            part[:] = vector[self.index]
