"""Mesh files: read as trimesh reads them, refused with a reason where they are damaged, written clean for engines."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from manipcli.core.errors import InvalidInput
from manipcli.description.lint.samples import TETRAHEDRON, ascii_tetrahedron, collada_tetrahedron
from manipcli.shapes import mesh as mesh_module
from manipcli.shapes import mesh_collada, mesh_formats
from manipcli.shapes.mesh import clean_mesh, read_mesh
from manipcli.shapes.mesh_formats import UnusableMesh, binary_stl
from manipcli.shapes.primitives import Mesh
from manipcli.shapes.proximity import coal_shape

CUBE_OBJ = b"""# two boxes' worth of nothing: one quad and one triangle
o first
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
f 1/1/1 2/2/1 3/3/1 4/4/1
o second
v 0 0 1
f -1 -2// -3
"""


def corners(path: Path) -> np.ndarray:
    mesh = read_mesh(path)
    return mesh.vertices[mesh.faces]


def write(path: Path, data: bytes | str) -> Path:
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path


def reason(path: Path) -> str:
    with pytest.raises(UnusableMesh) as caught:
        read_mesh(path)
    return caught.value.reason


@pytest.mark.parametrize("kind", ["stl", "stl_ascii", "obj", "dae"])
def test_every_format_holds_the_triangles_that_trimesh_wrote(tmp_path: Path, kind: str) -> None:
    solid = trimesh.creation.torus(0.3, 0.1, major_sections=12, minor_sections=8)
    path = tmp_path / f"torus.{kind.partition('_')[0]}"
    solid.export(path, file_type=kind)
    expected = np.asarray(solid.vertices)[solid.faces]
    np.testing.assert_allclose(corners(path), expected, atol=1e-6)  # text is written with 6 to 8 digits


def test_the_volume_of_a_solid_survives_being_read(tmp_path: Path) -> None:
    """Divergence theorem over the triangles: the sphere's facets enclose what trimesh says they do."""
    solid = trimesh.creation.icosphere(subdivisions=2, radius=0.5)
    path = tmp_path / "ball.stl"
    solid.export(path)
    a, b, c = np.moveaxis(corners(path), 1, 0)
    assert np.sum(a * np.cross(b, c)) / 6.0 == pytest.approx(solid.volume, rel=1e-5)


def test_polygons_become_fans_and_negative_indices_count_back(tmp_path: Path) -> None:
    mesh = read_mesh(write(tmp_path / "a.obj", CUBE_OBJ))
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [4, 3, 2]]
    assert mesh.parts == (0, 2)


def test_the_content_decides_not_the_name(tmp_path: Path) -> None:
    assert read_mesh(write(tmp_path / "a.obj", binary_stl(TETRAHEDRON))).format == "stl"
    assert read_mesh(write(tmp_path / "b.dae", ascii_tetrahedron())).format == "stl-ascii"
    assert read_mesh(write(tmp_path / "c.stl", collada_tetrahedron())).format == "collada"
    solid_in_name = b"solid but binary".ljust(80) + binary_stl(TETRAHEDRON)[80:]
    assert read_mesh(write(tmp_path / "d.stl", solid_in_name)).format == "stl"


def test_collada_places_its_nodes_and_counts_in_metres(tmp_path: Path) -> None:
    """T R S as written, from the left: p = unit (t + R s p_file); rotate is in degrees."""
    text = collada_tetrahedron(meter=0.01).decode()
    moved = "<translate>1 2 3</translate><rotate>0 0 1 90</rotate><scale>2 1 1</scale>"
    nested = f"<node>{moved}<node><instance_geometry"
    text = text.replace("<node><instance_geometry", nested).replace("</node></visual", "</node></node></visual")
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    expected = 0.01 * (np.array([1.0, 2.0, 3.0]) + (TETRAHEDRON * (2.0, 1.0, 1.0)) @ turn.T)
    np.testing.assert_allclose(corners(write(tmp_path / "a.dae", text)), expected, atol=1e-15)


def test_a_text_stl_in_capitals_is_one(tmp_path: Path) -> None:
    mesh = read_mesh(write(tmp_path / "a.stl", ascii_tetrahedron().upper()))
    np.testing.assert_allclose(mesh.vertices[mesh.faces], TETRAHEDRON)


def test_collada_up_axis_is_told_and_turns_nothing(tmp_path: Path) -> None:
    mesh = read_mesh(write(tmp_path / "a.dae", collada_tetrahedron(up_axis="Y_UP")))
    assert mesh.up_axis == "Y_UP"
    bare = read_mesh(write(tmp_path / "b.dae", DAE.replace(b"<up_axis>Z_UP</up_axis>", b"")))
    assert bare.up_axis == ""
    np.testing.assert_allclose(mesh.vertices[mesh.faces], TETRAHEDRON)


def test_collada_polylists_strips_and_reused_nodes(tmp_path: Path) -> None:
    text = collada_tetrahedron().decode()
    square = '<polylist count="1"><input semantic="VERTEX" source="#v" offset="1"/>'
    square += '<input semantic="NORMAL" source="#p" offset="0"/><vcount>4</vcount><p>9 0 9 1 9 2 9 3</p></polylist>'
    strip = '<tristrips count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2 3</p></tristrips>'
    kept, rest = text.split("<triangles", 1)[0], text.split("</triangles>", 1)[1]
    assert read_mesh(write(tmp_path / "p.dae", kept + square + rest)).faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert read_mesh(write(tmp_path / "s.dae", kept + strip + rest)).faces.tolist() == [[0, 1, 2], [1, 2, 3]]
    twice = text.replace('<instance_geometry url="#g"/>', '<instance_geometry url="#g"/>' * 2)
    assert len(read_mesh(write(tmp_path / "t.dae", twice)).faces) == 8


DAE = collada_tetrahedron()
DAMAGED = {
    "empty.stl": (b"", "is empty"),
    "short.stl": (b"abc", "3 bytes are less than its header of 84"),
    "cut.stl": (binary_stl(TETRAHEDRON)[:-7], "is truncated: 4 triangles take 284 bytes, the file has 277"),
    "long.stl": (binary_stl(TETRAHEDRON) + b"x", "is damaged: 4 triangles take 284 bytes, the file has 285"),
    "none.stl": (binary_stl(TETRAHEDRON[:0]), "has no triangles"),
    "nan.stl": (binary_stl(TETRAHEDRON * np.nan), "vertex 1 is at (nan, nan, nan)"),
    "inf.stl": (binary_stl(TETRAHEDRON * 1e30), "is damaged: vertex"),
    "point.stl": (binary_stl(TETRAHEDRON * 0.0), "are at one point"),
    "text.stl": (ascii_tetrahedron().replace(b"vertex 1.0 0.0 0.0", b"vertex 1.0 zero"), "is damaged"),
    "texts.stl": (ascii_tetrahedron().replace(b"vertex 1.0 0.0 0.0\n", b"", 1), "not a whole number of triangles"),
    "textcut.stl": (ascii_tetrahedron()[:-40], "is truncated"),
    "obj.stl": (b"# made by\no cube\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n" * 4, "contains OBJ, not STL"),
    "picture.stl": (b"\x89PNG\r\n\x1a\n" + b"x" * 200, "is a PNG picture"),
    "picture.obj": (b"\x89PNG\r\n\x1a\n" + b"x" * 200, "is a PNG picture"),
    "lfs.stl": (b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1\n", "Git LFS pointer"),
    "page.stl": (b"<!DOCTYPE html><html>404</html>", "is a web page"),
    "far.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99\n", "triangle 1 has vertices 0, 1, 98 of 3"),
    "back.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -30000\n", "face 1 has vertex"),
    "zero.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "face 1 has vertex"),
    "word.obj": (b"v 0 0 zero\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "is damaged"),
    "garbage.obj": (b"\x00\x01garbage", "is not an OBJ file"),
    "prose.obj": (b"nothing of it\n", "is not an OBJ file"),
    "a.ply": (b"ply\nformat ascii 1.0\n", "is a PLY file"),
    "a.mesh": (b"x" * 90, "has the unsupported format '.mesh'"),
    "not.dae": (b"solid", "is not a Collada file"),
    "other.dae": (b"<?xml version='1.0'?><svg/>", "its root element is <svg>"),
    "bare.dae": (b"<COLLADA/>", "has no triangles"),
    "open.dae": (DAE[:-20], "is not well-formed XML"),
    "far.dae": (DAE.replace(b"<p>0 2", b"<p>0 77"), "has vertex 77 of 4"),
    "minus.dae": (DAE.replace(b"<p>0 2", b"<p>0 -5"), "has vertex -5 of 4"),
    "count.dae": (DAE.replace(b'triangles count="4"', b'triangles count="99999999"'), "is damaged: <triangles"),
    "numbers.dae": (DAE.replace(b'id="pa" count="12"', b'id="pa" count="99999999"'), "is damaged: <float_array>"),
    "stride.dae": (DAE.replace(b'count="4" stride="3"', b'count="400" stride="3"'), "400 positions of 3 numbers"),
    "nobody.dae": (DAE.replace(b'url="#g"', b'url="#h"'), "unknown geometry '#h'"),
    "net.dae": (DAE.replace(b'url="#g"', b'url="http://x/#g"'), "unknown geometry 'http://x/#g'"),
    "circle.dae": (DAE.replace(b"<node>", b'<node id="n"><instance_node url="#n"/>'), "or a circle"),
    "up.dae": (DAE.replace(b"Z_UP", b"W_UP"), "up axis 'W_UP'"),
    "unit.dae": (DAE.replace(b'meter="1.0"', b'meter="-1"'), "a unit of -1 m"),
    "look.dae": (DAE.replace(b"<node>", b"<node><lookat>0</lookat>"), "uses <lookat>"),
    "doctype.dae": (DAE.replace(b"<COLLADA", b'<!DOCTYPE x [<!ENTITY a "b">]><COLLADA', 1), "DOCTYPE"),
}


@pytest.mark.parametrize("name", DAMAGED)
def test_a_damaged_file_says_what_is_wrong_with_it(tmp_path: Path, name: str) -> None:
    data, expected = DAMAGED[name]
    assert expected in reason(write(tmp_path / name, data))


def test_only_regular_files_are_opened(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "fifo.stl")
    assert reason(tmp_path / "fifo.stl") == "is not a regular file"
    assert reason(tmp_path) == "is not a regular file"
    assert reason(Path("/dev/zero")) == "is not a regular file"
    assert "No such file" in reason(tmp_path / "absent.stl")


def test_sizes_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "huge.stl"
    with path.open("wb") as file:
        file.truncate(mesh_module.MAX_BYTES + 1)
    assert "at most 256 MB" in reason(path)
    monkeypatch.setattr(mesh_formats, "MAX_TRIANGLES", 3)
    assert "has 4 triangles; at most 3" in reason(write(tmp_path / "many.stl", binary_stl(TETRAHEDRON)))
    monkeypatch.setattr(mesh_collada, "MAX_TRIANGLES", 3)
    assert "more than 3 triangles" in reason(write(tmp_path / "many.dae", DAE))


def test_a_file_that_changed_is_read_again(tmp_path: Path) -> None:
    path = write(tmp_path / "a.stl", binary_stl(TETRAHEDRON))
    assert len(read_mesh(path).faces) == 4
    write(path, binary_stl(TETRAHEDRON[:2]))
    assert len(read_mesh(path).faces) == 2


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(["stl", "ascii", "obj", "dae"]), st.data())
def test_whatever_the_bytes_are_the_answer_is_a_mesh_or_a_reason(
    tmp_path_factory: pytest.TempPathFactory, kind: str, data: st.DataObject
) -> None:
    good = {"stl": binary_stl(TETRAHEDRON), "ascii": ascii_tetrahedron(), "obj": CUBE_OBJ, "dae": DAE}[kind]
    spoilt = bytearray(good)
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(spoilt) - 1))
        spoilt[at : at + data.draw(st.integers(0, 6))] = data.draw(st.binary(max_size=6))
        if not spoilt:
            break
    suffix = {"ascii": "stl"}.get(kind, kind)
    path = write(tmp_path_factory.mktemp("mesh") / f"a.{suffix}", bytes(spoilt))
    try:
        mesh = read_mesh(path)
    except UnusableMesh as error:
        assert error.reason
    else:
        assert np.isfinite(mesh.vertices).all()
        assert mesh.faces.min() >= 0 and mesh.faces.max() < len(mesh.vertices)


def test_hulls_are_those_of_an_independent_program(tmp_path: Path) -> None:
    from scipy.spatial import ConvexHull

    points = np.random.default_rng(3).normal(size=(40, 3))
    faces = np.random.default_rng(4).permutation(39).reshape(-1, 3)
    path = write(tmp_path / "a.stl", binary_stl(points[faces]))
    hull = coal_shape(Mesh("a", path, (1.0, 2.0, -0.5)))
    assert hull.computeVolume() == pytest.approx(ConvexHull(points[:39]).volume, rel=1e-5)  # |1 * 2 * -0.5| = 1


@pytest.mark.parametrize("name", ["a.stl", "b.stl", "c.obj", "d.dae"])
def test_engines_get_a_file_of_ours_with_the_same_triangles(tmp_path: Path, name: str) -> None:
    data = {"a.stl": binary_stl(TETRAHEDRON), "b.stl": ascii_tetrahedron(), "c.obj": CUBE_OBJ, "d.dae": DAE}[name]
    user = write(tmp_path / name, data)
    (tmp_path / "engine").mkdir()
    path = clean_mesh(Mesh(name, user), tmp_path / "engine")
    assert path.parent == tmp_path / "engine"
    assert path.suffix == (".obj" if name.endswith("obj") else ".stl")
    np.testing.assert_array_equal(corners(path), corners(user))
    assert read_mesh(path).parts == read_mesh(user).parts
    assert read_mesh(path).format in ("stl", "obj")


def test_an_engine_never_gets_a_damaged_file(tmp_path: Path) -> None:
    user = write(tmp_path / "far.obj", DAMAGED["far.obj"][0])
    with pytest.raises(InvalidInput, match="triangle 1 has vertices"):
        clean_mesh(Mesh("far.obj", user), tmp_path)


def test_bullet_holds_the_same_shape_for_our_file_as_for_the_users(tmp_path: Path) -> None:
    """Distances from probes all around, to the millionth, for an OBJ of several parts and an STL."""
    import pybullet
    import pybullet_data

    data = Path(pybullet_data.getDataPath())
    files = [data / "franka_panda/meshes/collision/finger.obj", data / "kuka_iiwa/meshes/link_3.stl"]
    two = trimesh.creation.box(extents=(0.1, 0.1, 0.1)).export(file_type="obj")
    other = trimesh.creation.box(
        extents=(0.1, 0.1, 0.1), transform=trimesh.transformations.translation_matrix((1, 0, 0))
    )
    lines = [line for line in other.export(file_type="obj").splitlines() if line.startswith(("v ", "f "))]
    shifted = ["f " + " ".join(str(int(k) + 8) for k in line.split()[1:]) if line[0] == "f" else line for line in lines]
    files.append(write(tmp_path / "two.obj", "o a\n" + two + "\no b\n" + "\n".join(shifted) + "\n"))
    client = pybullet.connect(pybullet.DIRECT)
    rng = np.random.default_rng(0)
    try:
        for file in files:
            bodies = []
            for path in (file, clean_mesh(Mesh("m", file), tmp_path)):
                shape = pybullet.createCollisionShape(pybullet.GEOM_MESH, fileName=str(path), physicsClientId=client)
                bodies.append(pybullet.createMultiBody(1.0, shape, physicsClientId=client))
            ball = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=0.01, physicsClientId=client)
            for probe in rng.uniform(-1.0, 1.0, size=(20, 3)):
                k = pybullet.createMultiBody(0.0, ball, basePosition=probe.tolist(), physicsClientId=client)
                found = [
                    min(p[8] for p in pybullet.getClosestPoints(body, k, 9.0, physicsClientId=client))
                    for body in bodies
                ]
                assert found[0] == pytest.approx(found[1], abs=1e-6)
                pybullet.removeBody(k, physicsClientId=client)
            for body in bodies:
                pybullet.removeBody(body, physicsClientId=client)
    finally:
        pybullet.disconnect(client)
