"""A plan played before it is simulated: states as planned, dropped candidates as ghosts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable
from manipcli.plan.candidates import Dropped
from manipcli.replay.planned_playback import MOST_GHOSTS, planned_ghosts, planned_playback, refused_playback
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import Plan, plan_task, unplanned

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def plan() -> Plan:
    return plan_task(load_task(ROOT / "examples" / "02_pick_a_block" / "task.yaml", allow_outside=True))


def test_the_playback_ends_where_the_plan_does(plan: Plan) -> None:
    shown = planned_playback(plan, "x")
    assert shown.end == pytest.approx(sum(motion.duration for motion in plan.motions))
    assert np.all(np.diff(shown.times) > 0.0)
    end = plan.steps[-1].plan.end
    np.testing.assert_allclose(shown.position[-1], end.position, atol=1e-9)
    np.testing.assert_allclose(shown.body_position[-1], [X.p for X in end.bodies], atol=1e-9)
    assert [step.id for step in shown.steps] == [step.id for step in plan.steps]


def test_a_carried_body_moves_with_the_tool(plan: Plan) -> None:
    shown = planned_playback(plan, "x")
    k = [body.name for body in plan.planner.scene.movable].index("block")
    lift = next(step for step in shown.steps if step.verb == "lift")
    rows = [shown.index(time) for time in np.linspace(lift.start + 0.02, lift.end - 0.02, 5)]
    away = shown.body_position[rows, k] - shown.tool_path()[rows]
    assert np.ptp(np.linalg.norm(away, axis=1)) < 1e-6
    assert np.ptp(shown.body_position[rows, k, 2]) > 0.02


def test_ghosts_are_dropped_candidates_in_the_time_of_their_step(plan: Plan) -> None:
    """A candidate with a plan is shown to its end, one that was refused on the way up to its refusal, others not."""
    move = next(k for k, step in enumerate(plan.steps) if step.verb == "move")
    step, why = plan.steps[move], NotPlannable("no")
    dropped = (
        Dropped("whole", why, step.plan),
        Dropped("part", NotPlannable("no", motions=step.plan.motions[:1])),
        Dropped("nothing", why),
    )
    steps = tuple(replace(one, dropped=dropped if k == move else ()) for k, one in enumerate(plan.steps))
    made = replace(plan, steps=steps)
    shown = planned_playback(made, "x")
    ghosts, more = planned_ghosts(made, shown)
    assert [ghost.name for ghost in ghosts] == [f"{step.id}: whole", f"{step.id}: part"]
    assert more == 0
    middle = shown.index(0.5 * (shown.steps[move].start + shown.steps[move].end))
    for ghost in ghosts:
        np.testing.assert_allclose(ghost.position[middle], shown.stance[middle], atol=2e-2)
    many = tuple(
        replace(one, dropped=dropped[:1] * (MOST_GHOSTS + 2) if k == move else ()) for k, one in enumerate(plan.steps)
    )
    assert len(planned_ghosts(replace(plan, steps=many), shown)[0]) == MOST_GHOSTS
    assert planned_ghosts(replace(plan, steps=many), shown)[1] == 2


def test_a_task_without_a_plan_is_shown_at_its_start_with_the_reason_and_what_was_tried(tmp_path: Path) -> None:
    file = tmp_path / "wall.yaml"

    file.write_text(
        f"task: t\nrobot: {ROOT}/robots/panda/robot.yaml\ncontrollers: {ROOT}/controllers/panda.yaml\nscene:\n"
        "  wall: {box: {size: [0.3, 0.02, 0.3]}, pose: {xyz: [0.55, 0.0, 0.35]}, fixed: true}\nsteps:\n"
        "  - move: {pose: {xyz: [0.5, 0.25, 0.4], rpy: [180 deg, 0, 0]}}\n"
        "  - move: {pose: {xyz: [0.5, -0.25, 0.4], rpy: [180 deg, 0, 0]}, path: linear}\n"
    )
    task = load_task(file)
    with pytest.raises(NotPlannable) as refused:
        plan_task(task)
    nothing = unplanned(task)
    shown, ghosts = refused_playback(nothing, "t", refused.value)
    assert (shown.position == nothing.start.position).all()
    assert [(step.id, step.outcome, step.text) for step in shown.steps] == [("move_2", "failed", refused.value.cause)]
    assert any("'wall'" in note for note in shown.notes)
    assert len(ghosts) == 1
