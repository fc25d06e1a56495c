"""Comparison of two sweeps: the same samples are paired, and only a significant loss is worse."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from scipy import stats

from manipcli.core.errors import ExitCode, InvalidInput
from manipcli.sweep.compare import compare_sweeps, render_json, render_text
from manipcli.sweep.table import FIXED
from tests.conftest import RunCli

HEAD = ",".join([*FIXED, "margin near [m]", "scene.cup.mass"])


def written(path: Path, passed: list[bool], *, margin: float = 0.01, mass: float = 0.1, first: int = 0) -> Path:
    rows = []
    for k, good in enumerate(passed, first):
        least = margin / 0.02 if good else ""
        rows.append(f"{k},{'passed' if good else 'failed'},,,1.0,{least},{margin + 1e-4 * (k % 3)!r},{mass + k!r}")
    path.write_text("\n".join([HEAD, *rows]) + "\n")
    return path


@pytest.mark.parametrize(("worse", "better"), [(0, 0), (5, 0), (6, 0), (12, 3), (3, 12), (9, 9)])
def test_a_significant_loss_is_worse_and_nothing_else(tmp_path: Path, worse: int, better: int) -> None:
    before = [True] * worse + [False] * better + [True] * 30
    after = [False] * worse + [True] * better + [True] * 30
    found = compare_sweeps(written(tmp_path / "a", before), written(tmp_path / "b", after), alpha=0.05)
    p = stats.binomtest(worse, worse + better).pvalue if worse + better else 1.0
    assert found.p == pytest.approx(p)
    assert found.is_worse == (p < 0.05 and worse > better)
    assert found.worse == tuple(range(worse))
    assert found.better == tuple(range(worse, worse + better))
    assert json.loads(render_json(found))["result"] in ("worse", "better", "same")


def test_a_smaller_margin_is_told_and_counts_where_it_is_asked_for(tmp_path: Path) -> None:
    a, b = written(tmp_path / "a", [True] * 20), written(tmp_path / "b", [True] * 20, margin=0.007)
    found = compare_sweeps(a, b, alpha=0.05)
    assert found.exit_code == ExitCode.PASSED
    assert found.shifts["margin near [m]"].median == pytest.approx(-0.003)
    assert found.smaller == ("smallest_margin", "margin near [m]")
    assert "−3.0 mm" in render_text(found)
    assert compare_sweeps(a, b, alpha=0.05, with_margins=True).exit_code == ExitCode.FAILED
    assert compare_sweeps(b, a, alpha=0.05, with_margins=True).exit_code == ExitCode.PASSED


def test_only_the_same_samples_are_compared(tmp_path: Path, call_cli: RunCli) -> None:
    a = written(tmp_path / "a.csv", [True] * 10)
    longer = written(tmp_path / "b.csv", [True] * 10 + [False] * 20)
    assert compare_sweeps(a, longer, alpha=0.05).alone == 20
    other = written(tmp_path / "c.csv", [True] * 10, mass=0.2)
    ran = call_cli("sweep", "a.csv", "c.csv", cwd=tmp_path)
    assert ran.code == ExitCode.USAGE
    assert "'scene.cup.mass' is 0.1 and 0.2 in sample 0" in ran.err
    with pytest.raises(InvalidInput, match="no sample in common"):
        compare_sweeps(a, written(tmp_path / "d.csv", [True], first=50), alpha=0.05)
    assert other.exists()


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ("a,b\n", "a.csv:1:1: .*not the CSV of a sweep"),
        ("", "a.csv:1:1: .*expected the columns sample, outcome"),
        (f"{HEAD}\n1,passed\n", "a.csv:2:1: .*2 cells, expected 8; the file may be cut off"),
        (f"{HEAD}\n1,passed,,,1.0,high,0.1,0.1\n", "a.csv:2:1: .*'high' is not a number, in column 'smallest_margin'"),
        (f"{HEAD}\n1,passed,,,1.0,0.1,nan,0.1\n", "'nan' is not a number, in column 'margin near .m.'"),
        (f"{HEAD}\n1,passed,,,1.0,0.1,0.1,1e999\n", "'1e999' is not a number, in column 'scene.cup.mass'"),
        (f"{HEAD}\n1,PASSED,,,1.0,0.1,0.1,0.1\n", "'PASSED' is not an outcome, expected 'passed', 'failed'"),
        (f"{HEAD}\n-1,passed,,,1.0,0.1,0.1,0.1\n", "'-1' is not the number of a sample"),
        (f"{HEAD}\n" + "1,passed,,,1.0,0.1,0.1,0.1\n" * 2, "a.csv:3:1: .*sample 1 is there twice"),
        (f"{HEAD},scene.cup.mass\n", "two columns 'scene.cup.mass'"),
    ],
)  # fmt: skip
def test_what_is_not_the_csv_of_a_sweep_is_told_at_its_line(tmp_path: Path, text: str, cause: str) -> None:
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(InvalidInput, match=cause):
        compare_sweeps(tmp_path / "a.csv", written(tmp_path / "b.csv", [True]), alpha=0.05)


def test_differences_of_rounding_are_no_change(tmp_path: Path) -> None:
    a, b = written(tmp_path / "a", [True] * 20), written(tmp_path / "b", [True] * 20, margin=0.01 * (1.0 - 1e-9))
    found = compare_sweeps(a, b, alpha=0.05, with_margins=True)
    assert {(of.less, of.more, of.p) for of in found.shifts.values()} == {(0, 0, 1.0)}
    assert found.exit_code == ExitCode.PASSED


def test_margins_keep_the_order_of_their_columns_where_the_first_sample_has_none(tmp_path: Path) -> None:
    a, b = written(tmp_path / "a", [False, True]), written(tmp_path / "b", [False, True])
    assert [*compare_sweeps(a, b, alpha=0.05).shifts] == ["smallest_margin", "margin near [m]"]


def test_names_of_a_file_reach_a_terminal_escaped(tmp_path: Path) -> None:
    a = written(tmp_path / "a", [True] * 3)
    a.write_text(a.read_text().replace("near", "\x1b[31mnear"))
    assert "\\x1b[31mnear" in render_text(compare_sweeps(a, a, alpha=0.05))


def test_an_option_of_the_other_form_is_refused(tmp_path: Path, call_cli: RunCli) -> None:
    written(tmp_path / "a.csv", [True] * 3)
    ran = call_cli("sweep", "a.csv", "a.csv", "--html", "page.html", "--samples", "3", cwd=tmp_path)
    assert ran.code == ExitCode.USAGE
    assert "a comparison of two sweeps has no --samples and no --html" in ran.err
    ran = call_cli("sweep", "task.yaml", "--margins", cwd=tmp_path)
    assert ran.code == ExitCode.USAGE
    assert "a sweep of a task has no --margins" in ran.err
