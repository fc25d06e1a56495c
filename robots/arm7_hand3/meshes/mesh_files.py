"""Collada 1.4.1 and binary STL, written byte for byte the same each time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from surfaces import Array, Surface

_DOCUMENT = """<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset>
    <created>2000-01-01T00:00:00Z</created>
    <modified>2000-01-01T00:00:00Z</modified>
    <unit name="meter" meter="1"/>
    <up_axis>Z_UP</up_axis>
  </asset>
  <library_effects>
    <effect id="{name}-effect">
      <profile_COMMON>
        <technique sid="common">
          <phong>
            <diffuse><color>{r:g} {g:g} {b:g} {a:g}</color></diffuse>
            <specular><color>0.2 0.2 0.2 1</color></specular>
            <shininess><float>30</float></shininess>
          </phong>
        </technique>
      </profile_COMMON>
    </effect>
  </library_effects>
  <library_materials>
    <material id="{name}-material"><instance_effect url="#{name}-effect"/></material>
  </library_materials>
  <library_geometries>
    <geometry id="{name}-geometry">
      <mesh>
{positions}
{normals}
        <vertices id="{name}-vertices"><input semantic="POSITION" source="#{name}-positions"/></vertices>
        <triangles material="{name}-material" count="{count}">
          <input semantic="VERTEX" source="#{name}-vertices" offset="0"/>
          <input semantic="NORMAL" source="#{name}-normals" offset="0"/>
          <p>{faces}</p>
        </triangles>
      </mesh>
    </geometry>
  </library_geometries>
  <library_visual_scenes>
    <visual_scene id="scene">
      <node id="{name}">
        <instance_geometry url="#{name}-geometry">
          <bind_material>
            <technique_common>
              <instance_material symbol="{name}-material" target="#{name}-material"/>
            </technique_common>
          </bind_material>
        </instance_geometry>
      </node>
    </visual_scene>
  </library_visual_scenes>
  <scene><instance_visual_scene url="#scene"/></scene>
</COLLADA>
"""

_SOURCE = """        <source id="{id}">
          <float_array id="{id}-array" count="{count}">{values}</float_array>
          <technique_common>
            <accessor source="#{id}-array" count="{rows}" stride="3">
              <param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
            </accessor>
          </technique_common>
        </source>"""


def _source(name: str, values: Array, digits: int) -> str:
    rows = ["{:g} {:g} {:g}".format(*row) for row in np.round(values, digits) + 0.0]
    return _SOURCE.format(id=name, count=values.size, rows=len(values), values="\n".join(rows))


def write_collada(path: Path, surface: Surface, rgba: tuple[float, float, float, float]) -> None:
    """One geometry of one colour, in metres, z up. Positions are rounded to 0.01 mm, normals to 0.01."""
    name = path.stem
    r, g, b, a = rgba
    text = _DOCUMENT.format(
        name=name, r=r, g=g, b=b, a=a, count=len(surface.faces),
        positions=_source(f"{name}-positions", surface.points, 5),
        normals=_source(f"{name}-normals", surface.normals, 2),
        faces="\n".join("{} {} {}".format(*face) for face in surface.faces),
    )  # fmt: skip
    path.write_text(text, encoding="utf-8")


def write_stl(path: Path, surface: Surface) -> None:
    """Binary STL: 80 bytes of header, the count, then 50 bytes a triangle."""
    corners = surface.points[surface.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    data = np.zeros(len(corners), dtype=record)
    data["normal"] = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    data["corners"] = corners
    path.write_bytes(bytes(80) + np.uint32(len(data)).tobytes() + data.tobytes())
