"""A named pose in which the robot touches itself is told, with the pair and the place of the pose."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.preflight.check_files import check_files
from tests.onboard.small_robots import arm, robot

ROBOTS = Path(__file__).parents[2] / "robots"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["arm7_hand3", "iiwa7", "panda"])
def test_no_pose_of_the_robots_here_is_told(name: str) -> None:
    findings = check_files([ROBOTS / name / "robot.yaml"])
    assert not [finding for finding in findings if finding.severity != "note"]


def test_an_arm_folded_into_itself_is_told_where_the_pose_stands(tmp_path: Path) -> None:
    text = (ROBOTS / "arm7_hand3" / "robot.yaml").read_text()
    text = text.replace("description: urdf", f"description: {ROBOTS}/arm7_hand3/urdf")
    text = text.replace("  wrap:", "  folded: {arm: [0, -2.0, 0, -2.05, 0, 2.05, 0]}\n  wrap:")
    file = tmp_path / "robot.yaml"
    file.write_text(text)
    found = [finding for finding in check_files([file]) if finding.code == "ROBOT347"]
    assert found
    assert all("'folded'" in finding.message for finding in found)
    line = text.splitlines().index("  folded: {arm: [0, -2.0, 0, -2.05, 0, 2.05, 0]}") + 1
    assert {finding.place.line for finding in found if finding.place} == {line}


@pytest.mark.parametrize("given", [True, False])
def test_a_link_that_is_too_heavy_for_its_size_is_told_where_its_mass_is(tmp_path: Path, given: bool) -> None:
    """56 t in a box of 10 cm: 5.6e7 kg/m3."""
    text = robot(arm(list("abcdefg")))
    text = text if given else text.replace('value="0.5"', 'value="56000"', 1)
    (tmp_path / "arm.urdf").write_text(text)
    file = tmp_path / "robot.yaml"
    file.write_text("robot: arm\ndescription: arm.urdf\n" + "inertials: {links: {a: {mass: 56000}}}\n" * given)
    found = [finding for finding in check_files([file]) if finding.code == "ROBOT359"]
    assert [finding.message.split(":")[0] for finding in found] == ["link 'a' has mass 56000 kg"]
    place = found[0].place
    assert place is not None and (Path(place.file).name, place.line) == (
        ("robot.yaml", 3) if given else ("arm.urdf", 1)
    )
    assert "5.6e+07 kg/m3" in found[0].message
