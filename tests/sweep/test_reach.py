"""A map of where an object may be: each point is what planning it alone gives, whatever the number of processes."""

from __future__ import annotations

import csv
import json
import math
import shlex
from collections.abc import Callable, Generator, Iterable
from pathlib import Path

import numpy as np
import pytest

from manipcli import pipeline
from manipcli.core.errors import ExitCode, InvalidInput, NotPlannable
from manipcli.core.units import ANGLE, LENGTH
from manipcli.sweep.reach import workers
from manipcli.sweep.reach.grid import USUAL, Grid, Range, grid_of, read_range
from manipcli.sweep.reach.placement import Placement, placement_of
from manipcli.sweep.reach.prepare import Ranges, prepared_map
from manipcli.sweep.reach.question import PointResult, Question
from manipcli.sweep.reach.reach_map import ReachMap
from manipcli.sweep.reach.text import render_csv, render_json, render_text
from manipcli.sweep.reach.workers import planned_points
from tests.conftest import RunCli

ROOT = Path(__file__).parents[2]
TASK = f"""\
task: reached
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
simulation: {{engine: kinematic, control_period: 10 ms, step: 10 ms, settle: 0}}
frames: {{mark: {{pose: {{xyz: [0.7, -0.2, 0.4], rpy: [0, 0, 30 deg]}}}}}}
scene:
  desk: {{box: {{size: [0.6, 1.0, 0.4]}}, pose: {{xyz: [0.85, 0, 0.2]}}, fixed: true}}
  cup: {{cup: {{radius: 36 mm, height: 110 mm}}, mass: 150 g, rests_on: desk, at: [0.75, 0.0], yaw: 20 deg}}
  ball: {{sphere: {{radius: 14 mm}}, mass: 10 g, inside: cup}}
  post: {{box: {{size: [5 cm, 5 cm, 30 cm]}}, pose: {{xyz: [0.9, 0.3, 0.55], rpy: [0, 0, 10 deg]}}, fixed: true}}
  tin: {{box: {{size: [4 cm, 4 cm, 4 cm]}}, mass: 50 g, rests_on: desk, frame: mark, at: [5 cm, 2 cm]}}
  bowl: {{tray: {{size: [10 cm, 10 cm, 4 cm]}}, rests_on: desk, at: [0.65, 0.38], fixed: true}}
  bean: {{sphere: {{radius: 2 mm}}, mass: 1 g, count: 3, inside: bowl}}
  pea: {{sphere: {{radius: 2 mm}}, mass: 1 g, count: 3, rests_on: desk, at: [0.65, -0.4]}}
steps:
  - pick: {{object: cup, approach: {{from: side, distance: [8 cm, 14 cm]}}, grasp: {{posture: wrap, height: 68 mm}}}}
  - move: {{to: home}}
"""
PLACES = ((0.75, 0.0), (1.1, 0.4), (0.9, 0.28), (0.5, 0.0))
"""Of the cup: free, out of reach, in the post, beside the desk."""


@pytest.fixture(scope="module")
def task_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("reach") / "reached.yaml"
    path.write_text(TASK)
    return path


def alone(path: Path, overrides: Iterable[str]) -> tuple[str, str]:
    """What `manipcli plan` of the whole task gives with these overrides: whether the pick has a plan, or the cause."""
    try:
        pipeline.plan_task(pipeline.load_task(path, overrides=(*overrides,)))
    except NotPlannable as refusal:
        return ("refused", refusal.cause) if refusal.step == "pick_1" else ("planned", "")
    except InvalidInput as invalid:
        return "invalid", invalid.findings[0].message
    return "planned", ""


def test_each_point_is_what_planning_it_alone_gives(task_file: Path) -> None:
    placement = placement_of(pipeline.load_task(task_file), "cup")
    points = [(k, placement.overrides(x, y, None)) for k, (x, y) in enumerate(PLACES)]
    question = Question(task_file, {}, "pick_1", "cup")
    found = {result.number: result for result in planned_points(question, points, at_once=1)}
    assert [found[k].outcome for k in range(len(PLACES))] == ["planned", "refused", "invalid", "invalid"]
    for number, overrides in points:
        assert (found[number].outcome, found[number].cause) == alone(task_file, overrides)
    free, far, inside, beside = (found[k] for k in range(len(PLACES)))
    # The palm is 13 mm above the desk when the hand closes 68 mm above it, and nothing is nearer.
    assert free.between == "desk and robot/palm"
    assert free.clearance == pytest.approx(0.013, abs=1e-4)
    assert free.manipulability is not None
    assert free.manipulability > 0.05
    assert far.reason == "pick_1 approach: out of reach"
    assert (inside.code, inside.reason) == ("TASK226", "'cup' and 'post' overlap at the start")
    assert (beside.code, beside.reason) == ("TASK224", "'cup' is not above 'desk'")


def test_the_command_of_a_point_plans_up_to_the_step(task_file: Path, tmp_path: Path, call_cli: RunCli) -> None:
    found, _ = prepared_map(task_file, "pick_1", Ranges("0.75:1.1:2", "0"))
    ran = [call_cli(*shlex.split(found.command(k))[1:], "--format", "json", cwd=tmp_path) for k in range(2)]
    assert [each.code for each in ran] == [ExitCode.PASSED, ExitCode.FAILED]
    assert {motion["step"] for motion in json.loads(ran[0].out)["motions"]} == {"pick_1"}
    assert "pick_1" in json.loads(ran[1].out)["text"]


def test_a_process_that_dies_costs_its_point(monkeypatch: pytest.MonkeyPatch) -> None:
    dying = """
import json, os, sys
sys.path[:] = json.loads(sys.argv[1])
from multiprocessing.connection import Connection
from manipcli.sweep.reach.question import PointResult
parent = Connection(int(sys.argv[2]))
parent.recv()
while True:
    number, overrides = parent.recv()
    if number == 1:
        os.kill(os.getpid(), 11)
    if number == 2:
        raise ValueError("no")
    parent.send(PointResult(number, "planned"))
"""
    monkeypatch.setattr(workers, "WORKER", dying)
    question = Question(Path("none.yaml"), {}, "pick_1", "cup")
    results = planned_points(question, [(k, ()) for k in range(5)], at_once=2)
    found = {result.number: result for result in results}
    assert [found[k].outcome for k in range(5)] == ["planned", "crashed", "crashed", "planned", "planned"]
    assert "SIGSEGV" in found[1].cause
    assert found[2].cause.endswith("ValueError: no")


@pytest.mark.parametrize("name", ["cup", "ball", "post", "tin", "pea"])
def test_a_point_is_where_the_loaded_scene_has_the_object(task_file: Path, name: str) -> None:
    task = pipeline.load_task(task_file)
    placement = placement_of(task, name)
    x, y, yaw = placement.at[0] + 0.004, placement.at[1] - 0.003, 0.3
    moved = pipeline.load_task(task_file, overrides=placement.overrides(x, y, yaw))
    own = [body for body in moved.scene.bodies if body.name.split("[")[0] == name]
    there = np.mean([body.X_WO.p[:2] for body in own], axis=0)
    assert placement.from_world(there[None])[0] == pytest.approx([x, y], abs=1e-9)
    assert own[0].X_WO.rpy[2] == pytest.approx(placement.turned + yaw, abs=1e-9)
    before = next(body for body in task.scene.bodies if body.name == own[0].name)
    assert own[0].X_WO.p[2] == pytest.approx(before.X_WO.p[2], abs=1e-9)


def test_the_usual_grid_is_the_surface_below_the_object(task_file: Path) -> None:
    found, _ = prepared_map(task_file, "pick_1", Ranges())
    assert (found.grid.x[0], found.grid.x[-1], found.grid.y[0], found.grid.y[-1]) == (0.55, 1.15, -0.5, 0.5)
    assert USUAL / 4 < found.grid.count <= USUAL
    tin, _ = prepared_map(task_file, "pick_1", Ranges(), body="tin")  # a frame that is rotated by 30 deg
    corners = [(x - 0.7, y + 0.2) for x in (0.55, 1.15) for y in (-0.5, 0.5)]
    along = [x * math.cos(math.pi / 6) + y * math.sin(math.pi / 6) for x, y in corners]
    assert min(along) <= tin.grid.x[0] < min(along) + 0.1
    assert max(along) - 0.1 < tin.grid.x[-1] <= max(along)


@pytest.mark.parametrize(
    ("text", "dimension", "expected"),
    [
        ("0.5:1:11", LENGTH, (0.5, 1.0, 11)),
        ("50 cm:1 m:11", LENGTH, (0.5, 1.0, 11)),
        ("50:100cm", LENGTH, (0.5, 1.0, None)),
        ("30 cm", LENGTH, (0.3, 0.3, 1)),
        ("0:180 deg:7", ANGLE, (0.0, math.pi, 7)),
        ("-0.2:-10 cm:3", LENGTH, (-0.002, None, None)),
    ],
)
def test_ranges(text: str, dimension: object, expected: tuple[float, float | None, int | None]) -> None:
    assert dimension in (LENGTH, ANGLE)
    if expected[1] is None:  # a bound without a unit has that of the other: -0.2 cm to -10 cm goes down
        with pytest.raises(InvalidInput, match="does not go up"):
            read_range("--x", text, LENGTH)
        return
    found = read_range("--x", text, LENGTH if dimension == LENGTH else ANGLE)
    assert (found.low, found.high, found.count) == pytest.approx(expected)


@pytest.mark.parametrize("text", ["", "a:b", "1:2:3:4", "0:1:1", "1:0:5", "0:1 kg:5", "nan:1:5", "0:1:x", "0:inf:3"])
def test_what_is_no_range_is_refused(text: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        read_range("--x", text, LENGTH)
    assert refused.value.findings[0].code == "USE197"


def test_points_are_multiples_of_the_spacing_each_planned_once() -> None:
    grid = grid_of(Range(-0.11, 0.2, None), Range(0.0, 0.1, 3), Range(0.0, 1.0, 2), 0.05)
    assert grid.x == (-0.1, -0.05, 0.0, 0.05, 0.1, 0.15, 0.2)
    assert grid.y == (0.0, 0.05, 0.1)
    assert sorted(grid.order()) == list(range(7 * 3 * 2)) == list(range(grid.count))
    assert {grid.point(k) for k in range(grid.count)} == {(x, y, t) for x in grid.x for y in grid.y for t in grid.yaw}
    assert [grid.point(k) for k in (0, 1, 7, 21)] == [
        (-0.1, 0.0, 0.0), (-0.05, 0.0, 0.0), (-0.1, 0.05, 0.0), (-0.1, 0.0, 1.0),
    ]  # fmt: skip
    with pytest.raises(InvalidInput, match="at most"):
        grid_of(Range(0.0, 1.0, 1000), Range(0.0, 1.0, 1000), None, None)
    with pytest.raises(InvalidInput, match="no point"):
        grid_of(Range(0.01, 0.02, None), Range(0.0, 1.0, 2), None, 0.5)


def drawn_map(grid: Grid) -> ReachMap:
    """Planned where x > 0, by the clearance x [m]; refused elsewhere; the last point is missing."""
    at = Placement("cup", "at", "", (0.0, 0.0), 0.0, (0.0, 0.0, 0.0), np.zeros(2), 0.0)
    results = {}
    for number in range(grid.count - 1):
        x, y, _ = grid.point(number)
        good = PointResult(number, "planned", x, "desk and robot/palm", 1.0 - x)
        results[number] = good if x > 0 else PointResult(number, "refused", code="PLAN100", reason=f"far {y:g}")
    return ReachMap("drawn", Question(Path("a b.yaml"), {"seed": 3}, "pick_1", "cup"), at, grid, results)


def test_a_map_as_text_csv_and_json() -> None:
    found = drawn_map(Grid((-0.1, 0.1, 0.2), (0.0, 0.5)))
    text = render_text(found)
    assert "0.500 b ██?\n0.000 a ████\n      −0.100 0.200\n" in text
    assert "a 1 far 0 (PLAN100)\nb 1 far 0.5 (PLAN100)\n? 1 not planned yet" in text
    assert "3 of 5 points can be planned\ninterrupted: 1 of 6 points were not planned\n" in text
    assert "most clearance: [0.2, 0] m: clearance 200 mm" in text
    assert "most manipulability: [0.1, 0] m" in text
    assert "manipcli plan 'a b.yaml' --until pick_1 --seed 3 --set 'scene.cup.at=[0.2, 0.0]'" in text
    rows = list(csv.DictReader(render_csv(found).splitlines()))
    assert [(float(row["x"]), float(row["y"])) for row in rows] == [found.grid.point(k)[:2] for k in range(5)]
    assert [row["clearance"] for row in rows] == ["", "0.1", "0.2", "", "0.1"]
    read = json.loads(render_json(found))
    assert (read["planned"], read["count"], read["missing"], read["most_clearance"]) == (3, 5, 1, 2)
    assert shlex.split(read["points"][1]["command"])[-1] == "scene.cup.at=[0.1, 0.0]"


def test_several_yaws_are_a_share_and_rows_of_their_own() -> None:
    grid = Grid((0.1,), (0.0,), (0.0, math.pi / 2, math.pi, 4.0))
    found = drawn_map(grid)
    refused = PointResult(1, "refused", code="PLAN100", reason="far")
    found = ReachMap(found.task, found.question, found.placement, grid, {**found.results, 1: refused})
    assert "0.000 ▒▒\n" in render_text(found)  # two of four; the fourth is missing
    assert "yaw 180 deg" not in render_text(found)
    assert [row["yaw"] for row in csv.DictReader(render_csv(found).splitlines())] == [
        "0.0",
        repr(math.pi / 2),
        repr(math.pi),
    ]


def test_an_interrupt_leaves_what_is_there(
    task_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call_cli: RunCli
) -> None:
    def two(
        question: Question, points: list[tuple[int, tuple[str, ...]]], *, at_once: int, beat: Callable[[], None]
    ) -> Generator[PointResult, None, None]:
        for number, _ in points[:2]:
            yield PointResult(number, "planned", 0.01, "desk and robot/palm", 0.1)
            beat()
        raise KeyboardInterrupt

    monkeypatch.setattr(workers, "planned_points", two)
    words = ("reach", task_file, "pick_1", "--step", "20 cm", "--csv", "map.csv", "--picture", "map.png")
    ran = call_cli(*words, cwd=tmp_path)
    assert ran.code == ExitCode.INTERRUPTED
    assert "2 of 2 points can be planned" in ran.out
    assert len((tmp_path / "map.csv").read_text().splitlines()) == 3
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("words", "code", "hint"),
    [
        (("pick",), "USE120", "pick_1"),
        (("move_1",), "USE196", "--object cup"),
        (("pick_1", "--object", "cap"), "USE196", "'cup'"),
        (("pick_1", "--object", "bean"), "USE196", "--object bowl"),
        (("pick_1", "--x", "1:0:5"), "USE197", "write"),
        (("pick_1", "--step", "0"), "USE197", "write"),
        (("pick_1", "--yaw", "0:1 m:5"), "USE197", "write"),
        (("pick_1", "--picture", "map.bmp"), "USE061", ""),
    ],
)
def test_wrong_words(
    task_file: Path, tmp_path: Path, call_cli: RunCli, words: tuple[str, ...], code: str, hint: str
) -> None:
    ran = call_cli("reach", task_file, *words, cwd=tmp_path)
    assert ran.code == ExitCode.USAGE
    assert code in ran.err
    assert hint in ran.err
    assert not list(tmp_path.iterdir())
