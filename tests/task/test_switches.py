"""`switch_controllers` in a task: what is checked before anything runs, and what a run does."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import InvalidInput
from manipcli.pipeline import run_task
from manipcli.record.read.reading import open_recording
from manipcli.task.load_task import load_task

ROOT = Path(__file__).parents[2]
ARM = ", ".join(f"joint_{k}" for k in range(1, 8))
HAND = "finger_1_proximal, finger_1_distal"
CONTROLLERS = f"""\
arm: {{type: joint_trajectory, joints: [{ARM}], command_interface: velocity, gains: {{GAINS}}}}
soft_arm:
  {{type: joint_trajectory, active: false, joints: [{ARM}], gravity_compensation: true, gains: {{GAINS}}}}
"""
MOVE = "  - move: {to: {joint_1: 0.3}}\n"


def task_file(tmp_path: Path, steps: str, *, more: str = "", engine: str = "kinematic") -> Path:
    gains = ", ".join(f"joint_{k}: {{p: 400, d: 30}}" for k in range(1, 8))
    (tmp_path / "controllers.yaml").write_text(CONTROLLERS.replace("GAINS", gains) + more)
    file = tmp_path / "task.yaml"
    file.write_text(
        f"task: t\nrobot: {ROOT}/robots/arm7_hand3/robot.yaml\ncontrollers: controllers.yaml\n"
        f"simulation: {{engine: {engine}}}\nsteps:\n{steps}"
    )
    return file


def told(file: Path) -> list[str]:
    try:
        load_task(file, allow_outside=True)
    except InvalidInput as refused:
        return [f"{f.code} {f.place.line if f.place else 0} {f.message} | {f.hint}" for f in refused.findings]
    return []


@pytest.mark.slow
@pytest.mark.parametrize(
    "step",
    [
        "  - switch_controllers: soft_arm\n",
        "  - switch_controllers: [soft_arm]\n",
        "  - switch_controllers: {to: soft_arm}\n",
        "  - switch_controllers: {activate: [soft_arm], deactivate: [arm]}\n",
        "  - switch_controllers: {activate: [soft_arm, arm], deactivate: [arm, soft_arm], strictness: best_effort}\n",
    ],
)
def test_every_way_to_say_it_is_accepted(tmp_path: Path, step: str) -> None:
    assert told(task_file(tmp_path, step)) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("steps", "expected"),
    [
        (
            "  - switch_controllers: soft_rm\n",
            "TASK232 6 steps[0].switch_controllers.to[0]: controller 'soft_rm' is not in the controllers file | "
            "did you mean 'soft_arm'?",
        ),
        (
            "  - switch_controllers: {deactivate: [arm], activate: [soft_am]}\n",
            "TASK232 6 steps[0].switch_controllers.activate[0]: controller 'soft_am' is not in the controllers "
            "file | did you mean 'soft_arm'?",
        ),
        (
            "  - switch_controllers: {activate: [soft_arm]}\n",
            "TASK233 6 steps[0].switch_controllers: conflicting command interfaces of one joint: "
            "joint_1/velocity (arm), joint_1/effort (soft_arm); likewise for joint_2, joint_3, joint_4, and 3 more | "
            "name the controllers to activate under `to`: it deactivates conflicting ones",
        ),
        (
            "  - switch_controllers: {activate: [arm]}\n",
            "TASK233 6 steps[0].switch_controllers: cannot activate 'arm': it is active | "
            "name the controllers to activate under `to`: it deactivates conflicting ones",
        ),
        (
            "  - switch_controllers: soft_arm\n  - switch_controllers: {deactivate: [arm]}\n",
            "TASK233 7 steps[1].switch_controllers: cannot deactivate 'arm': it is inactive | "
            "name the controllers to activate under `to`: it deactivates conflicting ones",
        ),
        (
            "  - switch_controllers: {deactivate: [arm]}\n" + MOVE,
            "TASK232 7 steps[1].move.to: controller 'arm' is not active here; it follows trajectories "
            "of joint 'joint_1' | add a step before it: `switch_controllers: arm`",
        ),
        (
            "  - move: {to: {finger_1_distal: 0.1}}\n",
            "TASK232 6 steps[0].move.to: no controller follows trajectories of joint 'finger_1_distal' | "
            "add the joint to a controller of type `joint_trajectory`, "
            "`computed_torque` or `cartesian_impedance` in the controllers file",
        ),
        ("  - switch_controllers: {}\n", "TASK208 6 steps[0].switch_controllers: needs either `to`"),
        (
            "  - switch_controllers: {to: arm, activate: [soft_arm]}\n",
            "TASK208 6 steps[0].switch_controllers: needs either `to`",
        ),
        ("  - switch_controllers: {to: arm, strictness: auto}\n", "TASK203 6 steps[0].switch_controllers.strictness"),
    ],
)
def test_what_cannot_be_switched_is_told_before_anything_runs(tmp_path: Path, steps: str, expected: str) -> None:
    problems = told(task_file(tmp_path, steps))
    assert len(problems) == 1, problems
    assert problems[0].startswith(expected), problems[0]


def test_steps_are_checked_against_who_is_active_then(tmp_path: Path) -> None:
    steps = f"{MOVE}  - switch_controllers: soft_arm\n{MOVE}  - switch_controllers: arm\n{MOVE}"
    assert told(task_file(tmp_path, steps)) == []
    # The second switch is refused, so that the third step has the controller that it had.
    steps = f"  - switch_controllers: soft_arm\n  - switch_controllers: {{activate: [soft_arm]}}\n{MOVE}"
    assert [line[:9] for line in told(task_file(tmp_path, steps))] == ["TASK233 7"]


GRIPPERS = (
    f"hand: {{type: gripper, joints: [{HAND}], gains: {{finger_1_proximal: {{p: 3}}, finger_1_distal: {{p: 2}}}}}}\n"
    f"other: {{type: gripper, active: false, joints: [{HAND}], speed: 0.2, "
    "gains: {finger_1_proximal: {p: 3}, finger_1_distal: {p: 2}}}\n"
)


@pytest.mark.slow
def test_a_hand_is_moved_by_the_gripper_that_is_active(tmp_path: Path) -> None:
    grasp = "  - release: {}\n"
    assert told(task_file(tmp_path, grasp, more=GRIPPERS)) == []
    assert told(task_file(tmp_path, f"  - switch_controllers: other\n{grasp}", more=GRIPPERS)) == []
    (problem,) = told(task_file(tmp_path, "  - switch_controllers: {deactivate: [hand]}\n" + grasp, more=GRIPPERS))
    assert "controller 'hand' is not active here; it opens and closes a hand with joint 'finger_1_proximal'" in problem


def test_a_run_switches_and_the_log_tells_of_it(tmp_path: Path) -> None:
    from mcap.reader import make_reader

    steps = f"{MOVE}  - switch_controllers: soft_arm\n    id: soften\n  - move: {{to: {{joint_1: -0.2}}}}\n"
    log = tmp_path / "t.mcap"
    file = task_file(tmp_path, steps)
    report = run_task(file, log=log, allow_outside=True)
    assert report.verdict.verdict == "passed", report.verdict.text
    step = next(one for one in report.verdict.steps if one.id == "soften")
    assert step.text == "activated soft_arm; deactivated arm"
    assert step.planned_duration == 0.0
    assert step.ended - step.started == pytest.approx(0.001), "one control tick"
    with log.open("rb") as file:
        reader = make_reader(file)
        plan = next(a.data for a in reader.iter_attachments() if a.name == "plan.json")
        texts = b"".join(message.data for _, _, message in reader.iter_messages(topics=["/task/events"]))
    (switch,) = json.loads(plan)["steps"][1]["motions"]
    assert switch == {"label": "switch", "duration": 0.0, "switch": {"to": ["soft_arm"]}}
    assert b"activated soft_arm; deactivated arm" in texts
    arm, soft = open_recording(log).whole().controllers
    at = round(step.started / 0.001)
    for trace, active in ((arm, slice(0, at)), (soft, slice(at, None))):
        has_reference = np.isfinite(trace.reference_position).all(axis=1)
        assert has_reference[active].all(), "what was active has a reference"
        assert np.count_nonzero(has_reference) == len(has_reference[active]), "and nothing else"
