"""Soft limits that do not fit the limits."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.rigid import elements_by_name
from manipcli.model.samples import LIMIT, one_joint
from manipcli.model.urdf_numbers import finite


def _find(subject: Subject) -> Iterator[Finding]:
    written = elements_by_name(subject.description.root, "joint")
    for joint in subject.parts.joints:
        safety = written[joint.name].first("safety_controller") if joint.name in written else None
        if safety is None or joint.type not in ("revolute", "prismatic"):
            continue
        soft = [finite(safety.attributes.get(f"soft_{side}_limit", "0").strip()) for side in ("lower", "upper")]
        lower, upper = soft
        limits = joint.limits
        if lower is None or upper is None or limits.lower is None or limits.upper is None or lower == upper == 0.0:
            continue
        if lower > upper:
            message = f"joint '{joint.name}': the soft lower limit {lower:g} is above the soft upper limit {upper:g}"
        elif lower < limits.lower - 1e-9 or upper > limits.upper + 1e-9:
            message = (
                f"joint '{joint.name}': the soft limits {lower:g} to {upper:g} are not inside of the limits "
                f"{limits.lower:g} to {limits.upper:g}"
            )
        else:
            continue
        yield Finding("URDF107", message, safety.place, "soft limits lie inside of the limits", "warning")


CHECK = Check(
    code="URDF107",
    name="safety-limits",
    tier="physics",
    severity="warning",
    summary="The soft limits of a safety_controller lie outside of the limits, or cross",
    reason=(
        "Soft limits are there to slow a joint before its end; outside of the limits they never act, and the joint "
        "meets its hard limit at full speed."
    ),
    bad=one_joint(LIMIT + '<safety_controller soft_lower_limit="-2" soft_upper_limit="0.9" k_velocity="1"/>'),
    find=_find,
)
