"""How the links of a robot move, computed from the motion of its joints at every control tick.

From the parent P of joint J outwards, with r from the origin of P to that of J, the axis e and the joint's motion
q, q', q'' (Featherstone, Rigid Body Dynamics Algorithms, 2008, section 2.8, written out for the origins of the frames):

    revolute:   w = w_P + e q',  v = v_P + w_P x r,           a = a_P + w_P' x r + w_P x (w_P x r)
                w' = w_P' + e q'' + w_P x e q'
    prismatic:  w = w_P,         v = v_P + w_P x r + e q',    a = ... + 2 w_P x e q' + e q''

The laws are the definitions of the kernels `imu` and `momenta`, operation by operation. They are written in plain
floats: numpy costs several times as much for three numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from manipcli.control.compiled import bind
from manipcli.core.geometry import Array, Transform
from manipcli.model.robot import RobotModel

_FIXED, _REVOLUTE, _PRISMATIC = 0, 1, 2
MOTION: Final = 24
"""Numbers of a node's motion in the world: R (9), p, w, v, and with accelerations w', a of its origin."""
Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """Frames (n), parents first: of links, and of places in links.

    Attributes:
        parent: index of each frame's parent; -1: the base.
        placement: (n, 12) R, row by row, and p in the parent at joint position zero.
        axis: (n, 3) in the frame.
        kind: 0 fixed, 1 revolute, 2 prismatic.
        index: of the joint in joint vectors; 0 for a fixed one.
        base: (12) R and p of the root in the world.
        names: index of each link.
    """

    parent: npt.NDArray[np.int64]
    placement: Array
    axis: Array
    kind: npt.NDArray[np.int64]
    index: npt.NDArray[np.int64]
    base: Array
    names: dict[str, int]

    @classmethod
    def to(cls, robot: RobotModel, links: Iterable[str], place: tuple[str, Transform] | None = None) -> Chain:
        """All frames between the root and `links`; the last is at the `place` (link, pose in it), if there is one."""
        wanted = {*links} | ({place[0]} if place is not None else set())
        for joint in reversed(robot.joints):  # parents before children
            if joint.child in wanted:
                wanted.add(joint.parent)
        joints = [joint for joint in robot.joints if joint.child in wanted]
        names = {robot.root: -1} | {joint.child: k for k, joint in enumerate(joints)}
        rows = [(names[j.parent], _numbers(j.X_PJ), j.axis, _kind(j.type)) for j in joints]
        index = [robot.joint_names.index(j.name) if j.moves else 0 for j in joints]
        if place is not None:
            rows.append((names[place[0]], _numbers(place[1]), np.zeros(3), _FIXED))
            index.append(0)
        n = len(rows)
        parent, placement, axis, kind = zip(*rows, strict=True) if rows else ((), (), (), ())
        return cls(
            np.array(parent, dtype=np.int64), np.array(placement, dtype=np.float64).reshape(n, 12),
            np.array(axis, dtype=np.float64).reshape(n, 3), np.array(kind, dtype=np.int64),
            np.array(index, dtype=np.int64), _numbers(robot.X_WB), names,
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.parent)

    @property
    def arrays(self) -> tuple[npt.NDArray[np.int64] | Array, ...]:
        """The first arrays of the kernels."""
        return self.parent, self.kind, self.index, self.placement.reshape(-1), self.axis.reshape(-1), self.base


class PlaceMotion:
    """Angular velocity, and acceleration less gravity, of a place S in a link.

    Args:
        robot: it carries the link.
        link, X_LS: the place.
        gravity: (3) [m/s^2] in the world.
        period: [s] of a control tick.
        position, velocity, before: (n) of the joints; `before`: the velocities one tick ago. Read at every `measure`.

    Attributes:
        measured: (6) in S; written by `measure`.
        measure: one control tick.
    """

    def __init__(
        self, robot: RobotModel, link: str, X_LS: Transform, gravity: Array, period: float,
        position: Array, velocity: Array, before: Array,
    ) -> None:  # fmt: skip
        self._chain = chain = Chain.to(robot, (), (link, X_LS))
        self._joints = position, velocity, before
        self._gravity = np.array([*gravity, period])
        self._motion = np.zeros(MOTION * len(chain))
        self.measured = np.zeros(6)
        self.measure: Callable[[], object] = bind(
            "imu", len(chain), *chain.arrays, position, velocity, before, self._gravity, self._motion, self.measured
        ) or self._law  # fmt: skip

    def _law(self) -> None:
        """The definition of the kernel `imu`."""
        q, v, before = (values.tolist() for values in self._joints)
        *gravity, period = self._gravity.tolist()
        motion = travel(self._chain, q, v, [(now - then) / period for now, then in zip(v, before, strict=True)])[-1]
        self.measured[:3] = into(motion, motion[12:15])
        self.measured[3:] = into(motion, tuple(a - g for a, g in zip(motion[21:24], gravity, strict=True)))


class LinkMomenta:
    """Centres of mass and momenta of rigid bodies on links.

    Args:
        chain: to these links.
        nodes: (k) the frame of each body in the chain.
        inertias: (k, 16) mass, principal moments, R and p of the principal axes in the link.
        position, velocity: (n) of the joints, read by `update`.

    Attributes:
        motion: (frames, 24) of the chain; without accelerations.
        momenta: (9 k) of each body its centre, its momentum [N s], its angular momentum about its centre [N m s].
        update: computes both.
    """

    def __init__(
        self, chain: Chain, nodes: npt.NDArray[np.int64], inertias: Array, position: Array, velocity: Array
    ) -> None:
        self._chain, self._nodes, self._inertias = chain, nodes, inertias
        self._joints = position, velocity
        self.motion = np.zeros((len(chain), MOTION))
        self.momenta = np.zeros(9 * len(nodes))
        self.update: Callable[[], object] = bind(
            "momenta", len(chain), *chain.arrays, position, velocity, nodes, inertias.reshape(-1),
            self.motion.reshape(-1), self.momenta,
        ) or self._law  # fmt: skip

    def _law(self) -> None:
        """The definition of the kernel `momenta`."""
        q, v = (values.tolist() for values in self._joints)
        moved = travel(self._chain, q, v)
        self.motion[:, : len(moved[0])] = moved
        found: list[float] = []
        for node, (mass, i, j, k, *pose) in zip(self._nodes.tolist(), self._inertias.tolist(), strict=True):
            motion = moved[node]
            w, v = motion[12:15], motion[15:18]
            arm = out_of(motion, pose[9:])
            spin = into(pose, into(motion, w))
            spun = out_of(motion, out_of(pose, (i * spin[0], j * spin[1], k * spin[2])))
            swing = crossed(w, arm)
            found += [p + a for p, a in zip(motion[9:12], arm, strict=True)]
            found += [mass * (b + c) for b, c in zip(v, swing, strict=True)]
            found += spun
        self.momenta[:] = found


def travel(chain: Chain, q: Sequence[float], v: Sequence[float], a: Sequence[float] | None = None) -> list[list[float]]:
    """The motion of every frame; see `MOTION`."""
    root = [*chain.base.tolist(), *[0.0] * 12]
    done: list[list[float]] = []
    rows = zip(
        chain.parent.tolist(), chain.kind.tolist(), chain.index.tolist(), chain.placement.tolist(), chain.axis.tolist(),
        strict=True,
    )  # fmt: skip
    for parent, kind, index, placement, axis in rows:
        above = root if parent < 0 else done[parent]
        w, faster = above[12:15], above[18:21]
        R = product(above, placement)
        r = list(out_of(above, placement[9:]))
        e = out_of(R, axis)
        if kind == _PRISMATIC:
            r = [r[i] + e[i] * q[index] for i in range(3)]
        swing = crossed(w, r)
        linear = [above[15 + i] + swing[i] for i in range(3)]
        turning = list(w)
        if kind == _PRISMATIC:
            linear = [linear[i] + e[i] * v[index] for i in range(3)]
        if kind == _REVOLUTE:
            R = product(R, _turn(axis, q[index]))
            turning = [w[i] + e[i] * v[index] for i in range(3)]
        motion = [*R, *(above[9 + i] + r[i] for i in range(3)), *turning, *linear]
        if a is not None:
            tangential, centripetal = crossed(faster, r), crossed(w, swing)
            speeding = list(faster)
            gaining = [(above[21 + i] + tangential[i]) + centripetal[i] for i in range(3)]
            if kind != _FIXED:
                turned = crossed(w, [e[i] * v[index] for i in range(3)])
                if kind == _REVOLUTE:
                    speeding = [(faster[i] + e[i] * a[index]) + turned[i] for i in range(3)]
                else:
                    gaining = [(gaining[i] + 2.0 * turned[i]) + e[i] * a[index] for i in range(3)]
            motion += [*speeding, *gaining]
        done.append(motion)
    return done


def _turn(axis: Sequence[float], angle: float) -> list[float]:
    """Rotation (9) about a unit axis: Rodrigues' formula."""
    x, y, z = axis
    s, c = math.sin(angle), math.cos(angle)
    t = 1.0 - c
    return [
        c + x * x * t, x * y * t - z * s, x * z * t + y * s,
        x * y * t + z * s, c + y * y * t, y * z * t - x * s,
        x * z * t - y * s, y * z * t + x * s, c + z * z * t,
    ]  # fmt: skip


def product(A: Sequence[float], B: Sequence[float]) -> list[float]:
    """A B of rotations (9)."""
    return [(A[3 * i] * B[j] + A[3 * i + 1] * B[3 + j]) + A[3 * i + 2] * B[6 + j] for i in range(3) for j in range(3)]


def out_of(R: Sequence[float], v: Sequence[float]) -> Vector:
    """R v, for a rotation (9)."""
    x, y, z = v
    return (R[0] * x + R[1] * y) + R[2] * z, (R[3] * x + R[4] * y) + R[5] * z, (R[6] * x + R[7] * y) + R[8] * z


def into(R: Sequence[float], v: Sequence[float]) -> Vector:
    """R' v, for a rotation (9)."""
    x, y, z = v
    return (R[0] * x + R[3] * y) + R[6] * z, (R[1] * x + R[4] * y) + R[7] * z, (R[2] * x + R[5] * y) + R[8] * z


def crossed(a: Sequence[float], b: Sequence[float]) -> Vector:
    """a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _numbers(X: Transform) -> Array:
    """(12) R, row by row, and p."""
    return np.concatenate((np.asarray(X.R).reshape(-1), X.p))


def _kind(joint: str) -> int:
    return _FIXED if joint == "fixed" else _PRISMATIC if joint == "prismatic" else _REVOLUTE
