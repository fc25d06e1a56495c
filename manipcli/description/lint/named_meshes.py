"""The meshes that a description names, with the elements that name them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from manipcli.description.lint.check import Subject
from manipcli.description.located_xml import Element
from manipcli.description.packages import NotFound
from manipcli.description.urdf.numbers import finite
from manipcli.shapes.mesh_facts import MeshFacts, mesh_facts
from manipcli.shapes.mesh_fault import UnusableMesh


@dataclass(frozen=True, slots=True)
class NamedMesh:
    """A <mesh> of a description: `path` is None where its file is not found, `fault` why it cannot be used."""

    role: Literal["visual", "collision"]
    element: Element
    uri: str
    scale: tuple[float, float, float]
    path: Path | None

    @property
    def facts(self) -> MeshFacts | None:
        """None where the file is not found or cannot be used."""
        if self.path is None:
            return None
        try:
            return mesh_facts(self.path)
        except UnusableMesh:
            return None


def named_meshes(subject: Subject) -> Iterator[NamedMesh]:
    """Every <mesh> that names a file, in the order of the description."""
    for link in subject.description.root.all("link"):
        for geometry in link.children:
            holder = geometry.first("geometry") if geometry.tag in ("visual", "collision") else None
            for element in holder.all("mesh") if holder is not None else ():
                uri = element.attributes.get("filename", "").strip()
                if not uri:
                    continue
                try:
                    path = subject.packages.resolve(uri)
                except NotFound:
                    path = None
                role: Literal["visual", "collision"] = "visual" if geometry.tag == "visual" else "collision"
                yield NamedMesh(role, element, uri, _scale(element), path)


def _scale(element: Element) -> tuple[float, float, float]:
    """As written; 1 where that is not three numbers, which reading tells."""
    values = [finite(word) for word in element.attributes.get("scale", "").split()[:4]]
    x, y, z = values if len(values) == 3 else (1.0, 1.0, 1.0)
    return (1.0 if x is None else x, 1.0 if y is None else y, 1.0 if z is None else z)
