"""Masses and moments of inertia that no part of a robot has, or that are missing."""

from collections.abc import Iterator
from math import hypot, sqrt
from typing import Final

import numpy as np

from manipcli.core.errors import Diagnostic
from manipcli.core.text import digits
from manipcli.description.lint.check import Subject, check
from manipcli.description.lint.rigid import elements_by_name, extent, moved_bodies
from manipcli.description.lint.samples import CUBE, INERTIAL, one_joint
from manipcli.description.located_xml import Element
from manipcli.description.urdf.numbers import finite

FARTHEST: Final = 2.0
"""How many times the distance of the farthest point of the shape the largest radius of gyration may be."""
NEAREST: Final = 30.0
"""How many times smaller than that distance it may be."""
OUTSIDE: Final = 0.5
"""Of the diagonal of the box about the shapes: how far outside of that box it may lie."""
LEAST_OUTSIDE: Final = 0.01
"""[m]: nor is less than this far, for links that are small."""
HEAVIEST: Final = 10_000.0
"""[kg]"""
DENSEST: Final = 30_000.0
"""[kg/m3]: osmium, the densest there is, has 22590; shapes may be somewhat smaller than what they stand for."""


@check("URDF100", "massless-joint", "physics", "warning", bad=one_joint(tip=CUBE))
def _massless_joint(subject: Subject) -> Iterator[Diagnostic]:
    """A joint moves a link that has no mass.

    PyBullet gives a link without an inertial a mass of 1 kg, so gravity and torques mean nothing; here an engine
    with physics refuses such a joint.
    """
    links = elements_by_name(subject.description.root, "link")
    massive = {name for name, link in links.items() if _states_mass(link)}
    for joint, body in moved_bodies(subject.parts):
        if joint.child in links and not massive.intersection(body):  # of a link that is not there enough is said
            message = f"link '{joint.child}', which joint '{joint.name}' moves, has no mass"
            hint = "state the mass and moments of inertia of the link"
            yield Diagnostic("URDF100", message, links[joint.child].place, hint, "warning")


def _states_mass(link: Element) -> bool:
    """Also a mass that is refused for another reason, which reading tells."""
    inertial, mass = link.first("inertial"), link.first("inertial", "mass")
    return inertial is not None and (mass is None or finite(mass.attributes.get("value", "").strip()) != 0.0)


@check(
    "URDF101", "inertia-size", "physics", "warning", bad=one_joint(tip=INERTIAL.replace("0.02", "0.00000002") + CUBE)
)
def _inertia_size(subject: Subject) -> Iterator[Diagnostic]:
    """The moments of inertia do not fit the size of the link.

    A unit that was mixed up (g mm2 for kg m2, or a density) looks plausible as a number; the arm then shakes or
    crawls.
    """
    # sqrt(I / m) is how far from the centre of mass the mass lies on average: never farther than all of the shape. A
    # solid ball has 0.63 of its radius, a solid cube 0.47 of the distance of its corners.
    links = elements_by_name(subject.description.root, "link")
    for link in subject.parts.links:
        box = extent(link, links[link.name])
        if link.inertial is None or box is None or not link.inertial.inertia.any():
            continue
        low, high = box
        centre = np.clip(link.inertial.X_LI.p, low, high)  # one far outside is told as URDF102
        reach = hypot(*np.maximum(centre - low, high - centre))
        gyration = sqrt(float(np.linalg.eigvalsh(link.inertial.inertia)[2]) / link.inertial.mass)
        if reach / NEAREST <= gyration <= reach * FARTHEST:
            continue
        times = gyration / reach if gyration > reach else reach / gyration
        message = (
            f"link '{link.name}': its inertia puts the mass {gyration:.2g} m from its centre, {times:.3g} times "
            f"{'farther' if gyration > reach else 'nearer'} than its shape reaches ({reach:.2g} m)"
        )
        element = links[link.name].first("inertial") or links[link.name]
        hint = "compute it from the shape and the mass of the link, in kg m2"
        yield Diagnostic("URDF101", message, (element.first("inertia") or element).place, hint, "warning")


@check(
    "URDF102",
    "centre-of-mass",
    "physics",
    "warning",
    bad=one_joint(tip=INERTIAL.replace("<mass", '<origin xyz="0 0 2"/><mass') + CUBE),
)
def _centre_of_mass(subject: Subject) -> Iterator[Diagnostic]:
    """The centre of mass lies far outside of the shape of the link.

    Gravity then turns the joint with an arm that is not there; mostly a unit, a sign, or another frame.
    """
    links = elements_by_name(subject.description.root, "link")
    for link in subject.parts.links:
        box = extent(link, links[link.name])
        if link.inertial is None or box is None:
            continue
        low, high = box
        p = link.inertial.X_LI.p
        outside, across = hypot(*np.maximum(np.maximum(low - p, p - high), 0.0)), hypot(*(high - low))
        if outside <= max(LEAST_OUTSIDE, OUTSIDE * across):
            continue
        message = (
            f"link '{link.name}': the centre of mass lies {outside:.2g} m outside of its shape, "
            f"which is {across:.2g} m across"
        )
        element = links[link.name].first("inertial") or links[link.name]
        place = (element.first("origin") or element).place
        yield Diagnostic("URDF102", message, place, "check the <origin> of <inertial>: its unit, its frame", "warning")


@check(
    "URDF108",
    "inertia-without-mass",
    "physics",
    "warning",
    bad=one_joint(tip=CUBE + INERTIAL.replace('mass value="1"', 'mass value="0"'), kind="fixed", inside=""),
)
def _inertia_without_mass(subject: Subject) -> Iterator[Diagnostic]:
    """A link has moments of inertia and mass 0.

    No body is like that; the inertia is left out, and the joint that moves the link may move nothing at all.
    """
    for link in subject.description.root.all("link"):
        mass, inertia = link.first("inertial", "mass"), link.first("inertial", "inertia")
        if mass is None or inertia is None or finite(mass.attributes.get("value", "").strip()) != 0.0:
            continue
        if any(finite(inertia.attributes.get(key, "0").strip()) for key in ("ixx", "iyy", "izz")):
            message = f"link '{link.attributes.get('name', '')}' has moments of inertia and mass 0"
            yield Diagnostic("URDF108", message, inertia.place, "state its mass, or leave the inertial out", "warning")


@check(
    "URDF110",
    "root-inertia",
    "physics",
    "note",
    bad=one_joint().replace('<link name="base"/>', f'<link name="base">{INERTIAL}</link>'),
)
def _root_inertia(subject: Subject) -> Iterator[Diagnostic]:
    """The root link has an inertial, which is ignored.

    The robot stands on its root link, so that its mass moves nothing; KDL warns of it. On a mobile base it would
    matter.
    """
    root = elements_by_name(subject.description.root, "link").get(subject.parts.root)
    inertial = root.first("inertial") if root is not None else None
    if inertial is not None and subject.parts.joints:
        message = f"the inertial of root link '{subject.parts.root}' is ignored: the robot stands on it"
        yield Diagnostic("URDF110", message, inertial.place, "put an empty root link before it for KDL", "note")


@check(
    "URDF111",
    "no-inertial",
    "physics",
    "note",
    bad=one_joint().replace('<link name="base"/>', f'<link name="base">{CUBE}</link>'),
)
def _no_inertial(subject: Subject) -> Iterator[Diagnostic]:
    """A link that has a shape has no inertial; it counts as having no mass.

    Fine for a base that stands still; fixed to a moving link it makes the arm lighter than it is. PyBullet would
    give it 1 kg.
    """
    # But for links that a joint moves by themselves: URDF100 tells those.
    moved = {joint.child for joint, _ in moved_bodies(subject.parts)}
    for name, link in elements_by_name(subject.description.root, "link").items():
        shaped = link.first("visual") is not None or link.first("collision") is not None
        if shaped and link.first("inertial") is None and name not in moved:
            message = f"link '{name}' has no inertial: it counts as having no mass"
            yield Diagnostic("URDF111", message, link.place, None, "note")


@check("URDF112", "heavy-link", "physics", "warning", bad=one_joint(tip=INERTIAL.replace('value="1"', 'value="20000"')))
def _heavy_link(subject: Subject) -> Iterator[Diagnostic]:
    """A link is heavier than anything of its size can be, or than 10 t.

    A mass in grams or a mesh in millimetres taken for metres gives it; no motor moves such a link, and beside light
    ones it makes the simulation stiff or unstable.
    """
    # The box about all shapes is larger than they are, so that the density is at least what is told.
    links = elements_by_name(subject.description.root, "link")
    for link in subject.parts.links:
        if link.inertial is None:
            continue
        mass = link.inertial.mass
        box = extent(link, links[link.name])
        volume = float(np.prod(box[1] - box[0])) if box is not None else 0.0
        if volume > 0.0 and mass > DENSEST * volume:
            why = f"at least {digits(mass / volume)} kg/m3 in the box about its shapes; steel has 7850"
        elif mass > HEAVIEST:
            why = f"more than {HEAVIEST:g} kg"
        else:
            continue
        element = links[link.name].first("inertial") or links[link.name]
        place = (element.first("mass") or element).place
        message = f"link '{link.name}' has mass {digits(mass)} kg: {why}"
        yield Diagnostic("URDF112", message, place, "URDF counts in kg and m", "warning")
