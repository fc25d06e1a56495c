"""Limits of a set of joints as arrays, for retiming and for `verify`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, frozen
from manipcli.model.configuration import position_limits
from manipcli.model.robot import RobotModel


@dataclass(frozen=True, slots=True, eq=False)
class MotionLimits:
    """Symmetric bounds per joint, arrays (n) in the order of `names`; infinite where there is no limit. SI, rad or m.

    Attributes:
        names: (n) joints.
        lower, upper: position.
        velocity, acceleration: finite and positive.
        jerk: infinite where none is stated.
        soft: (joint, side) of the soft position limits; `lower` is side 0, `upper` side 1.
        sliding: those of `names` whose positions are in m.
    """

    names: tuple[str, ...]
    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    jerk: Array
    soft: frozenset[tuple[str, int]] = frozenset()
    sliding: frozenset[str] = frozenset()

    def unit(self, name: str) -> str:
        """Of the position of this joint."""
        return "m" if name in self.sliding else "rad"

    @staticmethod
    def of(
        robot: RobotModel, joints: Sequence[str], *, velocity_scale: float = 1.0, acceleration_scale: float = 1.0
    ) -> MotionLimits:
        """The limits of `joints`; the scales (0, 1] slow a motion down (`acceleration_scale` applies to jerk, too).

        Raises:
            NotPlannable: a joint states no positive velocity or acceleration limit.
        """
        limits = [robot.joint(name).limits for name in joints]
        velocity: list[float] = []
        acceleration: list[float] = []
        for name, limit in zip(joints, limits, strict=True):
            for word, value, into in (
                ("velocity", limit.velocity, velocity),
                ("acceleration", limit.acceleration, acceleration),
            ):
                if value is None or not 0.0 < value < np.inf:
                    stated = "none" if value is None else f"{value:g}"
                    raise NotPlannable(
                        f"joint '{name}' has no usable {word} limit (stated: {stated})",
                        hint=f"set it in the robot file: limits: {{{name}: {{{word}: ...}}}}",
                    )
                into.append(value)
        lower, upper = position_limits(robot.joint(name) for name in joints)
        return MotionLimits(
            names=tuple(joints),
            lower=lower,
            upper=upper,
            velocity=frozen(np.array(velocity) * velocity_scale),
            acceleration=frozen(np.array(acceleration) * acceleration_scale),
            jerk=frozen([np.inf if limit.jerk is None else limit.jerk * acceleration_scale for limit in limits]),
            soft=frozenset(
                (name, side)
                for name, limit in zip(joints, limits, strict=True)
                for side in (0, 1)
                if limit.is_soft(side)
            ),
            sliding=frozenset(name for name in joints if robot.joint(name).unit == "m"),
        )
