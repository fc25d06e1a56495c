"""Model-based feed-forward for effort commands: gravity, or the full dynamics along the reference.

Computed torque and gravity compensation: Siciliano et al., Robotics: Modelling, Planning and Control (2009), 8.5.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np
import numpy.typing as npt

from manipcli.control.compiled import Run, bind
from manipcli.control.compiled.library import integers
from manipcli.control.controller import Controller
from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel

if TYPE_CHECKING:
    from manipcli.model.kinematics import Kinematics

Index = slice | npt.NDArray[np.intp]


Served = tuple[Controller, Index, int, int]
"""A controller, the index of its joints in a joint vector, ticks between two of its updates, tick of the first."""


class FeedForwardLaw(Protocol):
    """Adds to the effort commands of controllers in place."""

    def serve(self, controllers: Sequence[Served]) -> None:
        """Set the controllers to serve."""
        ...

    def add(self, tick: int, position: Array, velocity: Array) -> None:
        """To the controllers that were updated at `tick`; at the measured joints (n)."""
        ...


class NoDynamics:
    """Adds nothing: for a robot without a model."""

    def serve(self, controllers: Sequence[Served]) -> None:
        """No effect."""

    def add(self, tick: int, position: Array, velocity: Array) -> None:
        """No effect."""


class ModelFeedForward:
    """Gravity g(q) for controllers that want it; for those that want inverse dynamics

        M(q) a + C(q, v) v + g(q) + D v_r

    with the wanted acceleration a, and the viscous damping D of the joints at the reference velocity v_r: at the
    measured velocity it would cancel the damping of the joints, which stabilises the loop. All other joints are assumed
    not to accelerate, except mimic joints: they move with their driver, which supplies their effort.
    """

    def __init__(self, robot: RobotModel, kinematics: Kinematics) -> None:
        self._kinematics = kinematics
        self._damping = np.array([joint.damping for joint in robot.moving_joints])
        self._acceleration, self._rate = np.zeros((2, len(robot.joint_names)))
        self._followers = [
            (k, robot.joint_names.index(joint.mimic.joint), joint.mimic.multiplier)
            for k, joint in enumerate(robot.moving_joints)
            if joint.mimic is not None
        ]
        self._served: list[tuple[Array, Index, int, int]] = []
        self._driven: list[tuple[Index, Array, Array]] = []
        self._spread: Run | None = None
        self._compiled: Run | None = None

    def serve(self, controllers: Sequence[Served]) -> None:
        """Set the controllers to serve."""
        wanting = [own for own in controllers if own[0].feed_forward != "none" and "effort" in own[0].interfaces]
        self._served = [
            (c.output.commands[c.interfaces.index("effort")], index, every, first) for c, index, every, first in wanting
        ]
        self._driven = [
            (index, c.output.wanted_acceleration, c.output.velocity)
            for c, index, _, _ in wanting
            if c.feed_forward == "inverse_dynamics"
        ]
        self._acceleration[:] = 0.0
        self._rate[:] = 0.0
        self._bind()

    def _bind(self) -> None:
        """Bind the compiled laws to the arrays of the controllers."""
        n = len(self._damping)
        targets = [
            (target, integers(index, n), source)
            for index, wanted, reference in self._driven
            for target, source in ((self._acceleration, wanted), (self._rate, reference))
        ]
        self._spread = bind("copies", n, *(array for group in targets for array in group))
        followers, drivers = (np.array([own[k] for own in self._followers], dtype=np.int64) for k in (0, 1))
        factors = np.array([own[2] for own in self._followers], dtype=np.float64)
        commands = [array for command, index, _, _ in self._served for array in (integers(index, n), command)]
        self._compiled = None
        if all(every == 1 for _, _, every, _ in self._served):
            self._compiled = bind("model_efforts", n, self._damping, self._rate, followers, drivers, factors, *commands)

    def add(self, tick: int, position: Array, velocity: Array) -> None:
        """To the controllers that were updated at `tick`; at the measured joints (n)."""
        if not self._served:
            return
        if self._driven:
            acceleration, rate = self._acceleration, self._rate
            if self._spread is not None:
                self._spread()
            else:
                for index, wanted, reference in self._driven:
                    acceleration[index] = wanted
                    rate[index] = reference
            for follower, driver, factor in self._followers:
                acceleration[follower] = factor * acceleration[driver]
                rate[follower] = factor * rate[driver]
            efforts = self._kinematics.inverse_dynamics(position, velocity, acceleration)
        else:
            efforts = self._kinematics.gravity(position)
        if self._compiled is not None:
            self._compiled(efforts, bool(self._driven))
            return
        if self._driven:
            np.multiply(self._damping, self._rate, self._rate)
            np.add(efforts, self._rate, efforts)
        for follower, driver, factor in self._followers:
            efforts[driver] += factor * efforts[follower]
        for command, index, every, first in self._served:
            if every == 1 or (tick - first) % every == 0:
                command += efforts[index]
