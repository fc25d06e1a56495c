"""Gains for a bandwidth and a damping ratio, and how the sampled loop answers a step with them.

A joint of inertia I and viscous friction b under u = p e + d de/dt swings, continuously, with p = I w^2 and
d = 2 zeta I w - b; I is the largest inertia that the joint meets while the others stand, so that nowhere it is damped
less. A joint that its friction slows down more than that, b > 2 I w, creeps after the reference at p / b: p = b w / 2.
On a velocity interface the reference is followed with u = v + p e, p = w. Where it must be,

- w is raised where the joint of a hand would press with less than all its effort, all the way through its travel;
- w is lowered until the step asks for no more than what gravity leaves of the effort (or for no more than the
  velocity);
- first zeta, down to `LEAST_DAMPING`, then w is lowered until all gains could be `MARGIN` times as large before the
  loop is unstable (`stability.py`) at the smallest inertia, and before all loops together are in any posture: an arm
  that is stretched out now and then straight up has a hundred times less inertia about its first joint.

The answer to a step is that of the joint alone, without gravity: decoupled, sampled, and with its effort limit.
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
"""All gains together could be so much larger."""
LEAST_DAMPING: Final = 0.3
"""Ratio at the largest inertia, where the control step allows no more."""
SLOW_INTEGRAL: Final = 0.1
"""Of the frequency of the loop: how fast an integral takes over where nothing carries the weight."""
WEIGHTLESS: Final = 1e-6
"""Of the effort: what carries no more has no weight to hold, only rounding."""
SETTLED: Final = 0.02
"""Of the step: closer for good counts as settled."""
LEAST_FREQUENCY: Final = 1e-3
"""[rad/s] where no slower one is looked for."""
LONGEST: Final = 6.0
"""[s] of a step."""

Limit = Literal["", "control step", "other joints", "effort", "velocity"]


@dataclass(frozen=True, slots=True)
class Wish:
    """What is wanted of every loop.

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
    """How a joint answers a step of its reference.

    Attributes:
        size: of the step [rad or m].
        times: (T,) [s].
        share: (T,) of the step that is done: 1 at its end.
    """

    size: float
    times: Array
    share: Array

    @property
    def overshoot(self) -> float:
        """Of the step, 0 or more."""
        return max(0.0, float(self.share.max()) - 1.0)

    @property
    def settling_time(self) -> float:
        """[s] after which it stays within `SETTLED`; infinite where it does not in this time."""
        away = np.flatnonzero(np.abs(self.share - 1.0) > SETTLED)
        if not len(away):
            return 0.0
        return float(self.times[away[-1] + 1]) if away[-1] + 1 < len(self.times) else math.inf


@dataclass(frozen=True, slots=True, eq=False)
class Tuned:
    """Proposed gains of one joint.

    Attributes:
        controller, joint, interface: whose gains.
        inertia: of the design, the most that it meets [kg m2 or kg]; `least`: the smallest.
        p, i, d: the gains; `i_clamp`: the most effort of the integral, None where i is 0.
        frequency, damping: natural frequency [Hz] and damping ratio at `inertia`.
        bandwidth: where the reference comes through with 1 / sqrt 2 [Hz], of the sampled loop.
        margin: by what factor all gains may grow, at `least`, before the loop is unstable.
        limited_by: what keeps it from what was wanted; "" where nothing does.
        predicted: the answer to a step.
        simulated: the same of the whole robot in an engine, where that was asked for.
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
class _Draft:
    """What is wanted of one joint, before its gains are written down in three digits."""

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
        load: what the joints meet.
        wish: what is wanted.
        steps: (k) that do not saturate [rad or m].
        carried: (k) whether something else carries the weight, so that no integral is needed.
        pressing: (k) the least p that is wanted, of joints that press on what they hold; 0 of others.
    """
    w = math.tau * wish.bandwidth
    inertia = load.held_inertia.max(axis=0)
    left = np.maximum(load.effort - np.abs(load.gravity).max(axis=0), 0.1 * load.effort)
    drafts = []
    for k in range(len(load.joints)):
        wanted = max(w, math.sqrt(float(pressing[k] / inertia[k])))
        draft = _Draft(float(inertia[k]), float(load.damping[k]), wanted, wish.damping, bool(carried[k]))
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


def _softer(draft: _Draft, limit: Limit) -> _Draft:
    """A twentieth less damping gain, at the cost of the damping ratio as long as that is not the least."""
    if draft.damping > LEAST_DAMPING:
        return replace(draft, damping=max(0.95 * draft.damping, LEAST_DAMPING), limit=limit)
    return replace(draft, w=0.95 * draft.w, limit=limit)


def _calmed(load: JointSpaceLoad, k: int, draft: _Draft, wish: Wish) -> _Draft:
    """With the margin at the least inertia."""
    least = float(load.own_inertia[:, k].min())
    while draft.w > LEAST_FREQUENCY and not is_stable(_loop(load, k, least, draft.gains, wish).scaled(MARGIN)):
        draft = _softer(draft, "control step")
    return draft


def _calm_together(load: JointSpaceLoad, drafts: list[_Draft], wish: Wish) -> None:
    """With the margin of all loops together, in every posture; those that have the largest share give in."""
    for mass in load.mass:
        for _ in range(400):
            p, i, d = (np.array(column) for column in zip(*(draft.gains for draft in drafts), strict=True))
            whole = Loop(mass, p, d, i, load.damping, wish.period, wish.substeps, np.array(load.latency))
            if min(draft.w for draft in drafts) < LEAST_FREQUENCY or is_stable(whole.scaled(MARGIN)):
                break
            _, share = unstable_share(whole.scaled(MARGIN))
            for k in np.flatnonzero(share >= min(0.25, share.max())):
                drafts[k] = _softer(drafts[k], "other joints")


def tightness(load: JointSpaceLoad, tuned: Sequence[Tuned], wish: Wish) -> Array:
    """(T,) how near these gains come to what the control step allows: the largest eigenvalue of M^-1 (2 D h + P h^2),
    which is 4 where they are unstable, in one step of Euler and for one joint exactly."""
    p, d = (np.array([getattr(one, key) for one in tuned]) for key in ("p", "d"))
    push = 2.0 * (d + load.damping) * wish.period + p * wish.period**2
    # Of the same eigenvalues as M^-1 W, and symmetric: W^1/2 M^-1 W^1/2.
    root = np.sqrt(push)
    return np.asarray(np.linalg.eigvalsh(root[:, None] * np.linalg.inv(load.mass) * root)[:, -1])


def least_margin(load: JointSpaceLoad, tuned: Sequence[Tuned], wish: Wish) -> float:
    """By what factor all of these gains may grow in every posture; 0 where they are unstable in one."""
    p, i, d = (np.array([getattr(one, key) for one in tuned]) for key in ("p", "i", "d"))
    late = np.array(load.latency)
    loops = (Loop(mass, p, d, i, load.damping, wish.period, wish.substeps, late) for mass in load.mass)
    return min(gain_margin(loop) for loop in loops)


def _tuned(load: JointSpaceLoad, k: int, controller: str, draft: _Draft, wish: Wish, step: float, left: float) -> Tuned:
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
    """The gain of a joint on the velocity interface, whose velocities come true within `acceleration` [rad/s2 or m/s2].

    Per tick the error shrinks by 1 - p h: unstable from p h = 2.
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
    """[Hz] up to which the reference of a loop of one joint comes through with at least 1 / sqrt 2."""
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
    """A loop of one joint, at rest, whose reference steps by `step` [rad or m]; the effort is cut at -+ `effort`."""
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
    """Long enough for what decays at `rate` [1/s]."""
    return max(10, math.ceil(min(max(10.0 / rate, 0.1), LONGEST) / period))
