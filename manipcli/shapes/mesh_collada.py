"""Collada (1.4, 1.5): the triangles of the scene, every node in its place, in metres.

`<up_axis>` is reported and not applied: RViz, MoveIt and Pinocchio take the numbers as they are, and every robot was
looked at in one of them (Y_UP is what some exporters write over a model whose z points up). `<unit>` is applied, as
they do. Geometry and plain colours are read; textures, animations and whatever an address outside of the file names
are left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from manipcli.core.geometry import Array, Transform
from manipcli.shapes.mesh_fault import MAX_TRIANGLES, Colours, Faces, UnusableMesh
from manipcli.shapes.primitives import Rgba

MAX_ELEMENTS = 200_000
MAX_DEPTH = 64
MAX_INSTANCES = 10_000
UP_AXES = ("X_UP", "Y_UP", "Z_UP")


@dataclass(slots=True)
class _Node:
    tag: str
    attributes: dict[str, str]
    children: list[_Node] = field(default_factory=list)
    pieces: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        return "".join(self.pieces)

    def all(self, *tags: str) -> list[_Node]:
        return [child for child in self.children if child.tag in tags]

    def first(self, tag: str) -> _Node | None:
        return next((child for child in self.children if child.tag == tag), None)

    def walk(self) -> Iterator[_Node]:
        stack = [self]
        while stack:
            node = stack.pop()
            yield node
            stack += node.children[::-1]


def read_collada(data: bytes) -> tuple[Array, Faces, tuple[int, ...], str, Colours]:
    """Vertices (n, 3) [m], faces (m, 3), one part, the up axis that is stated, the colours of the faces.

    Raises:
        UnusableMesh: not well-formed, a DOCTYPE, beyond a bound, or wrong counts, references or indices.
    """
    root = _tree(data)
    scene = _Scene(root)
    for node in scene.roots():
        scene.place(node, np.eye(4), 0)
    if not scene.placed:
        for geometry in (node for node in root.walk() if node.tag == "geometry"):
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


def _tree(data: bytes) -> _Node:
    from xml.parsers import expat

    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.buffer_size = 1 << 20
    top = _Node("", {})
    stack = [top]
    count = 0

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if count > MAX_ELEMENTS or len(stack) > MAX_DEPTH:
            raise UnusableMesh(f"has more than {MAX_ELEMENTS} elements, or {MAX_DEPTH} nested")
        node = _Node(name.rpartition(":")[2], attributes)
        stack[-1].children.append(node)
        stack.append(node)

    def end(_: str) -> None:
        stack.pop()

    def text(data: str) -> None:
        stack[-1].pieces.append(data)

    def refuse(*_: object) -> None:
        raise UnusableMesh("holds a DOCTYPE, which is not allowed", hint="delete it")

    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = start, end, text
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise UnusableMesh(f"is not well-formed XML: {expat.ErrorString(error.code)}, line {error.lineno}") from error
    except (LookupError, ValueError) as error:
        raise UnusableMesh(f"is not readable as XML: {error}") from error
    (root,) = top.children
    if root.tag != "COLLADA":
        raise UnusableMesh(f"is no Collada file: its root element is <{root.tag}>")
    return root


def _asset(root: _Node) -> tuple[float, str]:
    """Metres a unit, and the up axis; "" where none is stated."""
    asset = root.first("asset")
    unit = asset.first("unit") if asset is not None else None
    axis = asset.first("up_axis") if asset is not None else None
    (meter,) = _floats(unit.attributes.get("meter", "1") if unit is not None else "1", 1, "unit")
    if not 0.0 < meter < math.inf:
        raise UnusableMesh(f"states a unit of {meter:g} m")
    if axis is None:
        return meter, ""
    name = axis.text.strip()
    if name not in UP_AXES:
        raise UnusableMesh(f"states the up axis '{name[:20]}'; expected one of {', '.join(UP_AXES)}")
    return meter, name


class _Scene:
    """Walks the nodes of the scene and gathers triangles."""

    def __init__(self, root: _Node) -> None:
        self._root = root
        self._by_id = {node.attributes["id"]: node for node in root.walk() if "id" in node.attributes}
        self._meshes: dict[int, list[tuple[Array, Faces, str]]] = {}
        self._instances = 0
        self._triangles = 0
        self.placed: list[tuple[Array, Faces, Rgba | None]] = []

    def roots(self) -> list[_Node]:
        scene = self._root.first("scene")
        instance = scene.first("instance_visual_scene") if scene is not None else None
        if instance is not None:
            return self._named(instance.attributes.get("url", ""), "visual_scene").all("node")
        return [node for scene in self._root.walk() if scene.tag == "visual_scene" for node in scene.all("node")][:1000]

    def _named(self, url: str, tag: str) -> _Node:
        node = self._by_id.get(url[1:]) if url.startswith("#") else None
        if node is None or node.tag != tag:
            raise UnusableMesh(f"is damaged: it names {tag} '{url[:60]}', which is not in it")
        return node

    def place(self, node: _Node, X: Array, depth: int) -> None:
        """Adds what `node` and the nodes below it hold; `X` (4, 4) places its parent."""
        self._instances += 1
        if depth > MAX_DEPTH or self._instances > MAX_INSTANCES:
            raise UnusableMesh(f"has more than {MAX_INSTANCES} nodes, or {MAX_DEPTH} nested (or nodes in a circle)")
        for child in node.children:
            made = _TRANSFORMS.get(child.tag)
            if made is not None:
                X = X @ made(child)
        for child in node.children:
            url = child.attributes.get("url", "")
            if child.tag == "node":
                self.place(child, X, depth + 1)
            elif child.tag == "instance_node":
                self.place(self._named(url, "node"), X, depth + 1)
            elif child.tag == "instance_geometry":
                self.add(self._named(url, "geometry"), X, child)
            elif child.tag == "instance_controller":
                skin = self._named(url, "controller").first("skin")
                if skin is not None:
                    self.add(self._named(skin.attributes.get("source", ""), "geometry"), X, child)

    def add(self, geometry: _Node, X: Array, instance: _Node | None = None) -> None:
        """Adds a geometry; `instance` binds the names that it calls its materials by."""
        if id(geometry) not in self._meshes:
            meshes = [(mesh, part) for mesh in geometry.all("mesh") for part in mesh.all(*_PRIMITIVES)]
            self._meshes[id(geometry)] = [
                (*self._triangles_of(mesh, part), part.attributes.get("material", "")) for mesh, part in meshes
            ]
        for points, faces, symbol in self._meshes[id(geometry)]:
            self._triangles += max(len(faces), len(points) // 3)
            if self._triangles > MAX_TRIANGLES:
                raise UnusableMesh(f"has more than {MAX_TRIANGLES} triangles")
            if len(faces):
                with np.errstate(all="ignore"):  # what is not finite is told with its number
                    placed = points @ X[:3, :3].T + X[:3, 3]
                self.placed.append((placed, faces, self._colour(symbol, instance)))

    def _colour(self, symbol: str, instance: _Node | None) -> Rgba | None:
        """The diffuse colour behind a material's name; None where there is none, as with a texture: it is no fault."""
        bound = {
            node.attributes.get("symbol"): node.attributes.get("target", "").removeprefix("#")
            for node in (instance.walk() if instance is not None else ())
            if node.tag == "instance_material"
        }
        material = self._by_id.get(bound.get(symbol) or symbol)
        reference = material.first("instance_effect") if material is not None else None
        url = reference.attributes.get("url", "") if reference is not None else ""
        effect = self._by_id.get(url.removeprefix("#"))
        for tag in ("diffuse", "emission"):
            holder = next((node for node in effect.walk() if node.tag == tag), None) if effect is not None else None
            words = colour.text.split() if holder is not None and (colour := holder.first("color")) is not None else []
            try:
                r, g, b, a = (min(max(float(word), 0.0), 1.0) for word in [*words, "1"][:4])
            except ValueError:
                continue
            return (r, g, b, a)
        return None

    def _triangles_of(self, mesh: _Node, part: _Node) -> tuple[Array, Faces]:
        """Vertices (n, 3) of one primitive element and its faces (m, 3)."""
        inputs = part.all("input")
        vertex = next((each for each in inputs if each.attributes.get("semantic") == "VERTEX"), None)
        if vertex is None:
            raise UnusableMesh(f"is damaged: <{part.tag}> has no input VERTEX")
        vertices = self._named(vertex.attributes.get("source", ""), "vertices")
        position = next((each for each in vertices.all("input") if each.attributes.get("semantic") == "POSITION"), None)
        if position is None:
            raise UnusableMesh("is damaged: <vertices> has no input POSITION")
        points = self._points(self._named(position.attributes.get("source", ""), "source"))
        stride = 1 + max(_whole(each.attributes.get("offset", "0")) for each in inputs)
        offset = _whole(vertex.attributes.get("offset", "0"))
        faces = _faces(part, stride, offset)
        if len(faces) and (int(faces.min()) < 0 or int(faces.max()) >= len(points)):
            wrong = int(faces.min()) if int(faces.min()) < 0 else int(faces.max())
            raise UnusableMesh(f"is damaged: a triangle names vertex {wrong} of {len(points)}")
        return points, faces

    def _points(self, source: _Node) -> Array:
        array = source.first("float_array")
        if array is None:
            raise UnusableMesh("is damaged: a source of positions has no <float_array>")
        words = array.text.split()
        declared = array.attributes.get("count")
        if declared is not None and _whole(declared) != len(words):
            raise UnusableMesh(f"is damaged: <float_array> says {declared} numbers and has {len(words)}")
        values = _floats(words, len(words), "float_array")
        common = source.first("technique_common")
        accessor = common.first("accessor") if common is not None else None
        stride = _whole(accessor.attributes.get("stride", "1")) if accessor is not None else 3
        first = _whole(accessor.attributes.get("offset", "0")) if accessor is not None else 0
        count = _whole(accessor.attributes.get("count", "0")) if accessor is not None else len(values) // 3
        if stride < 3 or first + stride * count > len(values):
            raise UnusableMesh(f"is damaged: {count} positions of {stride} numbers do not fit into {len(values)}")
        return values[first : first + stride * count].reshape(-1, stride)[:, :3]


_PRIMITIVES = ("triangles", "polylist", "polygons", "tristrips", "trifans")


def _faces(part: _Node, stride: int, offset: int) -> Faces:
    """Triangles (m, 3) as indices of vertices; polygons become fans."""
    runs = [_indices(p.text)[: None if p.tag == "p" else 0] for p in part.all("p")]
    runs += [_indices(p.text) for holder in part.all("ph") for p in holder.all("p")]
    if any(len(run) % stride for run in runs):
        raise UnusableMesh(f"is damaged: <p> of <{part.tag}> does not hold {stride} numbers a vertex")
    corners = [run[offset::stride] for run in runs]
    declared = part.attributes.get("count")
    if part.tag == "triangles":
        flat = np.concatenate(corners) if corners else np.empty(0, dtype=np.int64)
        if len(flat) % 3 or (declared is not None and _whole(declared) * 3 != len(flat)):
            raise UnusableMesh(f'is damaged: <triangles count="{declared}"> has {len(flat)} vertices')
        return flat.reshape(-1, 3)
    if part.tag == "polylist":
        counts = part.first("vcount")
        sizes = _indices(counts.text) if counts is not None else np.empty(0, dtype=np.int64)
        flat = np.concatenate(corners) if corners else np.empty(0, dtype=np.int64)
        if int(sizes.sum()) != len(flat) or (len(sizes) and int(sizes.min()) < 0):
            raise UnusableMesh(f"is damaged: <vcount> says {int(sizes.sum())} vertices, <p> has {len(flat)}")
        if len(sizes) and bool((sizes == 3).all()):
            return flat.reshape(-1, 3)
        corners = np.split(flat, np.cumsum(sizes)[:-1])
    if sum(max(0, len(run) - 2) for run in corners) > MAX_TRIANGLES:
        raise UnusableMesh(f"has more than {MAX_TRIANGLES} triangles")
    made = [np.stack([_fan(run, part.tag), run[1:-1], run[2:]], axis=1) for run in corners if len(run) >= 3]
    return np.concatenate(made) if made else np.empty((0, 3), dtype=np.int64)


def _fan(run: Faces, tag: str) -> Faces:
    """The first vertex of each triangle of a polygon or fan (always the first one), or of a strip (the one before)."""
    return run[:-2] if tag == "tristrips" else np.full(len(run) - 2, run[0])


def _indices(text: str) -> Faces:
    try:
        return np.array(text.split(), dtype=np.int64)
    except (ValueError, OverflowError) as error:
        raise UnusableMesh(f"is damaged: an index is no whole number ({str(error)[:60]})") from error


def _whole(text: str) -> int:
    try:
        value = int(text[:20])
    except ValueError:
        value = -1
    if value < 0:
        raise UnusableMesh(f"is damaged: '{text[:20]}' is no count")
    return value


def _floats(text: str | list[str], count: int, what: str) -> Array:
    try:
        values = np.array(text.split() if isinstance(text, str) else text, dtype=np.float64)
    except ValueError as error:
        raise UnusableMesh(f"is damaged: a <{what}> holds what is no number") from error
    if len(values) != count:
        raise UnusableMesh(f"is damaged: a <{what}> holds {len(values)} numbers instead of {count}")
    return values


def _matrix(node: _Node) -> Array:
    return _floats(node.text, 16, "matrix").reshape(4, 4)


def _translate(node: _Node) -> Array:
    X = np.eye(4)
    X[:3, 3] = _floats(node.text, 3, "translate")
    return X


def _scale(node: _Node) -> Array:
    return np.diag([*_floats(node.text, 3, "scale"), 1.0])


def _rotate(node: _Node) -> Array:
    """About an axis x y z by an angle in degrees."""
    x, y, z, degrees = _floats(node.text, 4, "rotate")
    length = math.sqrt(x * x + y * y + z * z)
    X = np.eye(4)
    if length > 0.0 and math.isfinite(length + degrees):
        half = math.radians(degrees) / 2.0
        s = math.sin(half) / length
        X[:3, :3] = Transform.of(quat_xyzw=(x * s, y * s, z * s, math.cos(half))).R
    return X


def _unknown(node: _Node) -> Array:
    raise UnusableMesh(f"places a node by <{node.tag}>, which is not read", hint="export it with matrices")


_TRANSFORMS: dict[str, Callable[[_Node], Array]] = {
    "matrix": _matrix,
    "translate": _translate,
    "scale": _scale,
    "rotate": _rotate,
    "lookat": _unknown,
    "skew": _unknown,
}
