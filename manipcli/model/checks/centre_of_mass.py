"""Centres of mass far outside of the link."""

from collections.abc import Iterator
from math import hypot
from typing import Final

import numpy as np

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.rigid import elements_by_name, extent
from manipcli.model.samples import CUBE, INERTIAL, one_joint

FAR: Final = 0.5
"""Of the diagonal of the box about the shapes: how far outside of that box it may lie."""
NEAR: Final = 0.01
"""[m]: nor is less than this far, for links that are small."""


def _find(subject: Subject) -> Iterator[Finding]:
    links = elements_by_name(subject.description.root, "link")
    for link in subject.parts.links:
        box = extent(link, links[link.name])
        if link.inertial is None or box is None:
            continue
        low, high = box
        p = link.inertial.X_LI.p
        outside, across = hypot(*np.maximum(np.maximum(low - p, p - high), 0.0)), hypot(*(high - low))
        if outside <= max(NEAR, FAR * across):
            continue
        message = (
            f"link '{link.name}': the centre of mass lies {outside:.2g} m outside of its shape, "
            f"which is {across:.2g} m across"
        )
        element = links[link.name].first("inertial") or links[link.name]
        place = (element.first("origin") or element).place
        yield Finding("URDF102", message, place, "check the <origin> of <inertial>: its unit, its frame", "warning")


CHECK = Check(
    code="URDF102",
    name="centre-of-mass",
    tier="physics",
    severity="warning",
    summary="The centre of mass lies far outside of the shape of the link",
    reason="Gravity then turns the joint with an arm that is not there; mostly a unit, a sign, or another frame.",
    bad=one_joint(tip=INERTIAL.replace("<mass", '<origin xyz="0 0 2"/><mass') + CUBE),
    find=_find,
)
