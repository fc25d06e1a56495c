"""Moments of inertia that do not fit the shape of the link."""

from collections.abc import Iterator
from math import hypot, sqrt
from typing import Final

import numpy as np

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.rigid import elements_by_name, extent
from manipcli.model.samples import CUBE, INERTIAL, one_joint

TOO_FAR: Final = 2.0
"""How many times the distance of the farthest point of the shape the largest radius of gyration may be."""
TOO_NEAR: Final = 30.0
"""How many times smaller than that distance it may be."""


def _find(subject: Subject) -> Iterator[Finding]:
    """sqrt(I / m) is how far from the centre of mass the mass lies on average: never farther than all of the shape.

    A solid ball has 0.63 of its radius, a solid cube 0.47 of the distance of its corners.
    """
    links = elements_by_name(subject.description.root, "link")
    for link in subject.parts.links:
        box = extent(link, links[link.name])
        if link.inertial is None or box is None or not link.inertial.inertia.any():
            continue
        low, high = box
        centre = np.clip(link.inertial.X_LI.p, low, high)  # one far outside is told as URDF102
        reach = hypot(*np.maximum(centre - low, high - centre))
        gyration = sqrt(float(np.linalg.eigvalsh(link.inertial.inertia)[2]) / link.inertial.mass)
        if reach / TOO_NEAR <= gyration <= reach * TOO_FAR:
            continue
        times = gyration / reach if gyration > reach else reach / gyration
        message = (
            f"link '{link.name}': its inertia puts the mass {gyration:.2g} m from its centre, {times:.3g} times "
            f"{'farther' if gyration > reach else 'nearer'} than its shape reaches ({reach:.2g} m)"
        )
        element = links[link.name].first("inertial") or links[link.name]
        hint = "compute it from the shape and the mass of the link, in kg m2"
        yield Finding("URDF101", message, (element.first("inertia") or element).place, hint, "warning")


CHECK = Check(
    code="URDF101",
    name="inertia-size",
    tier="physics",
    severity="warning",
    summary="The moments of inertia do not fit the size of the link",
    reason=(
        "A unit that was mixed up (g mm2 for kg m2, or a density) looks plausible as a number; the arm then "
        "shakes or crawls."
    ),
    bad=one_joint(tip=INERTIAL.replace("0.02", "0.00000002") + CUBE),
    find=_find,
)
