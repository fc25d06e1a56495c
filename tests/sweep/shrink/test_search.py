"""The smallest change: regions of failure with known nearest points, and the file that is written of it."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
import yaml

from manipcli.batch.job import Settings
from manipcli.core.errors import InvalidInput
from manipcli.sweep.results import SampleResult
from manipcli.sweep.sampling import Sampling
from manipcli.sweep.shrink.file import TaskFile
from manipcli.sweep.shrink.runs import Runs
from manipcli.sweep.shrink.search import Search
from manipcli.sweep.shrink.shrink import Start, shrink, start_of
from manipcli.sweep.shrink.space import FINEST, Coordinate, Point, Space
from manipcli.sweep.shrink.trial import Outcome, Trial
from manipcli.task.load_task import load_task, load_written
from manipcli.task.vary import Law, Varied
from tests.conftest import RunCli

ROOT = Path(__file__).parents[3]
TASK = f"""\
# A block on its mark.
task: held  # its name
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
simulation: {{engine: kinematic, control_period: 10 ms, step: 10 ms, settle: 0}}
frames: {{mark: {{pose: {{xyz: [0.6, 0.4, 0.025]}}}}}}
scene:
  block: {{box: {{size: [5 cm, 5 cm, 5 cm]}}, fixed: true, pose: {{xyz: [0.6, 0.4, 0.025]}}}}
steps: [{{wait: 50 ms}}]
vary:
  scene.block.pose.xyz: {{offset: {{uniform: [[-2 cm, -1 cm, 0], [2 cm, 1 cm, 0]]}}}}  # not z
  scene.block.friction: {{normal: [0.8, 0.1]}}

# within 1 cm
expect: [{{near: {{object: block, to: mark, within: 1 cm}}}}]
"""
BOX = """\
<robot name="box"><link name="box">
  <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>
</link></robot>
"""
Vector = Sequence[float]


@pytest.fixture(scope="module")
def sampling(tmp_path_factory: pytest.TempPathFactory) -> Sampling:
    path = tmp_path_factory.mktemp("task") / "held.yaml"
    path.write_text(TASK)
    return Sampling(path, Settings())


@pytest.fixture(scope="module")
def space(sampling: Sampling) -> Space:
    return Space(sampling)


class IdealRuns(Runs):
    """Outcomes in closed form."""

    def __init__(self, sampling: Sampling, space: Space, outcome: Callable[[Vector], str], budget: int = 150) -> None:
        super().__init__(
            sampling.written.path, Settings(), space,
            sample=0, budget=budget, at_once=1, folder=Path("none"), observer=lambda state: None,
        )  # fmt: skip
        self.outcome = outcome

    def _run(self, points: Sequence[Point], doing: str) -> dict[Point, Trial]:
        self.done += len(points)
        return {point: self._trial(point) for point in reversed(points)}

    def _trial(self, point: Point) -> Trial:
        word, _, step = self.outcome(point.x).partition(" ")
        outcomes: tuple[Outcome, ...] = ("passed", "failed", "refused", "crashed")
        outcome = next(known for known in outcomes if known == word)
        return Trial(point, outcome, SampleResult(0, "passed" if outcome == "passed" else "failed", step=step))


def fails(*, where: Callable[[Vector], bool]) -> Callable[[Vector], str]:
    return lambda x: "failed" if where(x) else "passed"


def dot(a: Vector, b: Vector) -> float:
    return sum(u * v for u, v in zip(a, b, strict=True))


START = Start(0, (), ())


def test_a_point_is_the_only_sample_of_its_block(sampling: Sampling, space: Space) -> None:
    path, point = sampling.written.path, space.point([0.3, -0.77, 2.0])
    assert [each.name for each in space.coordinates] == [
        "scene.block.pose.xyz.0", "scene.block.pose.xyz.1", "scene.block.friction",
    ]  # fmt: skip
    assert [each.spread for each in space.coordinates] == [0.02, 0.01, 0.1]
    drawn = load_task(path, overrides=[space.override(point)], sample=0).drawn
    assert drawn is not None
    values = dict(drawn.values)
    assert values["scene.block.pose.xyz"] == pytest.approx((0.606, 0.3923, 0.025), abs=1e-9)
    assert values["scene.block.friction"] == pytest.approx(1.0)
    assert point.distance == pytest.approx(math.hypot(0.3, 0.77, 2.0))
    for number in range(5):
        drawn = sampling.written.drawn(number)
        near = [space.value(k, space.sample(number)) for k in range(3)]
        assert near == pytest.approx(
            [*dict(drawn.values)["scene.block.pose.xyz"][:2], drawn.values[1][1]], abs=0.1 * FINEST
        )
    assert space.inside(space.point([1.0, -1.0, 2.0]))
    assert not space.inside(space.point([1.1, 0.0, 0.0]))


def test_whole_numbers_stay_whole() -> None:
    law = Law("uniform", ((0.0,), (5.0,)), together=False)
    quantity = Varied("key", "robot.a", "ROBOT", ("a",), (2,), vector=False, whole=True, how="", law=law)
    each = Coordinate("robot.a", quantity, 0, nominal=2, spread=2.5, least=-0.8, most=1.2)
    assert [each.amount(x) for x in (0.0, 0.1, 0.5, 1.2)] == [2, 2, 3, 5]
    assert all(isinstance(each.amount(x), int) for x in (0.0, 0.5))


def test_numbers_that_an_override_sets_are_no_coordinates(sampling: Sampling) -> None:
    overridden = Sampling(sampling.written.path, Settings(overrides=("scene.block.friction=0.5",)))
    assert "scene.block.friction" not in [each.name for each in Space(overridden).coordinates]


@pytest.mark.parametrize("normal", [(1.0, 0.0, 0.0), (0.6, 0.8, 0.0), (0.48, -0.64, 0.6), (-0.5, 0.5, 0.7071)])
@pytest.mark.parametrize("distance", [0.4, 2.5])
def test_the_nearest_point_of_a_half_space(sampling: Sampling, space: Space, normal: Vector, distance: float) -> None:
    runs = IdealRuns(sampling, space, fails(where=lambda x: dot(x, normal) > distance))
    (smallest,) = shrink(space, runs, START, seed=0)
    point = smallest.trial.point
    assert dot(point.x, normal) > distance
    assert point.distance == pytest.approx(distance, rel=0.05)
    assert smallest.confirmed
    assert runs.done <= 150


def test_from_a_failing_point_numbers_that_do_not_matter_are_dropped(sampling: Sampling, space: Space) -> None:
    runs = IdealRuns(sampling, space, fails(where=lambda x: x[1] < -0.7))
    (smallest,) = shrink(space, runs, Start(0, (space.point([0.9, -0.95, 1.7]),), ()), seed=0)
    assert smallest.trial.point.changed == (1,)
    assert smallest.trial.point.x[1] == pytest.approx(-0.7, rel=0.01)


def test_islands_of_failure_are_not_taken_for_half_spaces(sampling: Sampling, space: Space) -> None:
    def failing(x: Vector) -> bool:
        return 0.55 < x[0] < 0.6 or math.hypot(*x) > 1.4

    runs = IdealRuns(sampling, space, fails(where=failing))
    (smallest,) = shrink(space, runs, Start(0, (space.point([1.0, 1.0, 1.0]),), ()), seed=0)
    assert failing(smallest.trial.point.x)
    assert smallest.nearer is not None
    assert not failing(smallest.nearer.point.x)
    assert smallest.nearer.point.distance == pytest.approx(0.9 * smallest.trial.point.distance, rel=1e-3)


def test_what_is_refused_is_no_failure_unless_asked_for(sampling: Sampling, space: Space) -> None:
    def outcome(x: Vector) -> str:
        return "refused" if x[0] > 0.5 else "failed" if x[0] < -4.0 else "passed"

    (smallest,) = shrink(space, IdealRuns(sampling, space, outcome), START, seed=0)
    assert smallest.trial.point.x == pytest.approx((-4.0, 0.0, 0.0), rel=0.01)
    assert not space.inside(smallest.trial.point)
    (smallest,) = shrink(
        space, IdealRuns(sampling, space, outcome), START, seed=0, counts=frozenset({"failed", "refused"})
    )
    assert smallest.trial.point.x == pytest.approx((0.5, 0.0, 0.0), rel=0.01)


def test_retreats_from_what_is_refused_to_what_fails_before_it(sampling: Sampling, space: Space) -> None:
    def outcome(x: Vector) -> str:
        return "refused" if math.hypot(*x) > 1.4 else "failed" if x[1] > 1.1 else "passed"

    (smallest,) = shrink(space, IdealRuns(sampling, space, outcome), START, seed=0)
    assert smallest.trial.point.x == pytest.approx((0.0, 1.1, 0.0), rel=0.01)


def test_one_change_for_each_way_of_failing(sampling: Sampling, space: Space) -> None:
    def outcome(x: Vector) -> str:
        return "failed lift_1" if x[0] > 0.8 else "failed pick_1" if x[1] > 0.6 else "passed"

    found = shrink(space, IdealRuns(sampling, space, outcome), START, seed=0, every_way=True)
    assert [each.trial.way.step for each in found] == ["pick_1", "lift_1"]
    assert [each.trial.point.distance for each in found] == pytest.approx([0.6, 0.8], rel=0.05)
    assert all(each.confirmed for each in found)


def test_numbers_of_another_way_of_failing_are_dropped(sampling: Sampling, space: Space) -> None:
    def outcome(x: Vector) -> str:
        return "failed lift_1" if x[0] < -0.5 else "failed pick_1" if x[1] > 1.5 else "passed"

    start = Start(0, (space.point([-0.6, 1.6, 0.2]), space.point([0.2, 1.7, -0.3])), ())
    (smallest,) = shrink(space, IdealRuns(sampling, space, outcome, 30), start, seed=0)
    assert smallest.trial.point.x == pytest.approx((-0.5, 0.0, 0.0), rel=0.01)


def test_a_budget_is_kept_and_what_is_found_is_returned(sampling: Sampling, space: Space) -> None:
    for budget in (1, 4, 9, 15, 60):
        runs = IdealRuns(sampling, space, fails(where=lambda x: x[0] + x[2] > 1.2), budget)
        found = shrink(space, runs, START, seed=0)
        assert runs.done <= budget
        failing = [trial.point.distance for trial in runs.trials.values() if trial.outcome == "failed"]
        assert [each.trial.point.distance for each in found] == ([min(failing)] if failing else [])
    assert found[0].confirmed


def test_nothing_fails(sampling: Sampling, space: Space) -> None:
    assert shrink(space, IdealRuns(sampling, space, lambda x: "passed"), START, seed=0) == ()


def test_an_interrupt_loses_nothing(sampling: Sampling, space: Space) -> None:
    class Interrupted(IdealRuns):
        def _run(self, points: Sequence[Point], doing: str) -> dict[Point, Trial]:
            if self.done > 12:
                raise KeyboardInterrupt
            return super()._run(points, doing)

    kept: list[float] = []
    runs = Interrupted(sampling, space, fails(where=lambda x: x[0] > 0.3))
    with pytest.raises(KeyboardInterrupt):
        shrink(space, runs, START, seed=0, found=lambda each: kept.append(each.trial.point.distance))
    assert kept == [min(trial.point.distance for trial in runs.trials.values() if trial.outcome == "failed")]


def test_the_search_begins_with_the_nearest_failing_samples(sampling: Sampling, space: Space) -> None:
    failing = {1: "lift_1", 3: "pick_1", 4: "pick_1"}
    results = [
        SampleResult(k, "failed" if k in failing else "passed", step=failing.get(k, ""), simulated=1.0)
        for k in range(6)
    ]
    results.append(SampleResult(6, "failed", simulated=0.0))  # it was not simulated: it has no plan
    start = start_of(sampling, space, results, refused=False)
    distance = {space.sample(k): space.sample(k).distance for k in failing}
    assert sorted(start.points, key=distance.__getitem__)[0] == start.points[0]
    assert len({failing[next(k for k in failing if space.sample(k) == point)] for point in start.points[:2]}) == 2
    assert len(start_of(sampling, space, results, refused=True).points) == 4


def test_the_best_is_known_while_searching(sampling: Sampling, space: Space) -> None:
    runs = IdealRuns(sampling, space, fails(where=lambda x: x[0] > 0.3))
    search = Search(space, runs, lambda trial: trial.outcome == "failed", seed=0)
    assert search.best is None
    search.nearest([space.point([0.2, 0.0, 0.0])])
    assert search.best is None  # it passes
    search.nearest([space.point([0.9, 0.0, 0.0])])
    assert search.best is not None


def written(sampling: Sampling, space: Space, file: Path) -> str:
    TaskFile(sampling.written, file).write(["a", "b\x1b[31m"], space.vary(space.point([0.7, 0.0, 1.0])), 0)
    return file.read_text()


def test_the_file_is_the_task_with_one_sample(sampling: Sampling, space: Space) -> None:
    path = sampling.written.path
    text = written(sampling, space, path.with_name("small.yaml"))
    assert text.startswith("# a\n# b\\x1b[31m\n# A block on its mark.\ntask: held_shrunk  # its name\n")
    assert "# within 1 cm\nexpect:" in text
    read = yaml.safe_load(text)
    assert read["vary"] == {
        "scene.block.pose.xyz": {"offset": {"choice": [[0.014, 0.0, 0.0]]}}, "scene.block.friction": {"choice": [0.9]},
    }  # fmt: skip
    loaded = load_task(path.with_name("small.yaml"))
    assert loaded.drawn is not None
    assert dict(loaded.drawn.values)["scene.block.pose.xyz"] == pytest.approx((0.614, 0.4, 0.025))
    assert loaded.true.scene.body("block").friction == 0.9
    assert loaded.scene.body("block").friction == 0.8  # the planner does not know
    assert not [*path.parent.glob(".*")]


def test_a_file_in_another_folder_finds_robot_and_controllers(tmp_path: Path) -> None:
    (tmp_path / "tasks").mkdir()
    (tmp_path / "out").mkdir()
    (tmp_path / "robots").symlink_to(ROOT / "robots")
    (tmp_path / "controllers").symlink_to(ROOT / "controllers")
    path = tmp_path / "tasks" / "held.yaml"
    path.write_text(TASK.replace(f"{ROOT}/", "../"))
    sampling = Sampling(path, Settings())
    text = written(sampling, Space(sampling), tmp_path / "out" / "small.yaml")
    assert '\nrobot: "../robots/arm7_hand3/robot.yaml"\n' in text
    deeper = tmp_path / "out" / "a"
    deeper.mkdir()
    text = written(sampling, Space(sampling), deeper / "small.yaml")
    assert '\nrobot: "../../robots/arm7_hand3/robot.yaml"\n' in text


def test_a_task_that_cannot_be_edited_is_written_from_its_values(sampling: Sampling, tmp_path: Path) -> None:
    path = tmp_path / "flow.yaml"
    path.write_text(json.dumps(yaml.safe_load(sampling.written.path.read_text())))
    flow = Sampling(path, Settings())
    text = written(flow, Space(flow), tmp_path / "small.yaml")
    assert text.count("\nvary:") == 1
    assert "\ntask: held_shrunk\n" in text
    assert load_written(tmp_path / "small.yaml").task.spec.sample == 0


def test_a_file_that_would_be_another_task_is_refused(sampling: Sampling, tmp_path: Path) -> None:
    (tmp_path / "box.urdf").write_text(BOX)
    path = tmp_path / "held.yaml"
    path.write_text(
        TASK.replace("scene:\n", "scene:\n  box: {urdf: {file: box.urdf}, fixed: true, pose: {xyz: [2, 0, 0]}}\n")
    )
    with_file = Sampling(path, Settings())
    (tmp_path / "out").mkdir()
    file = tmp_path / "out" / "small.yaml"
    space = Space(with_file)
    TaskFile(with_file.written, tmp_path / "small.yaml").check(space.vary(space.origin))
    with pytest.raises(InvalidInput, match="would not be the same task"):
        TaskFile(with_file.written, file).check(space.vary(space.origin))
    assert [*file.parent.iterdir()] == []


def test_shrink_as_a_command(sampling: Sampling, call_cli: RunCli, tmp_path: Path) -> None:
    (tmp_path / "held.yaml").write_text(sampling.written.path.read_text())
    words = ("shrink", "held.yaml", "--samples", "0", "--budget", "5", "-n", "2")
    ran = call_cli(*words, "--format", "json", cwd=tmp_path)
    found = json.loads(ran.out)
    (change,) = found["changes"]
    assert found["runs"] <= 5
    assert change["expectation"] == "near"
    assert [number["name"] for number in change["numbers"] if number["spreads"]] == ["scene.block.pose.xyz.0"]
    assert 0.5 <= change["distance"] <= 1.0
    assert ran.code == (0 if change["confirmed"] else 1)
    assert "verified: manipcli run held-shrunk.yaml fails with the same margins" in ran.err
    assert [*(tmp_path / "runs" / "shrink").iterdir()] == []
    again = call_cli(*words, cwd=tmp_path)
    assert again.code == 4
    assert "'held-shrunk.yaml' exists" in again.err


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("-o", "x.txt"), "USE203"),
        (("--samples", "40", "--budget", "50"), "USE202"),
        (("--sample", "1", "--samples", "3"), "USE189"),
        (("--timeout=-3",), "USE050"),
    ],
)
def test_options_that_do_not_fit_are_refused_before_any_run(
    words: tuple[str, ...], told: str, sampling: Sampling, call_cli: RunCli, tmp_path: Path
) -> None:
    ran = call_cli("shrink", sampling.written.path, *words, cwd=tmp_path)
    assert ran.code == 4
    assert f"error[{told}]" in ran.err


def test_a_task_that_fails_as_written_is_told_whatever_the_budget(
    sampling: Sampling, call_cli: RunCli, tmp_path: Path
) -> None:
    (tmp_path / "held.yaml").write_text(
        sampling.written.path.read_text().replace("fixed: true, pose: {xyz: [0.6", "fixed: true, pose: {xyz: [0.7")
    )
    ran = call_cli("shrink", "held.yaml", "--budget", "5", "-n", "2", cwd=tmp_path)
    assert ran.code == 1
    assert "does not pass as written, so there is nothing to shrink" in ran.out
