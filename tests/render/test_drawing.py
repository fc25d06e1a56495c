"""What is drawn: every link and body, in its place, with its colours; inertia as a box that has it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from manipcli.core.geometry import Transform, frozen
from manipcli.description.elements import Inertial
from manipcli.model.configuration import configuration, with_mimics, zero_configuration
from manipcli.model.kinematics import Kinematics
from manipcli.render.drawing import COLLISION, PLAIN, draw, inertia_box, shape_surfaces
from manipcli.render.placing import Placing
from manipcli.shapes.primitives import Box, Mesh
from manipcli.task.load_view import Sight, load_sight

ROOT = Path(__file__).parents[2]

DESCRIPTION = """<robot name="two">
  <link name="base"><collision><geometry><box size="0.2 0.2 0.1"/></geometry></collision></link>
  <link name="finger">
    <inertial><mass value="2"/><inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><geometry><sphere radius="0.1"/></geometry><material name="red"><color rgba="1 0 0 1"/></material></visual>
  </link>
  <link name="follower">
    <inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <joint name="drive" type="prismatic"><parent link="base"/><child link="finger"/><axis xyz="1 0 0"/>
    <limit lower="0.01" upper="0.1" velocity="1" effort="1"/></joint>
  <joint name="mimic" type="prismatic"><parent link="base"/><child link="follower"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/><mimic joint="drive" multiplier="-2" offset="0.5"/></joint>
</robot>
"""


@pytest.fixture
def two(tmp_path: Path) -> Sight:
    path = tmp_path / "two.urdf"
    path.write_text(DESCRIPTION)
    return load_sight(path)


@pytest.fixture(scope="module")
def pour() -> Sight:
    return load_sight(ROOT / "tasks" / "pour.yaml")


def test_every_link_and_body_has_a_frame_and_what_it_shows(pour: Sight) -> None:
    assert pour.scene is not None
    drawing = draw(pour.robot, pour.scene)
    bodies = tuple(body.name for body in pour.scene.bodies)
    assert drawing.frames == ("world", *(f"robot/{link.name}" for link in pour.robot.links), *bodies)
    assert drawing.missing == ()
    seen = {one.frame for one in drawing.layer("visual")}
    assert seen == {f"robot/{link.name}" for link in pour.robot.links if link.visuals} | set(bodies)
    assert len({one.name for one in drawing.drawables}) == len(drawing.drawables)
    assert next(mark.name for mark in drawing.marks) == "tool"


def test_colours_come_from_the_description_then_the_mesh_then_are_plain(two: Sight, pour: Sight) -> None:
    drawing = draw(two.robot)
    colours = {one.name: one.rgba for one in drawing.drawables}
    assert colours["robot/finger/visual_0"] == (1.0, 0.0, 0.0, 1.0)
    assert colours["robot/base/collision_0"] == COLLISION
    assert colours["robot/base/collision_0_seen"] == PLAIN  # what has no visual is seen by its collision shape
    # The accents of the arm are coloured by their Collada files alone.
    accents = [g.shape for link in pour.robot.links for g in link.visuals if isinstance(g.shape, Mesh)]
    accent = next(shape for shape in accents if shape.path.name == "link_1_accent.dae")
    (surface,) = shape_surfaces(accent)
    assert surface.rgba == pytest.approx((0.96, 0.45, 0.08, 1.0))


def test_frames_are_where_kinematics_puts_the_links(pour: Sight) -> None:
    robot = pour.robot
    rng = np.random.default_rng(1)
    q = np.array([with_mimics(robot, rng.uniform(-1.0, 1.0, len(robot.joint_names))) for _ in range(3)])
    poses = Placing(robot).at(q, np.zeros((3, 0, 3)), np.zeros((3, 0, 4)))
    kinematics = Kinematics(robot)
    for instant in range(3):
        for k, link in enumerate(robot.links, start=1):
            X = Transform.of(xyz=poses.position[instant, k], quat_xyzw=poses.quat_xyzw[instant, k])
            assert X.matrix == pytest.approx(kinematics.forward(q[instant], link.name).matrix, abs=1e-12)


def test_bodies_are_where_the_scene_starts_or_the_state_says(pour: Sight) -> None:
    assert pour.scene is not None
    placing = Placing(pour.robot, pour.scene)
    drawing = draw(pour.robot, pour.scene)
    start = placing.start(pour.q)
    for body in pour.scene.bodies:
        assert start.X_WF(drawing.frames.index(body.name)).matrix == pytest.approx(body.X_WO.matrix, abs=1e-12)
    m = len(pour.scene.movable)
    p, quat = np.arange(3.0 * m).reshape(m, 3), np.tile([1.0, 0.0, 0.0, 0.0], (m, 1))
    moved = placing.at(pour.q, p, quat)
    for k, body in enumerate(pour.scene.movable):
        assert moved.position[drawing.frames.index(body.name)] == pytest.approx(p[k])


def test_a_mimic_joint_follows_with_its_multiplier_and_offset(two: Sight) -> None:
    robot = two.robot
    assert dict(zip(robot.joint_names, with_mimics(robot, [0.05, 9.0]), strict=True)) == {
        "drive": 0.05,
        "mimic": pytest.approx(-2 * 0.05 + 0.5),
    }
    # Zero lies outside of the limits: the nearest position inside, and the follower with it.
    assert zero_configuration(robot) == pytest.approx([0.01, 0.48])
    placed = Placing(robot).start(with_mimics(robot, [0.1, 0.0]))
    assert placed.position[draw(robot).frames.index("robot/follower")] == pytest.approx([0.3, 0.0, 0.0])


def test_a_named_pose_is_taken_and_home_is_the_default(pour: Sight) -> None:
    home = pour.robot.pose("home")
    q = configuration(pour.robot)
    assert q[pour.robot.indices(home.joints)] == pytest.approx(home.positions)
    assert q == pytest.approx(configuration(pour.robot, "home"))


def _box_inertia(mass: float, size: tuple[float, float, float]) -> np.ndarray:
    a, b, c = size
    return mass / 12.0 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b])


edges = st.floats(0.01, 1.0)


@given(mass=st.floats(0.01, 100.0), size=st.tuples(edges, edges, edges), turn=st.tuples(*[st.floats(-3.0, 3.0)] * 3))
@settings(max_examples=50, deadline=None)
def test_the_inertia_box_has_the_mass_and_inertia_of_the_body(
    mass: float, size: tuple[float, float, float], turn: tuple[float, float, float]
) -> None:
    X_LI = Transform.of(xyz=(0.1, -0.2, 0.3), rpy=(0.4, 0.5, 0.6))
    R = Transform.of(rpy=turn).R
    inertia = R @ _box_inertia(mass, size) @ R.T
    box, X_LB = inertia_box(Inertial(mass, X_LI, frozen(inertia)))
    assert sorted(box.size) == pytest.approx(sorted(size), rel=1e-6)
    assert X_LB.p == pytest.approx(X_LI.p)
    # Turned back into the link, the box has the inertia of the body, wherever its axes went.
    here, wanted = X_LB.R @ _box_inertia(mass, box.size) @ X_LB.R.T, X_LI.R @ inertia @ X_LI.R.T
    assert here == pytest.approx(wanted, rel=1e-6, abs=1e-9 * float(np.trace(inertia)))


def test_moments_that_no_body_has_give_a_flat_box() -> None:
    box, _ = inertia_box(Inertial(1.0, Transform.identity(), frozen(np.diag([1.0, 0.1, 0.1]))))
    assert min(box.size) == 0.0


def test_a_collision_mesh_is_drawn_as_its_hull_and_a_bad_one_is_told(tmp_path: Path) -> None:
    # Two triangles of a tetrahedron's four, and a point in its middle: the hull has four faces of four points.
    path = tmp_path / "part.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0.1 0.1 0.1\nf 1 2 5\nf 3 4 5\n")
    mesh = Mesh("package://x/part.obj", path, (1.0, -1.0, 1.0))
    (hull,) = shape_surfaces(mesh, hull=True)
    assert len(hull.faces) == 4
    assert hull.vertices.min(axis=0) == pytest.approx([0.0, -1.0, 0.0])
    a, b, c = (hull.vertices[hull.faces[:, k]] for k in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0 == pytest.approx(1.0 / 6.0)


def test_obj_colours_are_read_from_the_file_beside_it_only(tmp_path: Path) -> None:
    (tmp_path / "secret.mtl").write_text("newmtl a\nKd 0 0 1\n")
    folder = tmp_path / "meshes"
    folder.mkdir()
    (folder / "part.mtl").write_text("newmtl a\nKd 1 0.5 0\nd 0.5\nnewmtl broken\nKd 1 x 0\n")
    lines = ["mtllib part.mtl", "mtllib ../secret.mtl", "v 0 0 0", "v 1 0 0", "v 0 1 0", "v 0 0 1"]
    lines += ["f 1 2 3", "usemtl a", "f 1 2 4", "usemtl broken", "f 1 3 4"]
    path = folder / "part.obj"
    path.write_text("\n".join(lines) + "\n")
    found = shape_surfaces(Mesh("part.obj", path))
    assert {one.rgba: len(one.faces) for one in found} == {None: 2, (1.0, 0.5, 0.0, 0.5): 1}


def test_what_cannot_be_drawn_is_left_out_and_told(two: Sight, tmp_path: Path) -> None:
    import dataclasses

    link = two.robot.link("finger")
    gone = dataclasses.replace(link.visuals[0], shape=Mesh("gone.stl", tmp_path / "gone.stl"))
    links = tuple(dataclasses.replace(one, visuals=(gone,)) if one is link else one for one in two.robot.links)
    drawing = draw(dataclasses.replace(two.robot, links=links))
    stands_in, line = drawing.missing
    assert "robot/finger" in line and "gone.stl" in line
    assert stands_in.startswith("drawn as bones between joints: ") and stands_in.endswith("finger")
    assert Box((0.2, 0.2, 0.1)) == two.robot.link("base").collisions[0].shape
