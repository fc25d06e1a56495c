"""Joints that move a link without mass."""

from collections.abc import Iterator

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.located_xml import Element
from manipcli.model.rigid import elements_by_name, moved_bodies
from manipcli.model.samples import CUBE, one_joint
from manipcli.model.urdf_numbers import finite


def _find(subject: Subject) -> Iterator[Finding]:
    """The child of a moving joint has no mass, and neither has what is fixed to it."""
    links = elements_by_name(subject.description.root, "link")
    massive = {name for name, link in links.items() if _states_mass(link)}
    for joint, body in moved_bodies(subject.parts):
        if joint.child in links and not massive.intersection(body):  # of a link that is not there enough is said
            message = f"link '{joint.child}', which joint '{joint.name}' moves, has no mass"
            hint = "state the mass and moments of inertia of the link"
            yield Finding("URDF100", message, links[joint.child].place, hint, "warning")


def _states_mass(link: Element) -> bool:
    """Also a mass that is refused for another reason, which reading tells."""
    inertial = link.first("inertial")
    mass = inertial.first("mass") if inertial is not None else None
    return inertial is not None and (mass is None or finite(mass.attributes.get("value", "").strip()) != 0.0)


CHECK = Check(
    code="URDF100",
    name="massless-joint",
    tier="physics",
    severity="warning",
    summary="A joint moves a link that has no mass",
    reason=(
        "PyBullet gives a link without an inertial a mass of 1 kg, so gravity and torques mean nothing; here an "
        "engine with physics refuses such a joint."
    ),
    bad=one_joint(tip=CUBE),
    find=_find,
)
