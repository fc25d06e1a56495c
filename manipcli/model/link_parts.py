"""Convex parts of the collision meshes of links (`collision_parts` of a robot file), and their file in a log."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Final

from pydantic import Field, TypeAdapter, ValidationError, model_validator

from manipcli.description.elements import Link
from manipcli.model.reporter import Reporter
from manipcli.model.robot import RobotModel
from manipcli.shapes.convex_parts import convex_parts
from manipcli.shapes.mesh_formats import UnusableMesh
from manipcli.shapes.primitives import ConvexPart, Geometry, Mesh
from manipcli.spec.base import Model

LINK_PARTS: Final = "collision_parts.json"
"""The attachment of a log with the parts, so that it is simulated and drawn again without decomposing anything."""

MeshParts = Mapping[str, tuple[ConvexPart, ...]]
"""Convex parts by the URI of their mesh."""


class _Part(Model):
    points: tuple[tuple[float, float, float], ...]
    triangles: tuple[tuple[Annotated[int, Field(ge=0)], Annotated[int, Field(ge=0)], Annotated[int, Field(ge=0)]], ...]

    @model_validator(mode="after")
    def _connected(self) -> _Part:
        if any(k >= len(self.points) for triangle in self.triangles for k in triangle):
            raise ValueError("a triangle has no such point")
        return self


class _File(Model):
    links: tuple[str, ...]
    meshes: dict[str, tuple[_Part, ...]]


def split_links(reporter: Reporter, links: Sequence[Link], names: Sequence[str]) -> tuple[Link, ...]:
    """The links, those of `names` (`collision_parts`, which exist) with convex parts in place of collision meshes."""
    parts: dict[str, tuple[ConvexPart, ...]] = {}
    for k, name in enumerate(names):
        link = next(link for link in links if link.name == name)
        meshes = [each.shape for each in link.collisions if isinstance(each.shape, Mesh)]
        if not meshes:
            message = f"link '{name}' has no collision mesh, so it has no convex parts"
            reporter.error("ROBOT313", message, ("collision_parts", k), hint="remove it")
        for mesh in meshes:
            try:
                parts[mesh.uri] = convex_parts(mesh.path)
            except UnusableMesh as error:
                message = f"mesh '{mesh.uri}' of link '{name}' {error.reason}"
                hint = (error.hint or "").replace("`collision: hull`", "remove the link here") or None
                reporter.error("ROBOT313", message, ("collision_parts", k), hint=hint)
    return with_parts(links, names, parts)


def with_parts(links: Sequence[Link], names: Iterable[str], parts: MeshParts) -> tuple[Link, ...]:
    """The links, those of `names` with the `parts` in place of their collision meshes."""
    chosen = set(names)
    return tuple(
        replace(link, collisions=tuple(part for each in link.collisions for part in _parts(each, parts)))
        if link.name in chosen
        else link
        for link in links
    )


def link_parts_to_json(robot: RobotModel) -> bytes | None:
    """The parts of all links, deterministic; None for a robot without any."""
    links, meshes = [], dict[str, tuple[_Part, ...]]()
    for link in robot.links:
        found: dict[str, list[_Part]] = {}
        for each in link.collisions:
            if isinstance(each.shape, Mesh) and each.shape.part is not None:
                part = each.shape.part
                found.setdefault(each.shape.uri, [])[part.index :] = [
                    _Part(points=part.points, triangles=part.triangles)
                ]
        meshes |= {uri: tuple(parts) for uri, parts in found.items()}
        links += [link.name] if found else []
    if not links:
        return None
    return (_File(links=tuple(links), meshes=meshes).model_dump_json() + "\n").encode()


def link_parts_from_json(content: bytes) -> tuple[tuple[str, ...], MeshParts]:
    """The links with parts, and the parts.

    Raises:
        ValueError: the content is not a valid file of parts.
    """
    try:
        read = TypeAdapter(_File).validate_json(content)
    except ValidationError as error:
        raise ValueError("invalid convex parts") from error
    return read.links, {
        uri: tuple(ConvexPart(k, part.points, part.triangles) for k, part in enumerate(parts))
        for uri, parts in read.meshes.items()
    }


def _parts(geometry: Geometry, parts: MeshParts) -> tuple[Geometry, ...]:
    mesh = geometry.shape
    if not isinstance(mesh, Mesh) or mesh.uri not in parts:
        return (geometry,)
    return tuple(replace(geometry, shape=replace(mesh, part=part)) for part in parts[mesh.uri])
