"""Tags for Gazebo."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.samples import one_joint


def _find(subject: Subject) -> Iterator[Finding]:
    """One finding for all of them."""
    tags = subject.description.root.all("gazebo")
    if tags:
        many = f"{len(tags)} <gazebo> elements are" if len(tags) > 1 else "a <gazebo> element is"
        yield Finding("URDF330", f"{many} ignored", tags[0].place, "friction: see `friction` of the robot file", "note")


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
