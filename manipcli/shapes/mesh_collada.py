"""Reader of Collada 1.4 and 1.5: the triangles of the scene with node transforms applied, in metres.

`<up_axis>` is returned but not applied, as in RViz, MoveIt and Pinocchio, in which robots are usually checked (some
exporters write Y_UP for a model whose z points up). `<unit>` is applied, as in these programs. Geometry and plain
colours are read; textures, animations and external references are ignored.

pycollada is not used: it reads NaN as 0, ignores counts, strides and all but the first <p> of <triangles>, and stops
silently at the first word that is not a number.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.shapes.mesh_formats import MAX_TRIANGLES, Colours, Faces, UnusableMesh
from manipcli.shapes.primitives import Rgba

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

MAX_ELEMENTS = 200_000
MAX_DEPTH = 64
MAX_INSTANCES = 10_000
UP_AXES = ("X_UP", "Y_UP", "Z_UP")
_PRIMITIVES = ("triangles", "polylist", "polygons", "tristrips", "trifans")


def read_collada(data: bytes) -> tuple[Array, Faces, tuple[int, ...], str, Colours]:
    """Vertices (n, 3) [m], faces (m, 3), parts (always one), the up axis in the file, and the colours of the faces.

    Raises:
        UnusableMesh: not well-formed, a DOCTYPE, a bound is exceeded, or wrong counts, references or indices.
    """
    root = _tree(data)
    scene = _Scene(root)
    for node in scene.roots():
        scene.place(node, np.eye(4), 0)
    if not scene.placed:
        for geometry in root.iter("geometry"):
            scene.add(geometry, np.eye(4))
    meter, up = _asset(root)
    if not scene.placed:
        return np.empty((0, 3)), np.empty((0, 3), dtype=np.int64), (0,), up, ()
    offsets = np.cumsum([0] + [len(points) for points, _, _ in scene.placed[:-1]])
    vertices = np.concatenate([points for points, _, _ in scene.placed]) * meter
    faces = np.concatenate([faces + offset for (_, faces, _), offset in zip(scene.placed, offsets, strict=True)])
    first = np.cumsum([0] + [len(faces) for _, faces, _ in scene.placed[:-1]])
    colours = tuple((int(k), rgba) for k, (_, _, rgba) in zip(first, scene.placed, strict=True))
    return vertices, faces, (0,), up, colours


def _tree(data: bytes) -> Element:
    """The element tree without namespace prefixes; ElementTree's parser has no bounds and accepts a DOCTYPE."""
    from xml.etree.ElementTree import TreeBuilder
    from xml.parsers import expat

    parser, builder = expat.ParserCreate(), TreeBuilder()
    parser.buffer_text = True
    parser.buffer_size = 1 << 20
    depth = count = 0

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if count > MAX_ELEMENTS or depth > MAX_DEPTH:
            raise UnusableMesh(f"has more than {MAX_ELEMENTS} elements or is nested more than {MAX_DEPTH} deep")
        builder.start(name.rpartition(":")[2], attributes)

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(name.rpartition(":")[2])

    def refuse(*_: object) -> None:
        raise UnusableMesh("has a DOCTYPE, which is not allowed", hint="delete it")

    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = start, end, builder.data
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise UnusableMesh(f"is not well-formed XML: {expat.ErrorString(error.code)}, line {error.lineno}") from error
    except (LookupError, ValueError) as error:
        raise UnusableMesh(f"is not valid XML: {error}") from error
    root = builder.close()
    if root.tag != "COLLADA":
        raise UnusableMesh(f"is not a Collada file: its root element is <{root.tag}>")
    return root


def _asset(root: Element) -> tuple[float, str]:
    """Metres per unit, and the up axis or ""."""
    unit, axis = root.find("asset/unit"), root.find("asset/up_axis")
    (meter,) = _floats(unit.get("meter", "1") if unit is not None else "1", 1, "unit")
    if not 0.0 < meter < math.inf:
        raise UnusableMesh(f"has a unit of {meter:g} m; expected a positive length")
    name = (axis.text or "").strip() if axis is not None else ""
    if axis is not None and name not in UP_AXES:
        raise UnusableMesh(f"has the unknown up axis '{name[:20]}'; expected one of {', '.join(UP_AXES)}")
    return meter, name


class _Scene:
    """Traverses the nodes of the scene and collects triangles."""

    def __init__(self, root: Element) -> None:
        self._root = root
        self._by_id = {node.attrib["id"]: node for node in root.iter() if "id" in node.attrib}
        self._meshes: dict[Element, list[tuple[Array, Faces, str]]] = {}
        self._instances = 0
        self._triangles = 0
        self.placed: list[tuple[Array, Faces, Rgba | None]] = []

    def roots(self) -> list[Element]:
        instance = self._root.find("scene/instance_visual_scene")
        if instance is not None:
            return self._named(instance.get("url", ""), "visual_scene").findall("node")
        return [node for scene in self._root.iter("visual_scene") for node in scene.findall("node")][:1000]

    def _named(self, url: str, tag: str) -> Element:
        node = self._by_id.get(url[1:]) if url.startswith("#") else None
        if node is None or node.tag != tag:
            raise UnusableMesh(f"is damaged: it refers to an unknown {tag} '{url[:60]}'")
        return node

    def place(self, node: Element, X: Array, depth: int) -> None:
        """Adds the geometry of `node` and of the nodes below it; `X` (4, 4) is the pose of its parent."""
        self._instances += 1
        if depth > MAX_DEPTH or self._instances > MAX_INSTANCES:
            raise UnusableMesh(
                f"has more than {MAX_INSTANCES} nodes, nodes nested more than {MAX_DEPTH} deep, or a circle"
            )
        for child in node:
            made = _transform(child)
            if made is not None:
                X = X @ made
        for child in node:
            url = child.get("url", "")
            if child.tag == "node":
                self.place(child, X, depth + 1)
            elif child.tag == "instance_node":
                self.place(self._named(url, "node"), X, depth + 1)
            elif child.tag == "instance_geometry":
                self.add(self._named(url, "geometry"), X, child)
            elif child.tag == "instance_controller":
                skin = self._named(url, "controller").find("skin")
                if skin is not None:
                    self.add(self._named(skin.get("source", ""), "geometry"), X, child)

    def add(self, geometry: Element, X: Array, instance: Element | None = None) -> None:
        """Adds a geometry; `instance` binds the material symbols."""
        if geometry not in self._meshes:
            parts = [part for mesh in geometry.findall("mesh") for part in mesh if part.tag in _PRIMITIVES]
            self._meshes[geometry] = [(*self._triangles_of(part), part.get("material", "")) for part in parts]
        for points, faces, symbol in self._meshes[geometry]:
            self._triangles += max(len(faces), len(points) // 3)
            if self._triangles > MAX_TRIANGLES:
                raise UnusableMesh(f"has more than {MAX_TRIANGLES} triangles")
            if len(faces):
                with np.errstate(all="ignore"):  # a number that is not finite is reported with its vertex
                    placed = points @ X[:3, :3].T + X[:3, 3]
                self.placed.append((placed, faces, self._colour(symbol, instance)))

    def _colour(self, symbol: str, instance: Element | None) -> Rgba | None:
        """The diffuse colour of a material symbol; None without a plain colour, as with a texture."""
        uses = instance.iter("instance_material") if instance is not None else ()
        bound = {use.get("symbol"): use.get("target", "").removeprefix("#") for use in uses}
        material = self._by_id.get(bound.get(symbol) or symbol)
        reference = material.find("instance_effect") if material is not None else None
        effect = self._by_id.get(reference.get("url", "").removeprefix("#")) if reference is not None else None
        for tag in ("diffuse", "emission"):
            holder = next(effect.iter(tag), None) if effect is not None else None
            words = (holder.findtext("color") or "").split() if holder is not None else []
            try:
                r, g, b, a = (min(max(float(word), 0.0), 1.0) for word in [*words, "1"][:4])
            except ValueError:
                continue
            return (r, g, b, a)
        return None

    def _triangles_of(self, part: Element) -> tuple[Array, Faces]:
        """Vertices (n, 3) and faces (m, 3) of a primitive element."""
        inputs = part.findall("input")
        vertex = part.find("input[@semantic='VERTEX']")
        if vertex is None:
            raise UnusableMesh(f"is damaged: <{part.tag}> has no input VERTEX")
        vertices = self._named(vertex.get("source", ""), "vertices")
        position = vertices.find("input[@semantic='POSITION']")
        if position is None:
            raise UnusableMesh("is damaged: <vertices> has no input POSITION")
        points = _points(self._named(position.get("source", ""), "source"))
        stride = 1 + max(_whole(each.get("offset", "0")) for each in inputs)
        faces = _faces(part, stride, _whole(vertex.get("offset", "0")))
        if len(faces) and (int(faces.min()) < 0 or int(faces.max()) >= len(points)):
            wrong = int(faces.min()) if int(faces.min()) < 0 else int(faces.max())
            raise UnusableMesh(f"is damaged: a triangle has vertex {wrong} of {len(points)}")
        return points, faces


def _points(source: Element) -> Array:
    array = source.find("float_array")
    if array is None:
        raise UnusableMesh("is damaged: a source of positions has no <float_array>")
    words = (array.text or "").split()
    declared = array.get("count")
    if declared is not None and _whole(declared) != len(words):
        raise UnusableMesh(f"is damaged: <float_array> declares {declared} numbers and has {len(words)}")
    values = _floats(words, len(words), "float_array")
    stride, first, count = 3, 0, len(values) // 3
    accessor = source.find("technique_common/accessor")
    if accessor is not None:
        stride, first, count = (
            _whole(accessor.get(key, default)) for key, default in (("stride", "1"), ("offset", "0"), ("count", "0"))
        )
    if stride < 3 or first + stride * count > len(values):
        raise UnusableMesh(f"is damaged: {count} positions of {stride} numbers exceed the {len(values)} numbers given")
    return values[first : first + stride * count].reshape(-1, stride)[:, :3]


def _faces(part: Element, stride: int, offset: int) -> Faces:
    """Triangles (m, 3) as vertex indices; polygons become fans."""
    runs = [_indices(p.text) for p in (*part.findall("p"), *part.findall("ph/p"))]
    if any(len(run) % stride for run in runs):
        raise UnusableMesh(f"is damaged: <p> of <{part.tag}> does not have {stride} numbers per vertex")
    corners = [run[offset::stride] for run in runs]
    flat = np.concatenate([np.empty(0, dtype=np.int64), *corners])
    if part.tag == "triangles":
        declared = part.get("count")
        if len(flat) % 3 or (declared is not None and _whole(declared) * 3 != len(flat)):
            raise UnusableMesh(f'is damaged: <triangles count="{declared}"> has {len(flat)} vertices')
        return flat.reshape(-1, 3)
    if part.tag == "polylist":
        sizes = _indices(part.findtext("vcount"))
        if int(sizes.sum()) != len(flat) or (len(sizes) and int(sizes.min()) < 0):
            raise UnusableMesh(f"is damaged: <vcount> declares {int(sizes.sum())} vertices, <p> has {len(flat)}")
        if len(sizes) and bool((sizes == 3).all()):
            return flat.reshape(-1, 3)
        corners = np.split(flat, np.cumsum(sizes)[:-1])
    if sum(max(0, len(run) - 2) for run in corners) > MAX_TRIANGLES:
        raise UnusableMesh(f"has more than {MAX_TRIANGLES} triangles")
    strip = part.tag == "tristrips"  # its triangles begin with the previous vertex, those of a fan with the first
    begins = [run[:-2] if strip else np.full(len(run) - 2, run[0]) if len(run) >= 3 else run[:0] for run in corners]
    made = [np.stack([a, run[1:-1], run[2:]], axis=1) for a, run in zip(begins, corners, strict=True) if len(a)]
    return np.concatenate(made) if made else np.empty((0, 3), dtype=np.int64)


def _transform(node: Element) -> Array | None:
    """The transform (4, 4) of an element; None if it is not a transform."""
    X = np.eye(4)
    match node.tag:
        case "matrix":
            return _floats(node.text, 16, node.tag).reshape(4, 4)
        case "translate":
            X[:3, 3] = _floats(node.text, 3, node.tag)
        case "scale":
            return np.diag([*_floats(node.text, 3, node.tag), 1.0])
        case "rotate":  # about an axis x y z by an angle in degrees
            x, y, z, degrees = _floats(node.text, 4, node.tag)
            length = math.sqrt(x * x + y * y + z * z)
            if length > 0.0 and math.isfinite(length + degrees):
                half = math.radians(degrees) / 2.0
                s = math.sin(half) / length
                X[:3, :3] = Transform.of(quat_xyzw=(x * s, y * s, z * s, math.cos(half))).R
        case "lookat" | "skew":
            raise UnusableMesh(f"uses <{node.tag}>, which is not supported", hint="export it with matrices")
        case _:
            return None
    return X


def _indices(text: str | None) -> Faces:
    try:
        return np.array((text or "").split(), dtype=np.int64)
    except (ValueError, OverflowError) as error:
        raise UnusableMesh(f"is damaged: an index is not a whole number ({str(error)[:60]})") from error


def _whole(text: str) -> int:
    try:
        value = int(text[:20])
    except ValueError:
        value = -1
    if value < 0:
        raise UnusableMesh(f"is damaged: '{text[:20]}' is not a count")
    return value


def _floats(text: str | list[str] | None, count: int, what: str) -> Array:
    try:
        values = np.array((text or "").split() if not isinstance(text, list) else text, dtype=np.float64)
    except ValueError as error:
        raise UnusableMesh(f"is damaged: <{what}> contains text instead of a number") from error
    if len(values) != count:
        raise UnusableMesh(f"is damaged: <{what}> has {len(values)} numbers; expected {count}")
    return values
