"""Links heavier than any matter of their size, or than any link of a manipulator."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from manipcli.core.errors import Finding
from manipcli.core.text import digits
from manipcli.model.check import Check, Subject
from manipcli.model.rigid import elements_by_name, extent
from manipcli.model.samples import INERTIAL, one_joint

HEAVIEST: Final = 10_000.0
"""[kg]"""
DENSEST: Final = 30_000.0
"""[kg/m3]: osmium, the densest there is, has 22590; shapes may be somewhat smaller than what they stand for."""


def _find(subject: Subject) -> Iterator[Finding]:
    """The box about all shapes is larger than they are, so that the density is at least what is told."""
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
        yield Finding("URDF112", message, place, "URDF counts in kg and m", "warning")


CHECK = Check(
    code="URDF112",
    name="heavy-link",
    tier="physics",
    severity="warning",
    summary="A link is heavier than anything of its size can be, or than 10 t",
    reason=(
        "A mass in grams or a mesh in millimetres taken for metres gives it; no motor moves such a link, and beside "
        "light ones it makes the simulation stiff or unstable."
    ),
    bad=one_joint(tip=INERTIAL.replace('value="1"', 'value="20000"')),
    find=_find,
)
