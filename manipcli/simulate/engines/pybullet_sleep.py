"""Sleep of resting bodies in PyBullet: a sleeping island costs neither collision checks nor the solver.

Bullet wakes an island when the bounding box of a moving body meets one of its bodies; its contacts stay as they were.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Final

from manipcli.model.state import WorldState
from manipcli.simulate.engines.pybullet_contacts import BulletPoint
from manipcli.simulate.engines.resting import AWAKE, FIXED, Resting

THRESHOLD: Final = 1e-6
"""Sum of the squares of speed [m/s] and angular velocity [rad/s] above which Bullet counts a body as awake."""


class Sleep:
    """Lets the resting bodies of one world sleep.

    Args:
        p, client: PyBullet and its world.
        resting: decides which bodies rest.
        bodies: Bullet's number of each movable body that can sleep, by row.
        fixed: Bullet's numbers of the fixed bodies.

    Attributes:
        due: whether a look is due.
    """

    def __init__(
        self, p: ModuleType, client: int, resting: Resting, bodies: Mapping[int, int], fixed: Sequence[int]
    ) -> None:
        self._p, self._client, self._resting, self._bodies = p, client, resting, bodies
        self._row = {number: row for row, number in bodies.items()} | dict.fromkeys(fixed, FIXED)
        self.due = False
        for number in bodies.values():
            p.changeDynamics(
                number,
                -1,
                activationState=p.ACTIVATION_STATE_ENABLE_SLEEPING | p.ACTIVATION_STATE_ENABLE_WAKEUP,
                sleepThreshold=THRESHOLD,
                physicsClientId=client,
            )

    def ticked(self) -> None:
        """After each tick."""
        self.due = self._resting.due() or self.due

    def look(self, state: WorldState, points: Sequence[BulletPoint]) -> None:
        """Put the islands to sleep that rest in this state, with these contacts."""
        self.due = False
        before = self._resting.asleep.copy()
        if self._resting.look(state):
            row = self._row
            pairs = {point[1:3] for point in points}
            for k in self._resting.islands((row.get(a, AWAKE), row.get(b, AWAKE)) for a, b in pairs):
                self._p.resetBaseVelocity(self._bodies[k], (0, 0, 0), (0, 0, 0), physicsClientId=self._client)
                self._set(k, self._p.ACTIVATION_STATE_SLEEP)
        for k in (before & ~self._resting.asleep).nonzero()[0].tolist():
            self._set(k, self._p.ACTIVATION_STATE_WAKE_UP)

    def wake(self) -> None:
        """Wake all bodies."""
        for k in self._bodies:
            self._set(k, self._p.ACTIVATION_STATE_WAKE_UP)
        self._resting.wake()

    def _set(self, row: int, state: int) -> None:
        self._p.changeDynamics(self._bodies[row], -1, activationState=state, physicsClientId=self._client)
