"""Links that are close with all joints at zero and have one link between them are never checked; others are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import Diagnostic
from manipcli.model.build_robot import build_robot
from manipcli.model.collision import CollisionChecker
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.model.self_collision import checked_pairs
from manipcli.preflight.check_files import check_files
from manipcli.scene.scene import Scene
from manipcli.spec.load import load_robot_text

NOTHING = Scene(bodies=(), frames=(), gravity=np.zeros(3))
BOX = '<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>'
MASS = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
TEXT = "robot: r\ndescription: r.urdf\n"


def written(folder: Path, gap: float, parents: tuple[int, ...], *, mass: str = MASS) -> Path:
    """Boxes of 10 cm: the first and the last are `gap` [m] apart at zero; those between have no shape."""
    text = ""
    last = len(parents)
    for k in range(last + 1):
        text += f'<link name="l{k}">{BOX if k in (0, last) else ""}{mass}</link>\n'
    for k, parent in enumerate(parents, start=1):
        origin = f'<origin xyz="0 0 {0.1 + gap}"/>' if k == last else ""
        ends = f'<parent link="l{parent}"/><child link="l{k}"/><axis xyz="1 0 0"/>'
        limit = '<limit lower="-2" upper="2" velocity="1" effort="1"/>'
        text += f'<joint name="j{k}" type="revolute">{ends}{limit}{origin}</joint>\n'
    (folder / "r.urdf").write_text(f'<robot name="r">\n{text}</robot>')
    (folder / "robot.yaml").write_text(TEXT)
    return folder / "robot.yaml"


def robot(folder: Path, gap: float, parents: tuple[int, ...]) -> RobotModel:
    file = written(folder, gap, parents)
    return build_robot(load_robot_text(TEXT, "robot.yaml").spec, file=file)[0]


@pytest.mark.parametrize(
    ("gap", "parents", "spaced"),
    [(0.002, (0, 1), True), (0.005, (0, 1), False), (0.002, (0, 1, 2), False)],
    ids=["close", "apart", "two links between"],
)
def test_only_close_links_with_one_between_are_left_out(
    tmp_path: Path, gap: float, parents: tuple[int, ...], *, spaced: bool
) -> None:
    made = robot(tmp_path, gap, parents)
    pair = ("l0", f"l{len(parents)}")
    checker = CollisionChecker(Kinematics(made), NOTHING)
    assert checker.spaced == ({pair} if spaced else set())
    assert (pair in checked_pairs(made)) == (not spaced)  # what engines keep apart is what plans keep apart
    near = checker.at(margin=0.004).every(np.zeros(len(parents)))
    assert bool(near) == (gap < 0.004 and not spaced)


def codes(findings: tuple[Diagnostic, ...], severity: str) -> list[str]:
    return [finding.code for finding in findings if finding.severity == severity and finding.code != "ROBOT330"]


def test_check_names_the_pair_in_a_note(tmp_path: Path) -> None:
    findings = check_files([written(tmp_path, 0.002, (0, 1))])
    assert codes(findings, "warning") == []
    (note,) = [finding for finding in findings if finding.code == "ROBOT348"]
    assert "'l0' and 'l2'" in note.message
    assert "collision_ignore: [[l0, l2]]" in (note.hint or "")


def test_check_warns_of_a_start_that_plans_refuse(tmp_path: Path) -> None:
    findings = check_files([written(tmp_path, 0.002, (0, 1, 2))])
    assert codes(findings, "warning") == ["ROBOT347"]
    assert any("2.0 mm apart, plans keep 4 mm" in finding.message for finding in findings)


def test_check_warns_of_what_engines_refuse(tmp_path: Path) -> None:
    findings = check_files([written(tmp_path, 0.1, (0, 1), mass="")])
    assert codes(findings, "warning") == ["SIM121", "SIM121"]  # once per link, not per engine
    assert all("`inertials: estimate`" in (each.hint or "") for each in findings if each.code == "SIM121")
    (tmp_path / "robot.yaml").write_text(f"{TEXT}inertials: estimate\n")
    assert codes(check_files([tmp_path / "robot.yaml"]), "warning") == []
