"""Transmissions of an unknown type."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.core.text import did_you_mean
from manipcli.model.check import Check, Subject
from manipcli.model.control_tags import SIZES, transmissions
from manipcli.model.samples import one_joint, transmission


def _find(subject: Subject) -> Iterator[Finding]:
    for found in transmissions(subject):
        if found.type not in SIZES:
            kind = found.element.first("type") or found.element.first("plugin") or found.element
            message = f"transmission '{found.name}' is of the unknown type '{found.type}'"
            hint = did_you_mean(found.type, list(SIZES)) or "known: " + ", ".join(SIZES)
            yield Finding("URDF310", message, kind.place, hint, "warning")


CHECK = Check(
    code="URDF310",
    name="transmission-type",
    tier="readiness",
    severity="warning",
    summary="A transmission is of a type that is not known",
    reason="It is left out: commands go to the joint as if there were no gear.",
    bad=one_joint(more=transmission(kind="Simpletransmission")),
    find=_find,
)
