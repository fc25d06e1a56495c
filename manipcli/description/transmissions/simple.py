"""Simple transmission: one actuator and one joint with a gear between them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from manipcli.description.elements import TransmissionTag
from manipcli.description.transmission import Compat, Maps, Transmission, TransmissionMember, finite, nonzero


@dataclass(frozen=True)
class SimpleTransmission(Transmission):
    """One actuator and one joint, applied elementwise to arrays, as in ros_control and ros2_control.

    position_j = position_a / n + offset;  velocity_j = velocity_a / n;  effort_j = n effort_a.

    Attributes:
        reduction: n, actuator revolutions per joint revolution; not 0; negative reverses the direction.
        offset: joint position at actuator position 0 [rad or m].

    Raises:
        InvalidArgument: a reduction of 0, or a number that is not finite.
    """

    reduction: float = 1.0
    offset: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "reduction", nonzero("reduction", (self.reduction,), 1)[0])
        object.__setattr__(self, "offset", finite("offset", (self.offset,), 1)[0])

    @cached_property
    def maps(self) -> Maps:
        n = self.reduction
        return Maps.of(
            joint_motion=[[1.0 / n]],
            actuator_motion=[[n]],
            joint_effort=[[n]],
            actuator_effort=[[1.0 / n]],
            offset=[self.offset],
        )


def _of(tag: TransmissionTag, compat: Compat) -> SimpleTransmission:
    """A tag has its reduction at the actuator (ROS 1) or at the joint (ros2_control); the other is 1."""
    return SimpleTransmission(
        reduction=tag.joint_reductions[0] * tag.actuator_reductions[0], offset=tag.joint_offsets[0]
    )


SIMPLE = TransmissionMember(name="simple", type="SimpleTransmission", size=1, of=_of)
