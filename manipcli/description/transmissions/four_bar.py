"""Four-bar linkage transmission: two actuators and two joints, the second joint coupled to the first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import get_args

from manipcli.core.errors import InvalidArgument
from manipcli.core.text import did_you_mean
from manipcli.description.elements import TransmissionTag
from manipcli.description.transmission import Compat, Maps, Transmission, TransmissionMember, finite, nonzero


@dataclass(frozen=True)
class FourBarLinkageTransmission(Transmission):
    """With actuator reductions r1, r2 and joint reductions s1, s2:

        velocity_j1 = velocity_a1 / (s1 r1)                               effort_j1 = s1 r1 effort_a1 + r2 effort_a2
        velocity_j2 = (velocity_a2 / r2 - velocity_a1 / (s1 r1)) / s2     effort_j2 = s2 r2 effort_a2

    and position_j is the same map of position_a, plus offset. The efforts are those of ros2_control, which conserve
    power. With compat="ros1" they are those of ros_control, which do not:

        effort_j1 = s1 r1 effort_a1                             effort_j2 = s2 (r2 effort_a2 - s1 r1 effort_a1)

    Attributes:
        actuator_reduction: r (2), not 0; negative reverses the direction.
        joint_reduction: s (2), not 0.
        joint_offset: (2) joint positions at actuator positions 0 [rad or m].
        compat: the effort map, "ros2" or "ros1".

    Raises:
        InvalidArgument: a reduction of 0, a number that is not finite, not two numbers, or an unknown `compat`.
    """

    actuator_reduction: Sequence[float]
    joint_reduction: Sequence[float] = (1.0, 1.0)
    joint_offset: Sequence[float] = (0.0, 0.0)
    compat: Compat = "ros2"

    def __post_init__(self) -> None:
        object.__setattr__(self, "actuator_reduction", nonzero("actuator_reduction", self.actuator_reduction, 2))
        object.__setattr__(self, "joint_reduction", nonzero("joint_reduction", self.joint_reduction, 2))
        object.__setattr__(self, "joint_offset", finite("joint_offset", self.joint_offset, 2))
        known = get_args(Compat)
        if self.compat not in known:
            message = f"compat = {self.compat!r}; expected {' or '.join(known)}"
            raise InvalidArgument("TRAN001", message, hint=did_you_mean(str(self.compat), known))

    @cached_property
    def maps(self) -> Maps:
        (r1, r2), (s1, s2) = self.actuator_reduction, self.joint_reduction
        if self.compat == "ros2":
            joint_effort = [[s1 * r1, r2], [0.0, s2 * r2]]
            actuator_effort = [[1.0 / (s1 * r1), -1.0 / (s1 * r1 * s2)], [0.0, 1.0 / (s2 * r2)]]
        else:
            joint_effort = [[s1 * r1, 0.0], [-s2 * s1 * r1, s2 * r2]]
            actuator_effort = [[1.0 / (s1 * r1), 0.0], [1.0 / r2, 1.0 / (s2 * r2)]]
        return Maps.of(
            joint_motion=[[1.0 / (s1 * r1), 0.0], [-1.0 / (s1 * r1 * s2), 1.0 / (r2 * s2)]],
            actuator_motion=[[s1 * r1, 0.0], [r2, r2 * s2]],
            joint_effort=joint_effort,
            actuator_effort=actuator_effort,
            offset=self.joint_offset,
        )


def _of(tag: TransmissionTag, compat: Compat) -> FourBarLinkageTransmission:
    return FourBarLinkageTransmission(tag.actuator_reductions, tag.joint_reductions, tag.joint_offsets, compat)


FOUR_BAR = TransmissionMember(name="four_bar", type="FourBarLinkageTransmission", size=2, of=_of)
