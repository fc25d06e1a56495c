"""Convex parts of links: in the robot, in its log without any file, and once only in the portable description."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from manipcli.core.errors import InvalidInput
from manipcli.model.build_robot import build_robot, rebuild_robot
from manipcli.model.collision import CollisionChecker
from manipcli.model.kinematics import Kinematics
from manipcli.model.link_parts import link_parts_from_json, link_parts_to_json
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Scene
from manipcli.shapes.primitives import Mesh
from manipcli.spec.robot import RobotSpec

URDF = """
<robot name="gate">
  <link name="frame"><collision><geometry><mesh filename="frame.stl" scale="2 2 2"/></geometry></collision></link>
  <link name="arm"/>
  <link name="probe"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <joint name="turn" type="continuous"><parent link="frame"/><child link="arm"/><axis xyz="0 0 1"/></joint>
  <joint name="slide" type="prismatic"><parent link="arm"/><child link="probe"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="2" effort="1" velocity="1"/></joint>
</robot>
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A doorway of three bars, unscaled 1 m wide and 1 m high, between the bars 0.8 m wide and 0.9 m high."""
    bars = [
        ((0.1, 0.1, 1.0), (-0.45, 0.0, 0.5)),
        ((0.1, 0.1, 1.0), (0.45, 0.0, 0.5)),
        ((0.8, 0.1, 0.1), (0.0, 0.0, 0.95)),
    ]
    made = []
    for size, p in bars:
        X = np.eye(4)
        X[:3, 3] = p
        made.append(trimesh.creation.box(size, X))
    trimesh.util.concatenate(made).export(tmp_path / "frame.stl")
    (tmp_path / "gate.urdf").write_text(URDF)
    return tmp_path


def robot(folder: Path, parts: list[str]) -> RobotModel:
    spec = RobotSpec.model_validate({"robot": "gate", "description": "gate.urdf", "collision_parts": parts})
    return build_robot(spec, file=folder / "robot.yaml")[0]


def hit(made: RobotModel, height: float) -> bool:
    checker = CollisionChecker(Kinematics(made), Scene((), (), np.array([0.0, 0.0, -9.81])))
    return checker.at().touches(np.array([0.0, height]))


def test_a_link_of_parts_leaves_its_doorway_free(folder: Path) -> None:
    parts = robot(folder, ["frame"])
    assert len(robot(folder, []).link("frame").collisions) == 1 and len(parts.link("frame").collisions) == 3
    for height, free in ((0.5, True), (1.69, True), (1.71, False), (1.9, False)):
        assert hit(parts, height) != free


def test_a_log_needs_no_file_for_the_parts(folder: Path) -> None:
    made = robot(folder, ["frame"])
    stored = link_parts_to_json(made)
    assert stored is not None and stored == link_parts_to_json(robot(folder, ["frame"]))
    assert made.urdf == robot(folder, []).urdf  # the mesh itself, once
    (folder / "frame.stl").unlink()
    spec = RobotSpec.model_validate({"robot": "gate", "description": "gate.urdf", "collision_parts": ["frame"]})
    again = rebuild_robot(spec, made.urdf.encode(), link_parts=stored)
    before = [each.shape.part for each in made.link("frame").collisions if isinstance(each.shape, Mesh)]
    after = [each.shape.part for each in again.link("frame").collisions if isinstance(each.shape, Mesh)]
    assert before == after and None not in after
    assert [hit(again, height) for height in (0.5, 1.71)] == [False, True]
    assert link_parts_to_json(robot_without_parts(again)) is None


def robot_without_parts(made: RobotModel) -> RobotModel:
    import dataclasses

    return dataclasses.replace(made, links=tuple(link for link in made.links if link.name != "frame"))


@pytest.mark.parametrize(
    "damage", [b"", b"{}", b'{"links": ["frame"], "meshes": {"x": [{"points": [], "triangles": [[0, 1, 2]]}]}}']
)
def test_damaged_parts_in_a_log_are_refused(folder: Path, damage: bytes) -> None:
    with pytest.raises(ValueError, match="invalid convex parts"):
        link_parts_from_json(damage)
    spec = RobotSpec.model_validate({"robot": "gate", "description": "gate.urdf"})
    with pytest.raises(InvalidInput, match="invalid convex parts"):
        rebuild_robot(spec, robot(folder, []).urdf.encode(), link_parts=damage)


@pytest.mark.parametrize(("name", "message"), [("fram", "is not in the robot"), ("probe", "has no collision mesh")])
def test_a_link_without_a_mesh_is_refused(folder: Path, name: str, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        robot(folder, [name])
