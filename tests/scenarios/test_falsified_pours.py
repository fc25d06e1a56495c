"""Pours into worlds that refuse: none is reported as done, and the first failed step is the first not done."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.scenarios.refusing_world import MISSING, ROOT, Change, World, fixed, run

pytestmark = [pytest.mark.slow, MISSING]

POUR = f"""\
task: pour
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
simulation: {{engine: mujoco, control_period: 2 ms}}
replan: false
scene:
  desk: {{box: {{size: [0.6, 1.0, 0.4]}}, pose: {{xyz: [0.85, 0, 0.2]}}, fixed: true}}
  cup: {{cup: {{radius: 36 mm, height: 110 mm, wall: 4 mm}}, mass: 150 g, rests_on: desk, at: [0.75, 0], friction: 1}}
  ball: {{sphere: {{radius: 14 mm}}, mass: 10 g, inside: cup, friction: 0.5, rolling_friction: 1e-4}}
  tray: {{tray: {{size: [0.3, 0.3, 0.05]}}, pose: {{xyz: [0.72, 0.26, 0.4]}}, fixed: true}}
steps:
  - pick: {{object: cup, approach: {{from: side, distance: 6 cm}}, grasp: {{posture: wrap, force: 8 N, height: 68 mm}}}}
  - lift: {{object: cup, by: 10 cm, velocity_scaling: 1}}
  - pour: {{object: cup, into: tray, dwell: 0, velocity_scaling: 1}}
"""


def static(name: str, fails: str, *true: str | tuple[str, str]) -> World:
    return World("pour", name, fails, true)


def at_pour(name: str, change: Change, says: str) -> World:
    return World("pour", name, "pour_1", (), "pour_1", change, says)


WEAK = [f"robot.limits.finger_{k}_proximal.effort=0.001" for k in (1, 2, 3)]
WORLDS = [
    static("a tray elsewhere", "pour_1", "scene.tray.pose.xyz=[0.72, 0.6, 0.4]"),
    static("a narrow tray", "pour_1", "scene.tray.tray.size=[0.06, 0.06, 0.05]"),
    static("a lid on the tray", "pour_1", fixed("lid", "0.3, 0.3, 0.004", "0.72, 0.26, 0.455")),
    static("a full tray", "pour_1", fixed("full", "0.28, 0.28, 0.06", "0.72, 0.26, 0.436")),
    static("a cup as heavy as lead", "lift_1", "scene.cup.mass=20"),
    static("a slippery cup", "lift_1", "scene.cup.friction=0.01"),
    static("weak fingers", "pick_1", *WEAK),
    at_pour("a ball that sticks", lambda world: world.tie("ball", world.body("cup")), "it is still in 'cup'"),
    at_pour("a ball taken away", lambda world: world.shift("ball", (0.0, -0.4, 0.0)), "'ball' is not in 'tray'"),
    at_pour("a ball that rises", lambda world: world.push("ball", (0.0, 0.0, 0.12)), "'ball' is not in 'tray'"),
    at_pour("a ball blown away", lambda world: world.push("ball", (0.2, 0.0, 0.0)), "'ball' is not in 'tray'"),
    at_pour("a cup that slips", lambda world: world.friction("cup", 0.0), "the hand does not carry 'cup'"),
    at_pour("a cup held by something", lambda world: world.hold("cup"), ""),
]


@pytest.mark.parametrize("world", WORLDS, ids=lambda world: world.name)
def test_a_pour_that_does_not_reach_the_tray_fails(
    world: World, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    verdict, recording, _ = run(world, POUR, tmp_path, monkeypatch)
    assert verdict.verdict == "failed"
    failed = next(step for step in verdict.steps if step.outcome != "done")
    assert failed.id == world.fails, verdict.text
    assert world.says in failed.text
    assert "replan: false" not in verdict.text
    (cup, ball), height = recording.states.body_position[-1], recording.states.body_position[:, 0, 2]
    in_tray = np.abs(ball - [0.72, 0.26, 0.425]).max() < 0.15 and ball[2] < 0.45
    assert not in_tray or "tray" in world.name
    assert (height.max() - height[0] > 0.05) == (world.fails == "pour_1")  # the cup was lifted before
    assert np.isfinite(cup).all()
