"""Moving links without a collision shape."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.rigid import elements_by_name, moved_bodies
from manipcli.model.samples import CUBE, INERTIAL, one_joint


def _find(subject: Subject) -> Iterator[Finding]:
    """Of the links that a joint moves as one: those with visuals only, and where none has any shape, one with mass."""
    links = elements_by_name(subject.description.root, "link")
    for joint, body in moved_bodies(subject.parts):
        elements = [(name, links[name]) for name in body if name in links]
        solid = any(element.first("collision") is not None for _, element in elements)
        seen = [name for name, element in elements if element.first("visual") and not element.first("collision")]
        if not seen and not solid and joint.child in links and links[joint.child].first("inertial") is not None:
            seen = [joint.child]
        for name in seen:
            message = f"link '{name}' is moved by joint '{joint.name}' and has no <collision>"
            yield Finding("URDF300", message, links[name].place, "a box or cylinder is enough", "warning")


CHECK = Check(
    code="URDF300",
    name="no-collision",
    tier="readiness",
    severity="warning",
    summary="A link that moves can be seen but has no collision shape",
    reason="It passes through everything, in planning and in simulation.",
    bad=one_joint(tip=INERTIAL + CUBE.replace("collision", "visual")),
    find=_find,
)
