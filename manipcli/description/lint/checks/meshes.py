"""Checks of mesh files: missing, mislabelled, oversized, or read differently by other programs."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Final, Literal

import numpy as np

from manipcli.core.errors import Diagnostic
from manipcli.description.lint.check import Subject, check, found_while_reading
from manipcli.description.lint.samples import TETRAHEDRON, ascii_tetrahedron, collada_tetrahedron, one_link
from manipcli.description.located_xml import Element
from manipcli.description.packages import NotFound
from manipcli.description.urdf.numbers import finite
from manipcli.description.urdf.schema_table import known_elements
from manipcli.shapes.mesh import SUFFIXES, MeshFacts, mesh_facts, scaled_box
from manipcli.shapes.mesh_formats import UnusableMesh, binary_stl

LARGEST: Final = 10.0
SMALLEST: Final = 0.001
"""[m]: bounds of the longest edge of a mesh's bounding box."""
MANY_TRIANGLES: Final = 200_000


@dataclass(frozen=True, slots=True)
class _NamedMesh:
    """A <mesh> of a description: `path` is None if its file is not found."""

    role: Literal["visual", "collision"]
    element: Element
    uri: str
    scale: tuple[float, float, float]
    path: Path | None

    @property
    def facts(self) -> MeshFacts | None:
        """None if the file is not found or unusable."""
        if self.path is None:
            return None
        try:
            return mesh_facts(self.path)
        except UnusableMesh:
            return None


def _named_meshes(subject: Subject) -> Iterator[_NamedMesh]:
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
                yield _NamedMesh(role, element, uri, _scale(element), path)


def _scale(element: Element) -> tuple[float, float, float]:
    """The scale as written; 1 for invalid numbers, which the reader reports."""
    values = [finite(word) for word in element.attributes.get("scale", "").split()[:4]]
    x, y, z = values if len(values) == 3 else (1.0, 1.0, 1.0)
    return (1.0 if x is None else x, 1.0 if y is None else y, 1.0 if z is None else z)


@check("URDF033", "missing-visual", "assets", "warning", bad=one_link('filename="package://missing_package/a.stl"'))
def _missing_visual(subject: Subject) -> Iterator[Diagnostic]:
    """A visual mesh or a texture is not found.

    The link is not drawn. PyBullet rejects the whole robot for it, so manipcli passes no visuals to an engine.
    """
    yield from found_while_reading("URDF033")(subject)
    for element, _ in known_elements(subject.description.root):
        uri = element.attributes.get("filename", "").strip()
        if element.tag == "texture" and uri:
            try:
                subject.packages.resolve(uri)
            except NotFound as error:
                yield Diagnostic("URDF033", f"texture: {error.message}", element.place, error.hint, "warning")


@check(
    "URDF203",
    "mesh-suffix",
    "assets",
    "warning",
    bad=one_link('filename="a.obj"'),
    files=lambda: {"a.obj": binary_stl(TETRAHEDRON)},
)
def _mesh_suffix(subject: Subject) -> Iterator[Diagnostic]:
    """The suffix of a mesh file does not match its format.

    Most programs choose the format by the suffix and fail or draw nothing; manipcli detects it from the content.
    """
    for mesh in _named_meshes(subject):
        facts = mesh.facts
        if facts is None or mesh.path is None:
            continue
        suffix, kind = mesh.path.suffix, facts.format.partition("-")[0]
        if SUFFIXES.get(suffix.lower()) != kind:
            message = (
                f"mesh '{mesh.uri}' has suffix '{suffix}' but contains "
                f"{kind.upper() if kind != 'collada' else 'Collada'}"
            )
            ending = next(ending for ending, known in SUFFIXES.items() if known == kind)
            yield Diagnostic("URDF203", message, mesh.element.place, f"rename it to *{ending}", "warning")


@check("URDF204", "absolute-mesh", "assets", "warning", bad=one_link('filename="file:///home/somebody/robot/base.stl"'))
def _absolute_mesh(subject: Subject) -> Iterator[Diagnostic]:
    """A mesh is named by an absolute path.

    The description works only on the machine it was written on.
    """
    for mesh in _named_meshes(subject):
        uri = mesh.uri
        windows = bool(PureWindowsPath(uri).drive)
        if subject.description.expanded and subject.packages.found_by_name(uri):
            continue  # written as `file://$(find NAME)/...`
        if uri.startswith("file:") or PurePosixPath(uri).is_absolute() or windows:
            message = f"mesh '{uri}' has an absolute path, which works only on this machine"
            yield Diagnostic(
                "URDF204", message, mesh.element.place, "use package://NAME/path or a relative path", "warning"
            )


@check(
    "URDF206",
    "mesh-unit",
    "assets",
    "warning",
    bad=one_link('filename="a.stl"'),
    files=lambda: {"a.stl": binary_stl(TETRAHEDRON * 300.0)},
)
def _mesh_unit(subject: Subject) -> Iterator[Diagnostic]:
    """A mesh is longer than 10 m or shorter than 1 mm: wrong unit?

    STL and OBJ files have no unit and URDF uses metres; an arm of 300 m is one modelled in millimetres.
    """
    for mesh in _named_meshes(subject):
        facts = mesh.facts
        if facts is None:
            continue
        low, high = scaled_box(facts.low, facts.high, mesh.scale)
        size = float((high - low).max())
        if SMALLEST <= size <= LARGEST:
            continue
        large = size > LARGEST
        message = f"mesh '{mesh.uri}' is {size:.3g} m long: " + ("is it in millimetres?" if large else "scaled twice?")
        hint = 'scale="0.001 0.001 0.001"' if large else "delete the scale"
        yield Diagnostic("URDF206", message, mesh.element.place, hint, "warning")


@check(
    "URDF207",
    "mesh-triangles",
    "assets",
    "warning",
    bad=one_link('filename="a.stl"', role="collision"),
    files=lambda: {"a.stl": binary_stl(np.tile(TETRAHEDRON, (MANY_TRIANGLES // 4 + 1, 1, 1)))},
)
def _mesh_triangles(subject: Subject) -> Iterator[Diagnostic]:
    """A collision mesh has more than 200 000 triangles.

    Loading takes seconds per million triangles, and the convex hull needs about a hundred. Meshes with more than
    2 000 000 are rejected.
    """
    for mesh in _named_meshes(subject):
        facts = mesh.facts
        if mesh.role == "collision" and facts is not None and facts.triangles > MANY_TRIANGLES:
            message = f"collision mesh '{mesh.uri}' has {facts.triangles} triangles, more than {MANY_TRIANGLES}"
            yield Diagnostic(
                "URDF207", message, mesh.element.place, "use a simplified mesh, or a box or cylinder", "warning"
            )


@check(
    "URDF208",
    "ascii-stl",
    "assets",
    "note",
    bad=one_link('filename="a.stl"'),
    files=lambda: {"a.stl": ascii_tetrahedron()},
)
def _ascii_stl(subject: Subject) -> Iterator[Diagnostic]:
    """An STL file is ASCII.

    Some programs, PyBullet among them, silently read it as empty; manipcli converts it to binary for its engines.
    """
    for mesh in _named_meshes(subject):
        facts = mesh.facts
        if facts is not None and facts.format == "stl-ascii":
            message = f"mesh '{mesh.uri}' is an ASCII STL file, which some programs cannot read; manipcli converts it"
            yield Diagnostic("URDF208", message, mesh.element.place, "save it as binary STL", "note")


@check(
    "URDF209",
    "mirrored-mesh",
    "assets",
    "note",
    bad=one_link('filename="a.stl" scale="1 -1 1"'),
    files=lambda: {"a.stl": binary_stl(TETRAHEDRON)},
)
def _mirrored_mesh(subject: Subject) -> Iterator[Diagnostic]:
    """A mesh is mirrored by a negative scale.

    This is valid and common for left and right parts, but some programs draw such a mesh inside out.
    """
    for mesh in _named_meshes(subject):
        if min(mesh.scale) < 0.0:
            shown = " ".join(f"{value:g}" for value in mesh.scale)
            message = f"mesh '{mesh.uri}' is mirrored by its scale {shown}"
            yield Diagnostic("URDF209", message, mesh.element.place, None, "note")


@check(
    "URDF211",
    "collada-up-axis",
    "assets",
    "note",
    bad=one_link('filename="a.dae"'),
    files=lambda: {"a.dae": collada_tetrahedron(up_axis="Y_UP")},
)
def _collada_up_axis(subject: Subject) -> Iterator[Diagnostic]:
    """A Collada file has an up axis other than z, or none.

    RViz, MoveIt, Pinocchio and manipcli ignore the up axis; PyBullet and three.js rotate the mesh. Only a file with z
    up looks the same in all programs.
    """
    for mesh in _named_meshes(subject):
        facts = mesh.facts
        if facts is not None and facts.up_axis != "Z_UP":
            stated = f"up axis {facts.up_axis}" if facts.up_axis else "no up axis, which means Y_UP"
            message = f"mesh '{mesh.uri}' has {stated}; it is ignored, as in RViz"
            yield Diagnostic("URDF211", message, mesh.element.place, "export it with z up", "note")


@check(
    "URDF212",
    "unusable-visual",
    "assets",
    "warning",
    bad=one_link('filename="text.stl"'),
    files=lambda: {"text.stl": b"<!DOCTYPE html><html>404 not found</html>"},
)
def _unusable_visual(subject: Subject) -> Iterator[Diagnostic]:
    """A visual mesh is damaged, empty, too large, or in an unsupported format.

    The link is not drawn. An engine may crash on it, so manipcli does not pass it on.
    """
    for mesh in _named_meshes(subject):
        if mesh.role == "collision" or mesh.path is None:
            continue
        try:
            mesh_facts(mesh.path)
        except UnusableMesh as error:
            message = f"visual mesh '{mesh.uri}' {error.reason}"
            yield Diagnostic("URDF212", message, mesh.element.place, error.hint, "warning")
