"""Everything wrong with a description is told at once, with its place; what is right is read as written."""

from __future__ import annotations

import re
import struct
import sys
from itertools import pairwise
from pathlib import Path
from random import Random

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.description.elements import Mimic
from manipcli.description.expanded import read_description
from manipcli.description.packages import Packages
from manipcli.description.urdf.urdf import Parts, read_parts
from manipcli.shapes.primitives import Box, Cylinder, Mesh, Sphere

INERTIAL = '<inertial><mass value="2"/><inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial>'
LINK_A = f'<link name="a">{INERTIAL}</link>'
LINK_B = f'<link name="b">{INERTIAL}</link>'
ENDS = '<parent link="a"/><child link="b"/>'
LIMIT = '<limit lower="-1" upper="2" velocity="3" effort="4"/>'
JOINT = f'<joint name="j" type="revolute">{ENDS}<axis xyz="0 0 1"/>{LIMIT}</joint>'
GOOD = f'<robot name="r">\n{LINK_A}\n{LINK_B}\n{JOINT}\n</robot>'


_CORNERS = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))
_FACES = [[_CORNERS[k] for k in face] for face in ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))]
TETRAHEDRON = (
    bytes(80)
    + struct.pack("<I", 4)
    + b"".join(struct.pack("<12f2x", 0, 0, 0, *(value for corner in face for value in corner)) for face in _FACES)
)


def read(folder: Path, text: str) -> Parts:
    path = folder / "r.urdf"
    path.write_text(text, encoding="utf-8")
    return read_parts(read_description(path, packages=Packages(path)))


def errors(folder: Path, text: str) -> tuple[Diagnostic, ...]:
    return read(folder, text).errors


def test_a_sound_description_gives_no_finding(tmp_path: Path) -> None:
    parts = read(tmp_path, GOOD)
    assert parts.findings == ()
    assert (parts.name, parts.root, [link.name for link in parts.links]) == ("r", "a", ["a", "b"])
    limits = parts.joints[0].limits
    assert (limits.lower, limits.upper, limits.velocity, limits.effort) == (-1.0, 2.0, 3.0, 4.0)


def link_b(content: str) -> str:
    return GOOD.replace(LINK_B, f'<link name="b">{content}</link>')


def joint(content: str, kind: str = "revolute") -> str:
    return GOOD.replace(JOINT, f'<joint name="j" type="{kind}">{content}</joint>')


def inertia(**moments: str) -> str:
    values = {"ixx": "0.02", "iyy": "0.03", "izz": "0.04", "ixy": "0", "ixz": "0", "iyz": "0"} | moments
    attributes = " ".join(f'{key}="{value}"' for key, value in values.items())
    return link_b(f'<inertial><mass value="2"/><inertia {attributes}/></inertial>')


BAD = {
    "link without name": (GOOD.replace('<link name="b">', "<link>"), "no attribute 'name'"),
    "link twice": (GOOD.replace(LINK_B, LINK_B + LINK_B), "duplicate link 'b'"),
    "joint twice": (GOOD.replace(JOINT, JOINT + JOINT), "duplicate joint 'j'"),
    "no link": ('<robot name="r"/>', "has no link"),
    "joint without type": (GOOD.replace(' type="revolute"', ""), "no attribute 'type'"),
    "unknown type": (joint(ENDS + LIMIT, "revolut"), "unknown type 'revolut'"),
    "joint without child": (joint('<parent link="a"/>' + LIMIT), "has no <child"),
    "child without link": (joint('<parent link="a"/><child/>' + LIMIT), "no attribute 'link'"),
    "undefined parent": (GOOD.replace('parent link="a"', 'parent link="aa"'), "parent link 'aa' is not"),
    "undefined child": (GOOD.replace('child link="b"', 'child link="c"'), "child link 'c' is not"),
    "itself": (GOOD.replace('child link="b"', 'child link="a"'), "to itself"),
    "two roots": (GOOD.replace(JOINT, ""), "2 root links: 'a', 'b'"),
    "two parents": (
        GOOD.replace(JOINT, JOINT + JOINT.replace('"j"', '"k"')),
        "child of two joints, 'j' and 'k'",
    ),
    "loop": (
        GOOD.replace(JOINT, JOINT + '<joint name="k" type="fixed"><parent link="b"/><child link="a"/></joint>'),
        "form a loop",
    ),
    "loop beside a root": (
        GOOD.replace(
            JOINT,
            '<link name="c"/><joint name="j" type="fixed"><parent link="b"/><child link="c"/></joint>'
            '<joint name="k" type="fixed"><parent link="c"/><child link="b"/></joint>',
        ),
        "form a loop",
    ),
    "zero axis": (joint(ENDS + '<axis xyz="0 0 0"/>' + LIMIT), "axis 0 0 0"),
    "axis with two numbers": (joint(ENDS + '<axis xyz="0 1"/>' + LIMIT), "expected 3 numbers"),
    "nan axis": (joint(ENDS + '<axis xyz="0 nan 1"/>' + LIMIT), "expected 3 numbers"),
    "no limit": (joint(ENDS), "has no <limit>"),
    "prismatic without limit": (joint(ENDS, "prismatic"), "has no <limit>"),
    "lower above upper": (joint(ENDS + '<limit lower="2" upper="1" velocity="1" effort="1"/>'), "is above upper"),
    "negative effort": (joint(ENDS + '<limit lower="0" upper="1" velocity="1" effort="-1"/>'), "effort is -1"),
    "infinite limit": (joint(ENDS + '<limit lower="0" upper="inf" velocity="1" effort="1"/>'), "expected a number"),
    "negative damping": (joint(ENDS + LIMIT + '<dynamics damping="-1"/>'), "damping is -1"),
    "origin with text": (joint(ENDS + LIMIT + '<origin xyz="0 0 high"/>'), "expected 3 numbers"),
    "origin with comma": (joint(ENDS + LIMIT + '<origin rpy="0 0,1 0"/>'), "expected 3 numbers"),
    "too large": (joint(ENDS + LIMIT + '<origin xyz="0 0 1e400"/>'), "expected 3 numbers"),
    "mimic unknown": (joint(ENDS + LIMIT + '<mimic joint="k"/>'), "mimics 'k', which is not"),
    "mimic itself": (joint(ENDS + LIMIT + '<mimic joint="j"/>'), "mimics itself"),
    "no mass": (link_b('<inertial><inertia ixx="1" iyy="1" izz="1"/></inertial>'), "no <mass>"),
    "mass text": (GOOD.replace('mass value="2"', 'mass value="heavy"'), "expected a number"),
    "negative mass": (GOOD.replace('mass value="2"', 'mass value="-2"'), "mass -2"),
    "no moments": (link_b('<inertial><mass value="2"/></inertial>'), "no <inertia>"),
    "negative moment": (inertia(ixx="-0.02"), "not positive definite"),
    "not definite": (inertia(ixy="0.5"), "not positive definite"),
    "triangle": (inertia(izz="0.06"), "impossible principal moments"),
    "moved point mass": (inertia(ixx="0", iyy="0", izz="0"), "no moments of inertia"),
    "unknown shape": (link_b("<collision><geometry><boxx/></geometry></collision>"), "unknown shape <boxx>"),
    "no shape": (link_b("<collision><geometry/></collision>"), "has no shape"),
    "cone": (link_b("<collision><geometry><cone/></geometry></collision>"), "<cone> is not a URDF shape"),
    "negative size": (
        link_b('<collision><geometry><box size="1 -1 1"/></geometry></collision>'),
        "expected positive lengths",
    ),
    "no radius": (link_b("<visual><geometry><sphere/></geometry></visual>"), "no attribute 'radius'"),
    "collision mesh": (
        link_b('<collision><geometry><mesh filename="x.stl"/></geometry></collision>'),
        "collision mesh: 'x.stl' is not found",
    ),
    "transmission joint": (
        GOOD.replace(JOINT, JOINT + '<transmission name="t"><type>x/S</type><joint name="jj"/></transmission>'),
        "names joint 'jj'",
    ),
    "transmission reduction": (
        GOOD.replace(
            JOINT,
            JOINT + '<transmission name="t"><type>S</type><joint name="j"/><actuator name="m">'
            "<mechanicalReduction>0</mechanicalReduction></actuator></transmission>",
        ),
        "reduction is 0",
    ),
}


@pytest.mark.parametrize("defect", BAD)
def test_a_defect_is_told_once_with_its_place(tmp_path: Path, defect: str) -> None:
    text, expected = BAD[defect]
    found = errors(tmp_path, text)
    assert any(expected in finding.message for finding in found), [str(finding) for finding in found]
    assert all(finding.place is not None for finding in found)


def test_all_defects_of_a_file_are_told_at_once(tmp_path: Path) -> None:
    text = GOOD.replace('mass value="2"', 'mass value="-2"').replace('"0 0 1"', '"0 0 0"').replace("<robot", "<robot")
    text = text.replace("</robot>", '<link name="c"><collision><geometry><box/></geometry></collision></link></robot>')
    messages = " ".join(finding.message for finding in errors(tmp_path, text))
    for expected in ("link 'a' has mass", "link 'b' has mass", "axis 0 0 0", "no attribute 'size'"):
        assert expected in messages


def test_an_unknown_name_is_answered_with_the_nearest(tmp_path: Path) -> None:
    text = GOOD.replace('name="b"', 'name="forearm"').replace('child link="b"', 'child link="forarm"')
    assert any("forearm" in (finding.hint or "") for finding in errors(tmp_path, text))


def test_what_can_be_lived_with_is_a_warning(tmp_path: Path) -> None:
    visual = '<visual><geometry><mesh filename="x.stl"/></geometry></visual>'
    text = GOOD.replace(LINK_B, f'<link name="b">{INERTIAL}{visual}</link>').replace('"0 0 1"', '"0 0 2"')
    parts = read(tmp_path, text.replace('velocity="3"', 'velocity="0"'))
    assert parts.errors == ()
    assert {finding.code for finding in parts.findings} == {"URDF033", "URDF034", "URDF036"}
    assert parts.joints[0].limits.velocity is None
    np.testing.assert_array_equal(parts.joints[0].axis, [0.0, 0.0, 1.0])
    assert parts.links[1].visuals == ()


def test_of_two_shapes_the_first_counts(tmp_path: Path) -> None:
    shapes = '<collision><geometry><box size="1 1 1"/><sphere radius="1"/></geometry></collision>'
    parts = read(tmp_path, link_b(INERTIAL + shapes))
    assert [finding.code for finding in parts.findings] == ["URDF061"]
    assert [each.shape for each in parts.links[1].collisions] == [Box((1.0, 1.0, 1.0))]


def test_a_capsule_is_a_cylinder_and_two_spheres(tmp_path: Path) -> None:
    capsule = '<origin xyz="1 0 0" rpy="1.5707963267948966 0 0"/>'
    capsule += '<geometry><capsule radius="0.1" length="2"/></geometry>'
    parts = read(tmp_path, link_b(f"{INERTIAL}<collision>{capsule}</collision>"))
    middle, *ends = parts.links[1].collisions
    assert (middle.shape, {each.shape for each in ends}) == (Cylinder(0.1, 2.0), {Sphere(0.1)})
    # The axis z of the capsule lies along -y of the link.
    for end, expected in zip(ends, ([1.0, 1.0, 0.0], [1.0, -1.0, 0.0]), strict=True):
        np.testing.assert_allclose(end.X_LS.p, expected, atol=1e-15)


def test_a_floating_joint_holds_its_link(tmp_path: Path) -> None:
    parts = read(tmp_path, joint(ENDS, "floating"))
    assert [(finding.code, finding.severity) for finding in parts.findings] == [("URDF065", "warning")]
    assert parts.joints[0].type == "fixed"


def test_a_bad_number_hides_no_error_of_the_tree(tmp_path: Path) -> None:
    text = GOOD.replace('"0 0 1"', '"0 0 0"').replace("</robot>", '<link name="c"/></robot>')
    assert {finding.code for finding in errors(tmp_path, text)} == {"URDF009", "URDF007"}


@pytest.mark.parametrize("fault", ["cycle of mimics", "undefined links"])
def test_reading_takes_work_in_proportion_to_the_number_of_links(tmp_path: Path, fault: str) -> None:
    """Counted in calls, of Python and of C: four times as many links take less than five times as many."""

    def calls(count: int) -> int:
        links = "".join(f'<link name="l{k}"/>' for k in range(count))
        joints = "".join(
            f'<joint name="j{k}" type="continuous"><parent link="l{k}"/><child link="l{k + 1}"/>'
            f'<mimic joint="j{(k + 1) % (count - 1)}"/></joint>'
            for k in range(count - 1)
        )
        if fault == "undefined links":
            joints = joints.replace('<child link="', '<child link="x')
        seen = 0

        def count_call(_frame: object, event: str, _arg: object) -> None:
            nonlocal seen
            seen += event in ("call", "c_call")

        before = sys.getprofile()
        sys.setprofile(count_call)
        try:
            found = errors(tmp_path, f'<robot name="r">{links}{joints}</robot>')
        finally:
            sys.setprofile(before)
        if fault == "cycle of mimics":
            assert [finding.code for finding in found] == ["URDF084"]
        else:
            assert len(found) >= count - 1
        return seen

    calls(10)  # what is imported at the first time is not of it
    assert calls(800) < 5 * calls(200)


@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.permutations("abcdefg"), st.integers(0, 3), st.randoms(use_true_random=False))
def test_links_of_the_smaller_tree_are_named_and_no_others(
    tmp_path: Path, order: list[str], shape: int, random: Random
) -> None:
    """Two trees, of four links under a and three under e, in any order."""
    parent = {"b": "a", "c": "ab"[shape % 2], "d": "abc"[shape % 3], "f": "e", "g": "ef"[shape // 2]}
    joints = [_fixed(f"j{child}", above, child) for child, above in parent.items()]
    random.shuffle(joints)
    links = "".join(f'<link name="{name}"/>' for name in order)
    (found,) = errors(tmp_path, f'<robot name="r">{links}{"".join(joints)}</robot>')
    assert found.code == "URDF007"
    named = found.message.split("not connected to 'a': ")[1]
    assert sorted(re.findall(r"\b[a-g]\b", named)) == ["e", "f", "g"]
    assert found.hint == "connect 'e' to 'a' with a fixed joint, or delete it"


@pytest.mark.parametrize("order", ["abcd", "dcba", "cadb"])
def test_a_loop_is_told_parents_first(tmp_path: Path, order: str) -> None:
    """The loop b -> c -> d -> b, with a hanging on it."""
    parent = {"c": "b", "d": "c", "b": "d", "a": "c"}
    links = "".join(f'<link name="{name}"/>' for name in order)
    joints = "".join(_fixed(f"j{child}", parent[child], child) for child in order)
    (found,) = errors(tmp_path, f'<robot name="r">{links}{joints}</robot>')
    told = found.message.removeprefix("links form a loop: ").split(" -> ")
    assert told[0] == told[-1]
    assert sorted(told[1:]) == ["b", "c", "d"]
    assert all(parent[child] == above for above, child in pairwise(told))


def _fixed(name: str, parent: str, child: str) -> str:
    return f'<joint name="{name}" type="fixed"><parent link="{parent}"/><child link="{child}"/></joint>'


def test_joints_come_depth_first_whatever_the_order_of_the_file(tmp_path: Path) -> None:
    links = "".join(f'<link name="{name}"/>' for name in "edcba")
    joints = _fixed("4", "c", "d") + _fixed("3", "a", "c") + _fixed("2", "b", "e") + _fixed("1", "a", "b")
    parts = read(tmp_path, f'<robot name="r">{links}{joints}</robot>')
    assert [joint.name for joint in parts.joints] == ["3", "4", "1", "2"]
    assert [link.name for link in parts.links] == ["a", "c", "d", "b", "e"]


def test_a_chain_of_mimics_follows_the_first_joint(tmp_path: Path) -> None:
    def sliding(name: str, parent: str, child: str, mimic: str) -> str:
        ends = f'<parent link="{parent}"/><child link="{child}"/>'
        return f'<joint name="{name}" type="prismatic">{ends}{LIMIT}{mimic}</joint>'

    joints = sliding("1", "a", "b", '<mimic joint="2" multiplier="2" offset="0.5"/>')
    joints += sliding("2", "a", "c", '<mimic joint="3" multiplier="-3" offset="1"/>') + sliding("3", "a", "d", "")
    links = "".join(f'<link name="{name}">{INERTIAL}</link>' for name in "abcd")
    parts = read(tmp_path, f'<robot name="r">{links}{joints}</robot>')
    q3 = 0.1
    mimic = parts.joints[0].mimic
    assert mimic is not None
    assert mimic.joint == "3"
    assert mimic.multiplier * q3 + mimic.offset == pytest.approx(2 * (-3 * q3 + 1) + 0.5, abs=1e-15)
    circle = joints.replace('<mimic joint="3"', '<mimic joint="1"')
    assert any("circle" in finding.message for finding in errors(tmp_path, f'<robot name="r">{links}{circle}</robot>'))
    assert parts.joints[1].mimic == Mimic("3", -3.0, 1.0)


@pytest.mark.parametrize(
    ("text", "most"),
    [
        ('<origin xyz="0 0 {}"/>', 1e6),
        ('<origin rpy="0 -{} 0"/>', 1e6),
        ('<dynamics damping="{}"/>', 1e9),
        ('<dynamics friction="{}"/>', 1e9),
    ],
)
def test_what_is_beyond_all_that_is_real_is_an_error(tmp_path: Path, text: str, most: float) -> None:
    for value, told in ((most, []), (most * 1.001, ["URDF004"]), (1e300, ["URDF004"])):
        described = joint(ENDS + LIMIT + text.format(value))
        assert [finding.code for finding in errors(tmp_path, described)] == told


def test_a_mimic_with_a_multiplier_of_0_follows_nothing(tmp_path: Path) -> None:
    second = JOINT.replace('"j"', '"k"').replace('"b"', '"c"').replace('"a"', '"b"')
    follower = second.replace("</joint>", '<mimic joint="j" multiplier="{}" offset="0.4"/></joint>')
    text = GOOD.replace(JOINT, LINK_B.replace('"b"', '"c"') + JOINT + follower)
    for multiplier, told in (("0", ["URDF014"]), ("-0.0", ["URDF014"]), ("1e-3", [])):
        assert [finding.code for finding in errors(tmp_path, text.format(multiplier))] == told


def test_colours_come_from_materials_by_name_and_in_place(tmp_path: Path) -> None:
    shape = '<geometry><box size="1 2 3"/></geometry>'
    visuals = f'<visual>{shape}<material name="red"/></visual>'
    visuals += f'<visual>{shape}<material name="own"><color rgba="0 1 0 0.5"/></material></visual>'
    visuals += f"<visual>{shape}</visual>"
    text = GOOD.replace(LINK_B, f'<link name="b">{INERTIAL}{visuals}</link>')
    parts = read(tmp_path, text.replace("</robot>", '<material name="red"><color rgba="1 0 0 1"/></material></robot>'))
    assert [visual.rgba for visual in parts.links[1].visuals] == [(1, 0, 0, 1), (0, 1, 0, 0.5), None]
    assert parts.links[1].visuals[0].shape == Box((1.0, 2.0, 3.0))


@pytest.mark.parametrize(
    ("there", "begins"), [("none.stl", "add the file"), ("elbw.stl", "did you mean 'elbw.stl'? Otherwise ")]
)
def test_what_to_do_without_a_collision_mesh_is_told(tmp_path: Path, there: str, begins: str) -> None:
    (tmp_path / there).touch()
    shape = '<collision><geometry><mesh filename="elbow.stl"/></geometry></collision>'
    (finding,) = errors(tmp_path, link_b(INERTIAL + shape))
    assert finding.code == "URDF013"
    assert (finding.hint or "").startswith(begins)
    assert "delete the <collision>" in (finding.hint or "")


def test_a_mesh_is_named_without_the_machine_it_lies_on(tmp_path: Path) -> None:
    folder = tmp_path / "arm" / "urdf"
    folder.mkdir(parents=True)
    mesh = tmp_path / "arm" / "meshes" / "x.stl"
    mesh.parent.mkdir()
    mesh.write_bytes(TETRAHEDRON)
    for uri in ("../meshes/x.stl", "package://arm/meshes/x.stl", f"file://{mesh}"):
        shape = f'<collision><geometry><mesh filename="{uri}" scale="1 -1 0.001"/></geometry></collision>'
        parts = read(folder, link_b(INERTIAL + shape))
        assert parts.errors == ()
        expected = Mesh(uri="package://arm/meshes/x.stl", path=mesh, scale=(1.0, -1.0, 0.001))
        assert parts.links[1].collisions[0].shape == expected


ROS1 = (
    '<transmission name="t"><type>transmission_interface/SimpleTransmission</type><joint name="j">'
    "<hardwareInterface>EffortJointInterface</hardwareInterface><offset>0.5</offset></joint>"
    '<actuator name="m"><mechanicalReduction>-50</mechanicalReduction></actuator></transmission>'
)
ROS2 = (
    '<ros2_control name="h" type="system"><joint name="j"/><transmission name="t">'
    "<plugin>transmission_interface/SimpleTransmission</plugin>"
    '<joint name="j" role="joint1"><mechanical_reduction>-50</mechanical_reduction><offset>0.5</offset></joint>'
    '<actuator name="m" role="actuator1"/></transmission></ros2_control>'
)


@pytest.mark.parametrize("text", [ROS1, ROS2], ids=["ros1", "ros2"])
def test_transmissions_of_both_generations_say_the_same(tmp_path: Path, text: str) -> None:
    (tag,) = read(tmp_path, GOOD.replace(JOINT, JOINT + text)).transmissions
    assert (tag.name, tag.type, tag.joints, tag.actuators) == ("t", "SimpleTransmission", ("j",), ("m",))
    assert tag.joint_reductions[0] * tag.actuator_reductions[0] == -50.0
    assert tag.joint_offsets == (0.5,)


PUT = ["", "0", "nan", '"', "<", "a", "-"]


@pytest.mark.slow
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(at=st.integers(0, len(GOOD)), length=st.integers(0, 12), put=st.sampled_from(PUT))
def test_any_change_of_the_text_gives_parts_or_findings(tmp_path: Path, at: int, length: int, put: str) -> None:
    try:
        parts = read(tmp_path, GOOD[:at] + put + GOOD[at + length :])
    except InvalidInput:
        return
    if not parts.errors:
        assert parts.root
        assert len(parts.joints) == len(parts.links) - 1
