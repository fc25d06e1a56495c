"""Tags for Gazebo."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.core.text import did_you_mean, shorten
from manipcli.model.check import Check, Subject
from manipcli.model.samples import one_joint


def _find(subject: Subject) -> Iterator[Finding]:
    """One finding for all of them, and one for each that refers to nothing."""
    tags = subject.description.root.all("gazebo")
    if tags:
        many = f"{len(tags)} <gazebo> elements are" if len(tags) > 1 else "a <gazebo> element is"
        yield Finding("URDF330", f"{many} ignored", tags[0].place, "friction: see `friction` of the robot file", "note")
    root = subject.description.root
    known = [each.attributes.get("name", "").strip() for tag in ("link", "joint") for each in root.all(tag)]
    for tag in tags:
        name = tag.attributes.get("reference", "").strip()
        if name and name not in known:
            message = f"<gazebo> refers to '{shorten(name)}', which is no link and no joint"
            near = did_you_mean(name, known) if len(known) < 1000 else None
            yield Finding("URDF330", message, tag.place, near, "note")


CHECK = Check(
    code="URDF330",
    name="gazebo-tags",
    tier="readiness",
    severity="note",
    summary="<gazebo> elements are ignored",
    reason=(
        "What they say (friction, colours, sensors, plugins) is for Gazebo alone; the robot file says what "
        "manipcli needs."
    ),
    bad=one_joint(more='<gazebo reference="tip"/>'),
    find=_find,
)
