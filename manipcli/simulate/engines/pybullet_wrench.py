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

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import ModuleType

import numpy as np

from manipcli.control.compiled import bind
from manipcli.core.geometry import Array, cross
from manipcli.model.robot import RobotModel
from manipcli.simulate.engines.pybullet_attachment import Pull
from manipcli.simulate.engines.pybullet_contacts import BulletPoint
from manipcli.simulate.link_motion import Chain, LinkMomenta, crossed, into


@dataclass(frozen=True, slots=True, eq=False)
class _Sensor:
    """`link`: the child, `links`: it and all below the joint; `values` (6)."""

    link: str
    links: frozenset[str]
    values: Array


class WrenchSensors:
    """All sensors of one robot.

    Args:
        p: PyBullet.
        client: its world.
        robot: the model; `body`: Bullet's number of it.
        joints: Bullet's numbers of its moving joints.
        links: Bullet's number of each link.
        gravity: (3) [m/s^2].
        step: [s] of the physics.
    """

    def __init__(
        self, p: ModuleType, client: int, robot: RobotModel, body: int, joints: Sequence[int], links: Mapping[str, int],
        *, gravity: Array, step: float,
    ) -> None:  # fmt: skip
        self._p, self._client, self._robot, self._body = p, client, robot, body
        self._numbers, self._links = joints, links
        self._gravity = np.array([*gravity, step])
        self._joints = np.zeros(2 * len(joints))  # positions and velocities
        self._sensors: list[_Sensor] = []
        self._known = self._remembers = False

    def __bool__(self) -> bool:
        return bool(self._sensors)

    def add(self, link: str) -> Array:
        """A sensor between `link` and its parent.

        Returns:
            (6) force [N] and torque [N m] of the link on its parent, in the link's frame, about its origin.
        """
        sensor = _Sensor(link, self._robot.descendants(link), np.zeros(6))
        self._sensors.append(sensor)
        self._known = self._remembers = False
        below = frozenset[str]().union(*(each.links for each in self._sensors))
        names = [link.name for link in self._robot.links if link.name in below]
        chain = Chain.to(self._robot, names)
        infos = [self._p.getDynamicsInfo(self._body, self._links[k], physicsClientId=self._client) for k in names]
        turned = [np.reshape(self._p.getMatrixFromQuaternion(info[4]), 9) for info in infos]
        self._inertias = np.array([(i[0], *i[2], *R, *i[3]) for i, R in zip(infos, turned, strict=True)])
        nodes = np.array([chain.names[name] for name in names], dtype=np.int64)
        position, velocity = self._joints.reshape(2, -1)
        self._bodies = LinkMomenta(chain, nodes, self._inertias, position, velocity)
        self._before = np.zeros_like(self._bodies.momenta)
        self._pulls = np.zeros((len(names), 6))
        self._rows = np.full(1 + max(self._links.values()), -1, dtype=np.int64)
        self._rows[[self._links[name] for name in names]] = np.arange(len(names))
        self._frames = np.array([chain.names[each.link] for each in self._sensors], dtype=np.int64)
        self._carried = np.array([[name in each.links for name in names] for each in self._sensors])
        self._compute: Callable[[Sequence[BulletPoint]], object] = bind(
            "wrenches", len(names), self._bodies.momenta, self._before, self._inertias.reshape(-1),
            self._pulls.reshape(-1), self._rows, np.array([self._body], dtype=np.int64), self._gravity,
            np.zeros(6 * len(names)), self._bodies.motion.reshape(-1), self._frames, self._carried.reshape(-1),
            *(each.values for each in self._sensors),
        ) or self._law  # fmt: skip
        return sensor.values

    def moved(self) -> None:
        """Invalidate the cached motion after a physics step."""
        self._known = False

    def remember(self) -> None:
        """Store the motion before the last physics step of a tick."""
        if not self._known:
            states = self._p.getJointStates(self._body, self._numbers, self._client)
            self._joints[:] = [*(state[0] for state in states), *(state[1] for state in states)]
            self._bodies.update()
        self._before[:] = self._bodies.momenta
        self._remembers = True

    def measure(self, joints: Array, points: Callable[[], Sequence[BulletPoint]], pulls: Sequence[Pull] = ()) -> None:
        """Compute the wrenches of the last physics step.

        Args:
            joints: (2 n) positions and velocities now.
            points: gives all contact points of that step.
            pulls: of attachments in that step.
        """
        if self._known or not self._remembers:
            return
        self._known = True
        self._joints[:] = joints
        self._bodies.update()
        self._pulls[:] = 0.0
        for pull in pulls:
            if (row := int(self._rows[pull.link])) >= 0:
                self._pulls[row, :3] += pull.force
                self._pulls[row, 3:] += cross(pull.point, pull.force) + pull.torque
        self._compute(points())

    def _law(self, points: Sequence[BulletPoint]) -> None:
        """The definition of the kernel `wrenches`, operation by operation, in plain floats."""
        *gravity, step = self._gravity.tolist()
        forces: list[list[float]] = []
        states = zip(
            self._bodies.momenta.reshape(-1, 9).tolist(), self._before.reshape(-1, 9).tolist(),
            self._inertias.tolist(), self._pulls.tolist(), strict=True,
        )  # fmt: skip
        for now, before, (mass, *_), pull in states:
            rate = [(now[3 + i] - before[3 + i]) / step for i in range(6)]
            force = [rate[i] - mass * gravity[i] for i in range(3)]
            moment = crossed(now, force)
            forces.append(
                [force[i] - pull[i] for i in range(3)] + [(rate[3 + i] + moment[i]) - pull[3 + i] for i in range(3)]
            )
        for point in points:
            _, a, b, link_a, link_b, at_a, at_b, normal, _, press, first, along, second, across = point[:14]
            push = [(press * n + first * u) + second * v for n, u, v in zip(normal, along, across, strict=True)]
            for body, link, at, sign in ((a, link_a, at_a, 1.0), (b, link_b, at_b, -1.0)):
                row = self._rows[link] if body == self._body and link >= 0 else -1
                if row >= 0:
                    given = [sign * each for each in push]
                    moment = crossed(at, given)
                    own = forces[row]
                    own[:] = [own[i] - given[i] for i in range(3)] + [own[3 + i] - moment[i] for i in range(3)]
        for sensor, frame, carried in zip(self._sensors, self._frames, self._carried, strict=True):
            total = [0.0] * 6
            for force in (force for force, below in zip(forces, carried, strict=True) if below):
                total = [total[i] + force[i] for i in range(6)]
            motion = self._bodies.motion[frame].tolist()
            moment = crossed(motion[9:12], total)
            sensor.values[:3] = into(motion, [-total[i] for i in range(3)])
            sensor.values[3:] = into(motion, [moment[i] - total[3 + i] for i in range(3)])
