"""Gains for a bandwidth and a damping ratio, and the step response of the sampled loop.

A joint of inertia I and viscous friction b under u = p e + d de/dt has, in continuous time, p = I w^2 and
d = 2 zeta I w - b. I is the largest inertia of the joint while the others are held, so that the damping ratio is
nowhere smaller. A joint with more friction than that, b > 2 I w, lags the reference with the rate p / b: p = b w / 2.
On a velocity interface u = v + p e, p = w. If necessary,

- w is raised until the joint of a hand presses with all its effort, over its whole travel;
- w is lowered until the step needs at most the effort left by gravity (or at most the velocity limit);
- first zeta, down to `LEAST_DAMPING`, then w is lowered until the gain margin (`stability.py`) is `MARGIN` at the
  smallest inertia of each joint, and of all loops together in every configuration: an arm that points straight up has
  a hundred times less inertia about its first joint than one that is stretched out.

The step response is that of the joint alone, without gravity: decoupled, sampled, and with its effort limit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from manipcli.control.joint_space_load import JointSpaceLoad
from manipcli.control.stability import Loop, gain_margin, is_stable, poles, transition, unstable_share
from manipcli.core.geometry import Array
from manipcli.model.damping import implicit_damping

MARGIN: Final = 2.0
"""Required gain margin: a factor on all gains together."""
LEAST_DAMPING: Final = 0.3
"""Least damping ratio at the largest inertia, if the control period limits it."""
SLOW_INTEGRAL: Final = 0.1
"""Frequency of the integral relative to the loop, if gravity is not compensated."""
WEIGHTLESS: Final = 1e-6
"""Share of the effort below which a gravity load counts as rounding."""
SETTLED: Final = 0.02
"""Relative band of the settled step response."""
LEAST_FREQUENCY: Final = 1e-3
"""[rad/s] Lower bound for natural frequencies."""
LONGEST: Final = 6.0
"""[s] Upper bound for the duration of a step response."""

Limit = Literal["", "control step", "other joints", "effort", "velocity"]


@dataclass(frozen=True, slots=True)
class Wish:
    """Requirements for every loop.

    Attributes:
        bandwidth: natural frequency [Hz].
        damping: ratio; 1 does not overshoot.
        period: [s] of a control tick.
        substeps: physics steps in one.
    """

    bandwidth: float
    damping: float
    period: float
    substeps: int = 1


@dataclass(frozen=True, slots=True, eq=False)
class StepAnswer:
    """Step response of a joint.

    Attributes:
        size: of the step [rad or m].
        times: (T,) [s].
        share: (T,) of the step: 1 at its end.
    """

    size: float
    times: Array
    share: Array

    @property
    def overshoot(self) -> float:
        """Overshoot as a share of the step, 0 or more."""
        return max(0.0, float(self.share.max()) - 1.0)

    @property
    def settling_time(self) -> float:
        """[s] after which it stays within `SETTLED`; infinite if it does not settle in this time."""
        away = np.flatnonzero(np.abs(self.share - 1.0) > SETTLED)
        if not len(away):
            return 0.0
        return float(self.times[away[-1] + 1]) if away[-1] + 1 < len(self.times) else math.inf


@dataclass(frozen=True, slots=True, eq=False)
class Tuned:
    """Proposed gains of one joint.

    Attributes:
        controller, joint, interface: whose gains.
        inertia: of the design, the largest [kg m2 or kg]; `least`: the smallest.
        p, i, d: the gains; `i_clamp`: effort limit of the integral, None if i is 0.
        frequency, damping: natural frequency [Hz] and damping ratio at `inertia`.
        bandwidth: -3 dB frequency of the sampled loop from reference to position [Hz].
        margin: gain margin at `least`, a factor on all gains.
        limited_by: what keeps it from the requirements; "" if they are met.
        predicted: the step response.
        simulated: the step response of the whole robot in an engine, if requested.
    """

    controller: str
    joint: str
    interface: Literal["effort", "velocity"]
    inertia: float
    least: float
    p: float
    i: float
    d: float
    i_clamp: float | None
    frequency: float
    damping: float
    bandwidth: float
    margin: float
    limited_by: Limit
    predicted: StepAnswer
    simulated: StepAnswer | None = None


@dataclass(frozen=True, slots=True)
class _Design:
    """Design of one joint, before its gains are rounded to three digits."""

    inertia: float
    friction: float  # viscous, of the joint itself
    w: float
    damping: float
    carried: bool
    limit: Limit = ""

    @property
    def gains(self) -> tuple[float, float, float]:
        """p, i, d."""
        p = max(self.inertia * self.w, 0.5 * self.friction) * self.w
        i = 0.0 if self.carried else p * self.w * SLOW_INTEGRAL
        return _short(p), _short(i), _short(max(0.0, 2.0 * self.damping * self.inertia * self.w - self.friction))


def tune_efforts(
    controllers: Sequence[str],
    load: JointSpaceLoad,
    wish: Wish,
    *,
    steps: Array,
    carried: npt.NDArray[np.bool_],
    pressing: Array,
) -> tuple[Tuned, ...]:
    """Gains of all joints (k) on the effort interface.

    Args:
        controllers: (k) whose gains.
        load: of the joints.
        wish: the requirements.
        steps: (k) that do not saturate [rad or m].
        carried: (k) whether gravity is compensated, so that no integral is needed.
        pressing: (k) the least p of joints that press on what they hold; 0 for others.
    """
    w = math.tau * wish.bandwidth
    inertia = load.held_inertia.max(axis=0)
    left = np.maximum(load.effort - np.abs(load.gravity).max(axis=0), 0.1 * load.effort)
    drafts = []
    for k in range(len(load.joints)):
        wanted = max(w, math.sqrt(float(pressing[k] / inertia[k])))
        draft = _Design(float(inertia[k]), float(load.damping[k]), wanted, wish.damping, bool(carried[k]))
        most = float(left[k] / steps[k])  # of p
        enough = math.sqrt(most / draft.inertia)
        if draft.friction:
            enough = min(enough, 2.0 * most / draft.friction)
        if enough < wanted:
            draft = replace(draft, w=enough, limit="effort")
        drafts.append(_calmed(load, k, draft, wish))
    _calm_together(load, drafts, wish)
    return tuple(
        _tuned(load, k, controllers[k], drafts[k], wish, float(steps[k]), float(left[k]))
        for k in range(len(load.joints))
    )


def _short(value: float) -> float:
    return float(f"{value:.3g}")


def _loop(load: JointSpaceLoad, k: int, inertia: float, gains: tuple[float, float, float], wish: Wish) -> Loop:
    p, i, d = gains
    return Loop.of_joint(
        inertia,
        p=p,
        d=d,
        i=i,
        damping=float(load.damping[k]),
        period=wish.period,
        substeps=wish.substeps,
        delay=load.latency[k],
    )


def _softened(draft: _Design, limit: Limit) -> _Design:
    """Reduce the damping gain by 5 %, by the damping ratio until that is at its least."""
    if draft.damping > LEAST_DAMPING:
        return replace(draft, damping=max(0.95 * draft.damping, LEAST_DAMPING), limit=limit)
    return replace(draft, w=0.95 * draft.w, limit=limit)


def _calmed(load: JointSpaceLoad, k: int, draft: _Design, wish: Wish) -> _Design:
    """The draft with the required gain margin at the least inertia."""
    least = float(load.own_inertia[:, k].min())
    while draft.w > LEAST_FREQUENCY and not is_stable(_loop(load, k, least, draft.gains, wish).scaled(MARGIN)):
        draft = _softened(draft, "control step")
    return draft


def _calm_together(load: JointSpaceLoad, drafts: list[_Design], wish: Wish) -> None:
    """Reduce the drafts until all loops together have the margin in every configuration, the largest shares first."""
    for mass in load.mass:
        for _ in range(400):
            p, i, d = (np.array(column) for column in zip(*(draft.gains for draft in drafts), strict=True))
            whole = Loop(mass, p, d, i, load.damping, wish.period, wish.substeps, np.array(load.latency))
            if min(draft.w for draft in drafts) < LEAST_FREQUENCY or is_stable(whole.scaled(MARGIN)):
                break
            _, share = unstable_share(whole.scaled(MARGIN))
            for k in np.flatnonzero(share >= min(0.25, share.max())):
                drafts[k] = _softened(drafts[k], "other joints")


def tightness(load: JointSpaceLoad, tuned: Sequence[Tuned], wish: Wish) -> Array:
    """(T,) distance of these gains to the stability limit of the control period: the largest eigenvalue of
    M^-1 (2 D h + P h^2), which is 4 at the limit (exact for one Euler step and one joint)."""
    p, d = (np.array([getattr(gains, key) for gains in tuned]) for key in ("p", "d"))
    push = 2.0 * (d + load.damping) * wish.period + p * wish.period**2
    # W^1/2 M^-1 W^1/2 is symmetric and has the eigenvalues of M^-1 W.
    root = np.sqrt(push)
    return np.asarray(np.linalg.eigvalsh(root[:, None] * np.linalg.inv(load.mass) * root)[:, -1])


def least_margin(load: JointSpaceLoad, tuned: Sequence[Tuned], wish: Wish) -> float:
    """Least gain margin of these gains over all configurations; 0 if they are unstable in one."""
    p, i, d = (np.array([getattr(gains, key) for gains in tuned]) for key in ("p", "i", "d"))
    late = np.array(load.latency)
    loops = (Loop(mass, p, d, i, load.damping, wish.period, wish.substeps, late) for mass in load.mass)
    return min(gain_margin(loop) for loop in loops)


def _tuned(
    load: JointSpaceLoad, k: int, controller: str, draft: _Design, wish: Wish, step: float, left: float
) -> Tuned:
    least = float(load.own_inertia[:, k].min())
    p, i, d = draft.gains
    clamp = None
    if not draft.carried:
        weight, effort = float(np.abs(load.gravity[:, k]).max()), float(load.effort[k])
        clamp = _short(1.2 * weight if weight > WEIGHTLESS * effort else 0.1 * effort)
    loop = _loop(load, k, draft.inertia, draft.gains, wish)
    return Tuned(
        controller=controller,
        joint=load.joints[k],
        interface="effort",
        inertia=draft.inertia,
        least=least,
        p=p,
        i=i,
        d=d,
        i_clamp=clamp,
        frequency=draft.w / math.tau,
        damping=max(draft.damping, draft.friction / (2.0 * math.sqrt(p * draft.inertia)) if p else 0.0),
        bandwidth=bandwidth(loop),
        margin=gain_margin(_loop(load, k, least, draft.gains, wish)),
        limited_by=draft.limit,
        predicted=step_answer(loop, step, effort=left, i_clamp=clamp),
    )


def tune_velocity(
    controller: str, joint: str, wish: Wish, *, step: float, inertia: float, velocity: float, acceleration: float
) -> Tuned:
    """The gain of a joint on the velocity interface, with ideal tracking up to `acceleration` [rad/s2 or m/s2].

    Per tick the error is multiplied by 1 - p h: unstable from p h = 2.
    """
    w = math.tau * wish.bandwidth
    limits: list[tuple[float, Limit]] = [(2.0 / MARGIN / wish.period, "control step"), (velocity / step, "velocity")]
    chosen: Limit = ""
    for most, why in limits:
        if most < w:
            w, chosen = most, why
    p = _short(w)
    times = np.asarray(np.arange(_ticks(w, wish.period)) * wish.period, dtype=np.float64)
    q = v = 0.0
    share = np.zeros(len(times))
    for tick in range(len(times)):
        share[tick] = q / step
        wanted = min(max(p * (step - q), -velocity), velocity)
        change = acceleration * wish.period
        v = min(max(wanted, v - change), v + change)
        q += wish.period * v
    nyquist = math.pi / wish.period
    scan = np.geomspace(1e-3 * w, nyquist, 2000)
    through = np.abs(p * wish.period / (np.exp(1j * scan * wish.period) - 1.0 + p * wish.period))
    return Tuned(
        controller=controller,
        joint=joint,
        interface="velocity",
        inertia=inertia,
        least=inertia,
        p=p,
        i=0.0,
        d=0.0,
        i_clamp=None,
        frequency=w / math.tau,
        damping=1.0,
        bandwidth=_last_through(scan, through),
        margin=2.0 / (p * wish.period),
        limited_by=chosen,
        predicted=StepAnswer(step, times, share),
    )


def bandwidth(loop: Loop) -> float:
    """-3 dB frequency [Hz] of a loop of one joint, from reference to position."""
    A = transition(loop)
    B = np.zeros(len(A))
    without = transition(replace(loop, p=np.zeros(1)))
    B[:] = without[:, 0] - A[:, 0]  # where -p q acts, p r acts against it
    if loop.i.any():
        B[2] = -loop.period
    scan = np.geomspace(1e-2, math.pi / loop.period, 600)
    eye = np.eye(len(A))
    stacked = np.exp(1j * scan * loop.period)[:, None, None] * eye - A
    through = np.abs(np.linalg.solve(stacked, np.broadcast_to(B[:, None], (len(scan), len(A), 1)))[:, 0, 0])
    return _last_through(scan, through)


def _last_through(scan: Array, through: Array) -> float:
    below = np.flatnonzero(through < math.sqrt(0.5))
    k = int(below[0]) if len(below) else len(scan) - 1
    if k == 0 or not len(below):
        return float(scan[k] / math.tau)
    return float(np.interp(-math.sqrt(0.5), -through[k - 1 : k + 1], scan[k - 1 : k + 1]) / math.tau)


def step_answer(loop: Loop, step: float, *, effort: float, i_clamp: float | None = None) -> StepAnswer:
    """A loop of one joint, at rest, whose reference steps by `step` [rad or m]; the effort saturates at -+ `effort`."""
    inertia, damping = float(loop.mass[0, 0]), float(loop.damping[0])
    p, d, i = float(loop.p[0]), float(loop.d[0]), float(loop.i[0])
    clamp = math.inf if i_clamp is None else i_clamp
    substeps = loop.substeps or 50
    s = loop.period / substeps
    moved = inertia + float(implicit_damping(loop.mass, loop.damping, s)[0])
    slowest = float(np.abs(poles(loop)).max())
    rate = -math.log(slowest) / loop.period if 0.0 < slowest < 1.0 else 0.0
    count = _ticks(max(rate, 1.0), loop.period)
    share = np.zeros(count)
    q = v = z = 0.0
    waiting = [0.0] * (int(loop.delay[0]) if loop.delay is not None else 0)
    for tick in range(count):
        share[tick] = q / step
        error = step - q
        waiting.append(p * error - d * v + z)
        z = min(max(z + i * loop.period * error, -clamp), clamp)
        u = min(max(waiting.pop(0), -effort), effort)
        for _ in range(substeps):
            v += s * (u - damping * v) / moved
            q += s * v
    return StepAnswer(step, np.asarray(np.arange(count) * loop.period, dtype=np.float64), share)


def _ticks(rate: float, period: float) -> int:
    """Number of ticks for a response that decays at `rate` [1/s]."""
    return max(10, math.ceil(min(max(10.0 / rate, 0.1), LONGEST) / period))
