"""Checks of masses, centres of mass and moments of inertia: missing or implausible."""

from collections.abc import Iterator
from math import hypot, sqrt
from typing import Final

import numpy as np

from manipcli.core.errors import Diagnostic
from manipcli.core.text import digits
from manipcli.description.lint.check import Subject, check
from manipcli.description.lint.rigid import elements_by_name, extent, moved_bodies, too_heavy
from manipcli.description.lint.samples import CUBE, INERTIAL, one_joint
from manipcli.description.located_xml import Element
from manipcli.description.urdf.numbers import finite

FARTHEST: Final = 2.0
"""Largest ratio of the radius of gyration to the distance of the shape's farthest point."""
NEAREST: Final = 30.0
"""Largest ratio of that distance to the radius of gyration."""
OUTSIDE: Final = 0.5
"""Distance of the centre of mass outside the box about the shapes, as a share of the box's diagonal."""
LEAST_OUTSIDE: Final = 0.01
"""[m]: smaller distances are accepted, for small links."""


@check("URDF100", "massless-joint", "physics", "warning", bad=one_joint(tip=CUBE))
def _massless_joint(subject: Subject) -> Iterator[Diagnostic]:
    """A joint moves a link that has no mass.

    PyBullet gives a link without an inertial a mass of 1 kg, so gravity and torques are wrong; in manipcli an engine
    with physics rejects such a joint.
    """
    links = elements_by_name(subject.description.root, "link")
    massive = {name for name, link in links.items() if _states_mass(link)}
    for joint, body in moved_bodies(subject.parts):
        if joint.child in links and not massive.intersection(body):  # the reader reports missing links
            message = f"link '{joint.child}' has no mass and is moved by joint '{joint.name}'"
            hint = "add the mass and moments of inertia of the link"
            yield Diagnostic("URDF100", message, links[joint.child].place, hint, "warning")


def _states_mass(link: Element) -> bool:
    """Whether a link states a mass, valid or not; the reader reports invalid ones."""
    inertial, mass = link.first("inertial"), link.first("inertial", "mass")
    return inertial is not None and (mass is None or finite(mass.attributes.get("value", "").strip()) != 0.0)


@check(
    "URDF101", "inertia-size", "physics", "warning", bad=one_joint(tip=INERTIAL.replace("0.02", "0.00000002") + CUBE)
)
def _inertia_size(subject: Subject) -> Iterator[Diagnostic]:
    """The moments of inertia do not match the size of the link.

    A wrong unit (g mm2 for kg m2, or a density) looks plausible as a number; the arm then oscillates or barely moves.
    """
    # The radius of gyration sqrt(I / m) is at most the distance of the farthest point: 0.63 of the radius for a solid
    # ball, 0.47 of the distance of the corners for a solid cube.
    links = elements_by_name(subject.description.root, "link")
    for link in subject.parts.links:
        box = extent(link, links[link.name])
        if link.inertial is None or box is None or not link.inertial.inertia.any():
            continue
        low, high = box
        centre = np.clip(link.inertial.X_LI.p, low, high)  # URDF102 reports one far outside
        reach = hypot(*np.maximum(centre - low, high - centre))
        gyration = sqrt(float(np.linalg.eigvalsh(link.inertial.inertia)[2]) / link.inertial.mass)
        if reach / NEAREST <= gyration <= reach * FARTHEST:
            continue
        large = gyration > reach
        times = gyration / reach if large else reach / gyration
        message = (
            f"link '{link.name}': radius of gyration {gyration:.2g} m is {times:.3g} times "
            f"{'larger' if large else 'smaller'} than the extent of its shape ({reach:.2g} m)"
        )
        element = links[link.name].first("inertial") or links[link.name]
        hint = "compute <inertia> from the shape and the mass of the link, in kg m2"
        yield Diagnostic("URDF101", message, (element.first("inertia") or element).place, hint, "warning")


@check(
    "URDF102",
    "centre-of-mass",
    "physics",
    "warning",
    bad=one_joint(tip=INERTIAL.replace("<mass", '<origin xyz="0 0 2"/><mass') + CUBE),
)
def _centre_of_mass(subject: Subject) -> Iterator[Diagnostic]:
    """The centre of mass is far outside the shape of the link.

    Gravity then acts on the joint with a wrong lever arm. The usual cause is a wrong unit, sign or frame.
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
            f"link '{link.name}': the centre of mass is {outside:.2g} m outside its shape, "
            f"which is {across:.2g} m across"
        )
        element = links[link.name].first("inertial") or links[link.name]
        place = (element.first("origin") or element).place
        yield Diagnostic("URDF102", message, place, "check unit and frame of the <origin> of <inertial>", "warning")


@check(
    "URDF108",
    "inertia-without-mass",
    "physics",
    "warning",
    bad=one_joint(tip=CUBE + INERTIAL.replace('mass value="1"', 'mass value="0"'), kind="fixed", inside=""),
)
def _inertia_without_mass(subject: Subject) -> Iterator[Diagnostic]:
    """A link has moments of inertia and mass 0.

    This is physically impossible. The inertia is ignored, and the joint that moves the link may move no mass at all.
    """
    for link in subject.description.root.all("link"):
        mass, inertia = link.first("inertial", "mass"), link.first("inertial", "inertia")
        if mass is None or inertia is None or finite(mass.attributes.get("value", "").strip()) != 0.0:
            continue
        if any(finite(inertia.attributes.get(key, "0").strip()) for key in ("ixx", "iyy", "izz")):
            message = f"link '{link.attributes.get('name', '')}' has moments of inertia and mass 0"
            yield Diagnostic("URDF108", message, inertia.place, "set its mass, or delete the <inertial>", "warning")


@check(
    "URDF110",
    "root-inertia",
    "physics",
    "note",
    bad=one_joint().replace('<link name="base"/>', f'<link name="base">{INERTIAL}</link>'),
)
def _root_inertia(subject: Subject) -> Iterator[Diagnostic]:
    """The inertial of the root link is ignored.

    The root link is fixed to the world, so its mass has no effect; KDL warns about it. It would matter for a mobile
    base.
    """
    root = elements_by_name(subject.description.root, "link").get(subject.parts.root)
    inertial = root.first("inertial") if root is not None else None
    if inertial is not None and subject.parts.joints:
        message = f"the inertial of root link '{subject.parts.root}' is ignored: the link is fixed to the world"
        yield Diagnostic("URDF110", message, inertial.place, "for KDL, add an empty root link above it", "note")


@check(
    "URDF111",
    "no-inertial",
    "physics",
    "note",
    bad=one_joint().replace('<link name="base"/>', f'<link name="base">{CUBE}</link>'),
)
def _no_inertial(subject: Subject) -> Iterator[Diagnostic]:
    """A link with a shape has no inertial; its mass is 0.

    This is fine for a fixed base; a link fixed to a moving link makes the arm too light. PyBullet would use 1 kg.
    """
    # URDF100 reports the child links of moving joints.
    moved = {joint.child for joint, _ in moved_bodies(subject.parts)}
    for name, link in elements_by_name(subject.description.root, "link").items():
        shaped = link.first("visual") is not None or link.first("collision") is not None
        if shaped and link.first("inertial") is None and name not in moved:
            message = f"link '{name}' has no inertial: its mass is 0"
            yield Diagnostic("URDF111", message, link.place, None, "note")


@check("URDF112", "heavy-link", "physics", "warning", bad=one_joint(tip=INERTIAL.replace('value="1"', 'value="20000"')))
def _heavy_link(subject: Subject) -> Iterator[Diagnostic]:
    """A link is too heavy for its size, or heavier than 10 t.

    The usual cause is a mass in grams, or a mesh in the wrong unit. No motor moves such a link, and next to light
    links it makes the simulation stiff or unstable.
    """
    links = elements_by_name(subject.description.root, "link")
    for link in subject.parts.links:
        if link.inertial is None:
            continue
        why = too_heavy(link.inertial.mass, extent(link, links[link.name]))
        if not why:
            continue
        element = links[link.name].first("inertial") or links[link.name]
        place = (element.first("mass") or element).place
        message = f"link '{link.name}' has mass {digits(link.inertial.mass)} kg: {why}"
        yield Diagnostic("URDF112", message, place, "use kg and m", "warning")
