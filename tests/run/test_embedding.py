"""A log that carries its meshes carries all that they are drawn with."""

from __future__ import annotations

from pathlib import Path

from manipcli.run.embedding import embeddable


def test_names_are_plain_and_distinct_and_materials_come_along(tmp_path: Path) -> None:
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "base link.obj").write_text("mtllib sub/base.mtl\nmtllib absent.mtl\nv 0 0 0\n")
        (tmp_path / folder / "base.mtl").write_text("newmtl red\n")
        (tmp_path / folder / "other.stl").write_bytes(b"mtllib base.mtl")
    meshes = {
        f"package://{folder}/{name}": tmp_path / folder / name
        for folder in ("a", "b")
        for name in ("base link.obj", "other.stl")
    }
    files = embeddable(meshes)
    assert [(one.uri, one.attachment) for one in files] == [
        ("package://a/base link.obj", "mesh_000_base_link.obj"),
        ("package://a/base.mtl", "mesh_001_base.mtl"),
        ("package://a/other.stl", "mesh_002_other.stl"),
        ("package://b/base link.obj", "mesh_003_base_link.obj"),
        ("package://b/base.mtl", "mesh_004_base.mtl"),
        ("package://b/other.stl", "mesh_005_other.stl"),
    ]
    assert files[1].path == tmp_path / "a" / "base.mtl"
    hostile = embeddable({"package://x/" + "ü/" * 3 + "a" * 300 + ".stl": tmp_path / "a" / "other.stl"})
    assert hostile[0].attachment == f"mesh_000_{'a' * 76}.stl"
