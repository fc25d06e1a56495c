"""Path and goal tolerances of a trajectory goal, and the texts that say which joint broke which, by how much, when."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from manipcli.control.trajectory_goal import JointFacts
from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array
from manipcli.spec.controllers import ConstraintsSpec, JointConstraintSpec


@dataclass(frozen=True, slots=True, eq=False)
class Tolerances:
    """`path`, `goal` (n) rad or m; `stopped_velocity` per second; infinite: not enforced. `goal_time` [s];
    `least_path`: the smallest of `path`."""

    path: Array
    goal: Array
    stopped_velocity: float
    goal_time: float
    least_path: float

    @staticmethod
    def of(joints: tuple[str, ...], constraints: ConstraintsSpec) -> Tolerances:
        """Of the joints in their order.

        Raises:
            InvalidArgument: a tolerance of a joint that is not one of them.
        """
        unknown = sorted(set(constraints.joints) - set(joints))
        if unknown:
            raise InvalidArgument("CTRL104", f"tolerances of '{unknown[0]}', which is not a joint of the controller")
        each = [constraints.joints.get(joint, JointConstraintSpec()) for joint in joints]
        path = np.array([c.trajectory or math.inf for c in each])
        return Tolerances(
            path=path,
            goal=np.array([c.goal or math.inf for c in each]),
            stopped_velocity=constraints.stopped_velocity_tolerance or math.inf,
            goal_time=constraints.goal_time,
            least_path=float(path.min()),
        )

    def outside_path(self, error: Array) -> bool:
        """Whether some joint is outside its path tolerance."""
        # The largest error is at most their norm: nearly always this alone answers. NaN does not pass here.
        if error.dot(error) < self.least_path**2:
            return False
        return bool((np.abs(error) > self.path).any())

    def inside_goal(self, error: Array, error_rate: Array) -> bool:
        """Whether every joint is within goal tolerance and slow enough, now."""
        within = np.abs(error) <= self.goal
        slow = np.abs(error_rate) <= self.stopped_velocity
        return bool((within & slow).all())

    def path_text(self, facts: JointFacts, error: Array, time: float, elapsed: float) -> str:
        j = int(np.argmax(np.abs(error) / self.path))
        unit = facts.units[j]
        return (
            f"joint '{facts.joints[j]}' left its path tolerance: error {error[j]:+.6g} {unit}, "
            f"limit {self.path[j]:.6g} {unit}, at t = {time:.3f} s ({elapsed:.3f} s into the goal)"
        )

    def goal_text(self, facts: JointFacts, error: Array, error_rate: Array, time: float, late: float) -> str:
        position = np.abs(error) / self.goal
        velocity = np.abs(error_rate) / self.stopped_velocity
        j = int(np.argmax(np.maximum(position, velocity)))
        unit = facts.units[j]
        if position[j] > 1.0:
            what = f"goal tolerance: error {error[j]:+.6g} {unit}, limit {self.goal[j]:.6g} {unit}"
        else:
            what = (
                f"stopped velocity tolerance: velocity error {error_rate[j]:+.6g} {unit}/s, "
                f"limit {self.stopped_velocity:.6g} {unit}/s"
            )
        return (
            f"joint '{facts.joints[j]}' is outside its {what}, at t = {time:.3f} s, "
            f"{late:.3f} s after the end (goal_time {self.goal_time:.6g} s)"
        )
