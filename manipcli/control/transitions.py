"""From what a trajectory controller follows to a new goal, and to rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manipcli.control.active_trajectory import (
    ACCELERATION,
    EFFORT,
    POSITION,
    VELOCITY,
    ActiveTrajectory,
    Columns,
    Part,
    Reference,
    decelerating,
    stopping_in,
)
from manipcli.control.trajectory_goal import (
    POSITION_SLACK,
    VELOCITY_SLACK,
    JointFacts,
    shortest,
    too_fast,
)
from manipcli.core.geometry import Array
from manipcli.plan.trajectory import Interpolation, JointTrajectory, TrajectoryPoint
from manipcli.spec.controllers import ConstraintsSpec


@dataclass(frozen=True, slots=True, eq=False)
class Transitions:
    """How one controller does it; see `JointTrajectoryController` for the first five.

    Attributes:
        deceleration: (n) how fast each joint stops; infinite: at once.
        together: whether all joints stop at the same time, on their straight path, where that is within their limits.
    """

    facts: JointFacts
    replaces: bool
    from_desired: bool
    smooth: bool
    interpolation: Interpolation
    stop_duration: float
    deceleration: Array
    together: bool

    @staticmethod
    def decelerations(facts: JointFacts, constraints: ConstraintsSpec) -> tuple[Array, bool]:
        """`deceleration` and `together`."""
        if not constraints.decelerate_on_cancel:
            return np.full(len(facts.joints), np.inf), True
        own = {joint: one.max_deceleration_on_cancel for joint, one in constraints.joints.items()}
        chosen = [own.get(joint, 0.0) or limit for joint, limit in zip(facts.joints, facts.acceleration, strict=True)]
        return np.array(chosen), not any(own.values())

    def to_goal(
        self,
        trajectory: JointTrajectory,
        later: float,
        reference: Reference,
        time: float,
        speed: float,
        measured: tuple[Array, Array],
    ) -> ActiveTrajectory:
        """What is followed from `time` [s] on.

        Args:
            trajectory: its joints stand in the order of the controller.
            later: [s] its time 0 is so much later; negative: its points up to now are left out.
            reference: what is followed now.
            time: now.
            speed: of the new trajectory.
            measured: position and velocity (n).
        """
        now = reference.row(time)
        if speed not in (0.0, 1.0):  # in seconds of the trajectory; where it is paused, nothing moves
            now[VELOCITY] /= speed
            now[ACCELERATION] /= speed**2
        active = reference.now(time) if self.replaces else ActiveTrajectory.hold(now[POSITION], now[EFFORT])
        begin = max(later, 0.0) if self.replaces else 0.0
        start = now
        if begin > 0.0:
            start = active.sample(np.array([begin]))[0]
        elif not self.from_desired and not (self.replaces and reference.moving):
            start[POSITION], start[VELOCITY], start[ACCELERATION] = *measured, 0.0
        columns = self._columns(trajectory.names)
        whole = lead_in(
            trajectory, start[:, columns], self.facts.some(trajectory.names), ago=begin - later, smooth=self.smooth,
            interpolation=self.interpolation,
        )  # fmt: skip
        return active.with_part(Part(columns, whole, begin))

    def check_way(
        self,
        trajectory: JointTrajectory,
        start_time: float,
        reference: Reference,
        time: float,
        period: float,
        actual: Array,
    ) -> None:
        """Whether the first point still to come of a new goal can be reached from where it begins: |p - q| <= v_max T.

        Of a goal in the past, T is what is left of it at the next tick, at the least a period: where its end is over by
        then, the reference steps there. Nobody knows exactly where the goal begins. It counts what is nearest of the
        reference now, the reference one tick later, and what is measured: who sends goals knows one of them.

        Args:
            trajectory: its joints stand in the order of the controller.
            start_time: of the goal.
            reference, time: as for `to_goal`.
            period: [s] to the next tick, at which the goal begins.
            actual: (n) what is measured now, continuous joints in the turn of the reference.

        Raises:
            GoalRejected: a joint would have to move faster than its limit, whatever the curve.
        """
        due = time + period
        later = start_time - due if start_time > 0.0 else 0.0
        k = first_to_come(trajectory.times, -later) if later < 0.0 else 0
        ahead = later > 0.0 and self.replaces
        duration = float(trajectory.times[k]) + (0.0 if ahead else later)
        if later < 0.0:
            duration = max(duration, period)
        stepping = "none" in (self.interpolation, trajectory.interpolation)
        if duration == 0.0 or stepping or trajectory.source is not None:
            return
        begin = start_time if ahead else time
        starts = [reference.row(begin)[POSITION], reference.row(begin + period)[POSITION]]
        if not ahead:
            starts.append(actual)
        facts = self.facts.some(trajectory.names)
        ways = trajectory.positions[k] - np.array(starts)[:, self._columns(trajectory.names)]
        shortest(ways, facts)
        way = np.take_along_axis(ways, np.abs(ways).argmin(axis=0)[None], axis=0)[0]
        excess = np.abs(way) - facts.velocity * duration * (1.0 + VELOCITY_SLACK)
        if (excess > POSITION_SLACK).any():
            j = int(excess.argmax())
            raise too_fast(facts, j, float(way[j]) / duration, f"on the way to point {k}")

    def to_rest(self, reference: Reference, time: float) -> ActiveTrajectory:
        """What is followed from `time` [s] on, until it rests; in seconds of real time.

        Where that would take a joint beyond a position limit, each joint stops by itself: within the time that it needs
        at its own deceleration, or that is given; before its limit even if it has to brake harder.
        """
        now = reference.row(time)
        if self.stop_duration > 0.0:
            own = np.full(now.shape[1], self.stop_duration)
            active = stopping_in(now, self.stop_duration)
        else:
            own = np.abs(now[VELOCITY]) / self.deceleration
            common = np.where(np.isfinite(self.deceleration), own.max(), 0.0)
            active = decelerating(now, common if self.together else own)
        room = self._room(now)
        ways = np.abs(active.sample(np.array([active.end]))[0, POSITION] - now[POSITION])
        if (ways <= room + POSITION_SLACK).all():
            return active
        rate = np.abs(now[VELOCITY])
        latest = np.divide(2.0 * room, rate, out=np.zeros_like(rate), where=rate > 0.0)
        return decelerating(now, np.minimum(own, latest))

    def _room(self, row: Array) -> Array:
        """(n) how far each joint may go on in the direction in which it moves; beyond its limit: not at all."""
        ahead = np.where(row[VELOCITY] > 0.0, self.facts.upper - row[POSITION], row[POSITION] - self.facts.lower)
        return np.asarray(np.maximum(ahead, 0.0))

    def _columns(self, names: Sequence[str]) -> Columns:
        joints = self.facts.joints
        return slice(None) if names == joints else np.array([joints.index(name) for name in names], dtype=np.intp)


def lead_in(
    trajectory: JointTrajectory,
    start: Array,
    facts: JointFacts,
    *,
    ago: float,
    smooth: bool,
    interpolation: Interpolation,
) -> JointTrajectory:
    """The trajectory from `start` on.

    The start becomes a point at time 0 of what the trajectory's points give, unless the first point is at 0 itself.
    Continuous joints of the trajectory are shifted by whole turns, so that its first point is the nearest.

    Args:
        trajectory: of the joints of `facts`.
        start: (4, n) where it begins: position, velocity, acceleration, effort.
        facts: of its joints.
        ago: [s] its time 0 was so long ago (negative: will be); of its points those that are still to come are left.
        smooth: whether points that give positions alone get the velocities of a spline.
        interpolation: `none` also where the trajectory does not say so.
    """
    if trajectory.source is not None:
        begin = TrajectoryPoint(start[0], 0.0, start[1], start[2], start[3])
        trajectory = JointTrajectory(trajectory.names, trajectory.source, begin, interpolation=trajectory.interpolation)
    if interpolation == "none":
        trajectory = trajectory.with_interpolation("none")
    if ago != 0.0:
        trajectory = _remaining(trajectory, ago)
    positions = trajectory.positions
    if facts.wraps:
        ahead = positions[0] - start[0]
        near = ahead.copy()
        shortest(near, facts)
        if (near != ahead).any():
            positions = positions + (near - ahead)
    leads = trajectory.times[0] > 0.0
    if not leads and positions is trajectory.positions:
        whole = trajectory
    else:

        def after(row: Array, values: Array | None) -> Array | None:
            return values if values is None or not leads else np.vstack([row, values])

        whole = JointTrajectory.of_arrays(
            trajectory.names, np.concatenate([[0.0], trajectory.times]) if leads else trajectory.times,
            np.vstack([start[0], positions]) if leads else positions,
            after(start[1], trajectory.velocities), after(start[2], trajectory.accelerations),
            after(start[3], trajectory.efforts), interpolation=trajectory.interpolation,
            led_in=leads or trajectory.led_in,
        )  # fmt: skip
    return whole.with_spline_velocities(start[1] if leads else None) if smooth else whole


def first_to_come(times: Array, ago: float) -> int:
    """Which of the points at `times` (K) is the first that comes later than `ago`; the last where none does."""
    return min(int(np.searchsorted(times, ago, side="right")), len(times) - 1)


def _remaining(trajectory: JointTrajectory, ago: float) -> JointTrajectory:
    """The points of a trajectory that come later than `ago` [s] of it, at the least the last, from then on."""
    first = first_to_come(trajectory.times, ago)

    def kept(values: Array | None) -> Array | None:
        return None if values is None else values[first:]

    return JointTrajectory.of_arrays(
        trajectory.names, np.maximum(trajectory.times[first:] - ago, 0.0), trajectory.positions[first:],
        kept(trajectory.velocities), kept(trajectory.accelerations), kept(trajectory.efforts),
        interpolation=trajectory.interpolation,
    )  # fmt: skip
