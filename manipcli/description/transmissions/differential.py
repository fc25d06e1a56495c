"""Differential transmission: two actuators drive two joints by their sum and difference, as in a bevel-gear wrist."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from manipcli.description.elements import TransmissionTag
from manipcli.description.transmission import Compat, Maps, Transmission, TransmissionMember, finite, nonzero


@dataclass(frozen=True)
class DifferentialTransmission(Transmission):
    """With actuator reductions r1, r2 and joint reductions s1, s2, as in the code of ros_control and ros2_control:

        velocity_j1 = (velocity_a1 / r1 + velocity_a2 / r2) / (2 s1)      effort_j1 = s1 (r1 effort_a1 + r2 effort_a2)
        velocity_j2 = (velocity_a1 / r1 - velocity_a2 / r2) / (2 s2)      effort_j2 = s2 (r1 effort_a1 - r2 effort_a2)

    and position_j is the same map of position_a, plus offset.

    Attributes:
        actuator_reduction: r (2), not 0; negative reverses the direction.
        joint_reduction: s (2), not 0.
        joint_offset: (2) joint positions at actuator positions 0 [rad or m].

    Raises:
        InvalidArgument: a reduction of 0, a number that is not finite, or not two numbers.
    """

    actuator_reduction: Sequence[float]
    joint_reduction: Sequence[float] = (1.0, 1.0)
    joint_offset: Sequence[float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "actuator_reduction", nonzero("actuator_reduction", self.actuator_reduction, 2))
        object.__setattr__(self, "joint_reduction", nonzero("joint_reduction", self.joint_reduction, 2))
        object.__setattr__(self, "joint_offset", finite("joint_offset", self.joint_offset, 2))

    @cached_property
    def maps(self) -> Maps:
        (r1, r2), (s1, s2) = self.actuator_reduction, self.joint_reduction
        return Maps.of(
            joint_motion=[[0.5 / (s1 * r1), 0.5 / (s1 * r2)], [0.5 / (s2 * r1), -0.5 / (s2 * r2)]],
            actuator_motion=[[r1 * s1, r1 * s2], [r2 * s1, -r2 * s2]],
            joint_effort=[[s1 * r1, s1 * r2], [s2 * r1, -s2 * r2]],
            actuator_effort=[[0.5 / (r1 * s1), 0.5 / (r1 * s2)], [0.5 / (r2 * s1), -0.5 / (r2 * s2)]],
            offset=self.joint_offset,
        )


def _of(tag: TransmissionTag, compat: Compat) -> DifferentialTransmission:
    return DifferentialTransmission(tag.actuator_reductions, tag.joint_reductions, tag.joint_offsets)


DIFFERENTIAL = TransmissionMember(name="differential", type="DifferentialTransmission", size=2, of=_of)
