"""Self-collision matrix of a robot, kept in the user's cache by a hash of everything it depends on."""

from __future__ import annotations

import hashlib
from importlib import metadata
from typing import Annotated

from pydantic import Field, TypeAdapter, ValidationError

from manipcli.core.activity import announce
from manipcli.core.cache import cache_key, read_cached, write_cached
from manipcli.core.version import __version__
from manipcli.model.link_parts import link_parts_to_json
from manipcli.model.robot import RobotModel
from manipcli.model.self_collision import CLOSE, SAMPLES, Kind, LinkPair, SelfCollisionMatrix, sampled_matrix
from manipcli.shapes.primitives import Mesh
from manipcli.spec.base import Model

KIND = "self_collision"


class _Pair(Model):
    a: str
    b: str
    kind: Kind
    share: Annotated[float, Field(ge=0, le=1)] | None
    proven: bool


class _File(Model):
    robot: str
    pairs: tuple[_Pair, ...]


def robot_hash(robot: RobotModel) -> str:
    """SHA-256 of what decides about collisions: description, limits, meshes, convex parts, ignored pairs."""
    collisions = {each.shape for link in robot.links for each in link.collisions if isinstance(each.shape, Mesh)}
    files = sorted((mesh.uri, hashlib.sha256(mesh.path.read_bytes()).hexdigest()) for mesh in collisions)
    pins = [(pin.links, pin.driver, *(point.tolist() for point in pin.points)) for pin in robot.pins]
    parts = [repr(pins)] if pins else []
    ignored = repr(sorted(map(sorted, robot.collision_ignore)))
    return cache_key(robot.urdf, ignored, repr(files), link_parts_to_json(robot) or b"", *parts)


def self_collision_matrix(robot: RobotModel, *, samples: int = SAMPLES) -> SelfCollisionMatrix:
    """The matrix of a robot, from the cache if it was computed before; damaged entries are computed again.

    Args:
        robot: the robot, with the files of its meshes.
        samples: number of random configurations.
    """
    digest = robot_hash(robot)
    key = cache_key(digest, str(samples), str(CLOSE), __version__, metadata.version("coal"), metadata.version("pin"))
    stored = read_cached(KIND, key)
    known = None if stored is None else _read(stored, digest, robot, samples)
    if known is not None:
        return known
    announce(f"sampling {samples} configurations of robot '{robot.name}', once: the result is kept")
    made = sampled_matrix(robot, samples=samples)
    pairs = tuple(_Pair(a=p.a, b=p.b, kind=p.kind, share=p.share, proven=p.proven) for p in made.pairs)
    write_cached(KIND, key, _File(robot=digest, pairs=pairs).model_dump_json().encode())
    return made


def _read(content: bytes, digest: str, robot: RobotModel, samples: int) -> SelfCollisionMatrix | None:
    """The stored matrix; None if it is not one of this robot."""
    try:
        file = TypeAdapter(_File).validate_json(content)
    except ValidationError:
        return None
    names = sorted(link.name for link in robot.links if link.collisions)
    expected = [(a, b) for k, a in enumerate(names) for b in names[k + 1 :]]
    if file.robot != digest or [(pair.a, pair.b) for pair in file.pairs] != expected:
        return None
    pairs = tuple(LinkPair(pair.a, pair.b, pair.kind, pair.share, pair.proven) for pair in file.pairs)
    return SelfCollisionMatrix(pairs, samples)
