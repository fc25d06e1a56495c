"""What a held body that touches another one is told: to be lifted only where that frees it."""

from __future__ import annotations

import pytest

from manipcli.core.geometry import Transform
from manipcli.plan.lifts_off import lifts_off
from manipcli.scene.build_scene import build_scene
from manipcli.spec.load import load_task_text
from manipcli.task.vocabulary import task_spec

TASK = """\
task: t
robot: r
controllers: c
scene:
  desk: {box: {size: [1, 1, 0.4]}, pose: {xyz: [0, 0, 0.2]}, fixed: true}
  roof: {box: {size: [0.4, 0.4, 0.02]}, pose: {xyz: [0, 0, 0.46]}, fixed: true}
  block: {box: {size: [4 cm, 4 cm, 4 cm]}, mass: 50 g, pose: {xyz: [0, 0, 0.42]}}
steps: [{wait: 1 s}]
"""


@pytest.mark.parametrize(("x", "other", "free"), [(0.0, "desk", True), (0.0, "roof", False), (0.4, "roof", True)])
def test_a_roof_keeps_a_body_down_and_a_desk_does_not(x: float, other: str, free: bool) -> None:
    scene = build_scene(load_task_text(TASK, "t.yaml", model=task_spec()).spec)
    block, near = scene.body("block"), scene.body(other)
    assert lifts_off(block, Transform.of(xyz=(x, 0.0, 0.42)), near, near.X_WO) is free
