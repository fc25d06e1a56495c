"""Joint trajectories: points in time, and what lies between them.

Between two points the curve is linear, cubic or quintic by what *both* ends give: positions; positions and velocities;
positions, velocities and accelerations. A planned trajectory is this same type with a point at every control tick, so
that sampling at ticks returns the planned values themselves.
"""

from __future__ import annotations

from dataclasses import dataclass

from manipcli.core.geometry import Array


@dataclass(frozen=True, slots=True, eq=False)
class JointTrajectory:
    """`names` (n); `times` (k,) [s] strictly increasing from the start of the goal; arrays (k, n), or None."""

    names: tuple[str, ...]
    times: Array
    positions: Array
    velocities: Array | None = None
    accelerations: Array | None = None

    @property
    def duration(self) -> float:
        return float(self.times[-1])
