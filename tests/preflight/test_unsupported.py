"""Bodies that fall or topple before the first step are found by geometry, as the run would refuse them."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.preflight.checks.unsupported import CHECK
from manipcli.preflight.preflight import Subject
from manipcli.task.load_task import load_task

ROOT = Path(__file__).parents[2]
TASK = f"""\
task: t
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
simulation: {{settle: SETTLE}}
scene:
  desk: {{box: {{size: [0.6, 1.0, 0.4]}}, pose: {{xyz: [0.85, 0, 0.2]}}, fixed: true}}
  cup: {{cup: {{radius: 36 mm, height: 110 mm}}, mass: 150 g, rests_on: desk, at: [0.75, 0.3]}}
  ball: {{sphere: {{radius: 14 mm}}, mass: 10 g, inside: cup}}
  plank: {{box: {{size: [20 cm, 4 cm, 4 cm]}}, mass: 50 g, pose: {{xyz: POSE}}}}
steps: [{{wait: 1 s}}]
"""


def codes(tmp_path: Path, pose: str, settle: str = "0.5 s") -> list[tuple[str, str, int]]:
    path = tmp_path / "t.yaml"
    path.write_text(TASK.replace("POSE", pose).replace("SETTLE", settle))
    found = CHECK.findings(Subject(load_task(path), None))
    return [(one.code, one.severity, one.place.line if one.place else 0) for one in found]


@pytest.mark.parametrize("z", ["0.4201", "0.4295"])
def test_a_body_that_settles_within_the_limit_of_the_run_is_sound(tmp_path: Path, z: str) -> None:
    assert codes(tmp_path, f"[0.75, -0.1, {z}]") == []


@pytest.mark.parametrize("pose", ["[0.75, -0.1, 0.431]", "[0.75, -0.1, 0.9]", "[0.3, 0.9, 0.2]"])
def test_a_body_in_the_air_is_an_error_at_its_pose(tmp_path: Path, pose: str) -> None:
    assert codes(tmp_path, pose) == [("TASK330", "error", 9)]
    assert codes(tmp_path, pose, settle="0 s") == []  # the run then refuses nothing


@pytest.mark.parametrize(("x", "topples"), [("0.53", True), ("0.545", True), ("0.555", False), ("0.75", False)])
def test_a_box_topples_with_its_centre_of_mass_beyond_the_edge_at_055(tmp_path: Path, x: str, topples: bool) -> None:
    assert codes(tmp_path, f"[{x}, -0.1, 0.42]") == [("TASK331", "warning", 9)] * topples
