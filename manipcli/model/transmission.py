"""The contract of transmissions, and the simple one: a gear between one actuator and one joint.

Position, velocity and effort change by different rules; what every transmission keeps is power:
effort_j velocity_j = effort_a velocity_a.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, Protocol

from manipcli.core.errors import Finding, InvalidInput
from manipcli.core.geometry import Array
from manipcli.model.robot import TransmissionTag

Quantity = Literal["position", "velocity", "effort"]


class Transmission(Protocol):
    """Maps actuators to joints and back; the last axis of `values` runs over them."""

    def actuator_to_joint(self, quantity: Quantity, values: Array) -> Array: ...

    def joint_to_actuator(self, quantity: Quantity, values: Array) -> Array: ...


@dataclass(frozen=True, slots=True)
class SimpleTransmission:
    """One actuator, one joint (or many such pairs, elementwise), as in ros2_control.

    position_j = position_a / reduction + offset;  velocity_j = velocity_a / reduction;  effort_j = reduction effort_a.

    Attributes:
        reduction: actuator turns a joint turn; negative turns the other way; not 0.
        offset: joint position where the actuator is at 0 [rad or m].

    Raises:
        InvalidInput: a reduction of 0, or a number that is not finite.
    """

    reduction: float = 1.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        if self.reduction == 0.0 or not math.isfinite(self.reduction):
            message = f"a reduction of {self.reduction:g} is not possible; expected a number that is not 0"
            raise InvalidInput([Finding("TRAN001", message)])
        if not math.isfinite(self.offset):
            raise InvalidInput([Finding("TRAN001", f"a joint offset of {self.offset:g} is not possible")])

    @staticmethod
    def of(tag: TransmissionTag) -> SimpleTransmission:
        """From a tag with one joint and one actuator.

        ROS 1 writes the reduction at the actuator, ros2_control at the joint; the other is 1.

        Raises:
            InvalidInput: more than one joint or actuator.
        """
        if len(tag.joints) != 1 or len(tag.actuators) > 1:
            message = f"transmission '{tag.name}': a simple one has one joint and one actuator"
            raise InvalidInput([Finding("TRAN002", f"{message}, not {len(tag.joints)} and {len(tag.actuators)}")])
        return SimpleTransmission(
            reduction=tag.joint_reductions[0] * math.prod(tag.actuator_reductions), offset=tag.joint_offsets[0]
        )

    def actuator_to_joint(self, quantity: Quantity, values: Array) -> Array:
        """Values of the joint for values of the actuator."""
        if quantity == "effort":
            return values * self.reduction
        moved = values / self.reduction
        return moved + self.offset if quantity == "position" else moved

    def joint_to_actuator(self, quantity: Quantity, values: Array) -> Array:
        """Values of the actuator for values of the joint."""
        if quantity == "effort":
            return values / self.reduction
        return (values - self.offset) * self.reduction if quantity == "position" else values * self.reduction
