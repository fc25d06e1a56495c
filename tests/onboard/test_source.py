"""What the robot file mends of a description, and what is told about it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manipcli.model.kinematics import Kinematics
from manipcli.onboard.first_task import FirstTask
from manipcli.onboard.source import HandSource, read_source
from manipcli.onboard.summary import summary
from tests.onboard import small_robots as small

LINKS = [f"l{k}" for k in range(7)]


def mesh(kind: str, file: str) -> str:
    return f'<{kind}><geometry><mesh filename="{file}"/></geometry></{kind}>'


def test_links_whose_visual_meshes_lack_too_are_told(tmp_path: Path) -> None:
    box = '<visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual>'
    rows = {
        "l1": mesh("collision", "only.stl") + box,
        "l2": mesh("collision", "both.stl") + mesh("visual", "both.stl") + box,
        "l3": mesh("collision", "both.stl") + mesh("visual", "both.stl"),
    }
    text = small.robot(small.arm(LINKS))
    for name, shapes in rows.items():
        before, after = text.split(f'<link name="{name}">')
        inertial, rest = after.split("<collision>", 1)
        text = f'{before}<link name="{name}">{inertial}{shapes}{rest.split("</collision>", 1)[1]}'
    (tmp_path / "small.urdf").write_text(text)
    source = read_source(str(tmp_path / "small.urdf"), {}, tmp_path, package_path=(), allow_outside=False)
    assert source.entries["collision"].value == {"l1": "from_visual", "l2": "from_visual", "l3": "none"}
    notes = "\n".join(source.notes)
    assert "2 of its collision meshes are not found or unusable: both.stl, only.stl; add them" in notes
    assert "1 link with a part of the shapes alone, as visual meshes are not found either: l2" in notes
    assert "1 link without any shape, which planning and physics do not see: l3" in notes


def test_the_same_evidence_is_told_once() -> None:
    task = FirstTask("wait", {}, {}, "the robot holds still", True, ())
    lines = list(summary(found=(), checks=[("a", "why"), ("b", ""), ("c", "other")], notes=(), task=task))
    assert "  a, b: why" in lines
    assert "  c: other" in lines


def test_a_link_denser_than_metal_is_estimated(tmp_path: Path) -> None:
    text = small.robot(small.arm(LINKS)).replace('<mass value="0.5"/>', '<mass value="5000"/>', 3)
    (tmp_path / "small.urdf").write_text(text)
    source = read_source(str(tmp_path / "small.urdf"), {}, tmp_path, package_path=(), allow_outside=False)
    rows = {name: {"density": 1000.0} for name in ("l1", "l2")}  # the base, 0.1 m wide, is as dense as this allows
    inertials = source.entries["inertials"]
    assert inertials.value["links"].keys() >= rows.keys()
    assert inertials.check and "denser than any metal" in inertials.why
    volume = (0.2 - 0.08) * 0.05 * 0.05
    assert source.robot.link("l2").inertial.mass == pytest.approx(1000.0 * volume, rel=0.01)


def test_an_arm_and_a_hand_of_two_files_are_the_robot_of_one(tmp_path: Path) -> None:
    hand = (small.palm("p"), small.gripper("p"))
    (tmp_path / "whole.urdf").write_text(
        small.robot(small.arm(LINKS), small.palm("p", parent="l6"), small.gripper("p"))
    )
    (tmp_path / "arm.urdf").write_text(small.robot(small.arm(LINKS)))
    world = ['<link name="world"/><joint name="at" type="fixed"><parent link="world"/><child link="p"/></joint>']
    (tmp_path / "hand.urdf").write_text(small.robot(*hand, world))
    given = {"package_path": (), "allow_outside": False}
    whole = read_source(str(tmp_path / "whole.urdf"), {}, tmp_path, **given).robot
    pose = (small.LINK, 0.0, 0.0)
    source = read_source(
        str(tmp_path / "arm.urdf"), {}, tmp_path, hand=HandSource(str(tmp_path / "hand.urdf"), {}, pose=pose), **given
    )
    assert source.entries["attach"].value == [
        {"description": "hand.urdf", "parent": "l6", "pose": {"xyz": [small.LINK, 0.0, 0.0]}}
    ]
    assert source.entries["attach"].check and "'l6'" in source.entries["attach"].why
    assert source.robot.joint_names == whole.joint_names
    q = np.array([0.3, -0.5, 1.2, 0.4, 0.8, 0.1, 0.01, 0.02])
    for link in ("l6", "p", "left", "right"):
        one, other = (Kinematics(robot).forward(q, link).matrix for robot in (source.robot, whole))
        np.testing.assert_allclose(one, other, atol=1e-12)


def test_a_hand_with_names_of_the_arm_gets_a_prefix(tmp_path: Path) -> None:
    bare = '<mass value="0.5"/>'
    (tmp_path / "arm.urdf").write_text(small.robot(small.arm(LINKS)))
    hand = small.robot(small.palm("l3"), small.gripper("l3"))
    (tmp_path / "hand.urdf").write_text(hand.replace(bare, '<mass value="5000"/>'))
    hands = HandSource(str(tmp_path / "hand.urdf"), {}, "l5", (0.0, 0.0, 0.1, 0.0, 0.0, 1.5))
    source = read_source(str(tmp_path / "arm.urdf"), {}, tmp_path, package_path=(), allow_outside=False, hand=hands)
    assert source.robot.joint("hand_l3_attach").parent == "l5"
    assert source.entries["inertials"].value["links"].keys() == {"hand_l3", "hand_left", "hand_right"}
    assert not source.entries["attach"].check  # the user named the link


@pytest.mark.parametrize("known", [True, False])
def test_a_package_around_the_description_is_named_for_commands_that_read_a_log(tmp_path: Path, known: bool) -> None:
    package = tmp_path / "ws" / "p_description"
    (package / "urdf").mkdir(parents=True)
    if known:
        (package / "package.xml").write_text("<package><name>p_description</name></package>")
    (package / "l1.obj").write_text("v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n")
    text = small.robot(small.arm(LINKS)).replace(
        '<link name="l1">', f'<link name="l1">{mesh("visual", "package://p_description/l1.obj")}'
    )
    (package / "urdf" / "small.urdf").write_text(text)
    project = tmp_path / "project"
    source = read_source(str(package / "urdf" / "small.urdf"), {}, project, package_path=(), allow_outside=False)
    named = {"p_description": "../ws/p_description"}  # without package.xml, other commands would refuse this folder
    assert ("packages" in source.entries) == known
    assert not known or source.entries["packages"].value == named
