"""Wrenches at joints of PyBullet's robot, computed from link motion and contacts.

Bullet's joint reactions lack the couplings of two joints (mimic joints, rotors): Bullet treats these as external forces
on the children. The motion of the links k below a joint in the last physics step h is known exactly, with velocities v
and w and positions c of their centres of mass. By Newton and Euler

    f = sum_k m_k ((v_k' - v_k) / h - g)
    t = sum_k c_k x m_k ((v_k' - v_k) / h - g) + ((I_k w_k)' - I_k w_k) / h

is the wrench on them, about the origin of the world. Minus the contact wrenches, it is transmitted by the joint, and
its opposite is the wrench of the child on its parent. A contact point has a normal force and friction along the
surface. PyBullet does not report the moment of spinning and rolling friction: the torque lacks it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType

import numpy as np

from manipcli.core.geometry import Array, cross, rotate, rotate_inverse
from manipcli.simulate.engines.pybullet_attachment import Pull
from manipcli.simulate.engines.pybullet_contacts import BulletPoint, Vector


@dataclass(frozen=True, slots=True, eq=False)
class _Sensor:
    """`link`: the child, `links`: all links below the joint, Bullet's numbers; `values` (6)."""

    link: int
    links: frozenset[int]
    values: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Motion:
    """Poses and momenta in the world of the links of all sensors (k).

    Attributes:
        centres: (k, 3) centres of mass.
        origins, turned: (k, 3), (k, 4) their frames; the quaternions xyzw.
        momenta: (k, 6) linear [N s], and angular about the centre of mass [N m s].
    """

    centres: Array
    origins: Array
    turned: Array
    momenta: Array


class WrenchSensors:
    """All sensors of one robot.

    Args:
        p: PyBullet.
        client: its world.
        body: Bullet's number of the robot.
        gravity: (3) [m/s^2].
        step: [s] of the physics.
    """

    def __init__(self, p: ModuleType, client: int, body: int, *, gravity: Array, step: float) -> None:
        self._p, self._client, self._body, self._gravity, self._step = p, client, body, gravity, step
        self._sensors: list[_Sensor] = []
        self._rows: dict[int, int] = {}
        self._mass: Array = np.zeros((0, 1))
        self._moments: Array = np.zeros((0, 3))
        self._carries: Array = np.zeros((0, 0))
        self._now: _Motion | None = None
        self._before: _Motion | None = None

    def __bool__(self) -> bool:
        return bool(self._sensors)

    def add(self, link: int, below: Sequence[int]) -> Array:
        """A sensor between `link` and its parent; `below`: it and all links below it.

        Returns:
            (6) force [N] and torque [N m] of the link on its parent, in the link's frame, about its origin.
        """
        sensor = _Sensor(link, frozenset(below), np.zeros(6))
        self._sensors.append(sensor)
        links = sorted(frozenset[int]().union(*(other.links for other in self._sensors)))
        self._rows = {k: row for row, k in enumerate(links)}
        infos = [self._p.getDynamicsInfo(self._body, k, physicsClientId=self._client) for k in links]
        self._mass = np.array([[info[0]] for info in infos])
        self._moments = np.array([info[2] for info in infos])
        self._carries = np.array([[k in other.links for k in links] for other in self._sensors], dtype=float)
        self._now = self._before = None
        return sensor.values

    def moved(self) -> None:
        """Invalidate the cached motion after a physics step."""
        self._now = None

    def remember(self) -> None:
        """Store the motion before the last physics step of a tick."""
        self._before = self._motion() if self._now is None else self._now

    def measure(self, points: Sequence[BulletPoint], pulls: Sequence[Pull] = ()) -> None:
        """Compute the wrenches of the last physics step, with all its contact `points` and `pulls` of attachments."""
        if self._now is not None or self._before is None:
            return
        now = self._now = self._motion()
        rate = (now.momenta - self._before.momenta) / self._step
        force = rate[:, :3] - self._mass * self._gravity
        torque = rate[:, 3:] + cross(now.centres, force)
        rows, places, pushes = self._pushed(points)
        if rows:
            given = np.array(pushes)
            np.subtract.at(force, rows, given)
            np.subtract.at(torque, rows, cross(np.array(places), given))
        for pull in pulls:
            if pull.link in self._rows:
                force[self._rows[pull.link]] -= pull.force
                torque[self._rows[pull.link]] -= cross(pull.point, pull.force) + pull.torque
        forces, torques = self._carries @ force, self._carries @ torque
        for sensor, f, t in zip(self._sensors, forces, torques, strict=True):
            row = self._rows[sensor.link]
            turned = now.turned[row]
            sensor.values[:3] = rotate_inverse(turned, -f)
            sensor.values[3:] = rotate_inverse(turned, cross(now.origins[row], f) - t)

    def _motion(self) -> _Motion:
        links = self._p.getLinkStates(
            self._body, list(self._rows), computeLinkVelocity=1, computeForwardKinematics=1,
            physicsClientId=self._client,
        )  # fmt: skip
        states = np.array([(*s[0], *s[1], *s[4], *s[5], *s[6], *s[7]) for s in links])
        principal = states[:, 3:7]
        turning = rotate(principal, self._moments * rotate_inverse(principal, states[:, 17:20]))
        momenta = np.hstack([self._mass * states[:, 14:17], turning])
        return _Motion(states[:, :3], states[:, 7:10], states[:, 10:14], momenta)

    def _pushed(self, points: Sequence[BulletPoint]) -> tuple[list[int], list[Vector], list[list[float]]]:
        """Rows of the links in contact, contact positions, and contact forces."""
        rows: list[int] = []
        places: list[Vector] = []
        pushes: list[list[float]] = []
        for point in points:
            _, a, b, link_a, link_b, at_a, at_b, normal, _, press, first, along, second, across = point[:14]
            if self._body not in (a, b):
                continue
            push = [press * n + first * u + second * v for n, u, v in zip(normal, along, across, strict=True)]
            if a == self._body and link_a in self._rows:
                rows.append(self._rows[link_a])
                places.append(at_a)
                pushes.append(push)
            if b == self._body and link_b in self._rows:
                rows.append(self._rows[link_b])
                places.append(at_b)
                pushes.append([-force for force in push])
        return rows, places, pushes
