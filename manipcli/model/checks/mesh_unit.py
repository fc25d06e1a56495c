"""Meshes of a size that no part of a robot has."""

from collections.abc import Iterator
from typing import Final

from manipcli.core.errors import Finding
from manipcli.model.check import Check, Subject
from manipcli.model.mesh_facts import scaled_box
from manipcli.model.mesh_stl import binary_stl
from manipcli.model.named_meshes import named_meshes
from manipcli.model.samples import TETRAHEDRON, one_link

LARGEST: Final = 10.0
SMALLEST: Final = 0.001
"""[m]: the longest edge of the box about a mesh lies between these."""


def _find(subject: Subject) -> Iterator[Finding]:
    for mesh in named_meshes(subject):
        facts = mesh.facts
        if facts is None:
            continue
        low, high = scaled_box(facts.low, facts.high, mesh.scale)
        size = float((high - low).max())
        if SMALLEST <= size <= LARGEST:
            continue
        large = size > LARGEST
        message = f"mesh '{mesh.uri}' is {size:.3g} m long: " + ("is it in millimetres?" if large else "scaled twice?")
        hint = 'scale="0.001 0.001 0.001"' if large else "leave the scale out"
        yield Finding("URDF206", message, mesh.element.place, hint, "warning")


CHECK = Check(
    code="URDF206",
    name="mesh-unit",
    tier="assets",
    severity="warning",
    summary="A mesh is longer than 10 m or shorter than 1 mm: another unit?",
    reason="STL and OBJ state no unit and URDF counts in metres; an arm of 300 m is one drawn in millimetres.",
    bad=one_link('filename="a.stl"'),
    find=_find,
    files=lambda: {"a.stl": binary_stl(TETRAHEDRON * 300.0)},
)
