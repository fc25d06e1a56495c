"""From what a trajectory controller follows to a new goal, and to rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manipcli.control.course import (
    ACCELERATION,
    EFFORT,
    POSITION,
    VELOCITY,
    Columns,
    Course,
    Part,
    decelerating,
    stopping_in,
)
from manipcli.control.reference import Reference
from manipcli.control.trajectory_goal import JointFacts, lead_in
from manipcli.core.geometry import Array
from manipcli.plan.trajectory import Interpolation, JointTrajectory
from manipcli.spec.controllers import ConstraintsSpec


@dataclass(frozen=True, slots=True, eq=False)
class Transitions:
    """How one controller does it; see `JointTrajectoryController` for the first five.

    Attributes:
        deceleration: (n) how fast each joint stops; infinite: at once.
        together: whether all joints stop at the same time, on their straight path.
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
    ) -> Course:
        """What is followed from `time` [s] on.

        Args:
            trajectory: its joints stand in the order of the controller.
            later: [s] its time 0 is so much later; negative: its points up to now are left out.
            reference: what is followed now.
            time: now.
            speed: of the new course.
            measured: position and velocity (n).
        """
        now = reference.row(time)
        if speed not in (0.0, 1.0):  # in seconds of the trajectory; where it is paused, nothing moves
            now[VELOCITY] /= speed
            now[ACCELERATION] /= speed**2
        course = reference.now(time) if self.replaces else Course.hold(now[POSITION], now[EFFORT])
        begin = max(later, 0.0) if self.replaces else 0.0
        start = now
        if begin > 0.0:
            start = course.sample(np.array([begin]))[0]
        elif not self.from_desired and not (self.replaces and reference.moving):
            start[POSITION], start[VELOCITY], start[ACCELERATION] = *measured, 0.0
        columns = self._columns(trajectory.names)
        whole = lead_in(
            trajectory, start[:, columns], self.facts.some(trajectory.names), ago=begin - later, smooth=self.smooth,
            interpolation=self.interpolation,
        )  # fmt: skip
        return course.with_part(Part(columns, whole, begin))

    def to_rest(self, reference: Reference, time: float) -> Course:
        """What is followed from `time` [s] on, until it rests; in seconds of real time."""
        now = reference.row(time)
        if self.stop_duration > 0.0:
            return stopping_in(now, self.stop_duration)
        return decelerating(now, self.deceleration, together=self.together)

    def _columns(self, names: Sequence[str]) -> Columns:
        joints = self.facts.joints
        return slice(None) if names == joints else np.array([joints.index(name) for name in names], dtype=np.intp)
