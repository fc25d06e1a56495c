"""Joint limiter: saturates the commands of all joints once per tick, and counts the saturations.

Unlike in ros2_control, a joint that is measured beyond its position limits is not an error: a simulation measures
exactly, so something pushed the joint there (a contact, a soft stop), and it can still return. A command or a
measurement that is not finite is an error, and names the joint.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from manipcli.control.command import JointCommand, Mode
from manipcli.control.compiled import Run, bind
from manipcli.control.limit_laws import LimitArrays, limit_acceleration, limit_effort, limit_position, limit_velocity
from manipcli.control.saturation import (
    ACCELERATION,
    EFFORT,
    KINDS,
    POSITION,
    VELOCITY,
    Rows,
    Saturation,
    Window,
    rows_of,
)
from manipcli.core.errors import ExitCode, ManipcliError
from manipcli.core.geometry import Array
from manipcli.description.elements import JointLimits

SLACK = 1e-3
"""Relative, on velocity and acceleration limits of positions: a plan that reaches a limit passes unchanged."""
_EFFORTS: Rows = slice(POSITION, EFFORT + 1), slice(None)


class NotFinite(ManipcliError):
    """A command or a measured value is not finite; names the joint."""

    exit_code: ClassVar[ExitCode] = ExitCode.FAILED
    code: ClassVar[str] = "CTRL192"

    def __init__(self, joint: str, what: str, value: float) -> None:
        self.joint = joint
        super().__init__(f"joint '{joint}': the {what} is {value:g}")


class _Efforts:
    """Joints with an effort command or a feed-forward effort; arrays are those of all joints.

    Soft limits act here only in the mode `effort`; in the mode `position` they act on the position.
    """

    def __init__(self, modes: Sequence[Mode], limits: LimitArrays) -> None:
        commanded = np.array([mode in ("effort", "position") for mode in modes])
        obeyed = np.array([mode == "effort" for mode in modes])

        def watched(limit: Array, default: float) -> Array:
            return np.where(commanded, limit, default)

        self._limits = LimitArrays(
            lower=watched(limits.lower, -math.inf),
            upper=watched(limits.upper, math.inf),
            velocity=watched(limits.velocity, math.inf),
            acceleration=limits.acceleration,
            effort=watched(limits.effort, math.inf),
            soft_lower=watched(limits.soft_lower, -math.inf),
            soft_upper=watched(limits.soft_upper, math.inf),
            k_position=np.where(obeyed, limits.k_position, 0.0),
            k_velocity=np.where(obeyed, limits.k_velocity, 0.0),
        )
        own = self._limits
        least, most = [own.lower, -own.velocity, -own.effort], [own.upper, own.velocity, own.effort]
        kv = own.k_velocity
        self._soft = bool(kv.any())
        if self._soft:
            # No saturation while effort + kv v is within -+ kv v_max, and with kv kp q added, within kv kp soft_limit.
            self._kv, self._kv_kp = kv, kv * own.k_position
            at, near = kv > 0.0, self._kv_kp > 0.0
            with np.errstate(invalid="ignore"):  # 0 times infinity, where it does not act
                fastest = np.where(at, kv * own.velocity, math.inf)
                least += [-fastest, np.where(near, self._kv_kp * own.soft_lower, -math.inf)]
                most += [fastest, np.where(near, self._kv_kp * own.soft_upper, math.inf)]
        self._window = Window(least, most)
        self._rows = self._window.rows
        self._seen: tuple[JointCommand, Array, Array] | None = None
        self._compiled: Run | None = None

    def _look(self, command: JointCommand, position: Array, velocity: Array) -> None:
        """Bind the compiled law to these arrays, which are overwritten at every tick."""
        self._seen = command, position, velocity
        n = len(position)
        kv, kv_kp = (self._kv, self._kv_kp) if self._soft else np.zeros((2, n))
        self._compiled = bind("window", n, position, velocity, command.effort, kv, kv_kp, *self._window.arrays)

    def inside(self, command: JointCommand, position: Array, velocity: Array) -> bool:
        """Whether no command saturates."""
        seen = self._seen
        if seen is None or seen[0] is not command or seen[1] is not position or seen[2] is not velocity:
            self._look(command, position, velocity)
        if self._compiled is not None:
            return bool(self._compiled())
        rows = self._rows
        rows[0][:] = position
        rows[1][:] = velocity
        rows[2][:] = command.effort
        if self._soft:
            np.multiply(self._kv, velocity, rows[3])
            np.add(rows[3], command.effort, rows[3])
            np.multiply(self._kv_kp, position, rows[4])
            np.add(rows[4], rows[3], rows[4])
        return self._window.holds()

    def saturate(
        self,
        command: JointCommand,
        position: Array,
        velocity: Array,
        saturation: Saturation,
    ) -> None:
        """Saturate the efforts; call it if `inside` is false."""
        own = self._limits
        limited = limit_effort(
            command.effort,
            effort=own.effort,
            position=position,
            velocity=velocity,
            lower=own.lower,
            upper=own.upper,
            max_velocity=own.velocity,
            soft_lower=own.soft_lower,
            soft_upper=own.soft_upper,
            k_position=own.k_position,
            k_velocity=own.k_velocity if self._soft else None,
        )
        saturated = limited != command.effort
        if saturated.any():
            broken = self._window.broken()[:3]
            broken[:2] &= limited == 0.0  # beyond these limits, efforts that lead back are allowed
            saturation.add(_EFFORTS, saturated, broken)
            command.effort[:] = limited


class _Positions:
    """Joints in the mode `position`, with their feed-forward velocity and acceleration."""

    def __init__(self, where: npt.NDArray[np.intp], limits: LimitArrays, dt: float) -> None:
        self._where, self._dt = where, dt
        self._own = own = limits.at(where)
        self._velocity, self._acceleration = own.velocity * (1.0 + SLACK), own.acceleration * (1.0 + SLACK)
        reach, gain = self._velocity * dt, self._acceleration * dt * dt
        # A position, its step since the one before, and by how much that has grown.
        least = [np.nextafter(own.lower, -math.inf), -reach, np.full(len(where), -math.inf)]
        self._window = Window(least, [np.nextafter(own.upper, math.inf), reach, gain])
        self._soft = bool(own.k_position.any())
        self._before, self._step, self._size = np.zeros((3, len(where)))
        self._kinds = rows_of((POSITION, VELOCITY, ACCELERATION), where)
        self._by_velocity, self._by_acceleration = rows_of((VELOCITY,), where), rows_of((ACCELERATION,), where)
        self.fresh = True

    def apply(self, command: JointCommand, position: Array, velocity: Array, saturation: Saturation) -> None:
        where, (wanted, step, growth) = self._where, self._window.rows
        if self.fresh:
            self.fresh = False
            self._before[:], self._step[:] = position[where], 0.0
        wanted[:] = command.position[where]
        np.subtract(wanted, self._before, step)
        np.abs(step, growth)
        np.abs(self._step, self._size)
        np.subtract(growth, self._size, growth)
        if self._soft or not self._window.holds():
            self._saturate(command, wanted, saturation)
        else:
            self._before[:], self._step[:] = wanted, step
        for values, most, rows in (
            (command.velocity, self._velocity, self._by_velocity),
            (command.acceleration, self._acceleration, self._by_acceleration),
        ):
            if values.any():
                asked = values[where]
                limited = limit_acceleration(asked, acceleration=most)  # a velocity, too, is clamped to -+ most
                saturated = limited != asked
                if saturated.any():
                    saturation.add(rows, saturated, saturated[np.newaxis])
                    values[where] = limited

    def _saturate(self, command: JointCommand, wanted: Array, saturation: Saturation) -> None:
        own, dt = self._own, self._dt
        limited = limit_position(
            wanted,
            lower=own.lower,
            upper=own.upper,
            velocity=self._velocity,
            acceleration=self._acceleration,
            previous=self._before,
            measured_velocity=self._step / dt,
            soft_lower=own.soft_lower,
            soft_upper=own.soft_upper,
            k_position=own.k_position,
            dt=dt,
        )
        saturated = limited != wanted
        if saturated.any():
            self._window.holds()
            saturation.add(self._kinds, saturated, self._window.broken())
        np.subtract(limited, self._before, self._step)
        self._before[:] = limited
        command.position[self._where] = limited


class _Velocities:
    """Joints in the mode `velocity`."""

    def __init__(self, where: npt.NDArray[np.intp], limits: LimitArrays, dt: float) -> None:
        self._where, self._dt = where, dt
        self._own = own = limits.at(where)
        # A velocity, by how much it has changed, and where it leads.
        least = [-own.velocity, -own.acceleration * dt, own.lower]
        most = [own.velocity, own.acceleration * dt, own.upper]
        self._window = Window([np.nextafter(a, -math.inf) for a in least], [np.nextafter(b, math.inf) for b in most])
        self._soft = bool(own.k_position.any())
        self._before = np.zeros(len(where))
        self._kinds = rows_of((VELOCITY, ACCELERATION, POSITION), where)
        self.fresh = True

    def apply(self, command: JointCommand, position: Array, velocity: Array, saturation: Saturation) -> None:
        where, (wanted, change, ahead) = self._where, self._window.rows
        if self.fresh:
            self.fresh = False
            self._before[:] = velocity[where]
        wanted[:] = command.velocity[where]
        np.subtract(wanted, self._before, change)
        np.multiply(wanted, self._dt, ahead)
        np.add(ahead, position[where], ahead)
        if not self._soft and self._window.holds():
            self._before[:] = wanted
            return
        own = self._own
        limited = limit_velocity(
            wanted,
            velocity=own.velocity,
            dt=self._dt,
            position=position[where],
            lower=own.lower,
            upper=own.upper,
            acceleration=own.acceleration,
            previous=self._before,
            soft_lower=own.soft_lower,
            soft_upper=own.soft_upper,
            k_position=own.k_position,
            beyond="return",
        )
        saturated = limited != wanted
        if saturated.any():
            self._window.holds()
            saturation.add(self._kinds, saturated, self._window.broken())
        self._before[:] = limited
        command.velocity[where] = limited


class JointLimiter:
    """The limits of joints, hard and soft, on their commands.

    Effort, in the modes `effort` and `position` (added there; hard limits only): `limit_effort`. Velocity:
    `limit_velocity`, from the command before (at first, the measured velocity). Position: `limit_position`, from the
    command before (at first, the measured position); its acceleration is that of the commands, so that a lagging joint
    is not slowed down.

    Attributes:
        saturations: (n) int, number of ticks in which each joint's command was saturated.
        by_kind: (k, n) int, number of these ticks by each of the `KINDS` of limits.

    Args:
        limits: (n) of the joints.
        joints: (n) their names, for errors; by default their numbers.

    Raises:
        InvalidArgument: see `refuse_limits`.
    """

    def __init__(self, limits: Sequence[JointLimits], joints: Sequence[str] | None = None) -> None:
        n = len(limits)
        self._joints = tuple(joints) if joints is not None else tuple(map(str, range(n)))
        self._limits = LimitArrays.of(limits)
        self._version, self._dt = -1, 0.0
        brake: Mode = "brake"
        self._efforts = _Efforts((brake,) * n, self._limits)
        self._others: list[_Positions | _Velocities] = []
        self._saturation = Saturation(n)
        self.saturations = np.zeros(n, dtype=np.int64)
        self.by_kind = np.zeros((len(KINDS), n), dtype=np.int64)

    @property
    def saturated(self) -> npt.NDArray[np.bool_]:
        """(n) whether each command was saturated in the last tick."""
        return self._saturation.joints

    def reset(self) -> None:
        """Clear the previous commands and the counts."""
        for group in self._others:
            group.fresh = True
        self.saturations[:] = 0
        self.by_kind[:] = 0
        self._saturation.clear()

    def _obey(self, modes: Sequence[Mode], dt: float) -> None:
        self._efforts = _Efforts(modes, self._limits)
        positions = np.flatnonzero([mode == "position" for mode in modes])
        velocities = np.flatnonzero([mode == "velocity" for mode in modes])
        self._others = []
        if len(positions):
            self._others.append(_Positions(positions, self._limits, dt))
        if len(velocities):
            self._others.append(_Velocities(velocities, self._limits, dt))

    def apply(self, command: JointCommand, position: Array, velocity: Array, dt: float) -> None:
        """Saturate the command in place.

        Args:
            command: of this tick.
            position, velocity: (n) measured; rad or m, and per second.
            dt: [s] of a control period.

        Raises:
            NotFinite: an active command or a measured value of a joint is not finite; the command is then unchanged.
        """
        if command.version != self._version or dt != self._dt:
            self._version, self._dt = command.version, dt
            self._obey(command.modes, dt)
        saturation = self._saturation
        if saturation.any:
            saturation.clear()
        others = self._others
        if self._efforts.inside(command, position, velocity):
            if not others:
                return
            self._refuse_not_finite(command, position, velocity)
        else:
            self._refuse_not_finite(command, position, velocity)
            self._efforts.saturate(command, position, velocity, saturation)
        for group in others:
            group.apply(command, position, velocity, saturation)
        if saturation.any:
            self.saturations += saturation.joints
            self.by_kind += saturation.kinds

    def _refuse_not_finite(self, command: JointCommand, position: Array, velocity: Array) -> None:
        # A quick test by products, as infinity times 0 is NaN; an overflow only costs the exact test below.
        with np.errstate(all="ignore"):
            products = np.vdot(position, velocity) + np.vdot(command.effort, command.velocity)
            if math.isfinite(products + command.position.sum()):
                return
        obeyed: dict[Mode, tuple[tuple[str, Array], ...]] = {
            "effort": (("effort command", command.effort),),
            "velocity": (("velocity command", command.velocity),),
            "position": (
                ("position command", command.position),
                ("velocity command", command.velocity),
                ("effort command", command.effort),
            ),
        }
        measured = (("measured position", position), ("measured velocity", velocity))
        for k, mode in enumerate(command.modes):
            for what, values in (*measured, *obeyed.get(mode, ())):
                if not math.isfinite(values[k]):
                    raise NotFinite(self._joints[k], what, float(values[k]))
