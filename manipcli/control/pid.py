"""PID control law of control_toolbox, for one joint or for all joints of a controller at once."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Literal, overload

import numpy as np
import numpy.typing as npt

from manipcli.control.compiled import bind
from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array
from manipcli.description.transmission import Compat

AntiWindup = Literal["none", "back_calculation", "conditional_integration"]


class Pid:
    """u = p e + I + d de/dt, clamped to [u_min, u_max]; the integral term I is clamped to [i_min, i_max].

    `compat="ros2"`: the command is computed before I, so the integral acts one step late (forward Euler); I is stored
    with its gain, so that a change of gain makes no step. `compat="ros1"`: the integral of the error is updated first
    (backward Euler), and there is no derivative before the second error.

    Anti-windup where the command u_unsat is clamped to u: `back_calculation` adds dt (u - u_unsat) / tracking_time to
    I; `conditional_integration` keeps I while the error drives further into the clamp. With `ros1`, `none`
    clamps only the term, so the integral of the error still winds up, and `conditional_integration` clamps that
    integral itself (ROS 1's `antiwindup: true`).

    Args:
        p, i, d: gains, numbers or (n).
        u_min, u_max: bounds of the command.
        i_min, i_max: bounds of the integral term; i_min <= 0 <= i_max.
        antiwindup: see above; one word, or (n).
        tracking_time: [s] of back calculation; 0 chooses sqrt(d / i), or p / i where d is 0.
        error_deadband: errors up to this are not integrated; rad or m, 0 or more.
        compat: see above.

    Raises:
        InvalidArgument: a gain or bound that is NaN, u_min >= u_max, i_min > 0, i_max < 0, a negative tracking time or
            deadband, back calculation with `ros1` (which has none).
    """

    def __init__(
        self,
        p: npt.ArrayLike = 0.0,
        i: npt.ArrayLike = 0.0,
        d: npt.ArrayLike = 0.0,
        *,
        u_min: npt.ArrayLike = -math.inf,
        u_max: npt.ArrayLike = math.inf,
        i_min: npt.ArrayLike = -math.inf,
        i_max: npt.ArrayLike = math.inf,
        antiwindup: AntiWindup | Sequence[AntiWindup] = "none",
        tracking_time: npt.ArrayLike = 0.0,
        error_deadband: npt.ArrayLike = 0.0,
        compat: Compat = "ros2",
    ) -> None:
        words = np.atleast_1d(np.asarray(antiwindup))
        for word in words:
            if word not in ("none", "back_calculation", "conditional_integration"):
                known = "'none', 'back_calculation' or 'conditional_integration'"
                hint = "ROS 1's `antiwindup: true` is 'conditional_integration' with compat='ros1'"
                raise InvalidArgument("CTRL110", f"unknown anti-windup '{word}'; expected {known}", hint=hint)
        if compat not in ("ros1", "ros2"):
            raise InvalidArgument("CTRL110", f"compat = {compat!r}; expected 'ros1' or 'ros2'")
        if compat == "ros1" and (words == "back_calculation").any():
            raise InvalidArgument("CTRL110", "back_calculation does not exist in ROS 1", hint="use compat='ros2'")
        self._ros1 = compat == "ros1"
        self._scalar = True
        self._size = 0
        self.set_gains(
            p=p, i=i, d=d, u_min=u_min, u_max=u_max, i_min=i_min, i_max=i_max, tracking_time=tracking_time,
            error_deadband=error_deadband,
        )  # fmt: skip
        if words.size not in (1, self._size):
            raise InvalidArgument("CTRL114", f"{words.size} anti-windup values for gains of {self._size} joints")
        words = np.broadcast_to(words, (self._size,))
        self._tracks[:], self._conditional[:] = words == "back_calculation", words == "conditional_integration"
        self._any_tracks, self._any_conditional = bool(self._tracks.any()), bool(self._conditional.any())
        self._set_switches()

    def set_gains(
        self,
        p: npt.ArrayLike = 0.0,
        i: npt.ArrayLike = 0.0,
        d: npt.ArrayLike = 0.0,
        *,
        u_min: npt.ArrayLike = -math.inf,
        u_max: npt.ArrayLike = math.inf,
        i_min: npt.ArrayLike = -math.inf,
        i_max: npt.ArrayLike = math.inf,
        tracking_time: npt.ArrayLike = 0.0,
        error_deadband: npt.ArrayLike = 0.0,
    ) -> None:
        """Replace all gains and bounds, or none of them if one is invalid; the integral is kept.

        Raises:
            InvalidArgument: as the constructor; also gains for another number of joints than before.
        """
        given = {
            "p": p, "i": i, "d": d, "u_min": u_min, "u_max": u_max, "i_min": i_min, "i_max": i_max,
            "tracking_time": tracking_time, "error_deadband": error_deadband,
        }  # fmt: skip
        raw = [np.asarray(value, dtype=np.float64) for value in given.values()]
        scalar = all(value.ndim == 0 for value in raw)
        g = dict(zip(given, map(np.array, np.broadcast_arrays(*map(np.atleast_1d, raw))), strict=True))
        _check(g)
        size = g["p"].size
        if self._size not in (0, size):
            raise InvalidArgument("CTRL114", f"gains for {size} joints; this PID has {self._size}")
        if self._size == 0:
            self._scalar, self._size = scalar, size
            self._allocate(size)
        self._i[:], self._deadband[:] = g["i"], g["error_deadband"]
        self._u_min[:], self._u_max[:], self._i_min[:], self._i_max[:] = g["u_min"], g["u_max"], g["i_min"], g["i_max"]
        self._gains[:] = g["p"], g["d"]
        integrates = self._i != 0.0
        safe_i = np.where(integrates, self._i, 1.0)
        chosen = np.where(g["d"] != 0.0, np.sqrt(np.abs(g["d"] / safe_i)), np.abs(g["p"] / safe_i))
        tracking = g["tracking_time"]
        self._tracking[:] = np.where(tracking > 0.0, tracking, np.where(integrates, chosen, 0.0))
        tracks = self._tracking > 0.0
        self._inverse_tracking[:] = np.where(tracks & integrates, 1.0 / np.where(tracks, self._tracking, 1.0), 0.0)
        self._integral_min[:] = np.where(integrates, np.minimum(self._i_min / safe_i, self._i_max / safe_i), -np.inf)
        self._integral_max[:] = np.where(integrates, np.maximum(self._i_min / safe_i, self._i_max / safe_i), np.inf)
        self._has_i, self._has_d = bool(integrates.any()), bool(g["d"].any())
        self._clamps_u = bool(np.isfinite(self._u_min).any() or np.isfinite(self._u_max).any())
        self._clamps_i = bool(np.isfinite(self._i_min).any() or np.isfinite(self._i_max).any())
        self._is_pd = not (self._has_i or self._clamps_u)
        self.freeze(False)

    def _allocate(self, size: int) -> None:
        """Allocate all arrays; they are written in place from then on, because a compiled law keeps them."""
        self._gains = np.zeros((2, size))
        self._i, self._deadband, self._u_min, self._u_max, self._i_min, self._i_max = np.zeros((6, size))
        self._tracking, self._inverse_tracking, self._integral_min, self._integral_max = np.zeros((4, size))
        self._counted_above, self._unwinding = np.zeros((2, size))
        self._tracks, self._conditional = np.zeros((2, size), dtype=np.bool_)
        self._any_tracks = self._any_conditional = False
        self._term, self._integral, self._last_error, self._command = np.zeros((4, size))
        self._scratch, self._unsaturated = np.zeros((2, size))
        self._products = np.zeros((2, size))
        self._proportional, self._derivative = self._products
        self._has_last = False
        self._switches = np.zeros(8, dtype=np.bool_)

    def _set_switches(self) -> None:
        """The switches of the compiled law, in its order."""
        self._switches[:] = (
            self._is_pd, self._ros1, self._has_i, self._clamps_u, self._clamps_i, self._any_tracks,
            self._any_conditional, self._has_deadband,
        )  # fmt: skip

    @property
    def tracking_time(self) -> Array:
        """(n) [s] of back calculation, chosen ones included; 0: none."""
        return self._tracking.copy()

    @property
    def i_term(self) -> Array:
        """(n) the integral term I, in units of the command."""
        return self._term.copy()

    def freeze(self, which: npt.ArrayLike) -> None:
        """Freeze the integrals where `which` (n) is true, and no others."""
        self._counted_above[:] = np.where(which, np.inf, self._deadband)
        self._unwinding[:] = np.where(which, 0.0, self._inverse_tracking)
        self._has_deadband = bool(self._counted_above.any())
        self._set_switches()

    def reset(self, keep_integral: bool = False) -> None:
        """Clear the last error and command, and the integral, too, unless `keep_integral`."""
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
            A number, or a new array (n). NaN where the error is not finite; the integral is then kept.

        Raises:
            InvalidArgument: a negative dt, or an error of another size than the gains.
        """
        errors = np.zeros((2, self._size))
        if self._scalar and (isinstance(error, float) or np.ndim(error) == 0):
            errors[0, 0] = error
        elif np.shape(error) == (self._size,):
            errors[0] = error
        else:
            raise InvalidArgument("CTRL114", f"error of shape {np.shape(error)} for gains of {self._size} joints")
        if not dt > 0.0:
            if dt != 0.0:
                raise InvalidArgument("CTRL115", f"dt is {dt} s; expected 0 or more")
            return float(self._command[0]) if self._scalar else self._command.copy()
        if error_rate is not None:
            errors[1] = error_rate
        elif self._has_d and (self._has_last or not self._ros1):
            errors[1] = (errors[0] - self._last_error) / dt
        command = np.empty(self._size)
        if np.isfinite(errors).all():
            self.apply(errors, dt, command)
            self._last_error[:] = errors[0]
        else:
            self._apply_finite(errors, dt, command)
        self._has_last = True
        self._command = command
        return float(command[0]) if self._scalar else command

    def apply(self, errors: Array, dt: float, command: Array) -> None:
        """`update` for the control loop, in place: without checks, and without state except the integral.

        Args:
            errors: (2, n) errors and their rates, all finite.
            dt: [s] above 0.
            command: (n) is overwritten.
        """
        np.multiply(self._gains, errors, self._products)
        np.add(self._proportional, self._derivative, command)
        if self._is_pd:
            return
        if self._ros1:
            self._integrate_first(errors[0], dt)
        if self._has_i:
            command += self._term
        unsaturated = command
        if self._clamps_u:
            if self._any_tracks or self._any_conditional:
                unsaturated = self._unsaturated
                unsaturated[:] = command
            np.maximum(command, self._u_min, out=command)
            np.minimum(command, self._u_max, out=command)
        if self._has_i and not self._ros1:
            self._integrate_afterwards(errors[0], dt, command, unsaturated)

    def loop(
        self, errors: Array, command: Array, *, feed: Array, effort: Array | None = None
    ) -> Callable[[float, bool], object]:
        """`apply` on these arrays, in one compiled call if possible.

        Args:
            errors: (2, n) as for `apply`.
            command: (n) is overwritten.
            feed: (n) feed-forward.
            effort: (n) largest command; None: unlimited.

        Returns:
            (dt, fed) -> None: the command of the next `dt` [s], plus `feed` if `fed`, clamped to -+ `effort`. The
            arrays may change between two calls.
        """
        n = self._size
        most = np.full(n, np.inf) if effort is None else effort
        compiled = bind(
            "pid", n, errors, self._gains, self._i, self._counted_above, self._u_min, self._u_max, self._i_min,
            self._i_max, self._tracks, self._unwinding, self._conditional, self._integral_min, self._integral_max,
            self._term, self._integral, feed, most, command, self._switches,
        )  # fmt: skip
        if compiled is not None:
            return compiled

        def law(dt: float, fed: bool) -> None:
            self.apply(errors, dt, command)
            if fed:
                np.add(command, feed, out=command)
            if effort is not None:
                np.maximum(command, -effort, out=command)
                np.minimum(command, effort, out=command)

        return law

    def _integrate_first(self, e: Array, dt: float) -> None:
        """ROS 1: backward Euler, on the integral of the error."""
        integral = self._integral
        integral += dt * self._counted(e)
        if self._any_conditional:
            bounded = np.minimum(np.maximum(integral, self._integral_min), self._integral_max)
            integral[self._conditional] = bounded[self._conditional]
        np.minimum(np.maximum(self._i * integral, self._i_min), self._i_max, out=self._term)

    def _integrate_afterwards(self, e: Array, dt: float, command: Array, unsaturated: Array) -> None:
        """ROS 2: forward Euler, on the term."""
        scratch, term = self._scratch, self._term
        np.multiply(self._i, self._counted(e), out=scratch)
        if self._any_tracks:
            scratch += self._tracks * (command - unsaturated) * self._unwinding
        if self._any_conditional:
            scratch[self._conditional & (command != unsaturated) & (e * unsaturated > 0.0)] = 0.0
        scratch *= dt
        term += scratch
        if self._clamps_i:
            np.maximum(term, self._i_min, out=term)
            np.minimum(term, self._i_max, out=term)

    def _counted(self, e: Array) -> Array:
        """The errors that are integrated."""
        return np.where(np.abs(e) > self._counted_above, e, 0.0) if self._has_deadband else e

    def _apply_finite(self, errors: Array, dt: float, command: Array) -> None:
        """NaN for the joints whose error is not finite, with their state kept; `apply` for the others."""
        bad = ~np.isfinite(errors).all(axis=0)
        kept = self._term[bad], self._integral[bad], self._last_error[bad]
        safe = np.where(bad, 0.0, errors)
        self.apply(safe, dt, command)
        self._last_error[:] = safe[0]
        self._term[bad], self._integral[bad], self._last_error[bad] = kept
        command[bad] = np.nan


def _check(g: dict[str, Array]) -> None:
    """Raise InvalidArgument for invalid gains and bounds."""
    for name, value in g.items():
        bound = name in ("u_min", "u_max", "i_min", "i_max")
        if np.isnan(value).any() or not (bound or np.isfinite(value).all()):
            raise InvalidArgument("CTRL110", f"{name} is {value.tolist()}; expected finite numbers")
    if (g["u_min"] >= g["u_max"]).any():
        raise InvalidArgument("CTRL111", f"u_min {g['u_min'].tolist()} is not below u_max {g['u_max'].tolist()}")
    if (g["i_min"] > 0.0).any() or (g["i_max"] < 0.0).any():
        message = f"i_min {g['i_min'].tolist()}, i_max {g['i_max'].tolist()}: 0 is not between them"
        raise InvalidArgument("CTRL112", message)
    for name in ("tracking_time", "error_deadband"):
        if (g[name] < 0.0).any():
            raise InvalidArgument("CTRL113", f"{name} {g[name].tolist()} is negative")
