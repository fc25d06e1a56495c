"""Where checks of physics, assets and readiness draw the line: what just fires, and what just does not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import Diagnostic
from manipcli.description.lint.examine import examine
from manipcli.description.lint.samples import (
    CUBE,
    INERTIAL,
    LIMIT,
    MOTOR,
    TETRAHEDRON,
    one_joint,
    one_link,
    transmission,
)
from manipcli.description.lint.zero_overlap import overlaps_at_zero
from manipcli.description.packages import Packages
from manipcli.shapes.mesh_formats import binary_stl


def findings(folder: Path, text: str, **files: bytes) -> tuple[Diagnostic, ...]:
    path = folder / "robot.urdf"
    path.write_text(text, encoding="utf-8")
    for name, data in files.items():
        (folder / name.replace("__", ".")).write_bytes(data)
    return examine(path, packages=Packages(path)).findings


def codes(folder: Path, text: str, **files: bytes) -> set[str]:
    """Of errors and warnings."""
    return {finding.code for finding in findings(folder, text, **files) if finding.severity != "note"}


def scaled_inertia(factor: float) -> str:
    return INERTIAL.replace("0.02", repr(0.02 * factor)) + CUBE


def placed(xyz: str) -> str:
    return INERTIAL.replace("<mass", f'<origin xyz="{xyz}"/><mass') + CUBE


def heavy(mass: float) -> str:
    """The cube, of this mass, with the moments of one."""
    return INERTIAL.replace('value="1"', f'value="{mass!r}"').replace('"0.02"', f'"{0.02 * mass!r}"') + CUBE


def moved(text: str, limits: str = LIMIT) -> str:
    return one_joint(text + limits)


SECOND = (
    f'<link name="other">{INERTIAL}{CUBE}</link><joint name="k" type="revolute"><origin xyz="0 0 1"/>'
    f'<parent link="tip"/><child link="other"/>{LIMIT}'
)
FIXED = '<link name="pad">{}</link><joint name="f" type="fixed"><parent link="tip"/><child link="pad"/></joint>'
HARDWARE = "<hardware><plugin>p/P</plugin></hardware>"


def control(inside: str, more: str = "") -> str:
    return one_joint(more=f'{more}<ros2_control name="c" type="system">{HARDWARE}{inside}</ros2_control>')


def coloured(name: str, inside: str) -> str:
    visual = f'<visual><geometry><box size="1 1 1"/></geometry><material {name}>{inside}</material></visual>'
    return one_joint(tip=INERTIAL + CUBE + visual)


def twice(inside: str, second: str = "d") -> str:
    """The same in a second component."""
    text = control(inside)
    one = text[text.index("<ros2_control") : text.index("</robot>")]
    return text.replace("</robot>", one.replace('name="c"', f'name="{second}"') + "</robot>")


def differential(roles: str) -> str:
    joints = "".join(
        f'<joint name="{name}"><role>{role}</role><hardwareInterface>EffortJointInterface</hardwareInterface></joint>'
        for name, role in zip("jk", roles.split(), strict=True)
    )
    motors = "".join(
        f'<actuator name="m{k}"><role>actuator{k}</role><mechanicalReduction>1</mechanicalReduction></actuator>'
        for k in (1, 2)
    )
    return one_joint(more=SECOND + "</joint>" + transmission(joints + motors, kind="DifferentialTransmission"))


def geared_twice(reduction: float) -> str:
    """Joint j with a reduction of 50 in the form of ROS 1 and one of ros2_control."""
    ros2 = control(
        '<joint name="j"><command_interface name="position"/></joint><transmission name="u">'
        "<plugin>transmission_interface/SimpleTransmission</plugin>"
        f'<joint name="j" role="joint1"><mechanical_reduction>{reduction}</mechanical_reduction></joint></transmission>'
    )
    ros1 = transmission().replace("<mechanicalReduction>1", "<mechanicalReduction>50")
    return ros2.replace("</robot>", ros1 + "</robot>")


# The cube is 0.35 m wide: its corners lie 0.303 m from its centre, its mass sqrt(0.02 / 1) = 0.141 m on average.
QUIET = {
    "sound": one_joint(),
    "inertia of a hollow cube": one_joint(tip=scaled_inertia(1.7)),
    "inertia four times as large": one_joint(tip=scaled_inertia(4.0)),
    "inertia a hundredth": one_joint(tip=scaled_inertia(0.01)),
    "centre in a corner": one_joint(tip=placed("0.17 0.17 0.17")),
    "centre a little outside": one_joint(tip=placed("0.3 0 0")),
    "mass on what is fixed to the link": one_joint(tip=CUBE, more=FIXED.format(INERTIAL)),
    "frame without a shape": one_joint(tip=INERTIAL + CUBE, more=FIXED.format("")),
    "collision on what is fixed to a link of mass": one_joint(tip=INERTIAL, more=FIXED.format(CUBE)),
    "a gantry": one_joint(LIMIT.replace("-1", "-15").replace('upper="1"', 'upper="15"'), kind="prismatic"),
    "a material with an empty name": coloured('name=""', '<color rgba="1 0 0 1"/>'),
    "a material with a name": coloured('name="m"', '<color rgba="1 0 0 1"/>'),
    "a version": one_joint().replace('name="r"', 'name="r" version="1.0"'),
    "many turns": moved("", LIMIT.replace("-1", "-12").replace('upper="1"', 'upper="12"')),
    "soft limits inside": moved(
        '<safety_controller soft_lower_limit="-1" soft_upper_limit="0.9" k_position="9" k_velocity="1"/>'
    ),
    "soft limits unstated": moved('<safety_controller k_velocity="1"/>'),
    "continuous": one_joint(kind="continuous", inside=""),
    "simple transmission": one_joint(more=transmission()),
    "prefixed interface": one_joint(more=transmission().replace(">PositionJoint", ">hardware_interface/PositionJoint")),
    "differential": differential("joint1 joint2"),
    "differential the other way round": differential("joint2 joint1"),
    "control": control(
        '<joint name="j"><command_interface name="position"/><state_interface name="velocity"/></joint>'
    ),
    "interface of one's own": control('<joint name="j"><command_interface name="glue_pressure"/></joint>'),
    "limits of an interface": control(
        '<joint name="j"><command_interface name="position"><param name="min">-1</param><param name="max">1</param>'
        "</command_interface></joint>"
    ),
    "transmission in ros2_control": control(
        '<joint name="j"><command_interface name="position"/></joint><transmission name="t">'
        "<plugin>transmission_interface/SimpleTransmission</plugin>"
        '<joint name="j" role="joint1"><mechanical_reduction>50</mechanical_reduction></joint></transmission>'
    ),
    "one gear in both forms": geared_twice(50.0),
    "sensors, switches and types": control(
        '<joint name="j"><limits enable="false"/><state_interface name="position" data_type="double"/>'
        '<command_interface name="position"/></joint><sensor name="s"><state_interface name="force.x"/></sensor>'
    ).replace('"system"', '"system" is_async="true"'),
    "two components, each with an interface of its own": twice('<joint name="j"/>'),
    "mimic with states only": control(
        '<joint name="j"/><joint name="k"><state_interface name="position"/></joint>',
        SECOND + '<mimic joint="j"/></joint>',
    ),
    "mimic within its limits": one_joint(more=SECOND + '<mimic joint="j" multiplier="-1"/></joint>'),
    "dash and dot": one_joint().replace('"tip"', '"tip-1.a"'),
    # 0.35^3 m3 = 0.0429 m3 of osmium weigh 969 kg.
    "a cube of osmium": one_joint(tip=heavy(969.0)),
    "root link without mass": one_joint(),
}


@pytest.mark.parametrize("case", QUIET)
def test_what_is_sound_gets_no_error_and_no_warning(tmp_path: Path, case: str) -> None:
    assert codes(tmp_path, QUIET[case]) == set()


LOUD = {
    "inertia ten times what the shape allows": (one_joint(tip=scaled_inertia(20.0)), "URDF101"),
    "inertia in g m2": (one_joint(tip=scaled_inertia(1e-3)), "URDF101"),
    "inertia in g mm2": (one_joint(tip=scaled_inertia(1e9)), "URDF101"),
    "centre in millimetres": (one_joint(tip=placed("0 0 35")), "URDF102"),
    "denser than osmium": (one_joint(tip=heavy(1300.0)), "URDF112"),
    "eleven tonnes, in no small space": (one_joint(tip=heavy(11000.0).replace("0.35", "0.9")), "URDF112"),
    "negative mass": (one_joint(tip=INERTIAL.replace('value="1"', 'value="-1"') + CUBE), "URDF011"),
    "no mass": (one_joint(tip=INERTIAL.replace('value="1"', 'value="0"') + CUBE), "URDF100"),
    "triangle": (one_joint(tip=INERTIAL.replace('ixx="0.02"', 'ixx="0.05"') + CUBE), "URDF011"),
    "prismatic without limits": (one_joint("", kind="prismatic"), "URDF010"),
    "negative effort": (moved("", LIMIT.replace('effort="1"', 'effort="-1"')), "URDF010"),
    "negative damping": (moved('<dynamics damping="-1"/>'), "URDF010"),
    "soft limits crossed": (
        moved('<safety_controller soft_lower_limit="0.5" soft_upper_limit="-0.5" k_velocity="1"/>'),
        "URDF107",
    ),
    "degrees": (moved("", LIMIT.replace("-1", "-180").replace('upper="1"', 'upper="180"')), "URDF109"),
    "millimetres": (
        one_joint(LIMIT.replace("-1", "-500").replace('upper="1"', 'upper="500"'), kind="prismatic"),
        "URDF109",
    ),
    "a mimic that is fixed": (one_joint('<mimic joint="k"/>', kind="fixed"), "URDF104"),
    "a texture that is not there": (coloured('name="m"', '<texture filename="none.png"/>'), "URDF033"),
    "a material without a name": (coloured("", '<color rgba="1 0 0 1"/>'), "URDF063"),
    "a version that is none": (one_joint().replace('name="r"', 'name="r" version="2.0"'), "URDF050"),
    "same role twice": (differential("joint1 joint1"), "URDF312"),
    "reduction of words": (
        one_joint(more=transmission().replace("<mechanicalReduction>1", "<mechanicalReduction>fifty")),
        "URDF004",
    ),
    "reduction of zero": (
        one_joint(more=transmission().replace("<mechanicalReduction>1", "<mechanicalReduction>0")),
        "URDF015",
    ),
    "offset not finite": (
        one_joint(more=transmission().replace("</hardwareInterface>", "</hardwareInterface><offset>nan</offset>")),
        "URDF004",
    ),
    "transmission of a mimic": (
        one_joint(more=SECOND + '<mimic joint="j"/></joint>' + transmission().replace('"j"', '"k"')),
        "URDF315",
    ),
    "no role in ros2_control": (
        control(
            '<joint name="j"><command_interface name="position"/></joint><transmission name="t">'
            '<plugin>transmission_interface/SimpleTransmission</plugin><joint name="j"/></transmission>'
        ),
        "URDF312",
    ),
    "two gears in two forms": (geared_twice(40.0), "URDF311"),
    "no actuator": (one_joint(more=transmission().replace(MOTOR, "")), "URDF313"),
    "mimic in ros2_control": (
        control('<joint name="k"><command_interface name="position"/></joint>', SECOND + '<mimic joint="j"/></joint>'),
        "URDF321",
    ),
    "fixed in ros2_control": (control('<joint name="f"/>', FIXED.format("")), "URDF320"),
    "initial position outside": (
        control(
            '<joint name="j"><state_interface name="position"><param name="initial_value">2</param></state_interface>'
            "</joint>"
        ),
        "URDF324",
    ),
    "sensor of a wrong kind": (control("<lidar/>"), "URDF325"),
    "a joint commanded by two": (twice('<joint name="j"><command_interface name="position"/></joint>'), "URDF325"),
    "two of one name": (twice("", second="c"), "URDF325"),
    "an interface twice": (
        control('<joint name="j"><state_interface name="position"/><state_interface name="position"/></joint>'),
        "URDF325",
    ),
    "an interface that is misspelt": (control('<joint name="j"><stat_interface name="position"/></joint>'), "URDF325"),
    "a sensor that is commanded": (
        control('<joint name="j"><command_interface name="position"/></joint>').replace('"system"', '"sensor"'),
        "URDF325",
    ),
    "a sensor without a name": (control('<sensor><state_interface name="force.x"/></sensor>'), "URDF325"),
    "a limit that is empty": (
        control('<joint name="j"><command_interface name="position"><param name="min"/></command_interface></joint>'),
        "URDF324",
    ),
    "asynchronous, maybe": (control("").replace('"system"', '"system" is_async="maybe"'), "URDF324"),
    "limits, maybe": (control('<joint name="j"><limits enable="maybe"/></joint>'), "URDF324"),
    "a type of data that is none": (
        control('<joint name="j"><state_interface name="position" data_type="foo"/></joint>'),
        "URDF324",
    ),
    "a multiplier of words": (control('<joint name="j"><param name="multiplier">x</param></joint>'), "URDF324"),
    "one joint in both roles": (differential("joint1 joint2").replace('"k"><role>', '"j"><role>'), "URDF312"),
    "mimic beyond its limits": (one_joint(more=SECOND + '<mimic joint="j" offset="0.5"/></joint>'), "URDF335"),
    "slash in a name": (one_joint().replace('"tip"', '"left/tip"'), "URDF331"),
}


@pytest.mark.parametrize("case", LOUD)
def test_what_is_not_sound_is_told_by_its_code_alone(tmp_path: Path, case: str) -> None:
    text, code = LOUD[case]
    told = codes(tmp_path, text)
    assert code in told
    assert told - {code} <= {"URDF108", "URDF100"}  # mass 0 is both


def test_a_mesh_is_measured_with_its_scale(tmp_path: Path) -> None:
    cube = binary_stl(TETRAHEDRON * 300.0)
    assert "URDF206" in codes(tmp_path, one_link('filename="a.stl"'), a__stl=cube)
    assert codes(tmp_path, one_link('filename="a.stl" scale="0.001 0.001 0.001"'), a__stl=cube) == set()
    assert "URDF206" in codes(tmp_path, one_link('filename="a.stl" scale="1e-6 1e-6 1e-6"'), a__stl=cube)


def test_a_damaged_visual_is_a_warning_and_a_damaged_collision_an_error(tmp_path: Path) -> None:
    for role, expected in (("visual", ("URDF212", "warning")), ("collision", ("URDF200", "error"))):
        (found,) = findings(tmp_path, one_link('filename="a.stl"', role=role), a__stl=b"garbage")[-1:]
        assert (found.code, found.severity) == expected
        assert found.place is not None and found.place.line == 1


def test_nothing_is_fetched_and_nothing_outside_is_read(tmp_path: Path) -> None:
    (tmp_path / "robots").mkdir()
    (tmp_path / "secret.stl").write_bytes(binary_stl(TETRAHEDRON))
    (tmp_path / "robots" / "link.stl").symlink_to(tmp_path / "secret.stl")
    folder = tmp_path / "robots" / "urdf"
    folder.mkdir()
    for role in ("visual", "collision"):
        for uri, code in (
            ("http://127.0.0.1:9/a.stl", "URDF201"),
            ("ftp://example.org/a.stl", "URDF201"),
            ("data:model/stl;base64,AAAA", "URDF201"),
            ("../../secret.stl", "URDF202"),
            ("../link.stl", "URDF202"),
        ):
            assert code in codes(folder, one_link(f'filename="{uri}"', role=role)), uri


@pytest.mark.parametrize(("apart", "told"), [(0.36, False), (0.34, True)])
def test_overlap_at_zero_is_that_of_the_shapes(tmp_path: Path, apart: float, told: bool) -> None:
    """Two cubes 0.35 m wide, their centres `apart`, of links that no joint joins directly."""
    chain = SECOND + '</joint><link name="last">' + INERTIAL + CUBE + "</link>"
    chain += f'<joint name="l" type="revolute"><origin xyz="{apart} 0 -1"/><parent link="other"/><child link="last"/>'
    path = tmp_path / "robot.urdf"
    path.write_text(one_joint(more=chain + LIMIT + "</joint>"), encoding="utf-8")
    parts = examine(path, packages=Packages(path)).parts
    assert parts is not None
    found = list(overlaps_at_zero(parts))
    assert [(a, b) for a, b, _ in found] == ([("tip", "last")] if told else [])
    for _, _, depth in found:
        assert depth == pytest.approx(0.35 - apart, abs=1e-6)


def test_hulls_that_overlap_are_no_overlap_where_the_surfaces_do_not_meet(tmp_path: Path) -> None:
    """A peg in a ring: their hulls overlap, they do not."""
    import trimesh

    ring = trimesh.creation.annulus(r_min=0.2, r_max=0.3, height=0.1)
    mesh = '<collision><geometry><mesh filename="ring.stl"/></geometry></collision>'
    peg = '<collision><geometry><cylinder radius="{}" length="0.1"/></geometry></collision>'
    (tmp_path / "ring.stl").write_bytes(binary_stl(np.asarray(ring.triangles)))
    for radius, told in ((0.1, False), (0.22, True)):
        chain = SECOND + '</joint><link name="last">' + INERTIAL + peg.format(radius) + "</link>"
        chain += '<joint name="l" type="revolute"><origin xyz="0 0 -1"/><parent link="other"/><child link="last"/>'
        text = one_joint(tip=INERTIAL + mesh, more=chain + LIMIT + "</joint>")
        assert ("URDF333" in codes(tmp_path, text)) is told


def test_a_joint_without_an_interface_is_told_that_of_its_actuator(tmp_path: Path) -> None:
    """Descriptions of early ROS 1 say it at the actuator alone."""
    for said, meant in (
        ("<hardwareInterface>EffortJointInterface</hardwareInterface>", "EffortJointInterface"),
        ("", "PositionJointInterface"),
    ):
        motor = MOTOR.replace("</actuator>", said + "</actuator>")
        found = findings(tmp_path, one_joint(more=transmission('<joint name="j"/>' + motor)))
        (hint,) = [finding.hint for finding in found if finding.code == "URDF314"]
        assert hint == f"<hardwareInterface>hardware_interface/{meant}</hardwareInterface>"


def test_what_is_taken_for_granted_or_refers_to_nothing_is_a_note(tmp_path: Path) -> None:
    for text, code, said in (
        (one_joint(LIMIT.replace(' lower="-1"', "")), "URDF036", "lower limit is missing; 0 is used"),
        (one_joint(more='<gazebo reference="tipp"/>'), "URDF330", "'tipp', which is neither a link nor a joint"),
    ):
        told = [found for found in findings(tmp_path, text) if said in found.message]
        assert [(found.code, found.severity) for found in told] == [(code, "note")]
    assert not any(
        "neither a link" in found.message for found in findings(tmp_path, one_joint(more='<gazebo reference="j"/>'))
    )


def test_stray_text_is_told_where_it_stands(tmp_path: Path) -> None:
    text = (
        '<robot name="r">\n  <link name="a">\n    <visual>  oh dear<geometry><box size="1 1 1"/></geometry></visual>\n'
        "  </link>\n\n  <!-- a\n  comment -->\n  stray \u00e9 words\n  and more\n"
        '  <link name="b"/>\n  <joint name="b" type="fixed"><parent link="a"/> b <child link="b"/></joint>\n</robot>\n'
    )
    for written in (text, text.replace("\n", "\r\n")):
        found = [each for each in findings(tmp_path, written) if each.code == "URDF057"]
        assert [(f.place.line, f.place.column) for f in found if f.place] == [(3, 15), (8, 3), (11, 51)]
