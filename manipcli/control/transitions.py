"""Transitions of a trajectory controller from the present reference to a new goal; `stopping.py` has those to rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from manipcli.control.active_trajectory import (
    ACCELERATION,
    EFFORT,
    POSITION,
    VELOCITY,
    ActiveTrajectory,
    Columns,
    Part,
    Reference,
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


@dataclass(frozen=True, slots=True, eq=False)
class Transitions:
    """Settings of one controller for transitions to new goals; see `JointTrajectoryController`."""

    facts: JointFacts
    replaces: bool
    from_desired: bool
    smooth: bool
    interpolation: Interpolation

    def to_goal(
        self,
        trajectory: JointTrajectory,
        later: float,
        reference: Reference,
        time: float,
        speed: tuple[float, float],
        measured: tuple[Array, Array],
    ) -> ActiveTrajectory:
        """The active trajectory from `time` [s] on.

        Args:
            trajectory: with its joints in the order of the controller.
            later: [s] delay of its time 0; negative: its points up to now are left out.
            reference: the present reference.
            time: now.
            speed: of the new trajectory, and its rate [1/s].
            measured: position and velocity (n).
        """
        now = reference.row(time)
        f, rate = speed
        if f == 0.0:  # while it is paused, nothing moves
            now[ACCELERATION] = 0.0
        elif (f, rate) != (1.0, 0.0):  # in seconds of the trajectory
            now[VELOCITY] /= f
            now[ACCELERATION] = (now[ACCELERATION] - now[VELOCITY] * rate) / f**2
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
        """Check that the next point of a new goal can be reached from its start: |p - q| <= v_max T.

        For a goal in the past, T is the time left at the next tick, at least a period: if the goal has ended by then,
        the reference steps there. The exact start is not known: of the reference now, the reference one tick later, and
        the measured position, the nearest counts, because the sender of a goal knows one of them.

        Args:
            trajectory: with its joints in the order of the controller.
            start_time: of the goal.
            reference, time: as for `to_goal`.
            period: [s] to the next tick, at which the goal begins.
            actual: (n) measured position; for continuous joints within half a turn of the reference.

        Raises:
            GoalRejected: a joint would exceed its velocity limit on every curve.
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
        distances = trajectory.positions[k] - np.array(starts)[:, self._columns(trajectory.names)]
        shortest(distances, facts)
        nearest = np.take_along_axis(distances, np.abs(distances).argmin(axis=0)[None], axis=0)[0]
        excess = np.abs(nearest) - facts.velocity * duration * (1.0 + VELOCITY_SLACK)
        if (excess > POSITION_SLACK).any():
            j = int(excess.argmax())
            raise too_fast(facts, j, float(nearest[j]) / duration, f"on the path to point {k}")

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
    """The trajectory with a lead-in from `start`.

    The start becomes a point at time 0, with the same fields as the points, unless the first point is at 0 itself.
    Continuous joints of the trajectory are shifted by whole turns, so that its first point is the nearest.

    Args:
        trajectory: of the joints of `facts`.
        start: (4, n) position, velocity, acceleration, effort.
        facts: of its joints.
        ago: [s] time since its time 0 (negative: until then); only its remaining points are kept.
        smooth: whether points with only positions get the velocities of a spline.
        interpolation: `none` overrides that of the trajectory.
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
            after(start[3], trajectory.efforts), orders=_led(trajectory, leads), interpolation=trajectory.interpolation,
            led_in=leads or trajectory.led_in,
        )  # fmt: skip
    return whole.with_spline_velocities(start[1] if leads else None) if smooth else whole


def _led(trajectory: JointTrajectory, leads: bool) -> npt.NDArray[np.int8] | None:
    """The orders of the points, after that of a start that gives everything."""
    if trajectory.orders is None or not leads:
        return trajectory.orders
    return np.concatenate([[np.int8(trajectory.order)], trajectory.orders])


def first_to_come(times: Array, ago: float) -> int:
    """Index of the first of the points at `times` (K) that is later than `ago`; the last if there is none."""
    return min(int(np.searchsorted(times, ago, side="right")), len(times) - 1)


def _remaining(trajectory: JointTrajectory, ago: float) -> JointTrajectory:
    """The points of a trajectory later than `ago` [s], at least the last, with `ago` as the new time 0."""
    first = first_to_come(trajectory.times, ago)

    def kept(values: Array | None) -> Array | None:
        return None if values is None else values[first:]

    return JointTrajectory.of_arrays(
        trajectory.names, np.maximum(trajectory.times[first:] - ago, 0.0), trajectory.positions[first:],
        kept(trajectory.velocities), kept(trajectory.accelerations), kept(trajectory.efforts),
        orders=None if trajectory.orders is None else trajectory.orders[first:],
        interpolation=trajectory.interpolation,
    )  # fmt: skip
