"""Reader of <link> elements: inertial, visuals, collisions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from manipcli.core.geometry import Array, Transform, frozen
from manipcli.description.elements import Inertial, Link, UnusableInertial
from manipcli.description.located_xml import Element
from manipcli.description.packages import Absent, NotFound, Outside, Packages, RemoteFile
from manipcli.description.urdf.numbers import FARTHEST, LARGEST, Reader
from manipcli.description.urdf.schema_table import is_foreign
from manipcli.shapes.mesh import mesh_facts
from manipcli.shapes.mesh_formats import UnusableMesh
from manipcli.shapes.primitives import Box, Cylinder, Geometry, Mesh, Rgba, Shape, Sphere

TRIANGLE_TOLERANCE = 1e-2
"""Relative excess of a principal moment over the sum of the others that is accepted: files have 2-3 digits."""
ROUNDING = 1e-6
"""Relative error of a principal moment that is only rounding: such an inertia is made regular, not refused."""
IMPOSSIBLE: Final = "URDF011"
REGULARISED: Final = "URDF038"
MISSING_VISUAL: Final = "URDF033"
UNUSABLE_MESH: Final = ("URDF013", "URDF200", "URDF210")
"""Codes of errors about a collision mesh: missing, unusable, flat."""
_SHAPES = ("box", "sphere", "cylinder", "mesh")
_ELSEWHERE = frozenset({"capsule", "plane", "cone", "ellipsoid", "polyline", "heightmap", "sdf"})
"""Shapes of other formats and of URDF extensions."""
WITHOUT_IT: Final = (
    "add the file, replace the mesh by a <box>, a <cylinder> or the mesh of the <visual>, or delete the <collision>: "
    "the link then has no contacts"
)


def read_link(reader: Reader, element: Element, name: str, packages: Packages, materials: Mapping[str, Rgba]) -> Link:
    """The link of a <link> element; invalid parts are omitted, with a finding."""
    inertial = _inertial(reader, element, name)
    unusable = inertial if isinstance(inertial, UnusableInertial) else None
    visuals = tuple(_geometries(reader, element, "visual", packages, materials))
    before = len(reader.findings)
    collisions = tuple(_geometries(reader, element, "collision", packages, materials))
    missing = tuple(finding for finding in reader.findings[before:] if finding.code in UNUSABLE_MESH)
    return Link(
        name=name,
        inertial=inertial if isinstance(inertial, Inertial) else None,
        visuals=visuals,
        collisions=collisions,
        place=element.place,
        unusable=unusable,
        missing=missing,
    )


def read_materials(reader: Reader, root: Element) -> dict[str, Rgba]:
    """Colours by material name, from all definitions."""
    found: dict[str, Rgba] = {}
    visuals = [visual for link in root.all("link") for visual in link.all("visual")]
    for parent in (root, *visuals):
        for material in parent.all("material"):
            colour = material.first("color")
            if colour is None:
                continue
            rgba = reader.numbers(colour, "rgba", 4)
            if rgba is not None and material.attributes.get("name"):
                found.setdefault(material.attributes["name"], (rgba[0], rgba[1], rgba[2], rgba[3]))
    return found


def _inertial(reader: Reader, link: Element, name: str) -> Inertial | UnusableInertial | None:
    """The inertial of a link; None if it has none, or mass 0."""
    element = link.first("inertial")
    if element is None:
        return None
    before = len(reader.findings)

    def refused(mass: float | None = None, X_LI: Transform | None = None) -> UnusableInertial | None:
        found = tuple(finding for finding in reader.findings[before:] if finding.severity == "error")
        physical = all(finding.code == IMPOSSIBLE for finding in found)
        return UnusableInertial(found, mass, X_LI) if physical else None

    mass_element, moments = element.first("mass"), element.first("inertia")
    if mass_element is None:
        reader.report(IMPOSSIBLE, f"link '{name}': <inertial> has no <mass>", element.place)
        return refused()
    X_LI = reader.origin(element)
    mass = reader.required(mass_element, "value", most=LARGEST)
    if mass is None:
        return None
    if mass < 0.0:
        message = f"link '{name}' has mass {mass:g} kg; expected a positive number"
        reader.report(IMPOSSIBLE, message, mass_element.place)
        return refused()
    if mass == 0.0:
        message = f"link '{name}' has mass 0: its inertial is ignored"
        reader.report("URDF031", message, mass_element.place, severity="note")
        return None
    if moments is None:
        reader.report(IMPOSSIBLE, f"link '{name}': <inertial> has no <inertia>", element.place)
        return refused(mass, X_LI)
    xx, yy, zz = (reader.required(moments, key, most=LARGEST) for key in ("ixx", "iyy", "izz"))
    xy, xz, yz = (_product(reader, moments, key) for key in ("ixy", "ixz", "iyz"))
    if xx is None or yy is None or zz is None:
        return None
    inertia = _plausible(reader, np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), name, moments)
    if inertia is None:
        return refused(mass, X_LI)
    return Inertial(mass=mass, X_LI=X_LI, inertia=frozen(inertia))


def _product(reader: Reader, moments: Element, key: str) -> float:
    """A product of inertia; 0 with a warning if missing."""
    if key not in moments.attributes:
        message = f"<inertia> has no attribute '{key}'; 0 is used"
        reader.report("URDF059", message, moments.place, severity="warning")
    return reader.number(moments, key, 0.0) or 0.0


def _plausible(reader: Reader, inertia: Array, name: str, element: Element) -> Array | None:
    """The inertia (3, 3), made regular if it is singular only by rounding; None with a finding if it is impossible."""
    if not inertia.any():
        return inertia  # a point mass: `read_parts` rejects it on a moving joint
    principal, R = np.linalg.eigh(inertia)
    shown = ", ".join(f"{value:.4g}" for value in principal)
    largest = float(principal[2])
    if principal[0] < -ROUNDING * largest or largest <= 0.0:
        message = f"link '{name}': inertia is not positive definite (principal moments {shown} kg m2)"
        reader.report(IMPOSSIBLE, message, element.place, hint="compute it from the shape and the mass of the link")
        return None
    if largest > (principal[0] + principal[1]) * (1.0 + TRIANGLE_TOLERANCE) + ROUNDING * largest:
        message = (
            f"link '{name}': impossible principal moments {shown} kg m2: the largest exceeds the sum of the others"
        )
        reader.report(IMPOSSIBLE, message, element.place, hint="compute it from the shape and the mass of the link")
        return None
    least = ROUNDING * largest
    if principal[0] >= least * (1.0 - 1e-9):
        return inertia
    # The least moment of a thin rod is rounded to 0; as little as rounding is added.
    message = f"link '{name}': inertia is singular by rounding (principal moments {shown} kg m2)"
    reader.report(
        REGULARISED, f"{message}; {least:.2g} kg m2 is used for the least one", element.place, severity="note"
    )
    return np.asarray(R @ np.diag(np.maximum(principal, least)) @ R.T)


def _geometries(
    reader: Reader, link: Element, tag: str, packages: Packages, materials: Mapping[str, Rgba]
) -> list[Geometry]:
    found = []
    for element in link.all(tag):
        X_LS = reader.origin(element)
        rgba = _colour(reader, element, materials)
        holder = element.first("geometry")
        shapes = [child for child in holder.children if not is_foreign(child.tag)] if holder is not None else []
        if not shapes:
            expected = " or ".join(f"<{shape}>" for shape in _SHAPES)
            message = f"<{tag}> has no shape; expected a <geometry> with {expected}"
            reader.report("URDF012", message, (holder or element).place)
            continue
        if len(shapes) > 1:
            message = f"<geometry> has {len(shapes)} shapes; only the first, <{shapes[0].tag}>, is used"
            hint = f"use one <{tag}> per shape"
            reader.report("URDF061", message, shapes[1].place, hint=hint, severity="warning")
        if shapes[0].tag == "capsule":
            found += _capsule(reader, shapes[0], X_LS, rgba)
            continue
        shape = _shape(reader, shapes[0], tag, packages)
        if shape is not None:
            found.append(Geometry(X_LS=X_LS, shape=shape, rgba=rgba))
    return found


def _capsule(reader: Reader, element: Element, X_LS: Transform, rgba: Rgba | None) -> list[Geometry]:
    """The capsule as a cylinder of its `length` along z and a sphere at each end."""
    radius, length = _sizes(reader, element, "radius", 1), _sizes(reader, element, "length", 1)
    if radius is None or length is None:
        return []
    message = "<capsule> is not supported by most programs; it is read as a cylinder and two spheres"
    reader.report("URDF062", message, element.place, severity="warning")
    ends = [X_LS @ Transform.of(xyz=(0.0, 0.0, side * length[0] / 2.0)) for side in (-1.0, 1.0)]
    return [
        Geometry(X_LS=X_LS, shape=Cylinder(radius=radius[0], length=length[0]), rgba=rgba),
        *(Geometry(X_LS=X_LE, shape=Sphere(radius=radius[0]), rgba=rgba) for X_LE in ends),
    ]


def _shape(reader: Reader, element: Element, tag: str, packages: Packages) -> Shape | None:
    if element.tag == "box":
        size = _sizes(reader, element, "size", 3)
        return Box(size=(size[0], size[1], size[2])) if size else None
    if element.tag == "sphere":
        radius = _sizes(reader, element, "radius", 1)
        return Sphere(radius=radius[0]) if radius else None
    if element.tag == "cylinder":
        radius, length = _sizes(reader, element, "radius", 1), _sizes(reader, element, "length", 1)
        return Cylinder(radius=radius[0], length=length[0]) if radius and length else None
    if element.tag == "mesh":
        return _mesh(reader, element, tag, packages)
    if element.tag in _ELSEWHERE:
        ignored = tag == "visual"
        message = f"<{element.tag}> is not a URDF shape" + ("; it is ignored" if ignored else "")
        hint = "use " + " or ".join(f"<{shape}>" for shape in _SHAPES)
        reader.report("URDF062", message, element.place, hint=hint, severity="warning" if ignored else "error")
        return None
    reader.report("URDF012", f"unknown shape <{element.tag}>", element.place, hint=reader.near(element.tag, _SHAPES))
    return None


def _mesh(reader: Reader, element: Element, tag: str, packages: Packages) -> Mesh | None:
    """The mesh of a <mesh> below a <visual> or <collision> (`tag`); None with a finding if it cannot be used."""
    uri = reader.name(element, "filename")
    scale = reader.numbers(element, "scale", 3) if "scale" in element.attributes else (1.0, 1.0, 1.0)
    if uri is None or scale is None:
        return None
    if 0.0 in scale:
        reader.report("URDF012", "a mesh has scale 0", element.place)
        return None
    try:
        path = packages.resolve(uri)
    except (Outside, RemoteFile) as error:
        code = "URDF202" if isinstance(error, Outside) else "URDF201"
        reader.report(code, f"{tag} mesh: {error.message}", element.place, hint=error.hint)
        return None
    except NotFound as error:
        if tag == "collision":
            hint = error.hint
            if isinstance(error, Absent):
                hint = f"{hint} Otherwise {WITHOUT_IT}" if hint else WITHOUT_IT
            reader.report("URDF013", f"collision mesh: {error.message}", element.place, hint=hint)
        else:
            message = f"visual mesh, ignored: {error.message}"
            reader.report(MISSING_VISUAL, message, element.place, hint=error.hint, severity="warning")
        return None
    if tag == "collision" and packages.reads and not _usable_mesh(reader, element, uri, packages):
        return None
    return Mesh(uri=packages.portable(path), path=path, scale=(scale[0], scale[1], scale[2]))


def _usable_mesh(reader: Reader, element: Element, uri: str, packages: Packages) -> bool:
    try:
        facts = mesh_facts(packages.resolve(uri))
    except UnusableMesh as error:
        reader.report("URDF200", f"collision mesh '{uri}' {error.reason}", element.place, hint=error.hint)
        return False
    if facts.flat:
        message = f"collision mesh '{uri}' is flat, ignored: its convex hull has no volume"
        reader.report("URDF210", message, element.place, hint="use a thin <box>", severity="warning")
    return not facts.flat


def _sizes(reader: Reader, element: Element, attribute: str, count: int) -> tuple[float, ...] | None:
    if attribute not in element.attributes:
        reader.missing(element, attribute)
        return None
    values = reader.numbers(element, attribute, count, most=FARTHEST)
    if values is not None and min(values) <= 0.0:
        message = f'<{element.tag} {attribute}="{element.attributes[attribute]}">: expected positive lengths [m]'
        reader.report("URDF012", message, element.place)
        return None
    return values


def _colour(reader: Reader, element: Element, materials: Mapping[str, Rgba]) -> Rgba | None:
    material = element.first("material")
    if material is None:
        return None
    colour = material.first("color")
    if colour is not None:
        rgba = reader.numbers(colour, "rgba", 4)
        return (rgba[0], rgba[1], rgba[2], rgba[3]) if rgba is not None else None
    return materials.get(material.attributes.get("name", ""))
