"""A robot whose meshes are nowhere to be found is still seen: as bones from joint to joint."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from manipcli.description.elements import Link
from manipcli.model.robot import RobotModel
from manipcli.render.drawing import bones, draw
from manipcli.shapes.primitives import Geometry, Mesh
from manipcli.task.load_view import load_sight

ROOT = Path(__file__).parents[2]
GONE = Mesh("package://gone/link.stl", Path("/nowhere/link.stl"))


def _without_meshes(robot: RobotModel) -> RobotModel:
    def gone(shapes: tuple[Geometry, ...]) -> tuple[Geometry, ...]:
        return tuple(replace(shape, shape=GONE) for shape in shapes)

    def bare(link: Link) -> Link:
        return replace(link, visuals=gone(link.visuals), collisions=gone(link.collisions))

    return replace(robot, links=tuple(bare(link) for link in robot.links))


def test_each_bone_reaches_from_the_frame_of_its_link_to_a_joint_below_it() -> None:
    robot = load_sight(ROOT / "robots" / "panda" / "robot.yaml").robot
    for link in robot.links:
        ends = [joint.X_PJ.p for joint in robot.joints if joint.parent == link.name]
        far = [end for end in ends if np.linalg.norm(end) > 1e-3]
        found = bones(robot, link.name)
        assert len(found) == max(len(far), 1)
        for end, bone in zip(far, found, strict=False):
            along = bone.vertices @ (end / np.linalg.norm(end))
            aside = np.linalg.norm(bone.vertices - np.outer(along, end / np.linalg.norm(end)), axis=1)
            np.testing.assert_allclose([along.min(), along.max()], [0.0, np.linalg.norm(end)], atol=1e-12)
            assert aside.max() <= np.linalg.norm(end) / 8.0 + 1e-12


def test_links_without_a_shape_that_can_be_drawn_are_seen_as_bones() -> None:
    robot = load_sight(ROOT / "robots" / "panda" / "robot.yaml").robot
    whole, bare = draw(robot), draw(_without_meshes(robot))
    assert not any("bone" in one.name for one in whole.drawables)
    assert {one.frame for one in bare.layer("visual")} == {one.frame for one in whole.layer("visual")}
    assert any("bones" in line for line in bare.missing)
