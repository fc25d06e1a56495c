"""Rigid groups of links (joined by fixed joints), and bounding boxes of a link's shapes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.core.text import digits
from manipcli.description.elements import Joint, Link
from manipcli.description.located_xml import Element
from manipcli.description.urdf.urdf import Parts
from manipcli.shapes.mesh import mesh_facts, scaled_box
from manipcli.shapes.mesh_formats import UnusableMesh
from manipcli.shapes.primitives import Box, Cylinder, Geometry, Mesh, Shape

LARGEST = 1e9
"""[m]: larger shapes are not measured."""
HEAVIEST: Final = 10_000.0
"""[kg]"""
DENSEST: Final = 30_000.0
"""[kg/m3]: osmium has 22590; collision shapes may be somewhat smaller than the part."""


def moved_bodies(parts: Parts) -> Iterator[tuple[Joint, tuple[str, ...]]]:
    """Each moving joint with the names of the links that it moves rigidly: its child and all links fixed to it."""
    fixed: dict[str, list[str]] = {}
    for joint in parts.joints:
        if not joint.moves:
            fixed.setdefault(joint.parent, []).append(joint.child)
    for joint in parts.joints:
        if joint.moves:
            body = [joint.child]
            for link in body:
                body += [child for child in fixed.get(link, ()) if child not in body]
            yield joint, tuple(body)


def elements_by_name(root: Element, tag: str) -> dict[str, Element]:
    """The elements of a tag directly below <robot>, by name; of duplicates the first."""
    found: dict[str, Element] = {}
    for element in root.all(tag):
        found.setdefault(element.name, element)
    return found


def extent(link: Link, element: Element) -> tuple[Array, Array] | None:
    """Lowest and highest corner (3,) [m] of a box about a link's collision shapes, else its visuals, in the link frame.

    None if `element`, the link's <link>, has no shape, or a shape could not be read or is larger than `LARGEST`.
    """
    for tag, shapes in (("collision", link.collisions), ("visual", link.visuals)):
        written = len(element.all(tag))
        if written:
            box = box_about(shapes) if len(shapes) >= written else None
            return box if box is not None and max(map(abs, (*box[0], *box[1]))) < LARGEST else None
    return None


def too_heavy(mass: float, box: tuple[Array, Array] | None) -> str:
    """Why a mass [kg] is too large for the box about the shapes of its link, or for any link; "" if it is not."""
    # The box is larger than the shapes, so the density is at least the reported one.
    volume = float(np.prod(box[1] - box[0])) if box is not None else 0.0
    if volume > 0.0 and mass > DENSEST * volume:
        return f"a density of at least {digits(mass / volume)} kg/m3 in the box about its shapes; steel has 7850"
    return f"more than {HEAVIEST:g} kg" if mass > HEAVIEST else ""


@np.errstate(all="ignore")
def box_about(geometries: Sequence[Geometry]) -> tuple[Array, Array] | None:
    """Lowest and highest corner (3,) [m] of a box about the boxes of the shapes, in their frame: not tight.

    None without a shape, or if a mesh cannot be read.
    """
    boxes = []
    for geometry in geometries:
        own = _box(geometry.shape)
        if own is None:
            return None
        low, high = own
        centre, half = geometry.X_LS.apply((low + high) / 2.0), np.abs(geometry.X_LS.R) @ ((high - low) / 2.0)
        boxes.append((centre - half, centre + half))
    if not boxes:
        return None
    return np.min([low for low, _ in boxes], axis=0), np.max([high for _, high in boxes], axis=0)


def _box(shape: Shape) -> tuple[Array, Array] | None:
    if isinstance(shape, Mesh):
        try:
            facts = mesh_facts(shape.path)
        except UnusableMesh:
            return None
        return scaled_box(facts.low, facts.high, shape.scale)
    if isinstance(shape, Box):
        half = np.array(shape.size) / 2.0
    elif isinstance(shape, Cylinder):
        half = np.array([shape.radius, shape.radius, shape.length / 2.0])
    else:
        half = np.full(3, shape.radius)
    return -half, half
