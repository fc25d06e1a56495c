"""Parts of a glTF 2.0 binary file: a JSON document and one buffer (registry.khronos.org/glTF/specs/2.0)."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.core.version import __version__
from manipcli.render.drawing import Drawable
from manipcli.render.surface import Surface
from manipcli.replay.pack import Json
from manipcli.shapes.primitives import Rgba

MEDIA_TYPE: Final = "model/gltf-binary"
FLOAT, UINT32 = 5126, 5125
"""Component types."""
_VERTICES, _INDICES = 34962, 34963
_WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}
_HEAD, _CHUNK = struct.Struct("<4sII"), struct.Struct("<I4s")
ROUGHNESS = 0.8
"""Of every material: descriptions have colours only."""


@dataclass(slots=True)
class Document:
    """A glTF document while it is made; equal surfaces and colours are stored once."""

    nodes: list[Json] = field(default_factory=list)
    animations: list[Json] = field(default_factory=list)
    _meshes: list[Json] = field(default_factory=list)
    _materials: list[Json] = field(default_factory=list)
    _accessors: list[Json] = field(default_factory=list)
    _views: list[Json] = field(default_factory=list)
    _parts: list[bytes] = field(default_factory=list)
    _length: int = 0
    _surfaces: dict[bytes, Json] = field(default_factory=dict)
    _colours: dict[Rgba, int] = field(default_factory=dict)

    def mesh(self, name: str, drawables: Sequence[Drawable]) -> int:
        """Index of a mesh with one primitive per drawable."""
        primitives = [
            {**self._surface(drawable.surface), "material": self._material(drawable.rgba)} for drawable in drawables
        ]
        self._meshes.append({"name": name, "primitives": primitives})
        return len(self._meshes) - 1

    def accessor(self, values: Array, *, bounds: bool = False) -> int:
        """Index of an accessor of float32: values (k,), (k, 3) or (k, 4); `bounds`: with minimum and maximum."""
        data = np.ascontiguousarray(values, dtype="<f4")
        kind = "SCALAR" if data.ndim == 1 else f"VEC{data.shape[1]}"
        extent: Json = {}
        if bounds:
            rows = data.reshape(len(data), _WIDTHS[kind])
            extent = {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        return self._add(data.tobytes(), FLOAT, kind, len(data), None, extent)

    def glb(self, root: int) -> bytes:
        """The file with the node `root` as its scene."""
        document: Json = {
            "asset": {"version": "2.0", "generator": f"manipcli {__version__}"},
            "scene": 0,
            "scenes": [{"nodes": [root]}],
            "nodes": self.nodes,
            **({"meshes": self._meshes} if self._meshes else {}),
            **({"materials": self._materials} if self._materials else {}),
            **({"animations": self.animations} if self.animations else {}),
            **({"accessors": self._accessors, "bufferViews": self._views} if self._views else {}),
            **({"buffers": [{"byteLength": self._length}]} if self._length else {}),
        }
        text = json.dumps(document, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
        chunks = [(b"JSON", text + b" " * (-len(text) % 4))]
        if self._length:
            chunks.append((b"BIN\0", b"".join(self._parts)))
        body = b"".join(_CHUNK.pack(len(data), kind) + data for kind, data in chunks)
        return _HEAD.pack(b"glTF", 2, _HEAD.size + len(body)) + body

    def _surface(self, surface: Surface) -> Json:
        key = surface.vertices.tobytes() + surface.faces.tobytes()
        if key not in self._surfaces:
            normals = np.asarray(surface.normals, dtype="<f4").astype(float)
            places = self._vertices(surface.vertices, bounds=True)
            facing = self._vertices(normals / np.linalg.norm(normals, axis=1, keepdims=True))
            corners = np.ascontiguousarray(surface.faces.reshape(-1), dtype="<u4")
            indices = self._add(corners.tobytes(), UINT32, "SCALAR", len(corners), _INDICES, {})
            self._surfaces[key] = {"attributes": {"POSITION": places, "NORMAL": facing}, "indices": indices}
        return self._surfaces[key]

    def _vertices(self, values: Array, *, bounds: bool = False) -> int:
        index = self.accessor(values, bounds=bounds)
        self._views[-1]["target"] = _VERTICES
        return index

    def _material(self, rgba: Rgba) -> int:
        if rgba not in self._colours:
            self._colours[rgba] = len(self._materials)
            colour = [*map(linear, rgba[:3]), min(max(rgba[3], 0.0), 1.0)]
            surface = {"baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": ROUGHNESS}
            clear = {"alphaMode": "BLEND"} if rgba[3] < 1.0 else {}
            self._materials.append({"pbrMetallicRoughness": surface, "doubleSided": True, **clear})
        return self._colours[rgba]

    def _add(self, data: bytes, component: int, kind: str, count: int, target: int | None, extent: Json) -> int:
        view: Json = {"buffer": 0, "byteOffset": self._length, "byteLength": len(data)}
        self._views.append(view | ({"target": target} if target is not None else {}))
        self._parts.append(data)
        self._length += len(data)
        entry: Json = {"bufferView": len(self._views) - 1, "componentType": component, "count": count, "type": kind}
        self._accessors.append(entry | extent)
        return len(self._accessors) - 1


def linear(value: float) -> float:
    """A colour of a description (sRGB) as the linear factor of a material (IEC 61966-2-1)."""
    value = min(max(value, 0.0), 1.0)
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4
