"""A start in which links of a hand overlap is reported, and the simulation does not tear them apart."""

from __future__ import annotations

from pathlib import Path

from manipcli.pipeline import run_task
from manipcli.preflight.check_files import check_files
from manipcli.run.engine_settings import engine_settings
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import plan_task

ROOT = Path(__file__).parents[2]


def task_file(folder: Path, hand: str, settings: str = "") -> Path:
    """A task that starts with the proximal and distal joints of the first finger at these angles."""
    robot = (ROOT / "robots/arm7_hand3/robot.yaml").read_text()
    robot = robot.replace("description: ", f"description: {ROOT}/robots/arm7_hand3/")
    robot = robot.replace(
        "poses:\n", f"poses:\n  begin: {{arm: [0, 0.1, 0, -1.6, 0, -0.1, 0], hand: [{hand}, 0, 0, 0, 0]}}\n"
    )
    (folder / "robot.yaml").write_text(robot)
    files = f"robot: robot.yaml\ncontrollers: {ROOT}/controllers/arm7_hand3.yaml\nstart: begin\n"
    (folder / "task.yaml").write_text(f"task: t\n{files}simulation: {{settle: 0.1{settings}}}\nsteps:\n  - wait: 0.1\n")
    return folder / "task.yaml"


def reported(file: Path) -> list[str]:
    return [found.message for found in check_files([file], allow_outside=True) if found.code == "TASK247"]


def test_links_that_overlap_at_the_start_pass_through_each_other_with_a_warning(tmp_path: Path) -> None:
    assert reported(task_file(tmp_path, "0.6, 0.6")) == []
    assert reported(task_file(tmp_path, "1.3, 1.3", ", self_collision: false")) == []
    file = task_file(tmp_path, "1.3, 1.3")
    (message,) = reported(file)
    assert message.startswith("links 'finger_1_distal_link' and 'palm' overlap by ")
    task = load_task(file, allow_outside=True)
    colliding = engine_settings(task, plan_task(task)).self_collision
    assert ("finger_1_distal_link", "palm") not in colliding and ("finger_2_distal_link", "palm") in colliding
    run = run_task(file, log=tmp_path / "t.mcap", allow_outside=True)
    assert run.verdict.verdict == "passed" and run.verdict.self_contacts == ()
