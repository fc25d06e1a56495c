"""`locate`: what a camera sees in the plan, the corrected belief in the run, and refusals at their places."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import InvalidInput, NotPlannable
from manipcli.core.geometry import Transform
from manipcli.pipeline import load_task, plan_task, run_task, unplanned
from manipcli.plan.motion import PlanningState
from manipcli.report.text import render_verdict
from manipcli.task.camera_sights import CameraSight
from tests.run.gantry import mass, written

CUP = f"""<link name="palm">{mass(0.2, 0.001)}<collision><origin xyz="0 0 -0.03"/>
  <geometry><cylinder radius="0.012" length="0.06"/></geometry></collision></link>"""
FIXED = "at: {xyz: [0.1, 0.5, 0.42], rpy: [0, 38 deg, -90 deg]}"
SENSORS = """sensors:
  eye: {type: camera, PLACE, resolution: [240, 180], rate: 10 Hz, delay: 20 ms, color: false,
        noise: {depth: {white: 1 mm}}}
steps:
  - locate: {object: block, with: eye}
"""
KNOWN = "rests_on: table, known: {region: {box: [12 cm, 12 cm, 0 cm]}}"
Write = Callable[..., Path]


@pytest.fixture
def task(tmp_path: Path) -> Write:
    """Writes a task of the gantry with a suction cup; its block is known within 6 cm."""

    def write(place: str = FIXED, *, engine: str = "mujoco", more: str = "") -> Path:
        file = written(tmp_path, CUP, engine=engine, holding="{suction: {force: 20 N}}", mass="200 g", more=more)
        text = file.read_text().replace("steps:\n", SENSORS.replace("PLACE", place))
        file.write_text(text.replace("rests_on: table", KNOWN).replace("{engine:", "{seed: 5, engine:"))
        return file

    return write


def sight_of(file: Path) -> tuple[CameraSight, PlanningState]:
    plan = plan_task(load_task(file))
    sight = plan.planner.sights["eye"]
    assert isinstance(sight, CameraSight)
    return sight, plan.steps[0].plan.end


def test_a_located_block_is_picked_and_the_report_has_both_errors(task: Write, tmp_path: Path) -> None:
    """The belief is off by the draw before, and by what 1 mm of noise leaves after; later steps hit it."""
    file = task()
    loaded = load_task(file)
    drawn = loaded.scene.body("block").X_WO.p - loaded.true.scene.body("block").X_WO.p
    assert np.abs(drawn).max() > 0.035  # half a block and half a cup: it would miss it without looking
    x, y, z = loaded.true.scene.body("block").X_WO.p
    asked = f"believed: {{near: {{object: block, to: [{x}, {y}, {z}], within: 3 mm}}}}, at: locate_1"
    file.write_text(file.read_text() + f"expect: [{{{asked}}}]\n")
    run = run_task(file, log=tmp_path / "seen.mcap")
    assert run.verdict.verdict == "passed", run.verdict.text
    (found,) = run.verdict.located
    assert (found.step, found.object) == ("locate_1", "block")
    assert found.before is not None and found.after is not None
    assert found.before.position == pytest.approx(np.linalg.norm(drawn), abs=1e-3)  # it settles by less
    assert found.after.position < 2e-3
    assert f"locate_1  block   {1000 * found.before.position:.3g} mm" in render_verdict(run.verdict, "")


def test_without_locate_the_suction_cup_misses(task: Write, tmp_path: Path) -> None:
    file = task()
    file.write_text(file.read_text().replace("  - locate: {object: block, with: eye}\n", ""))
    assert run_task(file, log=tmp_path / "blind.mcap").verdict.verdict == "failed"


def test_a_picture_without_the_block_fails_the_step_with_its_reason(task: Write, tmp_path: Path) -> None:
    """A camera that loses all pixels: the belief stays, and the task goes on where the step allows it."""
    file = task()
    text = file.read_text().replace("noise: {depth", "noise: {dropout: 100 %, depth")
    text = text.replace("with: eye}\n", "with: eye}\n    on_fail: continue\n  - wait: 0.1 s\n")
    file.write_text(text[: text.index("  - pick:")])
    verdict = run_task(file, log=tmp_path / "unseen.mcap").verdict
    assert [step.outcome for step in verdict.steps] == ["failed", "done"]
    assert "'eye' does not show 'block': 0 pixels" in verdict.steps[0].text
    assert verdict.verdict == "passed"
    assert [(each.object, each.after, each.text) for each in verdict.located] == [("block", None, "never located")]


def test_the_background_is_the_table_where_the_block_is_taken_away(task: Write) -> None:
    """Oracle: rays of the pinhole to the plane of the table top, z = 0.1 m."""
    sight, state = sight_of(task())
    X_WC = sight.pose(state)
    depth = sight.background(state, ["block"])
    points = X_WC.apply(sight.lens.points(depth).reshape(-1, 3))
    hit = np.isfinite(depth).ravel() & (np.abs(points[:, :2]) < 0.59).all(axis=1)
    below = points[hit][points[hit][:, 2] < 0.2]  # not the gantry
    assert len(below) > 5000
    assert np.abs(below[:, 2] - 0.1).max() < 1e-6


def test_a_wall_before_the_camera_hides_the_block(task: Write) -> None:
    """A wall between them hides all of it and has its name in the refusal; one that is beside it hides nothing."""
    wall = "  wall: {box: {size: [0.4, 0.02, 0.3]}, pose: {xyz: [X, 0.25, 0.25]}, fixed: true}\n"
    file = task()
    text = file.read_text()
    file.write_text(text.replace("  block:", wall.replace("X", "0.1") + "  block:"))
    with pytest.raises(NotPlannable, match=r"'wall' hides 100 % of 'block' from 'eye'"):
        plan_task(load_task(file))
    file.write_text(text.replace("  block:", wall.replace("X", "0.45") + "  block:"))
    sight, state = sight_of(file)
    assert sight.sighting(state, "block").shown == 1.0


def test_a_block_beside_the_picture_or_too_near_is_refused(task: Write) -> None:
    with pytest.raises(NotPlannable, match="'block' is outside its picture"):
        plan_task(load_task(task(FIXED.replace("-90 deg", "90 deg"))))
    with pytest.raises(NotPlannable, match="'block' is nearer than 80 cm"):
        plan_task(load_task(task(f"{FIXED}, limits: {{depth: {{least: 80 cm}}}}")))


def test_sighting_counts_the_pixels_of_the_pinhole(task: Write) -> None:
    """Oracle: from straight above at distance d the top of the block has (f a / d)^2 pixels."""
    file = task("at: {xyz: [0.1, 0.1, 0.54], rpy: [0, 90 deg, 0]}")
    plan = unplanned(load_task(file))
    sight = plan.planner.sights["eye"]
    state = replace(
        plan.start, bodies=(Transform.of(xyz=(0.1, 0.1, 0.12)),), position=np.array([-0.5, -0.5, -0.5, 0.0])
    )
    assert isinstance(sight, CameraSight)
    expected = (sight.lens.fx * 0.04 / 0.4) ** 2
    found = sight.sighting(state, "block")
    assert found.pixels == pytest.approx(expected, rel=0.25)  # pictures for this are coarse: 2 x 2 pixels in one
    assert found.inside == 1.0


def test_a_camera_on_the_arm_goes_to_where_it_sees_the_block(task: Write) -> None:
    """At the end of the motion the whole block is in the picture wherever it can be, and the camera looks at it."""
    sight, state = sight_of(task("link: palm, at: {xyz: [5 cm, 0, 0], rpy: [0, -50 deg, 0]}"))
    assert sight.sighting(state, "block").sufficient
    X_WC = sight.pose(state)
    to_block = state.bodies[0].p - X_WC.p
    assert float(X_WC.R[:, 2] @ to_block) / np.linalg.norm(to_block) > np.cos(sight.cone)


@pytest.mark.parametrize(
    ("old", "new", "at", "message"),
    [
        ("with: eye}", "with: eyes}", "with", "neither robot nor task has a sensor 'eyes'"),
        ("color: false", "depth: false", "with", "camera 'eye' has no depth"),
        ("object: block, with", "object: blok, with", "object", "'blok' is not a movable body"),
        (KNOWN, "rests_on: table", "object", "the pose of 'block' is known exactly"),
    ],
)
def test_what_cannot_be_located_is_refused_at_its_place(task: Write, old: str, new: str, at: str, message: str) -> None:
    file = task()
    file.write_text(file.read_text().replace(old, new, 1))
    with pytest.raises(InvalidInput) as refused:
        load_task(file)
    (finding,) = [each for each in refused.value.findings if message in each.message]
    line = next(line for line in file.read_text().splitlines() if "locate" in line)
    assert finding.place is not None
    assert finding.place.column == line.index(f"{at}: ") + len(at) + 3
