"""`inertials:` gives links the mass properties that their description lacks, and says which."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.model.build_robot import build_robot
from manipcli.model.robot import LinkInertial, RobotModel
from manipcli.spec.load import load_robot_text

GOOD = '<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
BOX = '<collision><origin xyz="0 0 0.1"/><geometry><box size="0.1 0.2 0.3"/></geometry></collision>'
BALL = '<visual><geometry><sphere radius="0.1"/></geometry></visual>'
FACTOR_5 = (
    GOOD.replace('value="2"', 'value="3"')
    .replace("<mass", '<origin xyz="0 0 0.05"/><mass')
    .replace('izz="1"', 'izz="10"')
)


def urdf(**links: str) -> str:
    """A chain of revolute joints; a link whose name begins with f is fixed."""
    names = list(links)
    text = "".join(f'<link name="{name}">{content}</link>\n' for name, content in links.items())
    for k, (a, b) in enumerate(pairwise(names)):
        kind = "fixed" if b.startswith("f") else "revolute"
        limit = '<limit lower="-1" upper="1" velocity="1" effort="9"/>' if kind == "revolute" else ""
        text += f'<joint name="j{k}" type="{kind}"><parent link="{a}"/><child link="{b}"/>{limit}</joint>\n'
    return f'<robot name="r">\n{text}</robot>'


def built(folder: Path, lines: str, **links: str) -> tuple[RobotModel, tuple[Diagnostic, ...]]:
    (folder / "r.urdf").write_text(urdf(**links))
    file = load_robot_text(f"robot: r\ndescription: r.urdf\n{lines}\n", str(folder / "robot.yaml"))
    return build_robot(file.spec, file=folder / "robot.yaml", source=file.source)


def refused(folder: Path, lines: str, **links: str) -> list[str]:
    with pytest.raises(InvalidInput) as caught:
        built(folder, lines, **links)
    return [f"{each} | {each.hint}" for each in caught.value.findings if each.severity == "error"]


def mass(robot: RobotModel, link: str) -> float:
    own = robot.link(link).inertial
    return 0.0 if own is None else own.mass


def test_links_without_inertial_have_the_mass_of_their_shapes(tmp_path: Path) -> None:
    robot, findings = built(tmp_path, "inertials: estimate", base=BOX, a=BOX, b=BALL, c=GOOD + BOX)
    assert mass(robot, "a") == pytest.approx(1000 * 0.1 * 0.2 * 0.3)
    assert mass(robot, "b") == pytest.approx(1000 * 4 / 3 * np.pi * 0.1**3)
    assert mass(robot, "c") == 2.0  # the description's
    own = robot.link("a").inertial
    assert own is not None
    np.testing.assert_allclose(own.X_LI.p, [0, 0, 0.1])
    np.testing.assert_allclose(np.diag(own.inertia), 6.0 / 12 * np.array([0.13, 0.10, 0.05]))
    assert [(row.link, row.kind) for row in robot.inertials] == [(name, "estimated") for name in ("base", "a", "b")]
    assert [row.source for row in robot.inertials][1:] == [
        "collision shapes (primitives)",
        "visual shapes (primitives)",
    ]
    assert any(finding.code == "ROBOT353" for finding in findings)


def test_collision_shapes_come_before_visual_ones(tmp_path: Path) -> None:
    robot, _ = built(tmp_path, "inertials: estimate", base="", a=BALL + BOX)
    assert mass(robot, "a") == pytest.approx(6.0)


def test_the_total_mass_scales_only_the_estimates(tmp_path: Path) -> None:
    links = {"base": BOX, "a": BOX, "b": GOOD}
    robot, _ = built(tmp_path, "inertials: {estimate: {total_mass: 5}}", **links)
    assert sum(mass(robot, link.name) for link in robot.links) == pytest.approx(5.0)
    assert mass(robot, "b") == 2.0
    plain, _ = built(tmp_path, "inertials: {estimate: {density: 10}}", **links)
    for name in ("base", "a"):
        scaled, own = robot.link(name).inertial, plain.link(name).inertial
        assert scaled is not None
        assert own is not None
        np.testing.assert_allclose(scaled.inertia / scaled.mass, own.inertia / own.mass)
    (error,) = refused(tmp_path, "inertials: {estimate: {total_mass: 1.5}}", **links)
    assert "robot.yaml:3:36" in error
    assert "total_mass is 1.5 kg" in error


def test_an_impossible_inertia_keeps_its_mass_and_centre(tmp_path: Path) -> None:
    (error,) = refused(tmp_path, "", base="", a=FACTOR_5 + BOX)
    assert "URDF011" in error
    assert "add `inertials: estimate` to the robot file" in error
    robot, _ = built(tmp_path, "inertials: estimate", base="", a=FACTOR_5 + BOX)
    own = robot.link("a").inertial
    assert own is not None
    assert own.mass == 3.0
    np.testing.assert_allclose(own.X_LI.p, [0, 0, 0.05])
    np.testing.assert_allclose(np.diag(own.inertia), 3.0 / 12 * np.array([0.13, 0.10, 0.05]))
    assert robot.inertials[0].kind == "repaired"


@pytest.mark.parametrize("izz", ["0", "-1e-9", "1e-20"])
def test_an_inertia_singular_by_rounding_is_made_regular(tmp_path: Path, izz: str) -> None:
    rod = f'<inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial>'
    robot, findings = built(tmp_path, "", base="", a=rod)
    own = robot.link("a").inertial
    assert own is not None
    principal = np.linalg.eigvalsh(own.inertia)
    assert principal[0] == pytest.approx(1e-7)
    np.testing.assert_allclose(own.inertia, np.diag([0.1, 0.1, 0.0]), atol=1.01e-7)
    assert [finding.severity for finding in findings if finding.code == "URDF038"] == ["note"]


def test_an_inertia_beyond_rounding_is_refused(tmp_path: Path) -> None:
    bad = GOOD.replace('izz="1"', 'izz="-1e-5"')
    assert "not positive definite" in refused(tmp_path, "", base="", a=bad)[0]


def test_a_frame_without_shape_needs_no_mass_where_the_body_has_one(tmp_path: Path) -> None:
    robot, _ = built(tmp_path, "inertials: estimate", base="", a="", f1="", f2=GOOD)
    assert [mass(robot, name) for name in ("a", "f1", "f2")] == [0, 0, 2]
    assert robot.inertials == ()


def test_a_moved_body_without_any_shape_is_a_small_ball(tmp_path: Path) -> None:
    robot, _ = built(tmp_path, "inertials: estimate", base="", a="", f1="", b=GOOD)
    assert mass(robot, "a") == pytest.approx(1000 * 4 / 3 * np.pi * 0.025**3)
    assert mass(robot, "f1") == 0.0
    assert "no shape: a ball of radius 25 mm" in str(robot.inertials[0])


def test_the_robot_file_states_single_links(tmp_path: Path) -> None:
    lines = """inertials:
  links:
    a: {mass: 4.2}
    b: {density: 2700}
    c: {mass: 3, centre: [0, 0, 0.1], inertia: {ixx: 0.2, iyy: 0.2, izz: 0.1, ixy: 0.01}}
    d: {mass: 0}"""
    robot, _ = built(tmp_path, lines, base="", a=BOX, b=BOX, c=GOOD, d=GOOD, fe=GOOD)
    a, c = robot.link("a").inertial, robot.link("c").inertial
    assert a is not None
    assert c is not None
    np.testing.assert_allclose(np.diag(a.inertia), 4.2 / 12 * np.array([0.13, 0.10, 0.05]))
    assert mass(robot, "b") == pytest.approx(2700 * 0.006)
    assert (c.mass, c.inertia[0, 1], c.X_LI.p[2]) == (3.0, 0.01, 0.1)
    assert robot.link("d").inertial is None
    assert {row.kind for row in robot.inertials} == {"given"}


def test_what_cannot_be_is_refused_where_it_is_written(tmp_path: Path) -> None:
    lines = """inertials:
  links:
    aa: {mass: 1}
    b: {density: 10}
    c: {mass: 3, inertia: {ixx: 1, iyy: 1, izz: 10}}"""
    errors = refused(tmp_path, lines, base="", a=GOOD, b=GOOD, c=GOOD + BOX)
    assert [error.split("robot.yaml:")[1][:2] for error in errors] == ["5:", "6:", "7:"]
    assert "did you mean 'a'" in errors[0]
    assert "no shape with a volume" in errors[1]
    assert "the largest exceeds the sum of the others" in errors[2]


def test_the_text_of_an_inertial_reads_back(tmp_path: Path) -> None:
    robot, _ = built(tmp_path, "inertials: estimate", base="", a=BOX, b=FACTOR_5 + BALL, c="")
    for row in robot.inertials:
        assert str(LinkInertial.read(row.link, str(row))) == str(row)
    with pytest.raises(ValueError, match="not an inertial"):
        LinkInertial.read("a", "heavy")


def test_missing_limits_are_proposed_as_the_lines_to_add(tmp_path: Path) -> None:
    (tmp_path / "r.urdf").write_text(
        urdf(base="", a=GOOD, b=GOOD).replace('velocity="1" effort="9"', 'velocity="0" effort="0"')
    )
    file = load_robot_text("robot: r\ndescription: r.urdf\n", "robot.yaml")
    _, findings = build_robot(file.spec, file=tmp_path / "robot.yaml", source=file.source)
    (slow,) = [finding for finding in findings if finding.code == "ROBOT331"]
    assert "j0, j1" in slow.message
    lines = (slow.hint or "").partition("such as: ")[2]
    again = load_robot_text(f"robot: r\ndescription: r.urdf\n{lines}\n", "robot.yaml")
    _, findings = build_robot(again.spec, file=tmp_path / "robot.yaml", source=again.source)
    assert not [finding for finding in findings if finding.code in ("ROBOT331", "URDF036")]
