"""Definition of a grasp: pressing links, pinched objects and carried objects.

- *pressing*: the links of the robot that touch an object with force.
- *pinched*: at least two links press, each with at least `GRIP_FORCE`. Used by the conditions `grasped` and `slip` and
  by the end of `release`; needs contacts only.
- *carried*: a link presses, and the object has followed at least `FOLLOWS` of the hand's motion since `Grasp.begin`.
  Used by every step that ends with an object in the hand, and by re-planning; needs contacts and poses.

The condition `slip` and the grasp intervals of a report build on `pressing`: `slip` measures how far a pinched object
moved in the hand, an interval is the time in which an object is pressed and has no other support.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.model.collision import Carried
from manipcli.model.kinematics import Kinematics
from manipcli.model.state import Contact, WorldState
from manipcli.scene.scene import Scene

LINK: Final = "robot/"
GRIP_FORCE: Final = 0.1
"""[N] Least force of each of the two links that pinch an object."""
BRIDGED: Final = 0.05
"""[s] Shorter gaps in a contact are ignored."""
FOLLOWS: Final = 0.5
"""Least share of the hand's motion that a carried object follows."""
STILL: Final = 1e-3
"""[m] Smaller motions of the hand are ignored: the servo error of an arm at rest."""
MISPLACED: Final = 0.05
"""[m] An object further than this from its planned pose in the hand is not carried."""


def pressing(contacts: Sequence[Contact], body: str) -> list[tuple[float, str]]:
    """(force [N], link) of each link of the robot that presses on a body, the largest force first."""
    found: dict[str, float] = {}
    for contact in contacts:
        other = contact.b if contact.a == body else contact.a if contact.b == body else ""
        if other.startswith(LINK) and contact.force > 0.0:
            found[other] = found.get(other, 0.0) + contact.force
    return sorted(((force, link) for link, force in found.items()), reverse=True)


def pinch_force(contacts: Sequence[Contact], body: str) -> float:
    """The second largest force [N] of a link on a body; 0 if fewer than two links press."""
    found = pressing(contacts, body)
    return found[1][0] if len(found) > 1 else 0.0


class Grasp:
    """Tracks the object in the hand to decide whether the hand carries it.

    Args:
        kinematics, scene: of the measured world.
    """

    def __init__(self, kinematics: Kinematics, scene: Scene) -> None:
        self._kinematics = kinematics
        self._scene = scene
        self._carried: Carried | None = None
        self._k = 0
        self._start = self._X_LC = np.zeros(3)
        self._travel = 0.0
        self._pressed_at = -np.inf

    def begin(self, carried: Carried, state: WorldState, contacts: Sequence[Contact]) -> None:
        """Starts tracking: at the end of a closing motion, or when a step begins with an object in the hand."""
        self._carried = carried
        self._k = self._scene.movable.index(self._scene.body(carried.body))
        self._start = self._centre(state)
        self._X_LC = self._link(state).inverse().apply(self._start)
        self._travel = 0.0
        self._pressed_at = -np.inf
        self.look(state, contacts)

    def look(self, state: WorldState, contacts: Sequence[Contact]) -> None:
        """Updates with the current world; call it at least every `BRIDGED` while the hand moves."""
        if self._carried is None:
            return
        if pressing(contacts, self._carried.body):
            self._pressed_at = float(state.time)
        self._travel = max(self._travel, float(np.linalg.norm(self._moved_with_hand(state))))

    def lost(self, carried: Carried, state: WorldState, contacts: Sequence[Contact]) -> str:
        """Why the hand does not carry this object now; "" if it does."""
        if self._carried is None or self._carried.body != carried.body:
            self.begin(carried, state, contacts)
        self.look(state, contacts)
        hand = self._moved_with_hand(state)
        length = float(np.linalg.norm(hand))
        direction = hand / length if length > STILL else np.zeros(3)
        object_moved = self._centre(state) - self._start
        behind = float((hand - object_moved) @ direction) > (1.0 - FOLLOWS) * max(self._travel, length)
        why = []
        if float(state.time) - self._pressed_at > BRIDGED:
            why.append("no robot link presses on it")
        if behind:
            lifted = direction[2] > 0.7
            verb, along = ("rose", object_moved[2]) if lifted else ("moved", object_moved @ direction)
            hand_moved = hand[2] if lifted else length
            why.append(f"it {verb} {_mm(float(along))} while the tool {verb} {_mm(float(hand_moved))}")
        off = float(np.linalg.norm(self._pose(state, carried).p - carried.X_LO.p))
        if off > MISPLACED and not behind:
            why.append(f"it is {_mm(off)} from its planned pose in the hand")
        return ", ".join(why)

    def _moved_with_hand(self, state: WorldState) -> Array:
        """(3,) motion [m] of the object's centre since `begin` if it had moved rigidly with the hand."""
        return np.asarray(self._link(state).apply(self._X_LC) - self._start)

    def _link(self, state: WorldState) -> Transform:
        assert self._carried is not None  # callers check it first
        return self._kinematics.forward(state.position, self._carried.link)

    def _object(self, state: WorldState) -> Transform:
        return Transform.of(xyz=state.body_position[self._k], quat_xyzw=state.body_quat_xyzw[self._k])

    def _centre(self, state: WorldState) -> Array:
        return self._object(state).apply(self._scene.movable[self._k].centre)

    def _pose(self, state: WorldState, carried: Carried) -> Transform:
        """Measured X_LO of the object."""
        return self._kinematics.forward(state.position, carried.link).inverse() @ self._object(state)


def _mm(length: float) -> str:
    return f"{1000.0 * length + 0.0:.1f} mm".replace("-0.0", "0.0")
