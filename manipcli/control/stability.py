"""Stability of sampled joint control loops: their poles from one control tick to the next.

Between two ticks the effort is held, and the joints move as M a = u - B v (gravity and what depends on the velocity
squared left out), in `substeps` steps of semi-implicit Euler as engines take them, v' = v + s a, q' = q + s v', where
stiff damping acts on v' so that none runs away, or exactly where `substeps` is None. At each tick

    u = -P q - D v - I z,    z the integral of q, a sum over the ticks

or the u of `delay` ticks before. With x = (q, v, z, delayed efforts), x' = A x, and the loop is stable if all
eigenvalues of A lie inside the unit circle (Franklin, Powell, Workman, Digital Control of Dynamic Systems, 4.3).

For one joint without damping, delay and integral, exactly: kd > kp h / 2 and kd < 2 I / h. In one step of Euler: kd > 0
and kd < 2 I / h - kp h / 2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.model.damping import implicit_damping

MARGINAL: Final = 1e-9
"""A pole this near to the unit circle counts as unstable."""
SLOW: Final = 1e-6
"""A slow integral, i h < SLOW p, has its pole at 1 within rounding."""
RINGING: Final = 0.5
"""Largest magnitude of a pole that changes its sign every tick."""
MOST_GAIN: Final = 1e6
"""Upper bound for gain margins."""


@dataclass(frozen=True, slots=True, eq=False)
class Loop:
    """Joints (n) held by gains.

    Attributes:
        mass: (n, n) kg m2 or kg, symmetric.
        p, d, i: (n) gains.
        damping: (n) of the joints themselves, viscous.
        period: [s] between two commands.
        substeps: physics steps in a period; None: exact.
        delay: (n) int, periods from a command to its effort.
    """

    mass: Array
    p: Array
    d: Array
    i: Array
    damping: Array
    period: float
    substeps: int | None = 1
    delay: npt.NDArray[np.int64] | None = None

    @classmethod
    def of_joint(
        cls,
        inertia: float,
        *,
        p: float,
        d: float,
        i: float = 0.0,
        damping: float = 0.0,
        period: float,
        substeps: int | None = 1,
        delay: int = 0,
    ) -> Loop:
        """One joint alone."""
        return cls(
            mass=np.array([[inertia]]),
            p=np.array([p]),
            d=np.array([d]),
            i=np.array([i]),
            damping=np.array([damping]),
            period=period,
            substeps=substeps,
            delay=np.array([delay]),
        )

    def scaled(self, gains: float) -> Loop:
        """The loop with all gains multiplied by this factor."""
        return replace(self, p=self.p * gains, d=self.d * gains, i=self.i * gains)


def transition(loop: Loop) -> Array:
    """A (m, m): x = (q, v, z, delayed efforts) at the next tick; z of joints with an integral gain."""
    n = len(loop.p)
    F, G = _held(loop)
    summed = np.flatnonzero(loop.i)
    delay = np.zeros(n, dtype=np.int64) if loop.delay is None else loop.delay
    most = int(delay.max(initial=0))
    first = 2 * n + len(summed)  # of the delayed efforts, the latest command first
    rows = first + most * n
    A = np.zeros((rows, rows))
    law = np.zeros((n, rows))
    law[:, :n], law[:, n : 2 * n] = -np.diag(loop.p), -np.diag(loop.d)
    for z, k in enumerate(summed, 2 * n):
        law[k, z] = -loop.i[k]
        A[z, z], A[z, k] = 1.0, loop.period
    applied = law.copy()
    for late in np.flatnonzero(delay):
        applied[late] = 0.0
        applied[late, first + (delay[late] - 1) * n + late] = 1.0
    A[: 2 * n] = G @ applied
    A[: 2 * n, : 2 * n] += F
    if most:
        A[first : first + n] = law
        for step in range(1, most):
            A[first + step * n : first + (step + 1) * n, first + (step - 1) * n : first + step * n] = np.eye(n)
    return A


def _held(loop: Loop) -> tuple[Array, Array]:
    """(F, G): (q, v)' = F (q, v) + G u while u is held for a period."""
    n = len(loop.p)
    eye = np.eye(n)
    if loop.substeps is None:
        from scipy.linalg import expm

        inverse = np.linalg.inv(loop.mass)
        drag = inverse * loop.damping  # M^-1 B
        flow = np.zeros((3 * n, 3 * n))
        flow[:n, n : 2 * n] = eye
        flow[n : 2 * n, n : 2 * n], flow[n : 2 * n, 2 * n :] = -drag, inverse
        whole = expm(flow * loop.period)
        return whole[: 2 * n, : 2 * n], whole[: 2 * n, 2 * n :]
    s = loop.period / loop.substeps
    damped = np.linalg.inv(loop.mass + np.diag(implicit_damping(loop.mass, loop.damping, s)))
    v_v, v_u = eye - s * damped * loop.damping, s * damped
    step = np.block([[eye, s * v_v], [np.zeros((n, n)), v_v]])
    push = np.vstack([s * v_u, v_u])
    F, G = np.eye(2 * n), np.zeros((2 * n, n))
    for _ in range(loop.substeps):
        F, G = step @ F, step @ G + push
    return F, G


def poles(loop: Loop) -> npt.NDArray[np.complex128]:
    """Eigenvalues of the loop from tick to tick, the largest first."""
    found = np.linalg.eigvals(transition(loop))
    return np.asarray(found[np.argsort(-np.abs(found))], dtype=np.complex128)


def is_stable(loop: Loop) -> bool:
    """Whether all poles lie inside the unit circle.

    A joint without a p gain has a pole at 1, which is ignored; so is that of a slow integral, at 1 - i h / p: no pole
    leaves the circle there while i and p are positive, because det(A - 1) is proportional to their product.
    """
    found = poles(loop)
    slow = (loop.i > 0.0) & (loop.i * loop.period < SLOW * loop.p)
    resting = int(np.count_nonzero((loop.p == 0.0) | slow))
    if resting:
        found = found[np.argsort(np.abs(found - 1.0))][resting:]
    return bool(np.all(np.abs(found) < 1.0 - MARGINAL))


def unstable_share(loop: Loop) -> tuple[complex, Array]:
    """The largest pole, and the share (n) of each joint in its mode: the power d |v|^2 of its damping, with sum 1."""
    values, vectors = np.linalg.eig(transition(loop))
    worst = int(np.argmax(np.abs(values)))
    n = len(loop.p)
    power = (loop.d + loop.p * loop.period) * np.abs(vectors[n : 2 * n, worst]) ** 2
    return complex(values[worst]), np.asarray(power / power.sum())


def gain_margin(loop: Loop) -> float:
    """Factor on all gains at which the loop becomes unstable; 0 if it is unstable already, at most `MOST_GAIN`."""
    if not is_stable(loop):
        return 0.0
    return boundary(loop.scaled)


def largest_damping(loop: Loop) -> float:
    """The largest d of a stable loop of one joint, with its other gains; 0 if there is none."""
    unit = math.sqrt(float(loop.p[0]) * float(loop.mass[0, 0])) or float(loop.mass[0, 0]) / loop.period
    # Upwards from the first stable value: with little damping a loop may be unstable, too.
    return _largest(lambda d: replace(loop, d=d), unit, 10.0 ** np.arange(-3.0, 4.0, 0.25))


def largest_stiffness(loop: Loop) -> float:
    """The largest p of a stable loop of one joint, with its other gains; 0 if there is none."""
    return _largest(lambda p: replace(loop, p=p), float(loop.mass[0, 0]) / loop.period**2, [1e-9])


def largest_integral(loop: Loop) -> float:
    """The largest i of a stable loop of one joint, with its other gains; 0 if there is none."""
    return _largest(lambda i: replace(loop, i=i), float(loop.p[0]) / loop.period, [1e-6])


def _largest(loop_with: Callable[[Array], Loop], unit: float, starts: Iterable[float]) -> float:
    """The largest stable gain above the first stable one of `starts`, in units of `unit`; 0 if there is none."""

    def loop_at(factor: float) -> Loop:
        return loop_with(np.array([unit * factor]))

    start = next((float(gain) for gain in starts if unit > 0.0 and is_stable(loop_at(float(gain)))), None)
    return 0.0 if start is None else unit * boundary(loop_at, start=start)


def boundary(loop_at: Callable[[float], Loop], *, start: float = 1.0) -> float:
    """The first factor above the stable `start` at which the loop is unstable; within 0.1 %."""
    low = start
    while is_stable(loop_at(2.0 * low)):
        low *= 2.0
        if low > MOST_GAIN:
            return low
    high = 2.0 * low
    while high - low > 1e-3 * low:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if is_stable(loop_at(middle)) else (low, middle)
    return low


def velocity_loop_poles(*, p: float, i: float = 0.0, d: float = 0.0, period: float) -> npt.NDArray[np.complex128]:
    """Poles, the largest first, of a joint with ideal velocity tracking: 3, or 2 without i.

    v = -p q - i z - d v_before, q' = q + period v, z' = z + period q: without inertia and delay.
    """
    law = np.array([-p, -i, -d])
    A = np.array([[1.0, 0.0, 0.0] + period * law, [period, 1.0, 0.0], law])
    found = np.linalg.eigvals(A if i else A[::2, ::2])  # z, which is not fed back, has its pole at 1
    return np.asarray(found[np.argsort(-np.abs(found))], dtype=np.complex128)


def largest_velocity_gain(*, i: float = 0.0, d: float = 0.0, period: float) -> float:
    """The p of such a joint at which a pole reaches -1: 2 (1 - d) / period + i period / 2; not below 0.

    The characteristic polynomial (x - 1)^2 (x + d) + period x (p (x - 1) + i period) at x = -1.
    """
    return max(2.0 * (1.0 - d) / period + 0.5 * i * period, 0.0)
