"""<link>: inertial, visuals, collisions."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from manipcli.core.geometry import Array, frozen
from manipcli.core.text import did_you_mean
from manipcli.model.located_xml import Element
from manipcli.model.packages import NotFound, Packages
from manipcli.model.robot import Box, Cylinder, Geometry, Inertial, Link, Mesh, Shape, Sphere
from manipcli.model.urdf_numbers import Reader

Rgba = tuple[float, float, float, float]
TRIANGLE_TOLERANCE = 1e-2
"""By which share one principal moment may exceed the sum of the others: descriptions are written with 2-3 digits."""
_SHAPES = ("box", "sphere", "cylinder", "mesh")


def read_link(reader: Reader, element: Element, name: str, packages: Packages, materials: Mapping[str, Rgba]) -> Link:
    """The link that `element` describes; what cannot be read is left out, with a finding."""
    return Link(
        name=name,
        inertial=_inertial(reader, element, name),
        visuals=tuple(_geometries(reader, element, "visual", packages, materials)),
        collisions=tuple(_geometries(reader, element, "collision", packages, materials)),
    )


def read_materials(reader: Reader, root: Element) -> dict[str, Rgba]:
    """Colours by the name of the material, wherever it is defined."""
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


def _inertial(reader: Reader, link: Element, name: str) -> Inertial | None:
    element = link.first("inertial")
    if element is None:
        return None
    mass_element, moments = element.first("mass"), element.first("inertia")
    if mass_element is None:
        reader.report("URDF011", f"link '{name}': <inertial> has no <mass>", element.place)
        return None
    X_LI = reader.origin(element)
    mass = reader.required(mass_element, "value")
    if mass is None:
        return None
    if mass < 0.0:
        reader.report("URDF011", f"link '{name}' has mass {mass:g} kg; expected a positive number", mass_element.place)
        return None
    if mass == 0.0:
        message = f"link '{name}' has mass 0: it counts as having no inertia at all"
        reader.report("URDF031", message, mass_element.place, severity="note")
        return None
    if moments is None:
        reader.report("URDF011", f"link '{name}': <inertial> has no <inertia>", element.place)
        return None
    xx, yy, zz = (reader.required(moments, key) for key in ("ixx", "iyy", "izz"))
    xy, xz, yz = (reader.number(moments, key, 0.0) or 0.0 for key in ("ixy", "ixz", "iyz"))
    if xx is None or yy is None or zz is None:
        return None
    I = frozen([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])  # noqa: E741  (the inertia matrix)
    if not _plausible(reader, I, name, moments):
        return None
    return Inertial(mass=mass, X_LI=X_LI, inertia=I)


def _plausible(reader: Reader, I: Array, name: str, element: Element) -> bool:  # noqa: E741
    if not I.any():
        return True  # a point mass: `read_parts` refuses it where a joint moves it
    principal = np.linalg.eigvalsh(I)
    shown = ", ".join(f"{value:.4g}" for value in principal)
    if principal[0] <= 0.0:
        message = f"link '{name}': the inertia is not positive definite (principal moments {shown} kg m2)"
        reader.report("URDF011", message, element.place, hint="compute it from the shape and the mass of the link")
        return False
    if principal[2] > (principal[0] + principal[1]) * (1.0 + TRIANGLE_TOLERANCE):
        message = f"link '{name}': no body has the principal moments {shown} kg m2: one is larger than the others' sum"
        reader.report("URDF011", message, element.place, hint="compute it from the shape and the mass of the link")
        return False
    return True


def _geometries(
    reader: Reader, link: Element, tag: str, packages: Packages, materials: Mapping[str, Rgba]
) -> list[Geometry]:
    found = []
    for element in link.all(tag):
        X_LS = reader.origin(element)
        holder = element.first("geometry")
        if holder is None or len(holder.children) != 1:
            expected = " or ".join(f"<{shape}>" for shape in _SHAPES)
            message = f"<{tag}> needs one <geometry> with one shape: {expected}"
            reader.report("URDF012", message, (holder or element).place)
            continue
        shape = _shape(reader, holder.children[0], tag, packages)
        if shape is not None:
            found.append(Geometry(X_LS=X_LS, shape=shape, rgba=_colour(reader, element, materials)))
    return found


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
    reader.report("URDF012", f"unknown shape <{element.tag}>", element.place, hint=did_you_mean(element.tag, _SHAPES))
    return None


def _sizes(reader: Reader, element: Element, attribute: str, count: int) -> tuple[float, ...] | None:
    if attribute not in element.attributes:
        reader.report("URDF012", f"<{element.tag}> has no attribute '{attribute}'", element.place)
        return None
    values = reader.numbers(element, attribute, count)
    if values is not None and min(values) <= 0.0:
        message = f"<{element.tag} {attribute}=\"{element.attributes[attribute]}\">: expected positive lengths [m]"
        reader.report("URDF012", message, element.place)
        return None
    return values


def _mesh(reader: Reader, element: Element, tag: str, packages: Packages) -> Mesh | None:
    uri = reader.name(element, "filename")
    scale = reader.numbers(element, "scale", 3) if "scale" in element.attributes else (1.0, 1.0, 1.0)
    if uri is None or scale is None:
        return None
    if 0.0 in scale:
        reader.report("URDF012", "a mesh is scaled by 0", element.place)
        return None
    try:
        path = packages.resolve(uri)
    except NotFound as error:
        if tag == "collision":
            reader.report("URDF013", f"collision mesh: {error.message}", element.place, hint=error.hint)
        else:
            message = f"visual mesh, left out: {error.message}"
            reader.report("URDF033", message, element.place, hint=error.hint, severity="warning")
        return None
    return Mesh(uri=packages.portable(path), path=path, scale=(scale[0], scale[1], scale[2]))


def _colour(reader: Reader, element: Element, materials: Mapping[str, Rgba]) -> Rgba | None:
    material = element.first("material")
    if material is None:
        return None
    colour = material.first("color")
    if colour is not None:
        rgba = reader.numbers(colour, "rgba", 4)
        return (rgba[0], rgba[1], rgba[2], rgba[3]) if rgba is not None else None
    return materials.get(material.attributes.get("name", ""))
