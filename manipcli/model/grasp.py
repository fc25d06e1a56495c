"""Definition of a grasp: pressing links, pinched objects and carried objects.

- *pressing*: the links of the robot that touch an object with force.
- *pinched*: at least two links press, each with at least `GRIP_FORCE`. Used by the conditions `grasped` and
  `slip` and by the end of `release`; needs contacts only.
- *carried*: a link presses, or it is attached to the tool, and the object has followed at least `FOLLOWS` of the
  hand's motion, since the hand closed and since the step began. Used by every step that ends with an object in the
  hand, and by re-planning; needs contacts and poses.

The condition `slip` and the grasp intervals of a report build on `pressing`: `slip` measures how far a pinched object
moved in the hand, an interval is the time in which an object is pressed and has no other support.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.model.collision import Carried
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact, WorldState
from manipcli.scene.scene import Body, Scene

LINK: Final = "robot/"
GRIP_FORCE: Final = 0.1
"""[N] Least force of each of the two links that pinch an object."""
BRIDGED: Final = 0.05
"""[s] Shorter gaps in a contact are ignored."""
FOLLOWS: Final = 0.5
"""Share of the hand's motion that a carried object follows at least."""
STILL: Final = 2e-4
"""[m] A hand that moved less has not moved: fingers and arm yield by so much under load."""
DROPPED: Final = 0.02
"""[m] A lag on the path counts from this motion of the hand on; below it, contacts are still settling."""
MISPLACED: Final = 0.05
"""[m] An object further than this from its planned pose in the hand is not carried."""


def friction_coefficient(robot: RobotModel, body: Body) -> float:
    """mu of a contact between robot and body: the product of those of the two surfaces, as in Bullet."""
    return body.friction * robot.friction


def friction_load(mu: float, forces: Iterable[float]) -> float:
    """[N] The largest load that friction carries across level fingers which press with these `forces` [N]: mu sum F."""
    return mu * sum(forces)


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


@dataclass(slots=True)
class _Motion:
    """Motion since a start of the point at which the hand holds the object, on the hand and on the object.

    Attributes:
        hand, body: (3,) [m] where the two points were.
        travel: [m] largest distance of the hand from there.
        dropped: how far hand and object had moved, (3,) [m] each, when the object first did not follow.
    """

    hand: Array
    body: Array
    travel: float = 0.0
    dropped: tuple[Array, Array] | None = None

    def look(self, hand: Array, body: Array) -> None:
        """The two points now, (3,) [m] in the world."""
        moved, followed = hand - self.hand, body - self.body
        length = float(np.linalg.norm(moved))
        self.travel = max(self.travel, length)
        if self.dropped is None and length > DROPPED and _behind(moved, followed, length):
            self.dropped = moved, followed

    def lag(self, hand: Array, body: Array) -> tuple[Array, Array] | None:
        """How far hand and object moved, where the object did not follow; None where it did."""
        moved, followed = hand - self.hand, body - self.body
        if self.travel > STILL and _behind(moved, followed, self.travel):
            return moved, followed
        return self.dropped


def _behind(hand: Array, body: Array, travel: float) -> bool:
    return float(np.linalg.norm(hand - body)) > (1.0 - FOLLOWS) * travel


class Attachment(Protocol):
    """What is attached to the tool; "" without an object, and why the last attachment broke, or ""."""

    attached: str
    broken: str


class Grasp:
    """Tracks the object in the hand to decide whether the hand carries it.

    It follows the point of the object that was at the tool when the hand closed, so that an object that pivots between
    the fingers is carried; `slip` measures how far it slips or rotates there. The motion counts since the hand closed,
    and since the step began.

    Args:
        kinematics, scene: of the world that is measured.
        period: [s] between two calls of `look`.
        attachment: of objects to the tool; None: contact and friction hold them.
    """

    def __init__(
        self, kinematics: Kinematics, scene: Scene, *, period: float = 0.0, attachment: Attachment | None = None
    ) -> None:
        self._attachment = attachment
        self._kinematics = kinematics
        self._scene = scene
        self._bridged = max(BRIDGED, 2.0 * period)
        self._carried: Carried | None = None
        self._k = 0
        self._p_LC = self._p_OC = np.zeros(3)
        self._motions: list[_Motion] = []
        self._pressed_at = -np.inf

    def close(self, carried: Carried, state: WorldState, contacts: Sequence[Contact]) -> None:
        """The hand has closed on an object, which follows it from now on."""
        self._carried = carried
        self._k = self._scene.movable.index(self._scene.body(carried.body))
        tool, X_WL, X_WO = self._kinematics.robot.tool, self._link(state), self._object(state)
        if tool is None:
            point = X_WO.apply(self._scene.movable[self._k].centre)
        else:
            point = self._kinematics.forward(state.position, tool.link).apply(tool.X_LT.p)
        self._p_LC, self._p_OC = X_WL.inverse().apply(point), X_WO.inverse().apply(point)
        self._motions = [_Motion(point, point)]
        self._pressed_at = -np.inf
        self.look(state, contacts)

    def begin_step(self, carried: Carried, state: WorldState, contacts: Sequence[Contact]) -> None:
        """A step begins with this object in the hand."""
        if self._carried is None or self._carried.body != carried.body:
            self.close(carried, state, contacts)
        self._motions = [self._motions[0], _Motion(*self._points(state))]

    def release(self) -> None:
        """The hand has opened."""
        self._carried = None

    def look(self, state: WorldState, contacts: Sequence[Contact]) -> None:
        """The world now; to be called every `period` while the hand moves."""
        if self._carried is None:
            return
        if pressing(contacts, self._carried.body):
            self._pressed_at = float(state.time)
        points = self._points(state)
        for motion in self._motions:
            motion.look(*points)

    def lost(self, carried: Carried, state: WorldState, contacts: Sequence[Contact]) -> str:
        """Why the hand does not carry this object now; "" if it does."""
        if self._carried is None or self._carried.body != carried.body:
            self.close(carried, state, contacts)
        self.look(state, contacts)
        points = self._points(state)
        lags = [lag for motion in reversed(self._motions) if (lag := motion.lag(*points)) is not None]
        reasons = []
        if self._attachment is not None:
            if self._attachment.attached != carried.body:
                reasons.append(self._attachment.broken or "it is not attached to the tool")
        elif float(state.time) - self._pressed_at > self._bridged:
            reasons.append("no robot link presses on it")
        if lags:
            reasons.append(_described(*lags[0]))
        off = float(np.linalg.norm(self._pose(state, carried).p - carried.X_LO.p))
        if off > MISPLACED and not lags:
            reasons.append(f"it is {_mm(off)} from its planned pose in the hand")
        return ", ".join(reasons)

    def short_of(self, planned: Array, state: WorldState) -> str:
        """Why the object did not follow the planned motion (3,) [m] of the hand in this step; "" where it did."""
        length = float(np.linalg.norm(planned))
        if self._carried is None or length <= STILL:
            return ""
        moved = self._points(state)[1] - self._motions[-1].body
        if float(moved @ planned) >= FOLLOWS * length**2:
            return ""
        up = planned[2] > 0.7 * length
        verb, along = ("rose", float(moved[2])) if up else ("moved", float(moved @ planned) / length)
        return f"it {verb} {_mm(along)} of the planned {_mm(float(planned[2]) if up else length)}"

    def _points(self, state: WorldState) -> tuple[Array, Array]:
        """The point (3,) [m] at which the object is held, in the world: on the hand, and on the object."""
        return self._link(state).apply(self._p_LC), self._object(state).apply(self._p_OC)

    def _link(self, state: WorldState) -> Transform:
        assert self._carried is not None  # callers check it first
        return self._kinematics.forward(state.position, self._carried.link)

    def _object(self, state: WorldState) -> Transform:
        return Transform.of(xyz=state.body_position[self._k], quat_xyzw=state.body_quat_xyzw[self._k])

    def _pose(self, state: WorldState, carried: Carried) -> Transform:
        """X_LO of the object as it is measured."""
        return self._link(state).inverse() @ self._object(state)


def _described(hand: Array, body: Array) -> str:
    """The motions (3,) [m] of hand and object; upwards where the hand mostly rose."""
    length = float(np.linalg.norm(hand))
    if hand[2] > 0.7 * length:
        return f"it rose {_mm(float(body[2]))} while the tool rose {_mm(float(hand[2]))}"
    along = float(body @ hand) / length if length > 0.0 else float(np.linalg.norm(body))
    return f"it moved {_mm(along)} while the tool moved {_mm(length)}"


def _mm(length: float) -> str:
    return f"{1000.0 * length + 0.0:.1f} mm".replace("-0.0", "0.0")
