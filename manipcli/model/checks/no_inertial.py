"""Links with a shape and no inertial."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.rigid import elements_by_name, moved_bodies
from manipcli.model.samples import CUBE, one_joint


def _find(subject: Subject) -> Iterator[Finding]:
    """But for links that a joint moves by themselves: URDF100 tells those."""
    moved = {joint.child for joint, _ in moved_bodies(subject.parts)}
    for name, link in elements_by_name(subject.description.root, "link").items():
        shaped = link.first("visual") is not None or link.first("collision") is not None
        if shaped and link.first("inertial") is None and name not in moved:
            message = f"link '{name}' has no inertial: it counts as having no mass"
            yield Finding("URDF111", message, link.place, None, "note")


CHECK = Check(
    code="URDF111",
    name="no-inertial",
    tier="physics",
    severity="note",
    summary="A link that has a shape has no inertial; it counts as having no mass",
    reason=(
        "Fine for a base that stands still; fixed to a moving link it makes the arm lighter than it is. "
        "PyBullet would give it 1 kg."
    ),
    bad=one_joint().replace('<link name="base"/>', f'<link name="base">{CUBE}</link>'),
    find=_find,
)
