"""What a valid task says without effect: each finding with its code, its line and its words."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.cli.app import main
from manipcli.task.lint import lint
from manipcli.task.load_task import load_task

ROOT = Path(__file__).parents[2]
HEAD = f"""\
task: t
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
params: {{high: 30 cm, twice: 2 * $high, dead: 1 s}}
scene:
  desk: {{box: {{size: [0.6, 1.0, 0.4]}}, pose: {{xyz: [0.85, 0, 0.2]}}, fixed: true}}
  cup: {{cup: {{radius: 36 mm, height: 110 mm}}, mass: 150 g, rests_on: desk, at: [0.75, 0.0]}}
  ball: {{sphere: {{radius: 14 mm}}, mass: 10 g, inside: cup}}
  tray: {{tray: {{size: [0.3, 0.3, 0.05]}}, rests_on: desk, at: [0.70, 0.32], fixed: true}}
  clutter: {{box: {{size: [4 cm, 4 cm, 4 cm]}}, mass: 50 g, rests_on: desk, at: [0.75, -0.3]}}
frames:
  left: {{parent: desk, pose: {{xyz: [0, 0.1, $twice]}}}}
  right: {{parent: desk, pose: {{xyz: [0, -0.1, 0.3]}}}}
steps:
  - {{move: {{to: home}}, timeout: 10 s}}
  - {{wait: 1 s, timeout: 2 s}}
"""


def found(tmp_path: Path, more: str = "") -> list[tuple[str, int, str]]:
    path = tmp_path / "t.yaml"
    path.write_text(HEAD + more)
    return [(f.code, f.place.line if f.place else 0, f.message) for f in lint(load_task(path))]


USED = "expect:\n  - near: {object: cup, to: left, within: 1 m}\n  - near: {object: cup, to: right, within: 1 m}\n"


def test_unused_names_are_found_and_used_ones_are_not(tmp_path: Path) -> None:
    assert found(tmp_path, USED) == [
        ("TASK320", 4, "params.dead: the parameter 'dead' is not used"),
        ("TASK322", 8, "scene.ball: no step and no condition names ball, clutter: only obstacles"),
    ]
    assert ("TASK321", 13, "frames.right: the frame 'right' is not used") in found(tmp_path)


FOREGONE = [
    ("upright: {object: tray, within: 5 deg}", "cannot fail: 'tray' is fixed"),
    ("never: {upright: {object: tray, within: 5 deg}}", "can never pass: 'tray' is fixed"),
    ("near: {object: tray, to: left, within: 2 cm}", "can never pass: 'tray' and 'desk' are fixed"),
    ("not: {inside: {object: desk, of: tray}}", "cannot fail"),
    ("eventually: {inside: {object: ball, of: cup}}", "cannot fail: it holds at the start already"),
    ("tracking: {group: hand, within: 3 rad}", "cannot fail: no joint of 'hand'"),
    ("saturation: {below: 100 %}", "cannot fail: no share is above 100 %"),
    ("duration: {below: 60 s}", "cannot fail: the timeouts of the steps end them within 13 s"),
    ("always: {any: [{upright: {object: tray, within: 1 deg}}, {grasped: {object: cup}}]}", "cannot fail"),
    ("always: {all: [{near: {object: tray, to: left, within: 1 cm}}, {at_rest: {object: cup}}]}", "can never pass"),
]
OPEN = [
    "upright: {object: cup, within: 5 deg}",
    "near: {object: cup, to: left, within: 2 cm}",
    "near: {object: cup, to: start, within: 2 cm}",
    "eventually: {inside: {object: ball, of: tray}}",
    "always: {inside: {object: ball, of: cup}}",
    "tracking: {group: arm, within: 0.05 rad}",
    "duration: {below: 9 s}",
    "always: {all: [{upright: {object: tray, within: 1 deg}}, {at_rest: {object: cup}}]}",
    "never: {collision: [robot, desk]}",
    "saturation: {group: arm}",
]


@pytest.mark.parametrize(("expected", "words"), FOREGONE)
def test_a_foregone_result_is_a_warning_at_its_line(tmp_path: Path, expected: str, words: str) -> None:
    wanted = "TASK324" if words.startswith("cannot fail") else "TASK325"
    hits = [hit for hit in found(tmp_path, f"expect:\n  - {expected}\n") if hit[0] in ("TASK324", "TASK325")]
    assert [(code, line) for code, line, _ in hits] == [(wanted, 18)]
    assert words in hits[0][2]


@pytest.mark.parametrize("expected", OPEN)
def test_what_the_run_decides_is_not_reported(tmp_path: Path, expected: str) -> None:
    assert not [hit for hit in found(tmp_path, f"expect:\n  - {expected}\n") if hit[0] in ("TASK324", "TASK325")]


def test_what_samples_change_is_not_foregone(tmp_path: Path) -> None:
    more = "expect: [{near: {object: tray, to: left, within: 2 cm}}]\n"
    assert "TASK325" in [code for code, _, _ in found(tmp_path, more)]
    more += "vary: {scene.tray.at: {offset: {uniform: [-2 cm, 2 cm]}}}\n"
    assert "TASK325" not in [code for code, _, _ in found(tmp_path, more)]


def test_a_controller_that_is_never_active_is_a_warning_in_its_file(tmp_path: Path) -> None:
    text = (ROOT / "controllers" / "arm7_hand3.yaml").read_text()
    spare = tmp_path / "controllers.yaml"
    joints = ", ".join(f"joint_{k}" for k in range(1, 8))
    spare.write_text(
        f"{text}  spare: {{type: joint_trajectory, active: false, joints: [{joints}], command_interface: position}}\n"
    )
    path = tmp_path / "t.yaml"
    path.write_text(HEAD.replace(f"{ROOT}/controllers/arm7_hand3.yaml", "controllers.yaml") + USED)
    (hit,) = [f for f in lint(load_task(path)) if f.code == "TASK323"]
    assert hit.place is not None
    assert (Path(hit.place.file).name, hit.place.line) == ("controllers.yaml", len(text.splitlines()) + 1)


def test_strict_fails_on_warnings_and_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "t.yaml").write_text(HEAD + USED)
    assert main(["check", str(tmp_path / "t.yaml")]) == 0
    assert main(["check", str(tmp_path / "t.yaml"), "--strict"]) == 1
    assert capsys.readouterr().out.endswith("✗ failed: 1 file checked, 0 errors, 1 warning\n")
    assert main(["check", str(tmp_path / "t.yaml"), "--strict", "--format", "json"]) == 1
    assert '"verdict": "failed"' in capsys.readouterr().out
