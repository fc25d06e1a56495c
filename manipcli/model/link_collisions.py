"""Collision shapes of links that the robot file replaces (`collision:`): by the visual shapes, or by none."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Final, Literal

from manipcli.core.errors import Diagnostic
from manipcli.core.text import did_you_mean, listed
from manipcli.description.elements import Link
from manipcli.model.reporter import Reporter
from manipcli.shapes.mesh import mesh_facts
from manipcli.shapes.mesh_formats import UnusableMesh
from manipcli.shapes.primitives import Geometry, Mesh

CollisionSpec = Literal["from_visual"] | Mapping[str, Literal["from_visual", "none"]] | None
REMEDY: Final = "add `collision: from_visual` to the robot file to use visual shapes, or `collision: {{{link}: none}}`"
"""The hint for a link whose collision mesh is missing."""


def replaced_meshes(spec: CollisionSpec, links: Sequence[Link], prefix: str = "") -> Collection[Diagnostic]:
    """The errors about collision meshes that the robot file replaces."""
    return {
        finding
        for link in links
        for finding in link.missing
        if spec == "from_visual" or (spec is not None and prefix + link.name in spec)
    }


def with_collisions(reporter: Reporter, spec: CollisionSpec, links: Sequence[Link]) -> list[Link]:
    """The links with the collision shapes of the robot file, and a note about what took its visual shapes."""
    if spec is None:
        return list(links)
    names = [link.name for link in links]
    if spec == "from_visual":
        chosen = {link.name: "from_visual" for link in links if link.missing or not link.collisions}
    else:
        chosen = dict(spec)
    for name in chosen:
        if name not in names:
            reporter.error(
                "ROBOT306", f"link '{name}' is not in the robot", ("collision", name), hint=did_you_mean(name, names)
            )
    made = []
    taken, bare = [], []
    for link in links:
        how = chosen.get(link.name)
        shapes = link.collisions if how is None else tuple(filter(_solid, link.visuals)) if how != "none" else ()
        taken += [link.name] if how == "from_visual" and shapes else []
        bare += [link.name] if how == "from_visual" and not shapes and (link.missing or spec != "from_visual") else []
        made.append(replace(link, collisions=shapes))
    if taken:
        message = f"visual shapes are used as collision shapes: {listed(taken)}"
        reporter.note("ROBOT354", message, ("collision",), hint=None)
    if bare:
        message = f"no visual shape that can be used as a collision shape, so no contacts: {listed(bare)}"
        hint = "add the mesh, or a <box> or <cylinder> to the description"
        reporter.warning("ROBOT355", message, ("collision",), hint=hint)
    return made


def _solid(geometry: Geometry) -> bool:
    """Whether the shape has a volume."""
    if not isinstance(geometry.shape, Mesh):
        return True
    try:
        return not mesh_facts(geometry.shape.path).flat
    except UnusableMesh:
        return False
