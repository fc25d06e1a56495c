"""Contact forces of a run as arrows, one pair of arrows for each recorded contact point.

A log holds the points of a contact at the times at which its force changed. Until the next message the parts move on,
and the points are drawn where the parts have carried them: a point keeps its offset from the part that the force acts
on, rotated by the rotation of the part that has turned less since. A grip thus moves with the hand, and the contact of
a rolling ball stays below the ball.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manipcli.core.geometry import Array, quat_product, rotate
from manipcli.model.state import Contact
from manipcli.render.drawing import link_frame
from manipcli.render.placing import Poses
from manipcli.replay.playback import Playback

LEAST = 0.05
"""Smallest drawn force of a contact [N]."""
LONGEST = 0.15
"""Length of the arrow of a strong force [m]."""
STRONG = 95.0
"""Percentile of the forces of a run that counts as strong, so that one impact does not hide the others."""


@dataclass(frozen=True, slots=True)
class Push:
    """Forces at a point (3,) [m] in the world on `on`, a movable body or else the robot, from `other`: `normal` (3,)
    and `friction` (3,) [N]."""

    on: str
    other: str
    point: Array
    normal: Array
    friction: Array


class Forces:
    """The force arrows of a playback, computed on demand."""

    def __init__(self, playback: Playback, poses: Poses) -> None:
        self._playback = playback
        self._poses = poses
        robot, scene = playback.robot, playback.scene
        links = robot.links if robot is not None else ()
        bodies = scene.bodies if scene is not None else ()
        names = [*(link_frame(link.name) for link in links), *(body.name for body in bodies)]
        self._frame = {name: k for k, name in enumerate(names, start=1)}
        self._movable = {body.name for body in bodies if not body.fixed}
        strong = [
            point.force
            for contacts in playback.contacts
            for contact in contacts
            if contact.force > LEAST
            for point in contact.points
            if point.force > 0.0
        ]
        self.scale = LONGEST / float(np.percentile(strong, STRONG)) if strong else 0.0
        """Length of an arrow per force [m/N]."""

    def at(self, k: int) -> tuple[Push, ...]:
        """The contact forces at the k-th time."""
        return tuple(push for _, pushes in self.by_contact(k) for push in pushes)

    def by_contact(self, k: int) -> tuple[tuple[Contact, tuple[Push, ...]], ...]:
        """The contacts at the k-th time that have contact points, with their forces."""
        contacts = zip(self._playback.contacts[k], self._playback.contact_times[k], strict=True)
        found = ((one, tuple(self._pushes(one, time, k))) for one, time in contacts if one.force > LEAST)
        return tuple((contact, pushes) for contact, pushes in found if pushes)

    def net(self, name: str, k: int) -> Array:
        """Sum of the drawn forces on a body or `robot/<link>` at the k-th time, (3,) [N] in the world."""
        total = np.zeros(3)
        for push in self.at(k):
            if name in (push.on, push.other):
                total += (push.normal + push.friction) * (1.0 if name == push.on else -1.0)
        return total

    def _pushes(self, contact: Contact, time: float, k: int) -> list[Push]:
        loaded = [point for point in contact.points if point.force > 0.0]
        if not loaded:
            return []
        first = contact.a in self._movable or not (contact.b in self._movable or contact.b.startswith("robot/"))
        on, other = (contact.a, contact.b) if first else (contact.b, contact.a)
        sign = 1.0 if first else -1.0
        p_then, p_now, turned = self._moved(on, time, k)
        *_, other_turned = self._moved(other, time, k)
        if abs(other_turned[3]) > abs(turned[3]):
            turned = other_turned
        return [
            Push(
                on,
                other,
                p_now + rotate(turned, np.subtract(point.position, p_then)),
                sign * point.force * rotate(turned, point.normal),
                sign * rotate(turned, point.friction),
            )
            for point in loaded
        ]

    def _moved(self, name: str, time: float, k: int) -> tuple[Array, Array, Array]:
        """Positions (3,) of a part at `time` [s] and at the k-th time, and its rotation since, a quaternion xyzw."""
        frame, times = self._frame.get(name, 0), self._playback.times
        p, quat = self._poses.position[:, frame], self._poses.quat_xyzw[:, frame]
        j = max(int(np.searchsorted(times[: k + 1], time, side="right")) - 1, 0)
        if j == k:
            return p[k], p[k], np.array([0.0, 0.0, 0.0, 1.0])
        share = (time - times[j]) / (times[j + 1] - times[j])
        p_then = (1.0 - share) * p[j] + share * p[j + 1]
        near = quat[j + 1] if quat[j] @ quat[j + 1] >= 0.0 else -quat[j + 1]
        then = (1.0 - share) * quat[j] + share * near
        then /= np.linalg.norm(then)
        return p_then, p[k], quat_product(quat[k], then * [-1.0, -1.0, -1.0, 1.0])
