"""Limits of position on continuous joints."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.samples import one_joint
from manipcli.model.urdf_numbers import finite


def _find(subject: Subject) -> Iterator[Finding]:
    for joint in subject.description.root.all("joint"):
        limit = joint.first("limit")
        if limit is None or joint.attributes.get("type") != "continuous":
            continue
        stated = [
            key for key in ("lower", "upper") if finite(limit.attributes.get(key, "0").strip()) not in (0.0, None)
        ]
        if stated:
            shown = " and ".join(f"{key}={limit.attributes[key].strip()}" for key in stated)
            message = f"joint '{joint.attributes.get('name', '')}' is continuous; {shown} is ignored"
            yield Finding("URDF106", message, limit.place, "make it revolute where the limits are meant", "note")


CHECK = Check(
    code="URDF106",
    name="continuous-limits",
    tier="physics",
    severity="note",
    summary="A continuous joint states lower and upper limits",
    reason="They are ignored: a joint with limits is revolute.",
    bad=one_joint(kind="continuous"),
    find=_find,
)
