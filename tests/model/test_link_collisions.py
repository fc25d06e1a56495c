"""`collision:` and `packages:` of a robot file: what to do without a mesh, and where the others are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.model.build_robot import build_robot
from manipcli.model.robot import RobotModel
from manipcli.shapes.mesh_formats import binary_stl
from manipcli.shapes.primitives import Box, Mesh
from manipcli.spec.load import load_robot_text

BOX = '<visual><geometry><box size="0.1 0.2 0.3"/></geometry></visual>'
GONE = '<collision><geometry><mesh filename="package://arm_pkg/gone.stl"/></geometry></collision>'
CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
TETRAHEDRON = CORNERS[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]


def built(folder: Path, lines: str, base: str) -> tuple[RobotModel, tuple[Diagnostic, ...]]:
    (folder / "vendor" / "pkg").mkdir(parents=True, exist_ok=True)
    (folder / "vendor" / "pkg" / "package.xml").write_text("<package><name>arm_pkg</name></package>")
    (folder / "vendor" / "pkg" / "here.stl").write_bytes(binary_stl(TETRAHEDRON))
    (folder / "own").mkdir(exist_ok=True)
    (folder / "own" / "r.urdf").write_text(f'<robot name="r"><link name="base">{base}</link></robot>')
    file = load_robot_text(f"robot: r\ndescription: r.urdf\n{lines}\n", str(folder / "own" / "robot.yaml"))
    return build_robot(file.spec, file=folder / "own" / "robot.yaml", source=file.source)


PACKAGES = "packages: {arm_pkg: ../vendor/pkg}"


def test_a_package_is_found_where_the_robot_file_says(tmp_path: Path) -> None:
    robot, _ = built(tmp_path, PACKAGES, GONE.replace("gone", "here"))
    (shape,) = (each.shape for each in robot.link("base").collisions)
    assert isinstance(shape, Mesh)
    assert shape.path == (tmp_path / "vendor" / "pkg" / "here.stl").resolve()
    with pytest.raises(InvalidInput, match="there is no folder"):
        built(tmp_path, PACKAGES.replace("vendor", "vendors"), BOX)


def test_a_missing_collision_mesh_names_what_can_be_done_without(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput) as caught:
        built(tmp_path, PACKAGES, BOX + GONE)
    (error,) = caught.value.findings
    assert "gone.stl" in error.message
    assert "`collision: from_visual`" in (error.hint or "")
    robot, findings = built(tmp_path, f"{PACKAGES}\ncollision: from_visual", BOX + GONE)
    assert [each.shape for each in robot.link("base").collisions] == [Box((0.1, 0.2, 0.3))]
    assert [each.code for each in findings if "base" in each.message] == ["ROBOT354"]
    robot, _ = built(tmp_path, f"{PACKAGES}\ncollision: {{base: none}}", BOX + GONE)
    assert robot.link("base").collisions == ()


def test_a_link_without_any_usable_shape_is_told(tmp_path: Path) -> None:
    robot, findings = built(tmp_path, f"{PACKAGES}\ncollision: from_visual", GONE)
    assert robot.link("base").collisions == ()
    assert [each.severity for each in findings if each.code == "ROBOT355"] == ["warning"]


def test_an_unknown_link_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="'bse' is not in the robot"):
        built(tmp_path, "collision: {bse: none}", BOX)
