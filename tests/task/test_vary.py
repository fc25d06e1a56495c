"""`vary:`: what is drawn follows its law, from seed, sample and path alone; what cannot be is told at its line."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from collections.abc import Callable
from itertools import product
from pathlib import Path

import pytest
from scipy import stats

from manipcli.core.errors import InvalidInput
from manipcli.judge.drawn import Drawn, Number
from manipcli.task.designs import draw
from manipcli.task.load_task import load_task
from manipcli.task.vary import bind, deviate

ROOT = Path(__file__).parents[2]
COUNT = 2000
LEAST_P = 1e-4
"""Of a fixed seed: a law that is wrong by a few percent has a p-value far below at this many samples."""

TASK = f"""
task: varied
robot: {ROOT}/robots/panda/robot.yaml
controllers: {ROOT}/controllers/panda.yaml
simulation: {{seed: 7}}
scene:
  table: {{box: {{size: [0.6, 0.8, 0.2]}}, pose: {{xyz: [0.55, 0, 0.1]}}, fixed: true}}
  block: {{box: {{size: [4 cm, 4 cm, 5 cm]}}, mass: 80 g, rests_on: table, at: [0.5, -0.15]}}
  peg: {{cylinder: {{radius: 1 cm, height: 5 cm}}, mass: 50 g, rests_on: table, at: [0.5, 0.1]}}
steps: [{{wait: 1 s}}]
vary:
"""

Values = Callable[..., dict[str, list[Number]]]


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str], Path]:
    def written(vary: str) -> Path:
        path = tmp_path / "task.yaml"
        path.write_text(TASK + "".join(f"  {line.strip()}\n" for line in vary.strip().splitlines()))
        return path

    return written


@pytest.fixture
def values(write: Callable[[str], Path]) -> Values:
    """What samples 0 to `count` - 1 draw, by path."""

    def drawn(vary: str, count: int = COUNT) -> dict[str, list[Number]]:
        task = load_task(write(vary))
        varied, _ = bind(task.file, task.robot_file, task.controllers_file)
        samples = [dict(draw(varied, task.spec.simulation.seed, k).values) for k in range(count)]
        return {one.path: [sample[one.path] for sample in samples] for one in varied}

    return drawn


def _told(path: Path) -> list[str]:
    with pytest.raises(InvalidInput) as caught:
        load_task(path)
    return [f"{one.place.line if one.place else 0}: {one.message} | {one.hint}" for one in caught.value.findings]


# -- laws


def test_uniform_is_uniform_between_its_ends(values: Values) -> None:
    drawn = values("scene.block.mass: {uniform: [50 g, 300 g]}")["scene.block.mass"]
    assert stats.kstest(drawn, stats.uniform(0.05, 0.25).cdf).pvalue > LEAST_P


def test_normal_is_normal(values: Values) -> None:
    drawn = values("scene.block.friction: {normal: {mean: 0.8, sd: 0.02}}")["scene.block.friction"]
    assert stats.kstest(drawn, stats.norm(0.8, 0.02).cdf).pvalue > LEAST_P


def test_every_choice_comes_as_often(values: Values) -> None:
    drawn = values("scene.block.yaw: {choice: [0, 90 deg, 180 deg]}")["scene.block.yaw"]
    counts = [drawn.count(item) for item in (0.0, math.pi / 2, math.pi)]
    assert sum(counts) == COUNT
    assert stats.chisquare(counts).pvalue > LEAST_P


def test_of_whole_numbers_both_ends_come_as_often_as_the_others(values: Values) -> None:
    drawn = values("simulation.seed: {uniform: [3, 7]}")["simulation.seed"]
    assert all(isinstance(one, int) for one in drawn)
    counts = [drawn.count(item) for item in (3, 4, 5, 6, 7)]
    assert sum(counts) == COUNT
    assert stats.chisquare(counts).pvalue > LEAST_P


def test_an_offset_is_added_to_each_component_on_its_own(values: Values) -> None:
    drawn = values("scene.block.at: {offset: {uniform: [-2 cm, 2 cm]}}")["scene.block.at"]
    x, y = zip(*drawn, strict=True)
    assert stats.kstest(x, stats.uniform(0.48, 0.04).cdf).pvalue > LEAST_P
    assert stats.kstest(y, stats.uniform(-0.17, 0.04).cdf).pvalue > LEAST_P
    assert stats.pearsonr(x, y).pvalue > LEAST_P


def test_a_scale_is_multiplied_with_the_value_in_the_file(values: Values) -> None:
    drawn = values("controllers.arm_controller.gains.panda_joint1.p: {scale: {uniform: [80 %, 1.2]}}")
    (p,) = drawn.values()
    assert stats.kstest(p, stats.uniform(480.0, 240.0).cdf).pvalue > LEAST_P


def test_lists_are_chosen_whole(values: Values) -> None:
    drawn = values("scene.block.at: {choice: [[0.4, -0.1], [50 cm, 0.2]]}")["scene.block.at"]
    assert {*drawn} == {(0.4, -0.1), (0.5, 0.2)}


def test_each_component_has_its_own_ends(values: Values) -> None:
    drawn = values("scene.block.at: {uniform: [[0.4, -0.2], [0.5, -0.1]]}", 200)["scene.block.at"]
    x, y = zip(*drawn, strict=True)
    assert 0.4 <= min(x) < 0.41 < 0.49 < max(x) <= 0.5
    assert -0.2 <= min(y) < -0.19 < -0.11 < max(y) <= -0.1


def test_grids_are_walked_through_like_nested_loops_beside_what_is_random(values: Values) -> None:
    drawn = values(
        """scene.block.mass: {grid: [50 g, 100 g]}
        scene.peg.mass: {uniform: [10 g, 20 g]}
        scene.block.friction: {grid: [0.5, 0.75, 1.0]}""",
        12,
    )
    pairs = list(zip(drawn["scene.block.mass"], drawn["scene.block.friction"], strict=True))
    assert pairs == 2 * list(product((0.05, 0.1), (0.5, 0.75, 1.0)))
    assert len({*drawn["scene.peg.mass"]}) == 12


def test_a_star_stands_for_every_name_each_drawn_on_its_own(values: Values) -> None:
    drawn = values("controllers.arm_controller.gains.*.d: {scale: {uniform: [0.5, 1.5]}}", 3)
    assert [*drawn] == [f"controllers.arm_controller.gains.panda_joint{k}.d" for k in range(1, 8)]
    assert len({tuple(row) for row in drawn.values()}) == 7


def test_a_star_leaves_out_what_has_no_such_value(values: Values) -> None:
    assert [*values("scene.*.mass: {scale: {uniform: [0.5, 2]}}", 1)] == ["scene.block.mass", "scene.peg.mass"]


# -- what a sample depends on


def test_another_path_changes_nothing_of_the_others(values: Values) -> None:
    line = "scene.block.mass: {uniform: [50 g, 300 g]}"
    alone = values(line, 20)["scene.block.mass"]
    more = values(
        f"scene.block.at: {{offset: {{normal: [0, 1 cm]}}}}\n{line}\nscene.peg.friction: {{grid: [0.5, 1]}}", 20
    )
    assert more["scene.block.mass"] == alone


def test_deviates_of_other_seeds_samples_paths_and_components_do_not_hang_together() -> None:
    rows = {
        "seed": [deviate(k, 0, "scene.cup.mass", 0) for k in range(COUNT)],
        "sample": [deviate(1, k, "scene.cup.mass", 0) for k in range(COUNT)],
        "path": [deviate(1, 0, f"scene.cup_{k}.mass", 0) for k in range(COUNT)],
        "component": [deviate(1, 0, "scene.cup.mass", k) for k in range(COUNT)],
    }
    for row in rows.values():
        assert stats.kstest(row, "uniform").pvalue > LEAST_P
        assert stats.pearsonr(row[1:], row[:-1]).pvalue > LEAST_P


def test_a_sample_is_the_same_in_another_process() -> None:
    statement = "from manipcli.task.vary import deviate; print(deviate(1, 17, 'scene.cup.mass', 0).hex())"
    told = subprocess.run([sys.executable, "-c", statement], capture_output=True, text=True, check=True, cwd=ROOT)
    assert float.fromhex(told.stdout.strip()) == deviate(1, 17, "scene.cup.mass", 0) == 0.7757466454688621


def test_what_the_log_keeps_of_a_sample_reads_back() -> None:
    drawn = Drawn(17, (("scene.cup.at", (0.1 + 0.2, -1e-9)), ("robot.actuators.a.latency", 3)))
    again = Drawn.from_metadata(drawn.to_metadata())
    assert again == drawn
    assert isinstance(again.values[1][1], int)
    for damaged in ({}, {"number": "1"}, {"number": "1", "values": '{"a": "b"}'}, {"number": "x", "values": "{}"}):
        with pytest.raises(ValueError):
            Drawn.from_metadata(damaged)


# -- mistakes


MISTAKES = (
    ("scene.blok.mass: {uniform: [0, 1]}", "there is no 'blok' in 'scene'", "did you mean 'block'?"),
    ("scene.block.mas: {uniform: [0, 1]}", "there is no 'mas' in 'scene.block'", "did you mean 'mass'?"),
    ("scen.block.mass: {uniform: [0, 1]}", "'scen' cannot be varied", "did you mean 'scene'?"),
    ("steps.0.wait: {uniform: [0, 1]}", "'steps' cannot be varied, only scene, frames", None),
    ("scene.block.rests_on: {uniform: [0, 1]}", "'scene.block.rests_on' is not a number", None),
    ("robot.actuators.*.latency: {uniform: [0, 1]}", "there is no value at 'actuators.*.latency'",
     "add it to the robot file first, as `actuators: {NAME: {latency: ...}}`"),
    ("robot.actuators.a.friction: {uniform: [0, 1]}", "'actuators' is empty", "{a: {friction: ...}}`"),
    ("scene.block: {uniform: [0, 1]}", "'scene.block' is not a number", None),
    ("scene.block.fixed: {choice: [0, 1]}", "'scene.block.fixed' is not a number", None),
    ("scene.table.mass: {uniform: [1, 2]}", "there is no value at 'scene.table.mass'",
     "add it to the task file first, as `scene: {table: {mass: ...}}`"),
    ("scene.block.at.2: {uniform: [0, 1]}", "there is no '2' in 'scene.block.at'", "known: 0, 1"),
    ("scene.*.mas: {uniform: [0, 1]}", "there is no value at 'scene.*.mas'", None),
    ("robot.frictio: {uniform: [0, 1]}", "there is no 'frictio' in the file", "did you mean 'friction'?"),
    ("scene.block.mass: {uniform: [1 cm, 2 cm]}", "'1 cm' is a length; expected a mass", None),
    ("scene.block.friction: {scale: {uniform: [1 g, 2 g]}}", "'1 g' is a mass; expected a plain number", None),
    ("scene.peg.mass: {uniform: [2, 1]}", "the least value, 2, is above the most, 1", None),
    ("scene.peg.friction: {normal: [1, 0]}", "the standard deviation must be above 0", None),
    ("scene.peg.yaw: {choice: [[1, 2]]}", "expected a single amount, got a list", None),
    ("simulation.settle: {uniform: [-1e308, 1e308]}", "-1e+308 exceeds the largest magnitude, 1e+100", None),
    ("simulation.step: {scale: {choice: [1e300]}}", "1e+300 exceeds the largest magnitude, 1e+100", None),
    ("scene.block.at: {choice: [[1, 2, 3]]}", "expected 2 amounts, got 3", None),
    ("simulation.seed: {choice: [1.5]}", "1.5 is not a whole number, as 'simulation.seed' must be", None),
)  # fmt: skip
MISSHAPEN = (
    ("scene.block.mass: {uniform: [1, 2], choice: [1]}", "expected exactly one of uniform, normal", None),
    ("scene.peg.mass: {offset: {}}", "expected exactly one of uniform, normal, choice, grid, got none", None),
    ("scene.peg.yaw: {uniforn: [1, 2]}", "unknown key 'uniforn'", "did you mean 'uniform'?"),
    ("scene.peg.friction: {choice: []}", "expected at least 1 item, got 0", None),
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("mistakes", [MISTAKES, MISSHAPEN], ids=["of paths and amounts", "of form"])
def test_every_mistake_is_told_at_its_line(
    write: Callable[[str], Path], mistakes: tuple[tuple[str, str, str | None], ...]
) -> None:
    lines = [*dict.fromkeys(line for line, _, _ in mistakes)]
    told = _told(write("\n".join(lines)))
    for line, message, hint in mistakes:
        at = [one for one in told if one.startswith(f"{12 + lines.index(line)}: ")]
        assert any(message in one and (hint is None or hint in one) for one in at), (line, told)
    assert len(told) == len(lines)


def test_one_number_is_varied_once(write: Callable[[str], Path]) -> None:
    (told,) = _told(write("scene.block.at: {choice: [[0.5, 0]]}\nscene.*.at.0: {uniform: [0.4, 0.5]}"))
    assert "'scene.block.at.0' is already varied by 'scene.block.at'" in told


def test_values_that_must_fit_each_other_are_compared_as_they_are_drawn(write: Callable[[str], Path]) -> None:
    """A step of 2 ms does not fit the control period of 1 ms in the file, but that is not drawn."""
    steps = "simulation.step: {choice: [0.5 ms, 1 ms, 2 ms]}"
    assert load_task(write(f"{steps}\nsimulation.control_period: {{choice: [2 ms, 4 ms]}}"), sample=3)


def test_a_normal_law_is_cut_off_at_the_bounds_of_its_field(values: Values) -> None:
    """Of the value, its offset and its scale: all the same masses, above 0 and distributed as a cut normal law."""
    mean, sd, nominal = 0.08, 0.5, 0.08
    laws = (
        f"normal: [{mean}, {sd}]",
        f"offset: {{normal: [{mean - nominal}, {sd}]}}",
        f"scale: {{normal: [{mean / nominal}, {sd / nominal}]}}",
    )
    cut = stats.truncnorm(-mean / sd, math.inf, loc=mean, scale=sd)
    for law in laws:
        drawn = values(f"scene.block.mass: {{{law}}}")["scene.block.mass"]
        assert min(drawn) > 0.0
        assert stats.kstest(drawn, cut.cdf).pvalue > LEAST_P
        assert stats.kstest(drawn, stats.norm(mean, sd).cdf).pvalue < LEAST_P
    both = values("scene.block.restitution: {normal: [0.5, 1]}", 200)["scene.block.restitution"]
    assert 0.0 <= min(both) < 0.1 < 0.9 < max(both) <= 1.0


def test_a_normal_law_with_next_to_nothing_where_its_field_may_be_is_refused(write: Callable[[str], Path]) -> None:
    (told,) = _told(write("scene.block.mass: {offset: {normal: [-2, 0.1]}}"))
    assert told.startswith("12:")
    assert "less than 0.1% of this distribution is in the range of 'scene.block.mass'" in told


def test_a_drawn_value_that_cannot_be_is_told_where_it_is_varied(write: Callable[[str], Path]) -> None:
    path = write("scene.block.at: {offset: {normal: [5, 0.1]}}")
    with pytest.raises(InvalidInput) as caught:
        load_task(path, sample=4)
    (finding,) = caught.value.findings
    assert re.match(r"'block' at \[5\.[^]]*\] m is not above 'table'", finding.message)
    assert finding.message.endswith("(sample 4)")
    assert finding.place is not None
    assert (finding.place.line, finding.place.column) == (12, 3)


OUT_OF_RANGE = (
    ("scene.block.friction: {uniform: [-1, 1]}", "scene.block.friction: must be at least 0, not -1.0 (a value that"),
    ("scene.block.mass: {choice: [1, 2, -3]}", "scene.block.mass: must be more than 0, not -3"),
    ("scene.peg.mass: {scale: {grid: [1, 0]}}", "scene.peg.mass: must be more than 0, not 0"),
    ("scene.peg.friction: {offset: {uniform: [-100, 0]}}", "scene.peg.friction: must be at least 0, not -"),
    ("robot.limits.panda_joint1.acceleration: {choice: [-1]}", "limits.panda_joint1.acceleration: must be more than 0"),
    ("controllers.arm_controller.gains.*.p: {offset: {uniform: [-1e6, 0]}}", "panda_joint7.p: must be at least 0"),
)  # fmt: skip


def test_what_a_field_refuses_of_a_law_is_told_before_anything_is_drawn(write: Callable[[str], Path]) -> None:
    told = _told(write("\n".join(line for line, _ in OUT_OF_RANGE)))
    for k, (_, message) in enumerate(OUT_OF_RANGE):
        assert any(one.startswith(f"{12 + k}: ") and message in one for one in told), (message, told)


def test_an_end_that_is_never_drawn_may_be_what_the_field_refuses(write: Callable[[str], Path]) -> None:
    load_task(write("scene.block.mass: {uniform: [0, 1 kg]}"), sample=0)


def test_a_task_that_does_not_vary_has_no_samples(tmp_path: Path) -> None:
    path = tmp_path / "task.yaml"
    path.write_text(TASK.replace("vary:\n", ""))
    with pytest.raises(InvalidInput, match="there is no sample 2: task 'varied' has no `vary:`"):
        load_task(path, sample=2)
