"""Convex parts of meshes: boxes stay boxes, a bowl becomes hollow; trimesh gives volumes and containment."""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from manipcli.core.activity import announced_to
from manipcli.core.cache import MAGIC
from manipcli.core.errors import InvalidInput
from manipcli.core.geometry import Array
from manipcli.description.packages import Packages
from manipcli.render.drawing import Layer, draw
from manipcli.scene.build_scene import build_scene
from manipcli.scene.scene import Scene
from manipcli.scene.scene_file import scene_from_json, scene_to_json
from manipcli.shapes import convex_parts as module
from manipcli.shapes.convex_parts import concave, convex_parts
from manipcli.shapes.mesh_formats import UnusableMesh
from manipcli.shapes.primitives import ConvexPart, Mesh
from manipcli.spec.scene import BodySpec
from manipcli.spec.task import TaskSpec

RADIUS, WALL = 0.08, 0.008
LAYERS: tuple[Layer, ...] = ("visual", "collision")


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
    module._parts.cache_clear()
    return folder / "manipcli" / "convex_parts"


def bowl(path: Path, *, around: int = 12, rings: int = 3) -> trimesh.Trimesh:
    """Half a hollow sphere, open at the top, its lowest point at the origin."""
    angles = np.linspace(-math.pi / 2, 0.0, rings + 1)
    profile = [(r * math.cos(a), r * math.sin(a) + RADIUS) for r, order in ((RADIUS, 1), (RADIUS - WALL, -1))
               for a in angles[::order]]  # fmt: skip
    made = trimesh.creation.revolve(np.array(profile), sections=around)
    made.export(path)
    return made


def shelf(path: Path) -> trimesh.Trimesh:
    """Two sides and three boards, which share corners and edges: five closed parts in one file."""
    sides = [trimesh.creation.box((0.02, 0.3, 0.9), translated(x, 0.0, 0.45)) for x in (-0.41, 0.41)]
    boards = [trimesh.creation.box((0.8, 0.3, 0.02), translated(0.0, 0.0, z)) for z in (0.01, 0.45, 0.89)]
    made = trimesh.util.concatenate([*sides, *boards])
    made.export(path)
    return made


def translated(x: float, y: float, z: float) -> Array:
    X = np.eye(4)
    X[:3, 3] = (x, y, z)
    return X


def surface(part: ConvexPart) -> trimesh.Trimesh:
    return trimesh.Trimesh(np.array(part.points), np.array(part.triangles), process=False)


def in_any(parts: tuple[ConvexPart, ...], points: Array) -> Array:
    """Whether each point is inside all faces of any part."""
    inside = np.zeros(len(points), dtype=bool)
    for part in map(surface, parts):
        offsets = np.einsum("ij,ij->i", part.triangles[:, 0], part.face_normals)
        inside |= (points @ part.face_normals.T <= offsets).all(axis=1)
    return inside


def scene(folder: Path, **bodies: dict[str, Any]) -> Scene:
    written = {name: BodySpec.model_validate(body) for name, body in bodies.items()}
    fields: dict[str, Any] = {"task": "t", "scene": written, "frames": {}}
    spec = TaskSpec.model_construct(**fields)
    return build_scene(spec, packages=Packages(folder / "task.yaml"))


def test_separate_convex_parts_need_no_decomposition(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = shelf(tmp_path / "shelf.stl")
    monkeypatch.setattr(metadata, "version", pytest.fail)
    assert concave(tmp_path / "shelf.stl")
    parts = convex_parts(tmp_path / "shelf.stl")
    assert [part.index for part in parts] == list(range(5))
    volumes = sorted(each.volume for each in mesh.split())
    assert sorted(surface(part).volume for part in parts) == pytest.approx(volumes, rel=1e-6)
    assert all(surface(part).is_watertight and surface(part).is_convex for part in parts)


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_solid_is_not_concave_also_inside_out(tmp_path: Path, mirrored: bool) -> None:
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.05)
    if mirrored:
        ball.invert()
    ball.export(tmp_path / "ball.stl")
    assert not concave(tmp_path / "ball.stl")
    (part,) = convex_parts(tmp_path / "ball.stl")
    assert surface(part).volume == pytest.approx(abs(ball.volume), rel=1e-4)


@pytest.mark.parametrize(("missing", "found"), [(0, False), (1, False), (2, True)])
def test_an_open_box_is_concave_and_one_with_a_hole_is_not(tmp_path: Path, missing: int, found: bool) -> None:
    box = trimesh.creation.box((1.0, 2.0, 3.0))
    top = np.flatnonzero(box.face_normals[:, 2] > 0.5)[:missing]  # each triangle hides 1/12 of the box
    box.update_faces(~np.isin(np.arange(len(box.faces)), top))
    box.export(tmp_path / "open.stl")
    assert concave(tmp_path / "open.stl") == found


def test_a_bowl_is_hollow_and_its_wall_is_not(tmp_path: Path, cache: Path) -> None:
    pytest.importorskip("coacd")
    mesh = bowl(tmp_path / "bowl.stl")
    heard: list[str] = []
    with announced_to(heard.append):
        parts = convex_parts(tmp_path / "bowl.stl")
    assert len(heard) == 1 and "bowl.stl" in heard[0]
    rng = np.random.default_rng(1)
    centre = np.array([0.0, 0.0, RADIUS])  # the inner surface is the outer one, shrunk towards this point
    found, faces = trimesh.sample.sample_surface(mesh, 2000, seed=1)
    outer = found[np.einsum("ij,ij->i", mesh.face_normals[faces], found - centre) > 0.5 * RADIUS] - centre
    wall = centre + rng.uniform(0.91, 0.99, (len(outer), 1)) * outer
    hollow = centre + rng.uniform(0.0, 0.85, (len(outer), 1)) * outer
    assert len(outer) > 500
    assert in_any(parts, wall).mean() > 0.98
    assert in_any(parts, hollow).mean() < 0.01
    # A second process and a damaged file: the same parts.
    (file,) = cache.iterdir()
    whole = file.read_bytes()
    module._parts.cache_clear()
    with announced_to(heard.append):
        assert convex_parts(tmp_path / "bowl.stl") == parts
    assert len(heard) == 1
    for damaged in (whole[:-1], b"", b"\x00" * 100, MAGIC, whole.replace(MAGIC, b"manipcli cache 9\n")):
        file.write_bytes(damaged)
        module._parts.cache_clear()
    with announced_to(heard.append):
        assert convex_parts(tmp_path / "bowl.stl") == parts
    assert len(heard) == 2 and file.read_bytes() == whole


def test_a_ball_falls_into_a_bowl_and_onto_its_hull(tmp_path: Path) -> None:
    pytest.importorskip("coacd")
    p = pytest.importorskip("pybullet")
    from manipcli.simulate.engines.pybullet_world import add_body

    bowl(tmp_path / "bowl.stl", around=8, rings=2)
    heights = {}
    for collision in (None, "hull"):
        client = p.connect(p.DIRECT)
        p.setGravity(0.0, 0.0, -9.81, physicsClientId=client)
        p.setTimeStep(0.002, physicsClientId=client)
        mesh = {"file": "bowl.stl", **({"collision": collision} if collision else {})}
        made = scene(
            tmp_path,
            bowl={"mesh": mesh, "fixed": True, "pose": {}},
            ball={
                "sphere": {"radius": 0.02},
                "mass": 0.05,
                "pose": {"xyz": [0.01, 0.0, 0.12]},
                "rolling_friction": 0.001,
            },
        )
        again = scene_from_json(scene_to_json(made))  # as the log has it, without the file of the mesh
        shapes = [[each.shape.part for each in s.body("bowl").geometries if isinstance(each.shape, Mesh)]
                  for s in (made, again)]  # fmt: skip
        assert shapes[0] == shapes[1] and (len(shapes[0]) > 1) == (collision is None)
        bodies = (again if collision is None else made).bodies
        numbers = [add_body(p, client, body, tmp_path) for body in bodies]
        for _ in range(1000):
            p.stepSimulation(physicsClientId=client)
        heights[collision] = p.getBasePositionAndOrientation(numbers[-1], physicsClientId=client)[0][2]
        p.disconnect(physicsClientId=client)
    assert heights[None] == pytest.approx(WALL + 0.02, abs=0.01)
    assert heights["hull"] > RADIUS + 0.015 or heights["hull"] < 0.03  # on the lid, or rolled off it


def test_a_shelf_has_room_mass_and_one_picture(tmp_path: Path) -> None:
    mesh = shelf(tmp_path / "shelf.stl")
    bodies: dict[str, Any] = {
        "shelf": {"mesh": {"file": "shelf.stl"}, "mass": 12.0, "pose": {}},
        "box": {"box": {"size": [0.3, 0.2, 0.4]}, "mass": 1.0, "pose": {"xyz": [0.0, 0.0, 0.23]}},
    }
    made = scene(tmp_path, **bodies)
    body = made.body("shelf")
    mesh.density = 12.0 / mesh.volume
    np.testing.assert_allclose(body.X_OI.p, mesh.center_mass, atol=1e-6)
    about_centre = body.X_OI.R @ body.inertia @ body.X_OI.R.T
    np.testing.assert_allclose(about_centre, mesh.moment_inertia, rtol=1e-5, atol=1e-6)
    drawing = draw(None, made)
    drawn = {layer: [each for each in drawing.layer(layer) if each.frame == "shelf"] for layer in LAYERS}
    assert (len(drawn["visual"]), len(drawn["collision"])) == (1, 5)
    bodies["shelf"]["mesh"]["collision"] = "hull"
    with pytest.raises(InvalidInput, match="overlap"):
        scene(tmp_path, **bodies)


def test_without_coacd_the_error_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(name: str) -> str:
        raise metadata.PackageNotFoundError(name)

    bowl(tmp_path / "bowl.stl")
    monkeypatch.setattr(metadata, "version", absent)
    with pytest.raises(InvalidInput) as raised:
        scene(tmp_path, bowl={"mesh": {"file": "bowl.stl"}, "fixed": True, "pose": {}})
    (finding,) = raised.value.findings
    assert "CoACD is not installed" in finding.message
    assert "manipcli[coacd]" in (finding.hint or "") and "collision: hull" in (finding.hint or "")
    assert scene(tmp_path, bowl={"mesh": {"file": "bowl.stl", "collision": "hull"}, "fixed": True, "pose": {}})


def test_a_mesh_with_too_many_triangles_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bowl(tmp_path / "bowl.stl")
    monkeypatch.setattr(module, "MOST_TRIANGLES", 10)
    with pytest.raises(UnusableMesh, match="at most 10 are decomposed"):
        convex_parts(tmp_path / "bowl.stl")


@pytest.mark.parametrize("body", ["raise SystemExit(3)", "import os; os.abort()", "import time; time.sleep(60)"])
def test_a_crash_or_endless_work_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, body: str, cache: Path
) -> None:
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "coacd.py").write_text(body)
    bowl(tmp_path / "bowl.stl")
    monkeypatch.setattr(metadata, "version", lambda _: "0")
    monkeypatch.setattr(module, "PATIENCE", 2.0)
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path / 'site'}:{Path(module.__file__).parents[2]}")
    with pytest.raises(UnusableMesh, match="decomposed into convex parts"):
        convex_parts(tmp_path / "bowl.stl")
    assert not cache.exists()


def _stored(points: Array, counts: Array) -> bytes:
    import io

    file = io.BytesIO()
    np.savez(file, points=points, counts=counts)
    return file.getvalue()


CORNERS = np.random.default_rng(0).uniform(size=(8, 3))


@pytest.mark.parametrize(
    "content",
    [
        lambda: b"",
        lambda: b"PK\x03\x04",
        lambda: _stored(CORNERS * 100.0, np.array([8])),
        lambda: _stored(CORNERS * np.nan, np.array([8])),
        lambda: _stored(CORNERS, np.array([9, -1])),
        lambda: _stored(CORNERS, np.array([], dtype=int)),
        lambda: _stored(CORNERS[:, :2], np.array([8])),
        lambda: _stored(np.array([object()], dtype=object), np.array([8])),
    ],
)
def test_stored_parts_are_not_trusted(content: Callable[[], bytes]) -> None:
    assert module._read(content(), CORNERS) is None
    found = module._read(_stored(CORNERS, np.array([4, 4])), CORNERS)
    assert found is not None and [len(part) for part in found] == [4, 4]


def test_without_a_writable_cache_the_parts_are_made_each_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("coacd")
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    bowl(tmp_path / "bowl.stl", around=6, rings=1)
    assert len(convex_parts(tmp_path / "bowl.stl")) > 1
