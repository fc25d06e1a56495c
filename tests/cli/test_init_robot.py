"""`manipcli init --robot`: files whose first task runs, and clear answers to bad input."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from manipcli.cli.app import main
from tests.onboard import small_robots as small

LINKS = [f"l{k}" for k in range(7)]
SRDF = """<robot name="r">
  <group name="manipulator"><chain base_link="l0" tip_link="p"/></group>
  <group name="gripper"><joint name="slide_left"/><joint name="slide_right"/></group>
  <group_state name="ready" group="manipulator">{joints}</group_state>
  <end_effector name="e" parent_link="p" group="gripper" parent_group="manipulator"/>
  <disable_collisions link1="l2" link2="l5" reason="Never"/>
</robot>"""
READY = {"j_l1": 0.0, "j_l2": -0.5, "j_l3": 1.2, "j_l4": 0.0, "j_l5": 0.8, "j_l6": 0.0}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with descriptions, as the working directory."""
    monkeypatch.chdir(tmp_path)
    parts = (small.arm(LINKS), small.palm("p", parent="l6"), small.gripper("p"))
    Path("whole.urdf").write_text(small.robot(*parts))
    Path("bare.urdf").write_text(small.robot(small.arm(LINKS, limits='velocity="0" effort="0"', inertials=False)))
    Path("still.urdf").write_text(small.robot(small.palm("p")))
    Path("hand.urdf").write_text(small.robot(small.palm("p"), small.gripper("p")))
    joints = "".join(f'<joint name="{name}" value="{value}"/>' for name, value in READY.items())
    Path("whole.srdf").write_text(SRDF.format(joints=joints))
    return tmp_path


def verb(file: Path) -> list[str]:
    return [next(iter(step)) for step in yaml.safe_load(file.read_text())["steps"]]


@pytest.mark.slow
@pytest.mark.usefixtures("runs_in_threads")
def test_an_arm_with_a_hand_picks_and_places(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["init", "--robot", "whole.urdf", "p", "--srdf", "whole.srdf"]) == 0
    out, err = capsys.readouterr()
    assert "its run passed" in out
    assert err.endswith("next: cd p && manipcli run tasks/pick_place.yaml\n")
    robot = yaml.safe_load(Path("p/robot.yaml").read_text())
    assert robot["description"] == "../whole.urdf"
    assert [*robot["groups"]] == ["manipulator", "gripper"]
    assert robot["poses"]["ready"] == {"manipulator": READY}
    assert ["l2", "l5"] in robot["collision_ignore"]
    assert verb(Path("p/tasks/pick_place.yaml")) == ["pick", "lift", "place", "move"]
    assert main(["check", "p/robot.yaml", "p/controllers.yaml"]) == 0
    assert main(["run", "p/tasks/pick_place.yaml"]) == 0


@pytest.mark.slow
@pytest.mark.usefixtures("runs_in_threads")
def test_an_arm_without_masses_and_limits_moves(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["init", "--robot", "bare.urdf", "p"]) == 0
    out = capsys.readouterr().out
    robot = yaml.safe_load(Path("p/robot.yaml").read_text())
    assert robot["inertials"] == "estimate"
    assert robot["limits"]["j_l1"].keys() == {"velocity", "effort", "acceleration"}
    assert "  limits.j_l1: velocity, effort missing in the description" in out
    assert verb(Path("p/tasks/moves.yaml")) == ["move"] * 3
    assert main(["run", "p/tasks/moves.yaml"]) == 0


@pytest.mark.slow
def test_a_hand_alone_opens_and_closes(folder: Path) -> None:
    assert main(["init", "--robot", "hand.urdf", "p"]) == 0
    task = yaml.safe_load(Path("p/tasks/open_close.yaml").read_text())
    assert [step["move"]["to"] for step in task["steps"]] == ["closed", "open"]
    assert [(row["at_pose"]["pose"], row.get("at")) for row in task["expect"]] == [("closed", "move_1"), ("open", None)]
    assert main(["run", "p/tasks/open_close.yaml"]) == 0


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        (["--robot", "whol.urdf"], "USE101", "did you mean 'whole.urdf'?"),
        (["--robot", "whole.urdf", "--srdf", "none.srdf"], "URDF", "none.srdf"),
        (["--robot", "whole.urdf", "--srdf", "whole.urdf"], "SRDF001", "not an SRDF"),
        (["--robot", "hand.urdf", "--srdf", "whole.srdf"], "SRDF005", "link 'l0' is not in the robot"),
        (["--robot", "whole.urdf", "--controllers", "other.yaml"], "INIT001", "did you mean 'j_l1'?"),
        (["--robot", "whole.urdf", "--arg", "a=b"], "USE045", "expected NAME:=VALUE"),
        (["--robot", "still.urdf"], "INIT002", "no joint of 'still.urdf' moves"),
        (["--srdf", "whole.srdf"], "USE089", "--srdf has no effect"),
        (["--hand", "hand.urdf"], "USE089", "--hand has no effect"),
        (["--robot", "bare.urdf", "--hand-at", "l6"], "USE089", "--hand-at has no effect: it belongs to --hand"),
        (["--robot", "bare.urdf", "--hand", "hnd.urdf"], "USE101", "did you mean 'hand.urdf'?"),
        (["--robot", "bare.urdf", "--hand", "hand.urdf", "--hand-at", "l66"], "ROBOT302", "did you mean 'l6'?"),
        (["--robot", "bare.urdf", "--hand", "hand.urdf", "--hand-pose", "0 0 1 cm"], "INIT003", "1 value"),
        (["--robot", "bare.urdf", "--hand", "hand.urdf", "--hand-pose", "0, 0, 1 kg"], "INIT003", "'1 kg' is a mass"),
        (["--robot", "bare.urdf", "--hand", "hand.urdf", "--hand-pose", "1e400, 0, 0"], "INIT003", "not finite"),
        (["--robot", "bare.urdf", "--hand", "hand.urdf", "--hand-pose", "0, 0, 1e999 mm"], "INIT003", "largest number"),
    ],
)
def test_bad_input_is_named_and_nothing_is_written(
    folder: Path, capsys: pytest.CaptureFixture[str], words: list[str], code: str, told: str
) -> None:
    Path("other.yaml").write_text(
        "controllers:\n  a: {type: joint_trajectory, command_interface: position, joints: [j_ll1]}\n"
    )
    assert main(["init", *words, "p"]) == 4
    err = capsys.readouterr().err
    assert f"error[{code}" in err
    assert told in err
    assert not Path("p").exists()


def test_an_existing_file_is_found_before_the_long_search(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("p").mkdir()
    Path("p/robot.yaml").write_text("mine")
    assert main(["init", "--robot", "whole.urdf", "p"]) == 4
    assert "p/robot.yaml already exists; nothing was written" in capsys.readouterr().err
    assert [path.name for path in Path("p").iterdir()] == ["robot.yaml"]
