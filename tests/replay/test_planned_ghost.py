"""The planned ghost: a task planned again from its log is where the robot was, unless the run went another way."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from manipcli.cli.app import main
from manipcli.core.errors import NotPlannable
from manipcli.logs import planned_ghost as of_log
from manipcli.logs.planned_ghost import open_planned_ghost, plan_differences
from manipcli.logs.replay import open_playback
from manipcli.pipeline import run_task
from manipcli.plan.outline import StepOutline
from manipcli.replay.ghost import Ghost
from manipcli.replay.playback import Playback

ROOT = Path(__file__).parents[2]
HEAD = f"""\
task: small
robot: {ROOT}/robots/differential_wrist/robot.yaml
controllers: {ROOT}/controllers/differential_wrist.yaml
start: up
simulation: {{engine: kinematic, settle: 0, control_period: 2 ms, step: 2 ms}}
"""
IDEAL = 30.0 * 0.015**2 / 8.0
"""[rad] Planned states are interpolated between 10 to 15 ms: a dt^2 / 8, with 30 rad/s^2 of the pitch joint."""
Shown = Callable[..., tuple[Playback, Ghost]]


@pytest.fixture
def shown(tmp_path: Path) -> Shown:
    """Runs a task, and opens its log with the planned ghost."""

    def run_text(text: str, head: str = HEAD) -> tuple[Playback, Ghost]:
        file, log = tmp_path / "small.yaml", tmp_path / "small.mcap"
        file.write_text(head + text)
        run_task(file, log=log)
        playback = open_playback(log)
        ghost, notes = open_planned_ghost(log, playback)
        assert ghost is not None and notes == ()
        return playback, ghost

    return run_text


def away(playback: Playback, ghost: Ghost, start: float, end: float) -> float:
    """The largest distance of a joint from the ghost in a time of the run."""
    rows = (playback.times >= start) & (playback.times < end)
    return float(np.abs(ghost.position - playback.position)[rows].max())


def test_where_the_robot_tracks_ideally_the_ghost_is_where_it_was(shown: Shown) -> None:
    playback, ghost = shown("steps:\n  - move: {to: {pitch: 0.3}}\n  - wait: 0.1 s\n  - move: {to: {pitch: -0.5}}\n")
    assert [visible[0] for visible in ghost.visible or ()] == [step.start for step in playback.steps]
    assert away(playback, ghost, 0.0, playback.end) < IDEAL
    assert np.ptp(ghost.position[:, 0]) == pytest.approx(0.8, abs=IDEAL)  # it moves, and does not rest at the end


def test_a_step_that_was_cut_short_and_the_one_planned_from_there_leave_the_plan(shown: Shown) -> None:
    """Stopped after 0.1 s on its way to 1 rad: the ghost goes on to 1 rad, waits, and goes home from there."""
    late = "  - move: {to: {pitch: 1.0}}\n    timeout: 0.1 s\n    on_fail: continue\n"
    playback, ghost = shown(f"steps:\n{late}  - move: {{to: up}}\n")
    first, second = playback.steps
    assert away(playback, ghost, first.start, first.end) < IDEAL
    before, at = playback.index(second.start - 0.03), playback.index(second.start)
    assert ghost.position[[before, at], 0] == pytest.approx([1.0, 1.0], abs=1e-9)
    assert playback.position[at, 0] < 0.5
    assert away(playback, ghost, second.start, second.end) > 0.3
    assert ghost.position[-1, 0] == pytest.approx(0.0, abs=1e-9)


def test_every_attempt_begins_the_plan_of_its_step(shown: Shown) -> None:
    never = "    until: {at_pose: {pose: up, within: 0.1}}\n    timeout: 0.5 s\n"
    playback, ghost = shown(f"steps:\n  - move: {{to: {{pitch: 0.3}}}}\n{never}    on_fail: {{retry: 1}}\n")
    starts = [event.time for event in playback.events if event.kind == "step_started"]
    assert [visible[0] for visible in ghost.visible or ()] == starts
    assert len(starts) == 2
    rows = [playback.index(time + 0.01) for time in starts]
    assert np.abs(ghost.position[rows, 0]).max() < 0.02  # at its start each time, where the robot is only once
    assert playback.position[rows[1], 0] == pytest.approx(0.3, abs=IDEAL)


@pytest.mark.parametrize(("at", "end"), [(0.02, 0.6), (0.2, -0.6)])
def test_the_ghost_takes_the_branch_that_the_run_took(shown: Shown, at: float, end: float) -> None:
    """The step behind the choice has a plan in each branch; its own begins where that of the branch ends."""
    playback, ghost = shown(
        f"steps:\n  - move: {{to: {{pitch: {at}}}}}\n"
        "  - if: {at_pose: {pose: up, within: 0.05}}\n"
        "    then:\n      - move: {to: {pitch: 0.6}}\n    else:\n      - move: {to: {pitch: -0.6}}\n"
        "  - move: {to: up}\n"
    )
    last = playback.steps[-1]
    assert ghost.position[playback.index(last.start), 0] == pytest.approx(end, abs=IDEAL)
    for step in playback.steps:
        assert away(playback, ghost, step.start, step.end) < IDEAL


@pytest.mark.slow
def test_the_ghost_picks_a_block_where_it_was_planned_to_be(shown: Shown) -> None:
    """The block falls by 5 cm before the pick, which is re-planned."""
    playback, ghost = shown(
        "scene:\n  table: {box: {size: [0.6, 0.8, 0.2]}, pose: {xyz: [0.55, 0, 0.1]}, fixed: true}\n"
        "  block: {box: {size: [4 cm, 4 cm, 5 cm]}, mass: 80 g, pose: {xyz: [0.5, -0.15, 0.275]}}\n"
        "steps:\n  - wait: 0.5 s\n"
        "  - pick: {object: block, approach: {from: top}, grasp: {posture: closed, force: 7 N}}\n",
        head=f"task: t\nrobot: {ROOT}/robots/panda/robot.yaml\ncontrollers: {ROOT}/controllers/panda.yaml\n"
        "simulation: {settle: 0 s}\n",
    )
    assert [event.step for event in playback.events if event.kind == "replanned"] == ["pick_1"]
    wait, pick = playback.steps
    assert away(playback, ghost, wait.start, wait.end) < 0.02  # [rad] the sag of the arm under its weight
    assert away(playback, ghost, pick.start, pick.end) > 0.05
    k = playback.index(pick.end)
    tool = replace(playback, position=ghost.position, times=playback.times).tool_path()
    assert tool[k, 2] - playback.tool_path()[k, 2] == pytest.approx(0.05, abs=5e-3)
    assert ghost.body[k, 0, 2] - playback.body_position[k, 0, 2] == pytest.approx(0.05, abs=5e-3)


def test_the_page_has_the_layer_only_if_it_is_asked_for_and_the_task_has_a_plan(
    shown: Shown, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    playback, _ = shown("steps:\n  - move: {to: {pitch: 0.3}}\n")
    log, page = tmp_path / "small.mcap", tmp_path / "page.html"

    def ghosts(*options: str) -> list[tuple[str, str, list[list[float]]]]:
        assert main(["replay", str(log), "--html", str(page), *options]) == 0
        found = re.search(r'data-part="head">(.*?)</script>', page.read_text(encoding="utf-8"))
        assert found is not None
        return [(one["name"], one["kind"], one["visible"]) for one in json.loads(found[1])["ghosts"]]

    assert ghosts() == []
    assert ghosts("--planned") == [("planned", "planned", [[0.0, playback.end]])]
    assert "note" not in capfd.readouterr().err

    def refuse(task: object) -> None:
        raise NotPlannable("no joint positions reach it", step="move_1")

    monkeypatch.setattr(of_log, "plan_task", refuse)
    assert ghosts("--planned") == []
    told = capfd.readouterr().err
    assert "note: no planned ghost: planning the task again failed: " in told
    assert "no joint positions reach it" in told


def test_a_log_whose_mesh_is_gone_has_no_planned_ghost_but_a_note(tmp_path: Path) -> None:
    corners = ["v 0 0 0", "v 0.1 0 0", "v 0 0.1 0", "v 0 0 0.1"]
    mesh, file, log = tmp_path / "wedge.obj", tmp_path / "small.yaml", tmp_path / "small.mcap"
    mesh.write_text("\n".join([*corners, "f 1 3 2", "f 1 2 4", "f 1 4 3", "f 2 3 4", ""]))
    wedge = "scene:\n  wedge: {mesh: {file: wedge.obj}, mass: 0.1, pose: {xyz: [2, 2, 0]}}\n"
    file.write_text(f"{HEAD}{wedge}steps:\n  - move: {{to: {{pitch: 0.3}}}}\n")
    run_task(file, log=log)
    assert open_planned_ghost(log, open_playback(log))[0] is not None
    mesh.unlink()
    ghost, (note,) = open_planned_ghost(log, open_playback(log))
    assert ghost is None
    assert note.startswith("no planned ghost: mesh ") and "wedge.obj" in note


def test_without_a_page_the_option_is_refused(shown: Shown, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    shown("steps:\n  - wait: 0.1 s\n")
    log, picture = str(tmp_path / "small.mcap"), tmp_path / "picture.png"
    assert main(["replay", log, "--planned", "--picture", str(picture)]) == 4
    assert "--planned has no effect without --html" in capfd.readouterr().err
    assert not picture.exists()
    assert main(["replay", log, "--planned", "--verify"]) == 4
    assert "--planned: no effect with --verify" in capfd.readouterr().err


def test_a_plan_that_is_not_that_of_the_run_is_said_to_differ() -> None:
    def outline(*durations: float | None) -> list[StepOutline]:
        return [StepOutline(f"s{k}", "move", "", duration) for k, duration in enumerate(durations)]

    assert [*plan_differences(outline(1.0, None), outline(1.0 + 1e-9, None))] == []
    assert [*plan_differences(outline(1.0, 2.0, 3.0), outline(1.0, 2.5, 4.0))] == [
        "step 's1' takes 2.500 s in it, but 2.000 s in the plan of the run"
    ]
    assert [*plan_differences(outline(None), outline(2.0))] == [
        "step 's0' was not planned before the run, and is planned now"
    ]
