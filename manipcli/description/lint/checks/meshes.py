"""Mesh files that are not what they seem, or that other programs read in another way."""

from collections.abc import Iterator
from pathlib import PurePosixPath, PureWindowsPath
from typing import Final

import numpy as np

from manipcli.core.errors import Finding
from manipcli.description.lint.check import Check, Subject, found_while_reading
from manipcli.description.lint.named_meshes import named_meshes
from manipcli.description.lint.samples import TETRAHEDRON, ascii_tetrahedron, collada_tetrahedron, one_link
from manipcli.description.packages import NotFound
from manipcli.description.urdf.schema_table import known_elements
from manipcli.shapes.mesh import SUFFIXES
from manipcli.shapes.mesh_facts import mesh_facts, scaled_box
from manipcli.shapes.mesh_fault import UnusableMesh
from manipcli.shapes.mesh_stl import binary_stl

LARGEST: Final = 10.0
SMALLEST: Final = 0.001
"""[m]: the longest edge of the box about a mesh lies between these."""
MANY_TRIANGLES: Final = 200_000


def _missing_visual(subject: Subject) -> Iterator[Finding]:
    """Visual meshes and textures that are not found."""
    yield from found_while_reading("URDF033")(subject)
    for element, _ in known_elements(subject.description.root):
        uri = element.attributes.get("filename", "").strip()
        if element.tag == "texture" and uri:
            try:
                subject.packages.resolve(uri)
            except NotFound as error:
                yield Finding("URDF033", f"texture: {error.message}", element.place, error.hint, "warning")


def _mesh_suffix(subject: Subject) -> Iterator[Finding]:
    """Names of mesh files that say another format than the file has."""
    for mesh in named_meshes(subject):
        facts = mesh.facts
        if facts is None or mesh.path is None:
            continue
        suffix, kind = mesh.path.suffix, facts.format.partition("-")[0]
        if SUFFIXES.get(suffix.lower()) != kind:
            message = (
                f"mesh '{mesh.uri}' ends in '{suffix}' and holds {kind.upper() if kind != 'collada' else 'Collada'}"
            )
            ending = next(ending for ending, known in SUFFIXES.items() if known == kind)
            yield Finding("URDF203", message, mesh.element.place, f"name it *{ending}", "warning")


def _absolute_mesh(subject: Subject) -> Iterator[Finding]:
    """Meshes named by an absolute path."""
    for mesh in named_meshes(subject):
        uri = mesh.uri
        windows = bool(PureWindowsPath(uri).drive)
        if uri.startswith("file:") or PurePosixPath(uri).is_absolute() or windows:
            message = f"mesh '{uri}' is named by an absolute path, which no other machine has"
            yield Finding(
                "URDF204", message, mesh.element.place, "use package://NAME/path or a relative path", "warning"
            )


def _mesh_unit(subject: Subject) -> Iterator[Finding]:
    """Meshes of a size that no part of a robot has."""
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


def _mesh_triangles(subject: Subject) -> Iterator[Finding]:
    """Collision meshes of more triangles than a collision needs."""
    for mesh in named_meshes(subject):
        facts = mesh.facts
        if mesh.role == "collision" and facts is not None and facts.triangles > MANY_TRIANGLES:
            message = f"collision mesh '{mesh.uri}' has {facts.triangles} triangles; {MANY_TRIANGLES} are many"
            yield Finding(
                "URDF207", message, mesh.element.place, "use a simplified mesh, or a box or cylinder", "warning"
            )


def _ascii_stl(subject: Subject) -> Iterator[Finding]:
    """STL files written as text."""
    for mesh in named_meshes(subject):
        facts = mesh.facts
        if facts is not None and facts.format == "stl-ascii":
            message = f"mesh '{mesh.uri}' is an STL file of text, which some programs cannot read; here it is converted"
            yield Finding("URDF208", message, mesh.element.place, "save it as binary STL", "note")


def _mirrored_mesh(subject: Subject) -> Iterator[Finding]:
    """Meshes with a negative scale."""
    for mesh in named_meshes(subject):
        if min(mesh.scale) < 0.0:
            shown = " ".join(f"{value:g}" for value in mesh.scale)
            message = f"mesh '{mesh.uri}' is mirrored by its scale {shown}"
            yield Finding("URDF209", message, mesh.element.place, None, "note")


def _collada_up_axis(subject: Subject) -> Iterator[Finding]:
    """Collada files that state another up axis than z."""
    for mesh in named_meshes(subject):
        facts = mesh.facts
        if facts is not None and facts.up_axis != "Z_UP":
            said = f"the up axis {facts.up_axis}" if facts.up_axis else "no up axis, which stands for Y_UP"
            message = f"mesh '{mesh.uri}' states {said}; it changes nothing here, as in RViz"
            yield Finding("URDF211", message, mesh.element.place, "export it with z up: programs differ", "note")


def _unusable_visual(subject: Subject) -> Iterator[Finding]:
    """Visual meshes whose files hold no mesh."""
    for mesh in named_meshes(subject):
        if mesh.role == "collision" or mesh.path is None:
            continue
        try:
            mesh_facts(mesh.path)
        except UnusableMesh as error:
            message = f"visual mesh '{mesh.uri}' {error.reason}"
            yield Finding("URDF212", message, mesh.element.place, error.hint, "warning")


MESH_CHECKS: tuple[Check, ...] = (
    Check(
        code="URDF033",
        name="missing-visual",
        tier="assets",
        severity="warning",
        summary="A visual mesh or a texture is not found",
        reason="The link is not drawn; PyBullet refuses the whole robot for it, so engines are given none.",
        bad=one_link('filename="package://missing_package/a.stl"'),
        find=_missing_visual,
    ),
    Check(
        code="URDF203",
        name="mesh-suffix",
        tier="assets",
        severity="warning",
        summary="The name of a mesh file says another format than the file has",
        reason="Most programs go by the name and fail, or draw nothing; here the content decides.",
        bad=one_link('filename="a.obj"'),
        find=_mesh_suffix,
        files=lambda: {"a.obj": binary_stl(TETRAHEDRON)},
    ),
    Check(
        code="URDF204",
        name="absolute-mesh",
        tier="assets",
        severity="warning",
        summary="A mesh is named by an absolute path",
        reason="The description works on the machine it was written on and on no other.",
        bad=one_link('filename="file:///home/somebody/robot/base.stl"'),
        find=_absolute_mesh,
    ),
    Check(
        code="URDF206",
        name="mesh-unit",
        tier="assets",
        severity="warning",
        summary="A mesh is longer than 10 m or shorter than 1 mm: another unit?",
        reason="STL and OBJ state no unit and URDF counts in metres; an arm of 300 m is one drawn in millimetres.",
        bad=one_link('filename="a.stl"'),
        find=_mesh_unit,
        files=lambda: {"a.stl": binary_stl(TETRAHEDRON * 300.0)},
    ),
    Check(
        code="URDF207",
        name="mesh-triangles",
        tier="assets",
        severity="warning",
        summary="A collision mesh has more than 200 000 triangles",
        reason=(
            "Every load reads it all (seconds for a million), for a hull that needs a hundred. 2 000 000 are refused."
        ),
        bad=one_link('filename="a.stl"', role="collision"),
        find=_mesh_triangles,
        files=lambda: {"a.stl": binary_stl(np.tile(TETRAHEDRON, (MANY_TRIANGLES // 4 + 1, 1, 1)))},
    ),
    Check(
        code="URDF208",
        name="ascii-stl",
        tier="assets",
        severity="note",
        summary="An STL file is written as text",
        reason="PyBullet, among others, takes it for empty without a word; engines get a binary one here.",
        bad=one_link('filename="a.stl"'),
        find=_ascii_stl,
        files=lambda: {"a.stl": ascii_tetrahedron()},
    ),
    Check(
        code="URDF209",
        name="mirrored-mesh",
        tier="assets",
        severity="note",
        summary="A mesh is mirrored by a negative scale",
        reason="Legal and common for left and right parts; some programs draw such a mesh inside out.",
        bad=one_link('filename="a.stl" scale="1 -1 1"'),
        find=_mirrored_mesh,
        files=lambda: {"a.stl": binary_stl(TETRAHEDRON)},
    ),
    Check(
        code="URDF211",
        name="collada-up-axis",
        tier="assets",
        severity="note",
        summary="A Collada file states an up axis other than z, or none",
        reason=(
            "RViz, MoveIt and Pinocchio take the numbers of the file as they are, and so does manipcli; PyBullet and "
            "three.js turn the mesh. Only a file with z up looks the same everywhere."
        ),
        bad=one_link('filename="a.dae"'),
        find=_collada_up_axis,
        files=lambda: {"a.dae": collada_tetrahedron(up_axis="Y_UP")},
    ),
    Check(
        code="URDF212",
        name="unusable-visual",
        tier="assets",
        severity="warning",
        summary="A visual mesh is damaged, empty, too large, or of a format that is not read",
        reason="The link is not drawn. An engine that reads it may crash, so it is given none.",
        bad=one_link('filename="text.stl"'),
        find=_unusable_visual,
        files=lambda: {"text.stl": b"<!DOCTYPE html><html>404 not found</html>"},
    ),
)
