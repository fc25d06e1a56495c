"""Pictures of plans: the tool's path in its colours, dropped paths and their collisions, and what is at the end."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable
from manipcli.replay.camera import direction
from manipcli.replay.caption import FAILED
from manipcli.replay.frames import Frames
from manipcli.replay.plan_picture import GHOST, PALETTE, clearest_view, plan_picture
from manipcli.replay.planned_playback import TriedPath, planned_playback, refused_path, refused_playback, tried_paths
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import Plan, plan_task, unplanned
from tests.replay.test_force_overlay import along

ROOT = Path(__file__).parents[2]
SIZE = (480, 360)
WALL = f"""\
task: t
robot: {ROOT}/robots/panda/robot.yaml
controllers: {ROOT}/controllers/panda.yaml
scene:
  wall: {{box: {{size: [0.3, 0.02, 0.6]}}, pose: {{xyz: [0.55, 0.0, 0.35]}}, fixed: true}}
steps:
  - move: {{pose: {{xyz: [0.5, 0.25, 0.4], rpy: [180 deg, 0, 0]}}}}
  - move: {{pose: {{xyz: [0.5, -0.25, 0.4], rpy: [180 deg, 0, 0]}}}}
"""


@pytest.fixture(scope="module")
def plan() -> Plan:
    return plan_task(load_task(ROOT / "examples" / "02_pick_a_block" / "task.yaml", allow_outside=True))


def pixel(frames: Frames, point: np.ndarray) -> tuple[float, float]:
    x, y, _ = frames.camera.project(point[None], SIZE)
    return float(x[0]), float(y[0])


def test_each_step_has_its_colour_along_the_path_of_the_tool(plan: Plan) -> None:
    playback, towards = planned_playback(plan, "t"), direction("front")
    image, _ = plan_picture(playback, (), size=SIZE, towards=towards)
    frames = Frames(playback, size=SIZE, towards=towards, captions=False)
    bare = frames.at(playback.start)
    path = playback.tool_path()
    moving = [
        step
        for step in playback.steps
        if np.ptp(path[playback.index(step.start) : playback.index(step.end) + 1], axis=0).max() > 0.005
    ]
    shown = 0
    for step, colour in zip(moving, PALETTE, strict=False):
        rows = np.linspace(playback.index(step.start), playback.index(step.end), 30).astype(int)[3:-3]
        ends = [pixel(frames, path[k]) for k in rows]
        share = np.mean([along(image, colour, end, end) for end in ends])
        shown += share > 0.6
        assert np.mean([along(bare, colour, end, end) for end in ends]) < 0.4
    assert shown >= len(moving) - 1  # a later step may cover an earlier one on the same path


def test_a_body_is_at_the_start_and_translucent_at_its_end(plan: Plan) -> None:
    playback, towards = planned_playback(plan, "t"), direction("front")
    frames = Frames(playback, size=SIZE, towards=towards, captions=False)
    image, depth = frames.between(playback.start, playback.end, GHOST)
    bare = frames.at(playback.start)
    k = [body.name for body in plan.planner.scene.movable].index("block")
    before, after = playback.body_position[0, k], playback.body_position[-1, k]
    assert np.linalg.norm(after - before) > 0.05
    x, y = (round(value) for value in pixel(frames, after))
    assert np.abs(image[y, x].astype(int) - bare[y, x]).max() > 15
    x, y = (round(value) for value in pixel(frames, before))
    np.testing.assert_allclose(image[y, x], bare[y, x], atol=2)
    away = float(np.linalg.norm(np.subtract(frames.camera.eye, before)))
    assert depth[y, x] == pytest.approx(away, abs=0.1)


@pytest.mark.slow
def test_a_path_around_an_obstacle_keeps_the_straight_one_with_its_collision() -> None:
    plan = plan_task(load_task(ROOT / "tasks" / "drawer.yaml", allow_outside=True))
    (home,) = plan.steps[-1].plan.motions
    assert home.searched and home.straight is not None
    (straight,) = (path for path in tried_paths(plan) if path.step == plan.steps[-1].id)
    assert straight.at is not None and " and " in straight.between
    playback = planned_playback(plan, "t")
    chosen = playback.tool_path()[playback.index(playback.steps[-1].start) :]
    np.testing.assert_allclose(straight.points[0], chosen[0], atol=2e-3)
    np.testing.assert_allclose(straight.points[-1], chosen[-1], atol=2e-3)
    assert np.ptp(straight.points - chosen[np.linspace(0, len(chosen) - 1, len(straight.points)).astype(int)]) > 0.05
    towards = direction("left")
    frames = Frames(playback, size=SIZE, towards=towards, captions=False)
    image, _ = plan_picture(playback, (straight,), size=SIZE, towards=towards)
    without, _ = plan_picture(playback, (), size=SIZE, towards=towards)
    at = pixel(frames, straight.points[straight.at])
    assert along(image, FAILED, at, at) == 1.0
    assert along(without, FAILED, at, at) == 0.0


def test_a_refused_task_is_drawn_with_the_collision_of_its_refusal(tmp_path: Path) -> None:
    file = tmp_path / "wall.yaml"
    file.write_text(WALL.rstrip()[:-1] + ", path: linear}\n")
    task = load_task(file, allow_outside=True)
    with pytest.raises(NotPlannable) as refused:
        plan_task(task)
    nothing = unplanned(task)
    (path,) = refused_path(nothing, refused.value)
    assert path.at is not None
    assert all(name.removeprefix("robot/") in path.between for name in refused.value.parts)
    playback, _ = refused_playback(nothing, "t", refused.value)
    image, _ = plan_picture(playback, (path,), refused=str(refused.value), size=SIZE)
    line = image[20:36].astype(int)
    assert ((line[..., 0] > line[..., 1] + 80) & (line[..., 0] > line[..., 2] + 80)).sum() > 60


def test_a_path_behind_a_wall_is_looked_at_from_the_other_side(plan: Plan, tmp_path: Path) -> None:
    file = tmp_path / "screen.yaml"
    screen = "  wall: {box: {size: [0.02, 2.0, 1.6]}, pose: {xyz: [0.9, 0.0, 0.8]}, fixed: true}\n"
    move = "  - move: {pose: {xyz: [0.5, 0.2, 0.4], rpy: [180 deg, 0, 0]}}\n"
    file.write_text(WALL[: WALL.index("  wall")] + screen + "steps:\n" + move)
    playback = planned_playback(plan_task(load_task(file, allow_outside=True)), "t")
    assert clearest_view(playback)[0] < 0.5
    assert clearest_view(planned_playback(plan, "t"))[0] == 1.0


def test_a_legend_names_steps_and_kinds_of_paths(plan: Plan) -> None:
    playback, towards = planned_playback(plan, "t"), direction("front")
    free = TriedPath("x", playback.tool_path()[:2])
    with_it, _ = plan_picture(playback, (free,), size=SIZE, towards=towards)
    without, _ = plan_picture(playback, (), size=SIZE, towards=towards)
    assert (with_it[-30:, :100] != without[-30:, :100]).any()
