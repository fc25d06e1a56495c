"""Sleep of resting bodies in MuJoCo: a sleeping island costs neither collision checks nor the solver.

MuJoCo wakes an island when an awake body touches it. It has no contacts while it sleeps; those that it had are kept.
"""

from __future__ import annotations

from types import ModuleType
from typing import Any, Final

from manipcli.model.state import Contact, WorldState
from manipcli.scene.scene import Scene
from manipcli.simulate.engines.conventions import sides
from manipcli.simulate.engines.resting import AWAKE, FIXED, Resting

TOLERANCE: Final = 1e-3
"""[m/s] Speed of a body, and of its surface by rotation, below which MuJoCo lets an island sleep, after 10 steps."""


def enable_sleep(mujoco: ModuleType, model: Any) -> None:
    """Let MuJoCo put islands to sleep, none of them yet."""
    model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_ISLAND)
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    model.opt.sleep_tolerance = TOLERANCE
    model.tree_sleep_policy[:] = int(mujoco.mjtSleepPolicy.mjSLEEP_NEVER)


class Sleep:
    """Lets the resting bodies of one world sleep.

    Args:
        mujoco, model, data: the library and the world, after `enable_sleep`.
        scene: the bodies.
        trees: number of the kinematic tree of each movable body.
        period: [s] of a tick.

    Attributes:
        due: whether a look is due.
    """

    def __init__(
        self, mujoco: ModuleType, model: Any, data: Any, scene: Scene, trees: list[int], period: float
    ) -> None:
        policy = mujoco.mjtSleepPolicy
        self._never, self._allowed = int(policy.mjSLEEP_NEVER), int(policy.mjSLEEP_ALLOWED)
        self._policy, self._asleep = model.tree_sleep_policy, data.tree_asleep
        self._twists = [data.qvel[at : at + n] for at, n in zip(model.tree_dofadr, model.tree_dofnum, strict=True)]
        self._resting, self._trees = Resting(scene, period), trees
        self._row = {body.name: k for k, body in enumerate(scene.movable)}
        self._row |= {
            body.name: FIXED for body in scene.bodies if body.fixed and body.name not in self._resting.jointed
        }
        self._kept: dict[tuple[str, str], tuple[int, Contact]] = {}
        self._slept: set[int] = set()  # rows that were asleep after the last tick
        self._before = b""
        self.due = False

    def ticked(self) -> None:
        """After each tick: what was woken may not fall asleep by itself."""
        self.due = self._resting.due() or self.due
        now = self._asleep.tobytes()
        if now != self._before:
            self._before = now
            slept = {k for k, tree in enumerate(self._trees) if self._asleep[tree] >= 0}
            for k in self._slept - slept:
                self._wake(k)
            self._slept = slept

    def look(self, state: WorldState, contacts: tuple[Contact, ...]) -> None:
        """Put the islands to sleep that rest in this state, with these contacts."""
        self.due = False
        before = self._resting.asleep.copy()
        if self._resting.look(state):
            row = self._row
            pairs = [(row.get(contact.a, AWAKE), row.get(contact.b, AWAKE)) for contact in contacts]
            found = self._resting.islands(pairs)
            for k in found:
                self._policy[self._trees[k]] = self._allowed
                self._twists[self._trees[k]][:] = 0.0
            for (a, b), contact in zip(pairs, contacts, strict=True):
                if a in found or b in found:
                    self._kept[contact.a, contact.b] = (max(a, b), contact)
        for k in (before & ~self._resting.asleep).nonzero()[0].tolist():
            self._wake(k)

    def wake(self) -> None:
        """Wake all bodies."""
        for k in range(len(self._trees)):
            self._wake(k)
        self._resting.wake()

    def _wake(self, row: int) -> None:
        self._policy[self._trees[row]] = self._never
        self._resting.asleep[row] = False

    def with_kept(self, contacts: tuple[Contact, ...]) -> tuple[Contact, ...]:
        """These contacts, and those of bodies that sleep."""
        if not self._slept:
            return contacts
        found = {(contact.a, contact.b) for contact in contacts}
        kept = [contact for pair, (k, contact) in self._kept.items() if k in self._slept and pair not in found]
        return tuple(sorted((*contacts, *kept), key=sides)) if kept else contacts
