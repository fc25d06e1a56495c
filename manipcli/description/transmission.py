"""The transmission seam: linear maps between actuators and the joints that they drive.

A transmission conserves power: with velocity_j = M velocity_a, effort_j = E effort_a and E = M^-T,
effort_j . velocity_j = effort_a . velocity_a.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
import numpy.typing as npt

from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array, frozen
from manipcli.core.text import did_you_mean

if TYPE_CHECKING:
    from manipcli.description.elements import TransmissionTag

Quantity = Literal["position", "velocity", "effort"]
Compat = Literal["ros1", "ros2"]


@dataclass(frozen=True, slots=True)
class Maps:
    """The matrices of a transmission with k actuators and k joints, or of several in blocks.

    Attributes:
        joint_motion: (k, k) M: velocity_j = M velocity_a, position_j = M position_a + offset.
        actuator_motion: (k, k) M^-1: velocity_a = M^-1 velocity_j, position_a = M^-1 (position_j - offset).
        joint_effort: (k, k) E: effort_j = E effort_a.
        actuator_effort: (k, k) E^-1.
        offset: (k) joint positions at actuator positions 0 [rad or m].
    """

    joint_motion: Array
    actuator_motion: Array
    joint_effort: Array
    actuator_effort: Array
    offset: Array

    @staticmethod
    def of(
        *,
        joint_motion: npt.ArrayLike,
        actuator_motion: npt.ArrayLike,
        joint_effort: npt.ArrayLike,
        actuator_effort: npt.ArrayLike,
        offset: npt.ArrayLike,
    ) -> Maps:
        """Read-only copies."""
        arrays = (joint_motion, actuator_motion, joint_effort, actuator_effort, offset)
        return Maps(*(frozen(array) for array in arrays))


class Transmission(ABC):
    """k actuators that drive k joints, both in the order of their roles.

    `values` are numbers, lists or arrays whose last axis (k) runs over the actuators or joints; leading axes (such as
    time) are kept. A transmission with one actuator takes any shape, including a number, and maps each element.
    """

    @cached_property
    @abstractmethod
    def maps(self) -> Maps:
        """The matrices."""

    @property
    def size(self) -> int:
        """k, the number of actuators and of joints."""
        return len(self.maps.offset)

    def actuator_to_joint(self, quantity: Quantity, values: npt.ArrayLike) -> Array:
        """Joint values from actuator values.

        Args:
            quantity: "position" [rad or m], "velocity" [rad/s or m/s] or "effort" [N m or N].
            values: (..., k) of the actuators.

        Returns:
            (..., k) of the joints, a new array.

        Raises:
            InvalidArgument: unknown quantity, or the last axis does not have length k.
        """
        maps = self.maps
        mapped = self._mapped(maps.joint_effort if _is_effort(quantity) else maps.joint_motion, values)
        return self._plain(mapped + maps.offset) if quantity == "position" else self._plain(mapped)

    def joint_to_actuator(self, quantity: Quantity, values: npt.ArrayLike) -> Array:
        """Actuator values from joint values; arguments and errors as in `actuator_to_joint`."""
        maps = self.maps
        matrix = maps.actuator_effort if _is_effort(quantity) else maps.actuator_motion
        if quantity == "position":
            self._refuse_shape(values)
            shifted = np.asarray(values, dtype=np.float64)
            values = shifted - (maps.offset[0] if self.size == 1 else maps.offset)
        return self._plain(self._mapped(matrix, values))

    def _mapped(self, matrix: Array, values: npt.ArrayLike) -> Array:
        self._refuse_shape(values)
        given = np.asarray(values, dtype=np.float64)
        if self.size == 1:
            return np.asarray(given[..., np.newaxis] * matrix[0, 0])
        return np.asarray(given @ matrix.T)

    def _plain(self, mapped: Array) -> Array:
        """Without the axis that `_mapped` adds for a single actuator."""
        return np.asarray(mapped[..., 0]) if self.size == 1 else mapped

    def _refuse_shape(self, values: npt.ArrayLike) -> None:
        shape = np.shape(values)
        if self.size > 1 and (not shape or shape[-1] != self.size):
            message = f"values have shape {shape}; expected {self.size} along the last axis, one per joint or actuator"
            raise InvalidArgument("TRAN003", message)


def _is_effort(quantity: str) -> bool:
    if quantity not in get_args(Quantity):
        known = get_args(Quantity)
        message = f"unknown quantity '{quantity}'; known: {', '.join(known)}"
        raise InvalidArgument("TRAN004", message, hint=did_you_mean(quantity, known))
    return quantity == "effort"


def nonzero(name: str, values: Sequence[float], count: int) -> tuple[float, ...]:
    """`count` finite numbers other than 0, for reductions.

    Raises:
        InvalidArgument: wrong count, not finite, or 0.
    """
    checked = finite(name, values, count)
    for value in checked:
        if value == 0.0:
            raise InvalidArgument("TRAN001", f"{name} = 0 is not allowed; expected a number other than 0")
    return checked


def finite(name: str, values: Sequence[float], count: int) -> tuple[float, ...]:
    """`count` finite numbers.

    Raises:
        InvalidArgument: wrong count, or not finite.
    """
    try:
        checked = tuple(float(value) for value in values)
    except (TypeError, ValueError):
        message = f"{name} = {values!r}: expected {count} number{'s' * (count != 1)}"
        raise InvalidArgument("TRAN001", message) from None
    if len(checked) != count:
        raise InvalidArgument(
            "TRAN001", f"{name} has {len(checked)} number{'s' * (len(checked) != 1)}; expected {count}"
        )
    for value in checked:
        if not math.isfinite(value):
            raise InvalidArgument("TRAN001", f"{name} = {value:g} is not allowed; expected a finite number")
    return checked


@dataclass(frozen=True, slots=True)
class TransmissionMember:
    """A kind of transmission.

    Attributes:
        name: in robot files: "simple".
        type: in descriptions, without the package: "SimpleTransmission".
        size: number of joints and of actuators.
        of: (tag, compat) -> the transmission of a tag with `size` joints and actuators in role order.
    """

    name: str
    type: str
    size: int
    of: Callable[[TransmissionTag, Compat], Transmission]
