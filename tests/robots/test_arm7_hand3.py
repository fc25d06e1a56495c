"""The robot of our own: inertias fit shapes, meshes fit collision shapes, frames are where they should be."""

from __future__ import annotations

import itertools
import sys
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt
import pytest
import trimesh
import xacro
from trimesh.transformations import euler_matrix

Array = npt.NDArray[np.float64]
ROBOT = Path(__file__).parents[2] / "robots" / "arm7_hand3"
HOME = {"joint_2": 0.1, "joint_4": -1.6, "joint_6": -0.1}
ARM = [f"joint_{k}" for k in range(1, 8)]
HAND = [f"finger_{k}_{part}" for k in (1, 2, 3) for part in ("proximal", "distal")]


def expand(name: str) -> ElementTree.Element:
    return ElementTree.fromstring(xacro.process_file(str(ROBOT / "urdf" / name)).toxml())


ROBOT_XML = expand("arm7_hand3.urdf.xacro")
BODIES = [link for link in ROBOT_XML.iter("link") if link.find("inertial") is not None]
MESHES = sorted(path for path in (ROBOT / "meshes").iterdir() if path.suffix in {".dae", ".stl"})


def numbers(element: ElementTree.Element | None, key: str, default: str = "0 0 0") -> Array:
    return np.array([float(word) for word in (default if element is None else element.get(key, default)).split()])


def placed(element: ElementTree.Element) -> Array:
    """The 4 x 4 transform of an element's <origin>."""
    origin = element.find("origin")
    X = euler_matrix(*numbers(origin, "rpy"), axes="sxyz")
    X[:3, 3] = numbers(origin, "xyz")
    return np.asarray(X)


def named(link: ElementTree.Element) -> str:
    return str(link.get("name"))


def solid(collision: ElementTree.Element) -> trimesh.Trimesh:
    """The collision shape as a fine mesh in the link's frame."""
    shape = collision.find("geometry/*")
    assert shape is not None
    if shape.tag == "box":
        made = trimesh.creation.box(extents=numbers(shape, "size"))
    else:
        made = trimesh.creation.cylinder(float(shape.get("radius", 0)), float(shape.get("length", 0)), sections=256)
    made.apply_transform(placed(collision))
    return made


def mesh_path(element: ElementTree.Element) -> Path:
    uri = element.get("filename", "")
    assert uri.startswith("package://arm7_hand3/"), uri
    return ROBOT / uri.removeprefix("package://arm7_hand3/")


def drawn(link: ElementTree.Element) -> trimesh.Trimesh:
    """All visual meshes of a link, as one, in its frame."""
    parts = []
    for visual in link.iter("visual"):
        mesh = visual.find("geometry/mesh")
        assert mesh is not None
        part = trimesh.load_mesh(mesh_path(mesh))
        part = part.to_geometry() if isinstance(part, trimesh.Scene) else part
        part.apply_transform(placed(visual))
        parts.append(part)
    return trimesh.util.concatenate(parts)


def forward(positions: dict[str, float]) -> dict[str, Array]:
    """Pose (4, 4) of every link in the base, by the product of joint transforms."""
    poses = {"base": np.eye(4)}
    waiting = list(ROBOT_XML.iter("joint"))
    waiting = [joint for joint in waiting if joint.find("parent") is not None]
    while waiting:
        for joint in list(waiting):
            parent, child = (str(joint.find(tag).get("link")) for tag in ("parent", "child"))  # type: ignore[union-attr]
            if parent not in poses:
                continue
            turn = positions.get(str(joint.get("name")), 0.0)
            motion = trimesh.transformations.rotation_matrix(turn, numbers(joint.find("axis"), "xyz", "1 0 0"))
            poses[child] = poses[parent] @ placed(joint) @ motion
            waiting.remove(joint)
    return poses


def parents() -> dict[str, str]:
    found = {}
    for joint in ROBOT_XML.iter("joint"):
        parent, child = joint.find("parent"), joint.find("child")
        if parent is not None and child is not None:
            found[str(child.get("link"))] = str(parent.get("link"))
    return found


def moving() -> list[str]:
    return [str(joint.get("name")) for joint in ROBOT_XML.iter("joint") if joint.get("type") == "revolute"]


def inertia(link: ElementTree.Element) -> tuple[float, Array, Array]:
    """Mass, centre (3,) and inertia (3, 3) about the centre, of an unrotated <inertial>."""
    block = link.find("inertial")
    assert block is not None
    assert not numbers(block.find("origin"), "rpy").any()
    mass, written = block.find("mass"), block.find("inertia")
    assert mass is not None
    assert written is not None
    xx, xy, xz, yy, yz, zz = (float(written.get(f"i{ij}", "nan")) for ij in ("xx", "xy", "xz", "yy", "yz", "zz"))
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return float(mass.get("value", "nan")), numbers(block.find("origin"), "xyz"), tensor


@pytest.mark.parametrize("link", BODIES, ids=named)
def test_principal_moments_are_positive_and_keep_the_triangle_inequality(link: ElementTree.Element) -> None:
    a, b, c = np.linalg.eigvalsh(inertia(link)[2])
    assert a > 0.0
    assert a + b > c


@pytest.mark.parametrize("link", BODIES, ids=named)
def test_inertia_is_that_of_the_collision_shapes_at_one_density(link: ElementTree.Element) -> None:
    """Oracle: trimesh's volume integrals over triangulated shapes. 1 %: a 256-gon is 0.01 % smaller than its circle."""
    mass, centre, tensor = inertia(link)
    shapes = [solid(collision) for collision in link.iter("collision")]
    density = mass / sum(shape.volume for shape in shapes)
    expected_centre = density / mass * sum(shape.volume * shape.center_mass for shape in shapes)
    expected = np.zeros((3, 3))
    for shape in shapes:
        shape.density = density
        arm = shape.center_mass - expected_centre
        expected += shape.moment_inertia + shape.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    np.testing.assert_allclose(centre, expected_centre, atol=1e-5)
    np.testing.assert_allclose(tensor, expected, atol=0.01 * np.linalg.eigvalsh(expected)[0])


@pytest.mark.parametrize("path", MESHES, ids=lambda path: path.name)
def test_mesh_file_is_small_and_drawn_by_some_link(path: Path) -> None:
    assert path in {mesh_path(mesh) for mesh in ROBOT_XML.iter("mesh")}
    assert path.stat().st_size < 150_000


def test_both_mesh_formats_are_there_and_all_meshes_are_less_than_a_megabyte() -> None:
    assert {path.suffix for path in MESHES} == {".dae", ".stl"}
    assert sum(path.stat().st_size for path in MESHES) < 1_000_000


@pytest.mark.parametrize("link", BODIES, ids=named)
def test_what_is_drawn_has_the_size_of_what_collides(link: ElementTree.Element) -> None:
    """Within 17 mm a side: the foot is wider than the column that stands for it, and knuckles stand out of the palm."""
    collides = trimesh.util.concatenate([solid(collision) for collision in link.iter("collision")])
    np.testing.assert_allclose(drawn(link).bounds, collides.bounds, atol=0.017)


@pytest.mark.slow
def test_committed_meshes_are_what_the_generator_makes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Positions are written to 0.01 mm; the rest is for another machine's sine."""
    monkeypatch.syspath_prepend(str(ROBOT / "meshes"))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    import generate  # type: ignore[import-not-found]

    surfaces = {f"{name}.dae": part[0] for name, part in generate.arm().items()}
    surfaces |= {f"{name}.stl": surface for name, surface in generate.hand().items()}
    assert sorted(surfaces) == [path.name for path in MESHES]
    for path in MESHES:
        surface = surfaces[path.name]
        mesh = trimesh.load_mesh(path)
        mesh = mesh.to_geometry() if isinstance(mesh, trimesh.Scene) else mesh
        assert len(mesh.faces) == len(surface.faces)
        made = trimesh.Trimesh(surface.points, surface.faces, process=False)
        np.testing.assert_allclose(mesh.bounds, made.bounds, atol=2e-5)
        assert mesh.area == pytest.approx(made.area, rel=1e-3)


def test_joints_are_the_arms_then_the_hands_and_each_has_one_transmission() -> None:
    assert moving() == ARM + HAND
    driven = [block.find("joint").get("name") for block in ROBOT_XML.iter("transmission")]  # type: ignore[union-attr]
    assert driven == ARM + HAND
    reductions = [float(str(block.text)) for block in ROBOT_XML.iter("mechanicalReduction")]
    assert min(reductions) > 1.0


def test_segments_of_the_arm_have_the_lengths_of_its_design() -> None:
    """In any posture: 0.34 m to the shoulder, 0.40 to the elbow, 0.40 to the wrist, 0.126 to the flange."""
    poses = forward(dict(zip(ARM, (0.3, 0.7, -1.1, 1.3, 0.4, -0.9, 2.0), strict=True)))
    corners = [poses[name][:3, 3] for name in ("base_link", "link_2", "link_4", "link_6", "palm")]
    lengths = [np.linalg.norm(b - a) for a, b in itertools.pairwise(corners)]
    np.testing.assert_allclose(lengths, [0.34, 0.40, 0.40, 0.126], atol=1e-12)


def test_home_points_the_hand_forward() -> None:
    """The bending axes are parallel at home, so their angles add: 1.6 rad from upright, 1.7 degrees below level."""
    R_BT = forward(HOME)["tool"][:3, :3]
    np.testing.assert_allclose(R_BT[:, 2], [np.sin(1.6), 0.0, np.cos(1.6)], atol=1e-12)
    np.testing.assert_allclose(R_BT[:, 1], [0.0, 1.0, 0.0], atol=1e-12)
    assert np.degrees(np.arccos(R_BT[0, 2])) < 2.0


@pytest.mark.parametrize("finger", ["finger_1", "finger_2", "finger_3"])
@pytest.mark.parametrize("part", ["proximal", "distal"])
def test_positive_angles_close_every_finger(finger: str, part: str) -> None:
    tip = np.array([0.0, 0.0, 0.055, 1.0])
    still, closed = forward({}), forward({f"{finger}_{part}": 0.2})
    y = [(np.linalg.inv(X["palm"]) @ X[f"{finger}_distal_link"] @ tip)[1] for X in (still, closed)]
    assert abs(y[1]) < abs(y[0]) - 0.005


@pytest.fixture
def bullet(tmp_path: Path) -> Iterator[tuple[int, int]]:
    """The robot without its visuals in PyBullet: client and body."""
    import pybullet

    bare = expand("arm7_hand3.urdf.xacro")
    for link in bare.iter("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    ElementTree.indent(bare)  # Bullet corrupts lines longer than 8191 bytes
    path = tmp_path / "bare.urdf"
    path.write_text(ElementTree.tostring(bare, encoding="unicode"), encoding="utf-8")
    client = pybullet.connect(pybullet.DIRECT)
    yield client, pybullet.loadURDF(str(path), useFixedBase=True, physicsClientId=client)
    pybullet.disconnect(client)


@pytest.mark.parametrize("posture", [{}, HOME], ids=["zero", "home"])
def test_links_that_are_no_neighbours_keep_a_centimetre_apart(
    bullet: tuple[int, int], posture: dict[str, float]
) -> None:
    import pybullet

    client, body = bullet
    links = {-1: "base"}
    for index in range(pybullet.getNumJoints(body, physicsClientId=client)):
        info = pybullet.getJointInfo(body, index, physicsClientId=client)
        links[index] = info[12].decode()
        pybullet.resetJointState(body, index, posture.get(info[1].decode(), 0.0), physicsClientId=client)
    above = parents()
    for (a, first), (b, second) in itertools.combinations(links.items(), 2):
        if above.get(second) == first or above.get(first) == second:
            continue
        near = pybullet.getClosestPoints(body, body, 0.01, a, b, physicsClientId=client)
        assert not near, f"{first} and {second}: {min(point[8] for point in near):.4f} m"


def test_the_hand_alone_is_the_hand_of_the_arm() -> None:
    hand = expand("hand3.urdf.xacro")
    names = [named(link) for link in hand.iter("link")]
    assert names[:2] == ["hand_base", "palm"]
    whole = {named(link): ElementTree.tostring(link).strip() for link in ROBOT_XML.iter("link")}
    for link in list(hand.iter("link"))[1:]:
        assert ElementTree.tostring(link).strip() == whole[named(link)]
