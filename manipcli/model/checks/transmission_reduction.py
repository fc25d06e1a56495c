"""ROS 1 transmissions without a reduction."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.control_tags import transmissions
from manipcli.model.samples import GEARED, one_joint, transmission


def _find(subject: Subject) -> Iterator[Finding]:
    for found in transmissions(subject):
        for actuator in found.actuators if found.ros1 else ():
            if actuator.first("mechanicalReduction") is None:
                name = actuator.attributes.get("name", "")
                message = f"transmission '{found.name}': actuator '{name}' has no <mechanicalReduction>"
                yield Finding(
                    "URDF316", message, actuator.place, "<mechanicalReduction>1</mechanicalReduction>", "warning"
                )


CHECK = Check(
    code="URDF316",
    name="transmission-reduction",
    tier="readiness",
    severity="warning",
    summary="A ROS 1 transmission states no reduction at its actuator",
    reason=(
        "ros_control wants <mechanicalReduction> there and does not load the transmission without it; here it "
        "counts as 1."
    ),
    bad=one_joint(more=transmission(GEARED + '<actuator name="m"/>')),
    find=_find,
)
