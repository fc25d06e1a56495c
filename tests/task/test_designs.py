"""Designs: the points of each are those that its definition promises, and the values are quantiles."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.stats import qmc

from manipcli.core.errors import InvalidInput
from manipcli.judge.drawn import Drawn, Number
from manipcli.task.designs import Design, draw
from manipcli.task.vary import Law, Varied

MASS = Varied("m", "scene.cup.mass", "TASK", ("scene", "cup", "mass"), (0.2,), False, False, "",
              Law("uniform", ((0.1,), (0.3,)), False))  # fmt: skip
AT = Varied("a", "scene.cup.at", "TASK", ("scene", "cup", "at"), (0.5, 0.0), True, False, "offset",
            Law("uniform", ((-0.02, -0.04), (0.02, 0.04)), False))  # fmt: skip
GRIP = Varied("f", "scene.cup.friction", "TASK", ("scene", "cup", "friction"), (0.5,), False, False, "",
              Law("choice", ((0.3,), (0.5,), (0.9,)), False))  # fmt: skip
LATE = Varied("l", "robot.actuators.a.latency", "ROBOT", ("actuators", "a", "latency"), (1,), False, True, "",
              Law("uniform", ((1,), (4,)), False))  # fmt: skip
GAIN = Varied("g", "controllers.c.gains.j.p", "CTRL", ("controllers", "c", "gains", "j", "p"), (80.0,), False, False,
              "scale", Law("normal", ((1.0,), (0.1,)), False, ((0.0, np.inf),)))  # fmt: skip


def values(varied: list[Varied], design: str, seed: int = 3) -> list[dict[str, Number]]:
    read = Design.read(design)
    return [dict(draw(varied, seed, k, read).values) for k in range(read.total(varied) or read.count)]


def unit(varied: list[Varied], design: str, seed: int = 3) -> np.ndarray:
    """The points (N, d), from values of quantities that are all uniform."""
    rows = []
    for found in values(varied, design, seed):
        row: list[float] = []
        for quantity in varied:
            drawn = np.atleast_1d(found[quantity.path]) - (np.array(quantity.nominal) if quantity.how else 0.0)
            least, most = map(np.array, quantity.law.rows)
            row += [*((drawn - least) / (most - least))]
        rows.append(row)
    return np.array(rows)


@pytest.mark.parametrize("count", [7, 64])
def test_latin_hypercube_has_one_sample_in_each_interval_of_each_dimension(count: int) -> None:
    points = unit([MASS, AT], f"lhs:{count}")
    for column in points.T:
        assert sorted(np.floor(column * count).astype(int)) == [*range(count)]
    assert abs(np.corrcoef(points.T) - np.eye(3)).max() < (0.9 if count == 7 else 0.35)


def test_sobol_points_are_a_net_and_less_discrepant_than_random_ones() -> None:
    points = unit([MASS, AT], "sobol:256")
    for column in points.T:
        assert sorted(np.floor(column * 256).astype(int)) == [*range(256)]
    for a, b in ((0, 1), (0, 2), (1, 2)):  # each of the first two pairs of Sobol's dimensions is a (1, 8, 2) net
        boxes = Counter(zip(*np.floor(points[:, [a, b]] * 8).astype(int).T, strict=True))
        assert set(boxes.values()) == {4}
    random = np.random.default_rng(0).random((256, 3))
    assert qmc.discrepancy(points) < 0.2 * qmc.discrepancy(random)
    assert not np.array_equal(points, unit([MASS, AT], "sobol:256", seed=4))


def test_a_grid_has_every_combination_once_and_ends_at_the_ends() -> None:
    found = values([MASS, GRIP], "grid:16")
    expected = product(np.linspace(0.1, 0.3, 5), (0.3, 0.5, 0.9))
    assert np.array([[*row.values()] for row in found]) == pytest.approx(np.array([*expected]))
    assert Counter(row["robot.actuators.a.latency"] for row in values([LATE], "grid:4")) == {1: 1, 2: 1, 3: 1, 4: 1}


def test_one_at_a_time_changes_one_number_and_leaves_the_others_as_written() -> None:
    found = values([AT, LATE, GAIN], "oat:21")
    assert found[0] == {}
    at, late, gain = found[1:11], found[11:15], found[15:]
    x, y = np.array([row["scene.cup.at"] for row in at]).T
    assert x[:5] == pytest.approx(np.linspace(0.48, 0.52, 5))
    assert y[5:] == pytest.approx(np.linspace(-0.04, 0.04, 5))
    assert not y[:5].any()
    assert (x[5:] == 0.5).all()
    assert [row["robot.actuators.a.latency"] for row in late] == [1, 2, 3, 4]
    gains = np.array([row["controllers.c.gains.j.p"] for row in gain])
    assert gains[2] == pytest.approx(80.0)
    assert gains + gains[::-1] == pytest.approx(160.0)  # quantiles of a normal distribution are symmetric
    assert all(len(row) == 1 for row in found[1:])


def test_saltelli_has_a_b_and_a_with_each_column_of_b() -> None:
    points = unit([MASS, AT], "saltelli:32").reshape(32, 5, 3)
    a, b = points[:, 0], points[:, 1]
    for j in range(3):
        mixed = a.copy()
        mixed[:, j] = b[:, j]
        assert np.allclose(points[:, 2 + j], mixed, atol=1e-12)
    assert qmc.discrepancy(np.hstack([a, b])) < 0.5 * qmc.discrepancy(np.random.default_rng(0).random((32, 6)))


def test_a_number_with_one_value_is_not_a_dimension() -> None:
    fixed = replace(AT, path="scene.cup.pose.xyz", law=Law("uniform", ((-0.02, 0.0), (0.02, 0.0)), False))
    assert Design("saltelli", 8).total([fixed, MASS]) == 8 * (2 + 2)
    found = values([fixed, MASS], "sobol:8")
    assert {at[1] for row in found if isinstance(at := row["scene.cup.pose.xyz"], tuple)} == {0.0}
    assert len({row["scene.cup.mass"] for row in found}) == 8


def test_a_sample_is_the_same_alone_and_says_its_design() -> None:
    assert draw([MASS, AT], 3, 200, Design.read("sobol:256")) == draw([MASS, AT], 3, 200, Design("sobol", 256))
    drawn = draw([MASS], 3, 5, Design.read("lhs:8"))
    assert str(drawn).startswith("sample 5 of lhs:8: scene.cup.mass=")
    assert Drawn.from_metadata(drawn.to_metadata()) == drawn
    assert "design" not in draw([MASS], 3, 5).to_metadata()


@pytest.mark.parametrize(
    ("design", "cause"),
    [
        ("sobl:8", "'sobl:8' is not a design"), ("sobol", "is not a design"), ("random:5", "is not a design"),
        ("lhs:0", "N of 'lhs' is 0; expected 1 to 16777216"), ("saltelli:48", "expected a power of two"),
        ("lhs:²", "is not a design"), ("sobol:16777217", "expected 1 to 16777216"),
        ("grid:5", "has at least 6 samples; N is 5"), ("oat:2", "has at least 3 samples; N is 2"),
    ],
)  # fmt: skip
def test_what_is_not_a_design_is_refused(design: str, cause: str) -> None:
    with pytest.raises(InvalidInput, match=cause):
        Design.read(design).total([MASS, GRIP])


def test_a_design_ends() -> None:
    with pytest.raises(IndexError, match="has samples 0 to 7"):
        draw([MASS], 3, 8, Design("lhs", 8))
