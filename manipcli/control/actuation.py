"""Actuator model: effort commands from joints to motors and back, once per control tick.

joint_to_actuator -> latency -> effort and velocity limits -> friction and losses -> actuator_to_joint
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from manipcli.control.compiled import bind
from manipcli.core.geometry import Array
from manipcli.model.drivetrain import Drivetrain
from manipcli.model.robot import RobotModel

STIFFNESS: Final = 0.25
"""Largest share of an actuator's velocity that friction removes per tick; at 2 it would oscillate for ever."""
_PLENTY: Final = 1e9
"""Represents an unlimited effort in sums [N m or N]."""


class Actuation:
    """The actuators of a robot.

    An actuator applies tau, the effort commanded `latency` ticks ago, at most its effort limit, and 0 if that drives it
    further beyond its velocity limit. The gear receives

        tau - b v - clip(g v, -+(c + (1 - efficiency) |tau|)),

    v the actuator's velocity, b its viscous and c its Coulomb friction: away from rest the Coulomb friction, and a
    share of the effort that is lost where the motor drives and added where it brakes; near rest a damping g that is as
    stiff as is stable for one tick, so that the joint does not chatter. A load below c makes the joint creep at
    load / g instead of sticking.

    This applies only to joints commanded by effort; those commanded by position or velocity are the engine's motors,
    whose force `motor_effort_limits` caps. Both joints of a pair must be commanded by effort.

    Attributes:
        names: (a) of the actuators.
        ideal: whether every actuator is ideal; `apply` then returns the command.
        saturations: (a) int, number of ticks in which each actuator was saturated.
        saturated: (a) bool, whether it was in the last tick.

    Args:
        robot: the robot.
        period: of the control tick [s].
    """

    def __init__(self, robot: RobotModel, period: float) -> None:
        self._robot = robot
        self._period = period
        self.drivetrain = Drivetrain.of(robot)
        self.names = self.drivetrain.names
        actuators = self.drivetrain.actuators
        a = len(actuators)
        n = len(robot.joint_names)

        def each(values: list[float]) -> Array:
            return np.array(values, dtype=np.float64)

        self._effort = each([math.inf if x.effort is None else x.effort for x in actuators])
        self._pull = -self._effort
        self._velocity = each([math.inf if x.velocity is None else x.velocity for x in actuators])
        self._coulomb = each([x.coulomb_friction for x in actuators])
        self._viscous = each([x.viscous_friction for x in actuators])
        self._loss = each([1.0 - x.efficiency for x in actuators])
        latency = np.array([x.latency for x in actuators], dtype=np.intp)
        self._sees_velocity = bool(np.isfinite(self._velocity).any())
        limited = self._sees_velocity or bool(np.isfinite(self._effort).any())
        self._rubs = bool(self._coulomb.any() or self._viscous.any() or self._loss.any())
        self._waits = bool(latency.any())
        self.ideal = not (limited or self._rubs or self._waits)
        self._sees_velocity |= self._rubs
        self.saturations = np.zeros(a, dtype=np.int64)
        self.saturated = np.zeros(a, dtype=np.bool_)

        self._damping: Array | None = None  # (2 a): g, then b; known once the robot's inertia is
        self._latency = latency
        self._past = np.zeros((int(latency.max(initial=0)) + 1, a))
        self._past_flat = self._past.reshape(-1)
        self._at = np.zeros(a, dtype=np.intp)
        self._row = -1  # index of the last command in `_past`; -1: there was none

        width = 2 if self._sees_velocity else 1
        self._seen = np.zeros(width * n)
        self._asked = np.zeros(width * a)
        self._bound = np.concatenate((self._effort, self._velocity))[: width * a]
        self._asked_effort, self._asked_speed = self._asked[:a], self._asked[a:]
        self._size = np.zeros(width * a)
        self._within = np.zeros(width * a, dtype=np.bool_)
        self._most, self._least, self._wanted, self._given, self._friction = np.zeros((5, a))
        self._fast = np.zeros(a, dtype=np.bool_)
        self._applied, self._passed = np.zeros((2, n))
        self.select(["effort"] * len(robot.joint_names))

    def select(self, modes: Sequence[str | None]) -> None:
        """Set the modes (n) of the joints; entries of a command pass unchanged in any mode but "effort"."""
        n, a = len(self._robot.joint_names), len(self.names)
        maps = self.drivetrain.transmission.maps
        joints = list(self.drivetrain.joints)
        by_effort = np.array([modes[k] == "effort" for k in joints], dtype=np.bool_)
        at = 0
        for block in self.drivetrain.transmission.blocks:
            end = at + block.size
            by_effort[at:end] = by_effort[at:end].all()
            at = end
        here = [joints[k] for k in np.flatnonzero(by_effort)]
        width = len(self._seen) // n if n else 1
        self._to_actuator = np.zeros((width * a, width * n))
        self._to_joint = np.zeros((n, a))
        self._to_actuator[:a, here] = maps.actuator_effort[:, by_effort]
        self._to_joint[here] = maps.joint_effort[by_effort]
        if width == 2:
            self._to_actuator[a:, n:][:, here] = maps.actuator_motion[:, by_effort]
        self._pass = np.ones(n)
        self._pass[here] = 0.0
        self._passes = len(here) < n
        self._look(None, None)

    def _look(self, command: Array | None, velocity: Array | None) -> None:
        """Bind the compiled law to these arrays, which are overwritten at every tick.

        It needs one joint per actuator, no latency, and the damping, which the first tick computes.
        """
        self._seen_arrays, self._compiled = (command, velocity), None
        if command is None or velocity is None or self._waits or (self._rubs and self._damping is None):
            return
        n, a = len(command), len(self.names)
        joints = np.array(self.drivetrain.joints, dtype=np.int64)
        k = np.arange(a)
        to_effort, to_joint = self._to_actuator[k, joints], self._to_joint[joints, k]
        to_speed = self._to_actuator[a + k, n + joints] if self._sees_velocity else np.zeros(a)
        if np.count_nonzero(self._to_actuator) != np.count_nonzero(to_effort) + np.count_nonzero(to_speed) or (
            np.count_nonzero(self._to_joint) != np.count_nonzero(to_joint)
        ):
            return
        self._compiled = bind(
            "actuation", a, command, velocity, joints, to_effort, to_speed, self._effort, self._velocity, self._coulomb,
            self._loss, np.zeros(2 * a) if self._damping is None else self._damping, to_joint, self._pass,
            self.saturated, self.saturations, self._applied,
            np.array([self._sees_velocity, self._rubs, self._passes]),
        )  # fmt: skip

    def reset(self) -> None:
        """Forgets past commands and the counts."""
        self._row = -1
        self.saturations[:] = 0
        self.saturated[:] = False

    def apply(self, command: Array, position: Array, velocity: Array) -> Array:
        """The efforts that a command produces at the joints.

        Args:
            command: (n) after the joint limits [N m or N where it is an effort].
            position, velocity: (n) measured.

        Returns:
            (n) the efforts at the joints; entries of other joints as in `command`. Valid until the next call, and
            `command` itself if no actuator changes it.
        """
        if self.ideal:
            return command
        if self._seen_arrays[0] is not command or self._seen_arrays[1] is not velocity:
            self._look(command, velocity)
        if self._compiled is not None:
            return self._applied if self._compiled() else command
        n = len(command)
        seen = self._seen
        if self._sees_velocity:
            seen[:n], seen[n:] = command, velocity
        else:
            seen = command
        asked, within = self._asked, self._within
        np.matmul(self._to_actuator, seen, out=asked)
        if not self._rubs and not self._waits:
            np.abs(asked, out=self._size)
            np.less_equal(self._size, self._bound, out=within)
            if np.count_nonzero(within) == len(within):
                self.saturated.fill(False)
                return command
        wanted, speed = self._asked_effort, self._asked_speed
        if self._waits:
            wanted = self._delayed(wanted)
        given = self._limited(wanted, speed)
        if self._rubs:
            given = self._rubbed(given, speed, position)
        np.matmul(self._to_joint, given, out=self._applied)
        if self._passes:
            np.multiply(command, self._pass, out=self._passed)
            np.add(self._applied, self._passed, out=self._applied)
        return self._applied

    def _delayed(self, wanted: Array) -> Array:
        """The effort commanded `latency` ticks ago; before the first tick, that of the first."""
        rows, a = self._past.shape
        if self._row < 0:
            self._past[:] = wanted
            self._at[:] = np.arange(a) + (-self._latency % rows) * a
            self._row = 0
        self._past[self._row] = wanted
        self._wanted[:] = self._past_flat[self._at]
        self._row = (self._row + 1) % rows
        np.add(self._at, a, out=self._at)
        np.remainder(self._at, rows * a, out=self._at)
        return self._wanted

    def _limited(self, wanted: Array, speed: Array) -> Array:
        """Clamped to the limits of the motors; ticks with saturation are counted."""
        most, least, given = self._effort, self._pull, self._given
        if len(speed):
            np.abs(speed, out=self._friction)
            np.greater(self._friction, self._velocity, out=self._fast)
            if np.count_nonzero(self._fast):
                most, least = self._most, self._least
                most[:], least[:] = self._effort, self._pull
                np.copyto(most, 0.0, where=self._fast & (speed > 0.0))
                np.copyto(least, 0.0, where=self._fast & (speed < 0.0))
        np.minimum(wanted, most, out=given)
        np.maximum(given, least, out=given)
        np.not_equal(given, wanted, out=self.saturated)
        if np.count_nonzero(self.saturated):
            np.add(self.saturations, self.saturated, out=self.saturations)
        return given

    def _rubbed(self, given: Array, speed: Array, position: Array) -> Array:
        """The efforts minus friction and losses."""
        if self._damping is None:
            self._damping = self._stable_damping(position)
            self._look(*self._seen_arrays)
        damping, a = self._damping, len(given)
        most, least, friction = self._most, self._least, self._friction
        np.abs(given, out=most)
        np.multiply(most, self._loss, out=most)
        np.add(most, self._coulomb, out=most)
        np.negative(most, out=least)
        np.multiply(speed, damping[:a], out=friction)
        np.minimum(friction, most, out=friction)
        np.maximum(friction, least, out=friction)
        np.subtract(given, friction, out=given)
        np.multiply(speed, damping[a:], out=friction)
        np.subtract(given, friction, out=given)
        return given

    def _stable_damping(self, position: Array) -> Array:
        """g and b (2 a): the friction per velocity that is stable for a tick at `position`.

        Efforts on the actuators change their velocities by L = T M^-1 T^T period per unit in a tick, M the mass matrix
        with rotors and velocity_a = T velocity_j. With m the sums of the rows of |L| and g = STIFFNESS / m, no
        eigenvalue of L diag(g) is above STIFFNESS (Gershgorin), and with b / (1 + b m), nearly b where that is small,
        none of the whole above 1 + STIFFNESS: no friction gives energy.
        """
        from manipcli.model.kinematics import Kinematics

        M = Kinematics(self._robot).mass_matrix(np.asarray(position, dtype=np.float64))
        T = np.zeros((len(self.names), len(M)))
        T[:, list(self.drivetrain.joints)] = self.drivetrain.transmission.maps.actuator_motion
        m = np.abs(T @ np.linalg.solve(M, T.T)).sum(axis=1) * self._period
        return np.concatenate((STIFFNESS / m, self._viscous / (1.0 + self._viscous * m)))
