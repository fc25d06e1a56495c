"""The newest state of the session, as the page shows it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from manipcli.core.geometry import Array
from manipcli.live.page.drive import Drive
from manipcli.model.state import WorldState

ACTIVE = "active"
RESETTING, ENDED = "resetting", "ended"


@dataclass(frozen=True, slots=True)
class Snapshot:
    """One state.

    Attributes:
        time: simulated [s].
        state: of joints and bodies.
        rows: of the outputs of controllers, see `ControllerOutput`; None while one is inactive.
        controllers: their states by name, as in list_controllers.
        simulation: as in simulation_interfaces/SimulationState; None if it is unknown.
        stopped: whether the emergency stop is active.
        phase: `RESETTING` or `ENDED`; "" while the session goes on.
    """

    time: float
    state: WorldState
    rows: tuple[Array | None, ...] = ()
    controllers: Mapping[str, str] = field(default_factory=dict)
    simulation: int | None = None
    stopped: bool = False
    phase: str = ""

    @classmethod
    def of(cls, time: float, state: WorldState, outputs: Sequence[tuple[Array, Array] | None]) -> Self:
        """With copies of a state, and the rows and speeds of the outputs of controllers at this time [s]."""
        joints, bodies = state.position.shape[-1], state.body_position.shape[-2]
        copy = WorldState.room(joints, bodies)
        np.copyto(copy.numbers, state.numbers)
        return cls(time, copy, tuple(None if output is None else output[0] for output in outputs))

    def is_active(self, controller: str) -> bool:
        """Whether a controller is active, or not yet known."""
        return self.controllers.get(controller, ACTIVE) == ACTIVE

    def obstacle(self, controller: str) -> str:
        """Why a controller cannot be moved now; "" if it can."""
        if self.phase:
            return "the session has ended" if self.phase == ENDED else "the simulation is reset"
        if self.stopped:
            return 'the emergency stop is active; press "Release emergency stop"'
        return "" if self.is_active(controller) else f"{controller} is not active"

    def reference(self, drive: Drive) -> tuple[Array, Array]:
        """(n) positions and (n) velocities where a drive is: its references; as measured while it has none."""
        rows = self.rows[drive.index] if drive.index < len(self.rows) else None
        n = len(drive.joints)
        if rows is not None and len(rows) >= 2 and rows.shape[1] == n and bool(np.isfinite(rows[:2]).all()):
            return rows[0], rows[1]
        columns = list(drive.columns)
        return self.state.position[columns], self.state.velocity[columns]
