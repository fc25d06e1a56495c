"""A press in the simulation: the true force is that of the step, without a knock; on nothing it fails."""

from pathlib import Path

import numpy as np
import pytest

from manipcli.pipeline import run_task
from manipcli.record.read.reading import read_recording

TASK = Path(__file__).parents[2] / "tasks" / "press.yaml"


def run(log, *overrides):
    report = run_task(TASK, log=log, overrides=overrides)
    touching = [
        (each.time, sum(c.force for c in each.contacts if {"button"} & {c.a, c.b} and "robot/" in c.a + c.b))
        for each in read_recording(log).contacts
    ]
    return report.verdict, np.array(touching)


@pytest.mark.slow
def test_the_true_force_rises_to_the_target_and_stays(tmp_path):
    """All expectations of the task, and the controllers of the file are active again at the end."""
    quick = ("simulation.engine=mujoco", "steps.2.wait=0.2 s", "steps.1.press.speed=8 mm/s")
    verdict, forces = run(tmp_path / "log.mcap", *quick)
    assert verdict.verdict == "passed", verdict.text
    (press,) = [step for step in verdict.steps if step.id == "press"]
    assert press.text.startswith("felt 9.")
    assert forces[:, 1].max() <= 1.3 * 10.0
    assert forces[-1, 1] == 0.0


def test_pressing_on_nothing_fails(tmp_path):
    quick = ("simulation.engine=mujoco", "steps.1.press.reach=1 mm", "steps.1.press.speed=8 mm/s")
    verdict, forces = run(tmp_path / "log.mcap", *quick)
    (press,) = [step for step in verdict.steps if step.id == "press"]
    assert press.outcome == "failed"
    assert "the tool met nothing within 1 mm" in press.text
    assert not forces.size or forces[:, 1].max() == 0.0
