"""The PID law of control_toolbox, for one joint or for all joints of a controller at once."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal, overload

import numpy as np
import numpy.typing as npt

from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array

AntiWindup = Literal["none", "back_calculation", "conditional_integration"]
Compat = Literal["ros1", "ros2"]
Step = Callable[[Array, float, Array | None], Array]


class Pid:
    """u = p e + I + d de/dt, clamped to [u_min, u_max]; the integral term I is clamped to [i_min, i_max].

    `compat="ros2"`: the command is computed first and I afterwards, so the integral acts one step late (forward Euler);
    I is stored with its gain, so that a change of gain makes no step. `compat="ros1"`: the integral of the error is
    updated first (backward Euler), and there is no derivative before a second error is known.

    Anti-windup where the command u_unsat is clamped to u: `back_calculation` adds dt (u - u_unsat) / tracking_time to
    I; `conditional_integration` leaves I alone while the error drives further into the clamp. With `ros1`, `none`
    clamps only the term, so the integral of the error still winds up, and `conditional_integration` clamps that
    integral itself (ROS 1's `antiwindup: true`).

    Args:
        p, i, d: gains, numbers or (n).
        u_min, u_max: bounds of the command.
        i_min, i_max: bounds of the integral term; i_min <= 0 <= i_max.
        antiwindup: see above.
        tracking_time: [s] of back calculation; 0 chooses sqrt(d / i), or p / i where d is 0.
        compat: see above.

    Raises:
        InvalidArgument: a gain or bound that is NaN, u_min >= u_max, i_min > 0, i_max < 0, a negative tracking time,
            back calculation with `ros1` (which has none).
    """

    def __init__(
        self,
        *,
        p: npt.ArrayLike = 0.0,
        i: npt.ArrayLike = 0.0,
        d: npt.ArrayLike = 0.0,
        u_min: npt.ArrayLike = -math.inf,
        u_max: npt.ArrayLike = math.inf,
        i_min: npt.ArrayLike = -math.inf,
        i_max: npt.ArrayLike = math.inf,
        antiwindup: AntiWindup = "none",
        tracking_time: npt.ArrayLike = 0.0,
        compat: Compat = "ros2",
    ) -> None:
        if antiwindup not in ("none", "back_calculation", "conditional_integration"):
            raise InvalidArgument("CTRL110", f"unknown anti-windup '{antiwindup}'")
        if compat == "ros1" and antiwindup == "back_calculation":
            raise InvalidArgument("CTRL110", "back_calculation does not exist in ROS 1", hint="use compat='ros2'")
        self._antiwindup = antiwindup
        self._ros1 = compat == "ros1"
        self._scalar = True
        self._size = 0
        self.set_gains(p=p, i=i, d=d, u_min=u_min, u_max=u_max, i_min=i_min, i_max=i_max, tracking_time=tracking_time)

    def set_gains(
        self,
        *,
        p: npt.ArrayLike = 0.0,
        i: npt.ArrayLike = 0.0,
        d: npt.ArrayLike = 0.0,
        u_min: npt.ArrayLike = -math.inf,
        u_max: npt.ArrayLike = math.inf,
        i_min: npt.ArrayLike = -math.inf,
        i_max: npt.ArrayLike = math.inf,
        tracking_time: npt.ArrayLike = 0.0,
    ) -> None:
        """Replaces all gains and bounds, or none of them when one is invalid; the integral is kept.

        Raises:
            InvalidArgument: as the constructor; also gains for another number of joints than before.
        """
        raw = [np.asarray(v, dtype=np.float64) for v in (p, i, d, u_min, u_max, i_min, i_max, tracking_time)]
        names = ("p", "i", "d", "u_min", "u_max", "i_min", "i_max", "tracking_time")
        scalar = all(v.ndim == 0 for v in raw)
        g = [np.array(v) for v in np.broadcast_arrays(*(np.atleast_1d(v) for v in raw))]
        for name, value in zip(names, g, strict=True):
            if np.isnan(value).any() or (name in ("p", "i", "d", "tracking_time") and not np.isfinite(value).all()):
                raise InvalidArgument("CTRL110", f"{name} is {value.tolist()}; expected finite numbers")
        if (g[3] >= g[4]).any():
            raise InvalidArgument("CTRL111", f"u_min {g[3].tolist()} is not below u_max {g[4].tolist()}")
        if (g[5] > 0.0).any() or (g[6] < 0.0).any():
            raise InvalidArgument("CTRL112", f"i_min {g[5].tolist()}, i_max {g[6].tolist()}: 0 is not between")
        if (g[7] < 0.0).any():
            raise InvalidArgument("CTRL113", f"tracking_time {g[7].tolist()} is negative")
        if self._size not in (0, g[0].size):
            raise InvalidArgument("CTRL114", f"gains for {g[0].size} joints; this PID has {self._size}")
        self._p, self._i, self._d, self._u_min, self._u_max, self._i_min, self._i_max, tracking = g
        if self._size == 0:
            self._scalar, self._size = scalar, g[0].size
            self._term, self._integral, self._last_error, self._command, self._scratch = np.zeros((5, self._size))
            self._has_last = False
        integrates = self._i != 0.0
        safe_i = np.where(integrates, self._i, 1.0)
        chosen = np.where(self._d != 0.0, np.sqrt(np.abs(self._d / safe_i)), np.abs(self._p / safe_i))
        self._tracking = np.where(tracking > 0.0, tracking, np.where(integrates, chosen, 0.0))
        tracks = self._tracking > 0.0
        self._inverse_tracking = np.where(tracks, 1.0 / np.where(tracks, self._tracking, 1.0), 0.0)
        self._integral_min = np.where(integrates, np.minimum(self._i_min / safe_i, self._i_max / safe_i), -np.inf)
        self._integral_max = np.where(integrates, np.maximum(self._i_min / safe_i, self._i_max / safe_i), np.inf)
        self._has_i, self._has_d = bool(integrates.any()), bool(self._d.any())
        self._clamps_u = bool(np.isfinite(self._u_min).any() or np.isfinite(self._u_max).any())
        self._clamps_i = bool(np.isfinite(self._i_min).any() or np.isfinite(self._i_max).any())

    @property
    def tracking_time(self) -> Array:
        """(n) [s] of back calculation, chosen ones included; 0: none."""
        return self._tracking.copy()

    @property
    def i_term(self) -> Array:
        """(n) the integral term I, in units of the command."""
        return self._term.copy()

    def reset(self, keep_integral: bool = False) -> None:
        """Forgets the last error and command, and the integral too unless `keep_integral`."""
        self._has_last = False
        self._last_error[:] = 0.0
        self._command = np.zeros(self._size)
        if not keep_integral:
            self._term[:] = 0.0
            self._integral[:] = 0.0

    @overload
    def update(self, error: float, dt: float, error_rate: float | None = None) -> float: ...
    @overload
    def update(self, error: Array, dt: float, error_rate: Array | None = None) -> Array: ...
    def update(self, error: float | Array, dt: float, error_rate: float | Array | None = None) -> float | Array:
        """The command for `error` (desired minus measured) over the next `dt` [s].

        Args:
            error: a number, or (n) as the gains; rad or m.
            dt: [s]; 0 returns the command before.
            error_rate: its derivative; by default (error - last error) / dt, the last error being 0 at first.

        Returns:
            A number, or a new array (n). NaN where the error is not finite, whose integral is then left alone.

        Raises:
            InvalidArgument: a negative dt, or an error of another size than the gains.
        """
        if self._scalar:
            e = np.array([error], dtype=np.float64)
            rate = None if error_rate is None else np.array([error_rate], dtype=np.float64)
        else:
            e, rate = np.asarray(error), None if error_rate is None else np.asarray(error_rate)
        if e.shape != (self._size,):
            raise InvalidArgument("CTRL114", f"an error of shape {np.shape(error)} for gains of {self._size} joints")
        if not dt > 0.0:
            if dt != 0.0:
                raise InvalidArgument("CTRL115", f"dt is {dt} s; expected a time that is not negative")
            return float(self._command[0]) if self._scalar else self._command.copy()
        if rate is None and self._has_d:
            rate = (e - self._last_error) / dt if self._has_last or not self._ros1 else np.zeros(self._size)
        step = self._step_ros1 if self._ros1 else self._step
        # Infinity times 0 is NaN too, so one product tells whether everything is finite; overflow is sorted out there.
        finite = math.isfinite(e.dot(e if rate is None else rate))
        command = step(e, dt, rate) if finite else self._masked(step, e, dt, rate)
        return float(command[0]) if self._scalar else command

    def _step(self, e: Array, dt: float, rate: Array | None) -> Array:
        scratch = self._scratch
        command = self._p * e
        if rate is not None:
            np.multiply(self._d, rate, out=scratch)
            command += scratch
        if self._has_i:
            command += self._term
        unsaturated = command
        if self._clamps_u:
            command = np.minimum(np.maximum(unsaturated, self._u_min), self._u_max)
        if self._has_i:
            np.multiply(self._i, e, out=scratch)
            if self._antiwindup == "back_calculation":
                scratch += (command - unsaturated) * self._inverse_tracking
            elif self._antiwindup == "conditional_integration":
                scratch[(command != unsaturated) & (e * unsaturated > 0.0)] = 0.0
            scratch *= dt
            term = self._term
            term += scratch
            if self._clamps_i:
                np.maximum(term, self._i_min, out=term)
                np.minimum(term, self._i_max, out=term)
            if self._antiwindup == "back_calculation":
                term[self._i == 0.0] = 0.0
        return self._remember(e, command)

    def _step_ros1(self, e: Array, dt: float, rate: Array | None) -> Array:
        integral = self._integral
        integral += dt * e
        if self._antiwindup == "conditional_integration":
            np.minimum(np.maximum(integral, self._integral_min), self._integral_max, out=integral)
        np.minimum(np.maximum(self._i * integral, self._i_min), self._i_max, out=self._term)
        command = self._p * e + self._term
        if rate is not None:
            command += self._d * rate
        command = np.minimum(np.maximum(command, self._u_min), self._u_max)
        return self._remember(e, command)

    def _masked(self, step: Step, e: Array, dt: float, rate: Array | None) -> Array:
        """NaN for the joints whose error is not finite, their state kept; the others as ever."""
        bad = ~np.isfinite(e)
        if rate is not None:
            bad |= ~np.isfinite(rate)
        kept = [self._term[bad], self._integral[bad], self._last_error[bad]]
        command = step(np.where(bad, 0.0, e), dt, None if rate is None else np.where(bad, 0.0, rate)).copy()
        self._term[bad], self._integral[bad], self._last_error[bad] = kept
        command[bad] = np.nan
        return command

    def _remember(self, e: Array, command: Array) -> Array:
        self._last_error[:] = e
        self._has_last = True
        self._command = command
        return command
