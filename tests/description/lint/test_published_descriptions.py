"""What published descriptions have, each in its smallest file: what is accepted and what is told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from manipcli.core.errors import Diagnostic
from manipcli.description.lint.examine import Examination
from manipcli.description.lint.inspection import inspect, mend
from manipcli.description.xacro.expression import Evaluator
from manipcli.description.xacro.values import Refused, python_symbols
from manipcli.report.description import alike, render_text

XACRO = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
LIMIT = '<axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1" effort="1"/>'


def examined(folder: Path, text: str, name: str = "r.urdf") -> Examination:
    (folder / name).write_text(text)
    return inspect(folder / name, package_path=[folder]).examination


def found(examination: Examination, code: str) -> list[Diagnostic]:
    return [finding for finding in examination.findings if finding.code == code]


@pytest.mark.parametrize(
    ("text", "python"),
    [
        ("isinstance([1], list)", isinstance([1], list)),
        ("isinstance({}, (list, dict))", isinstance({}, (list, dict))),
        ("isinstance('a', str)", isinstance("a", str)),
        ("isinstance(1, str)", isinstance(1, str)),
        ("isinstance(True, int)", isinstance(True, int)),
        ("isinstance(1, float)", isinstance(1, float)),
        ("isinstance(1.0, (bool, float))", isinstance(1.0, (bool, float))),
        ("isinstance((1, 2), tuple)", isinstance((1, 2), tuple)),
        ("isinstance([1], tuple)", isinstance([1], tuple)),
    ],
)
def test_types_are_those_of_python(text: str, python: bool) -> None:
    assert Evaluator()(text, python_symbols()) is python


@pytest.mark.parametrize("text", ["isinstance(1, len)", "isinstance(1, 'list')", "isinstance(1, (list, 3))"])
def test_what_is_no_type_is_an_error(text: str) -> None:
    with pytest.raises(TypeError, match="expected one or several of bool, dict, float, int, list, set, str, tuple"):
        Evaluator()(text, python_symbols())
    with pytest.raises(Refused):
        Evaluator()("isinstance(1, list.__class__)", python_symbols())


def test_xacro_asks_for_types_by_their_module(tmp_path: Path) -> None:
    text = f"""<robot name="r" {XACRO}><xacro:property name="x" value="${{[1, 2]}}"/>
<xacro:if value="${{python.isinstance(x, list)}}"><link name="base"/></xacro:if>
<xacro:if value="${{python.isinstance(x, python.dict)}}"><link name="other"/></xacro:if></robot>"""
    assert examined(tmp_path, text, "r.xacro").errors == ()


def test_a_type_as_attribute_of_a_transmission_is_a_warning(tmp_path: Path) -> None:
    joint = f'<joint name="j" type="revolute"><parent link="base"/><child link="tip"/>{LIMIT}</joint>'
    inertial = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    parts = f'<link name="base"/><link name="tip">{inertial}</link>{joint}'
    gear = '<transmission name="t" type="pr2_mechanism_model/SimpleTransmission"><joint name="j"/></transmission>'
    examination = examined(tmp_path, f'<robot name="r">{parts}{gear}</robot>')
    assert examination.errors == ()
    (finding,) = found(examination, "URDF015")
    assert (finding.severity, finding.hint) == (
        "warning", "write <type>transmission_interface/SimpleTransmission</type> inside"
    )  # fmt: skip


@pytest.mark.parametrize(("uri", "told"), [("file://$(find pkg)/a.stl", 0), ("file://{folder}/pkg/a.stl", 1)])
def test_a_mesh_of_a_found_package_has_no_absolute_path(uri: str, told: int, tmp_path: Path) -> None:
    (tmp_path / "pkg").mkdir()
    trimesh.creation.box((1, 1, 1)).export(tmp_path / "pkg" / "a.stl")
    mesh = f'<mesh filename="{uri.format(folder=tmp_path)}"/>'
    link = f'<link name="base"><visual><geometry>{mesh}</geometry></visual></link>'
    examination = examined(tmp_path, f'<robot name="r" {XACRO}>{link}</robot>', "r.xacro")
    assert len(found(examination, "URDF204")) == told
    assert found(examination, "URDF033") == []


def test_a_file_that_only_declares_xacro_is_fixed(tmp_path: Path) -> None:
    (tmp_path / "r.urdf").write_text(f'<robot name="r" {XACRO}><link name=" base "/></robot>')
    target, changes = mend(inspect(tmp_path / "r.urdf"), in_place=False)
    assert target.read_text() == f'<robot name="r" {XACRO}><link name="base"/></robot>'
    assert len(changes) == 1


def test_a_flat_collision_mesh_is_ignored_with_a_warning(tmp_path: Path) -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    trimesh.Trimesh(corners, [[0, 1, 2], [1, 3, 2]]).export(tmp_path / "a.stl")
    mesh = '<collision><geometry><mesh filename="a.stl"/></geometry></collision>'
    examination = examined(tmp_path, f'<robot name="r"><link name="base">{mesh}</link></robot>')
    assert examination.errors == ()
    assert [finding.severity for finding in found(examination, "URDF210")] == ["warning"]
    assert examination.parts is not None and examination.parts.links[0].collisions == ()


def test_a_mimic_of_a_mimic_is_told_with_what_it_follows(tmp_path: Path) -> None:
    """q3 = 2 q2 + 0.1 and q2 = -3 q1 + 0.5: q3 = -6 q1 + 1.1."""
    mimics = ("", '<mimic joint="j1" multiplier="-3" offset="0.5"/>', '<mimic joint="j2" multiplier="2" offset="0.1"/>')
    joints = "".join(
        f'<link name="l{k}"/><joint name="j{k}" type="revolute"><parent link="l{k - 1}"/><child link="l{k}"/>'
        f"{LIMIT}{mimic}</joint>"
        for k, mimic in enumerate(mimics, start=1)
    )
    examination = examined(tmp_path, f'<robot name="r"><link name="l0"/>{joints}</robot>')
    (finding,) = found(examination, "URDF085")
    assert finding.message == (
        "joint 'j3' mimics 'j2', which mimics 'j1': it follows 'j1' with multiplier -6 and offset 1.1"
    )


def test_a_long_name_is_told_with_the_limit_and_a_comma_with_the_dot(tmp_path: Path) -> None:
    text = f'<robot name="r"><link name="base"/><link name="{"x" * 300}"/></robot>'
    (finding,) = found(examined(tmp_path, text), "URDF003")
    assert "has 300 characters" in finding.message and finding.hint == "at most 200 are allowed"
    mass = '<inertial><mass value="0,01"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    (finding,) = found(examined(tmp_path, f'<robot name="r"><link name="base">{mass}</link></robot>'), "URDF004")
    assert finding.hint == "use a dot: 0.01"


def test_findings_with_one_cause_are_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    meshes = "\n".join(
        f'<visual><geometry><mesh filename="/none/robot/{part}/m.stl"/></geometry></visual>' for part in range(29)
    )
    examination = examined(tmp_path, f'<robot name="r"><link name="base">{meshes}</link></robot>')
    shown = render_text("r.urdf", examination.findings, None, passed=True)
    (line,) = [line for line in shown.splitlines() if "URDF033" in line]
    assert line.endswith("'/none/robot/0/m.stl' is not found (x 29, all below /none/robot)")
    assert "58 warnings" in shown
    relative = meshes.replace("/none/robot/", "parts/")  # the message then names the place that was searched, too
    examination = examined(tmp_path, f'<robot name="r"><link name="base">{relative}</link></robot>')
    shown = render_text("r.urdf", examination.findings, None, passed=True)
    assert [line.endswith("(x 29, all below parts)") for line in shown.splitlines() if "URDF033" in line] == [True]
    assert f"  files: {', '.join(f'{part}/m.stl' for part in range(29))}" in shown.splitlines()
    assert sum(map(len, alike(examination.findings))) == len(examination.findings)
    assert len(alike(examination.findings[:2])) == 2
    monkeypatch.chdir(tmp_path)  # places are then shown relative to it
    assert (
        len(alike(found(examined(tmp_path, f'<robot name="r"><link name="base">{relative}</link></robot>'), "URDF033")))
        == 1
    )


def test_a_reduction_that_is_no_number_is_one(tmp_path: Path) -> None:
    actuator = '<actuator name="m"><mechanicalReduction>reduction</mechanicalReduction></actuator>'
    gears = f'<transmission name="t"><type>SimpleTransmission</type><joint name="j"/>{actuator}</transmission>'
    joint = f'<joint name="j" type="revolute"><parent link="base"/><child link="tip"/>{LIMIT}</joint>'
    examination = examined(tmp_path, f'<robot name="r"><link name="base"/><link name="tip"/>{joint}{gears}</robot>')
    (finding,) = found(examination, "URDF004")
    assert finding.severity == "warning" and finding.message.endswith("expected a finite number; 1 is used")
    assert examination.parts is not None
    assert [tag.actuator_reductions for tag in examination.parts.transmissions] == [(1.0,)]


@pytest.mark.parametrize(("gain", "told"), [("", 1), ('k_position="0" ', 1), ('k_position="20" ', 0)])
def test_soft_limits_without_effect_are_told(gain: str, told: int, tmp_path: Path) -> None:
    safety = f'<safety_controller {gain}k_velocity="1" soft_lower_limit="-0.5" soft_upper_limit="0.5"/>'
    joint = f'<joint name="j" type="revolute"><parent link="base"/><child link="tip"/>{LIMIT}{safety}</joint>'
    examination = examined(tmp_path, f'<robot name="r"><link name="base"/><link name="tip"/>{joint}</robot>')
    assert [finding.severity for finding in found(examination, "URDF086")] == ["warning"] * told
