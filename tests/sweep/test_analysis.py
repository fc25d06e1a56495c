"""What a sweep says of its numbers, through the designs: against closed forms, and against results that are chance."""

from __future__ import annotations

import math
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from manipcli.batch.job import Settings
from manipcli.sweep.analysis import Analysis
from manipcli.sweep.results import Margin, SampleResult
from manipcli.sweep.sampling import Sampling
from manipcli.sweep.statistics import Rate
from manipcli.sweep.sweep import Sweep
from manipcli.sweep.text import render_json, render_text

ROOT = Path(__file__).parents[2]
TASK = f"""\
task: cube
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
simulation: {{engine: kinematic}}
scene: {{block: {{box: {{size: [5 cm, 5 cm, 5 cm]}}, fixed: true, pose: {{xyz: [9, 9, 9]}}}}}}
steps: [{{wait: 50 ms}}]
vary: {{scene.block.pose.xyz: {{offset: {{uniform: ["-{math.pi} m", "{math.pi} m"]}}}}}}
"""


def cube(folder: Path, design: str) -> Sampling:
    """Samples of three numbers in [-pi, pi] about 9."""
    path = folder / "cube.yaml"
    path.write_text(TASK)
    return Sampling(path, Settings(design=design))


def result(number: int, margin: float, *, passed: bool) -> SampleResult:
    found = Margin("f", "m", margin, margin, missed=not passed)
    return SampleResult(number, "passed" if passed else "failed", margins=(found,))


def test_indices_of_ishigamis_function_through_design_and_analysis(tmp_path: Path) -> None:
    """f = sin x0 + 7 sin^2 x1 + 0.1 x2^4 sin x0 (Ishigami and Homma 1990), as the margin of a sweep."""
    sampling = cube(tmp_path, "saltelli:512")
    assert sampling.total == 512 * 5
    results = []
    for number in range(512 * 5):
        x, y, z = (value - 9.0 for value in sampling.values(number))
        margin = (math.sin(x) + 7.0 * math.sin(y) ** 2 + 0.1 * z**4 * math.sin(x)) / 20.0  # within +-1 tolerance
        results.append(result(number, margin, passed=margin >= 0.0))
    analysis = Analysis(Sweep(sampling, tuple(results), len(results), "", 0.0, 0))
    of_x, of_xz = 0.5 * (1.0 + 0.1 * math.pi**4 / 5.0) ** 2, 8.0 * 0.01 * math.pi**8 / 225.0
    whole = 49.0 / 8.0 + of_x + of_xz
    first = {"0": of_x / whole, "1": 49.0 / 8.0 / whole, "2": 0.0}
    total = {"0": (of_x + of_xz) / whole, "1": 49.0 / 8.0 / whole, "2": of_xz / whole}
    assert [influence.column.name[-1] for influence in analysis.influences] == ["0", "1", "2"]
    for influence in analysis.influences:
        assert influence.indices is not None
        k = influence.column.name[-1]
        assert influence.indices.first.value == pytest.approx(first[k], abs=0.03)
        assert influence.indices.whole.value == pytest.approx(total[k], abs=0.03)
    assert "95 % interval" not in render_text(analysis).splitlines()[0]  # repeated numbers: no interval of the rate
    assert '"interval": null' in render_json(analysis)


def test_where_no_number_matters_one_is_marked_in_at_most_5_percent_of_sweeps(tmp_path: Path) -> None:
    sampling = cube(tmp_path, "")
    sampling.values = cache(sampling.values)  # type: ignore[method-assign]
    rng = np.random.default_rng(7)
    marked = 0
    for _ in range(1000):
        margins, passed = rng.random(40), rng.random(40) < 0.6
        results = tuple(result(k, margins[k], passed=bool(passed[k])) for k in range(40))
        found = Analysis(Sweep(sampling, results, 40, "", 0.0, 0)).influences
        marked += any(influence.matters for influence in found)
    assert marked / 1000 < 0.05 + 3.0 * math.sqrt(0.05 * 0.95 / 1000)
    assert marked > 0


@pytest.mark.parametrize(("design", "has"), [("", True), ("lhs:16", True), ("sobol:16", True), ("grid:16", False),
                                             ("oat:16", False)])  # fmt: skip
def test_only_samples_spread_over_the_distributions_have_an_interval(tmp_path: Path, design: str, has: bool) -> None:
    sampling = cube(tmp_path, design)
    results = tuple(result(k, 1.0, passed=k > 3) for k in range(8))
    swept = Sweep(sampling, results, 8, "", 0.0, 0)
    assert swept.interval == (Rate(4, 8).interval if has else None)


def test_one_at_a_time_shows_how_far_each_number_can_go(tmp_path: Path) -> None:
    """Levels at -pi, -pi/2, 0, pi/2 and pi; the second number fails at -pi/2 and passes beyond."""
    sampling = cube(tmp_path, "oat:16")
    results = []
    for number in range(16):
        x, y, z = (value - 9.0 for value in sampling.values(number))
        margin = min(2.0 - x, 1.0 + y if y > -2.0 else 9.0, math.inf if z == 0.0 else 0.5)
        results.append(result(number, margin, passed=margin >= 0.0))
    analysis = Analysis(Sweep(sampling, tuple(results), 16, "", 0.0, 0))
    found = {one.column.name[-1]: one.levels for one in analysis.influences if one.levels is not None}
    passes = {k: [value - 9.0 for value in one.passes or ()] for k, one in found.items()}
    assert passes == {
        "0": pytest.approx([-math.pi, math.pi / 2.0]), "1": pytest.approx([0.0, math.pi]),
        "2": pytest.approx([-math.pi, math.pi]),
    }  # fmt: skip
    assert {k: one.smallest for k, one in found.items()} == {
        "0": pytest.approx(2.0 - math.pi), "1": pytest.approx(1.0 - math.pi / 2.0), "2": 0.5,
    }  # fmt: skip
    assert [one.column.name[-1] for one in analysis.influences] == ["0", "1", "2"]
    text = render_text(analysis)
    assert re.search(r"pose.xyz.0 +9 m +5.858 m to 12.14 m +5.858 m to 10.57 m +−1.14 +12.14 m", text)
    assert re.search(r"pose.xyz.2 .* all ", text)
    broken = Analysis(Sweep(sampling, (result(0, -1.0, passed=False), *results[1:]), 16, "", 0.0, 0))
    assert [one.levels.passes for one in broken.influences if one.levels is not None] == [None] * 3


def test_where_all_results_are_equal_nothing_is_said_of_the_numbers(tmp_path: Path) -> None:
    sampling = cube(tmp_path, "")
    crashed = tuple(SampleResult(k, "crashed", "crashed by signal 11") for k in range(6))
    for results in (crashed, tuple(result(k, 1.0, passed=True) for k in range(6))):
        text = render_text(Analysis(Sweep(sampling, results, 6, "", 0.0, 0)))
        assert "which number matters cannot be seen" in text
        assert "rank correlation" not in text
        assert ("expectation " in text) == (results is not crashed)
