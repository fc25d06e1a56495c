"""`manipcli tune`: a table, JSON, a figure and a file; and what it will not do."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from manipcli.cli.app import main

ROOT = Path(__file__).parents[2]
FILES = [str(ROOT / "robots" / "arm7_hand3" / "robot.yaml"), str(ROOT / "controllers" / "arm7_hand3.yaml")]
ONE = ["--joint", "joint_6"]


def test_the_table_names_the_joint_and_says_what_its_numbers_are(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tune", *FILES, *ONE]) == 0
    out = capsys.readouterr().out
    assert "gains for 5 Hz and a damping ratio of 1, at a control period of 1 ms" in out
    (row,) = [line for line in out.splitlines() if line.startswith("joint_6 ")]
    head = next(line for line in out.splitlines() if line.startswith("joint "))
    there = head.index("frequency")
    assert row[there : there + len("frequency")].strip() == "5 Hz"  # as --bandwidth asks; with damping 1 it is
    assert row[there + len("frequency") :].split()[0] == "3.2"  # 5 Hz sqrt(sqrt(2) - 1), where |H| is 1 / sqrt 2
    assert " ms " in row
    assert row.endswith("nothing")  # limits it
    assert "for each joint alone" in out


@pytest.mark.slow
def test_json_a_figure_and_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    figure, file = tmp_path / "step.svg", tmp_path / "tuned.yaml"
    wanted = ["--bandwidth", "8 Hz", "--damping", "0.8", "--period", "2ms", "--format", "json"]
    assert main(["tune", *FILES, *ONE, *wanted, "-o", str(figure), "--write", str(file)]) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["bandwidth"], said["damping"], said["period"]) == (8.0, 0.8, 0.002)
    (joint,) = said["joints"]
    assert joint["joint"] == "joint_6"
    assert joint["margin"] >= 2.0
    assert joint["simulated"] is None
    assert b"<svg" in figure.read_bytes()
    text = file.read_text()
    assert f"joint_6: {{p: {joint['p']}, d: {joint['d']}}}" in text
    assert "joint_7: {p: 30.0, d: 0.4}" in text
    assert main(["check", str(file)]) == 0


def test_no_file_is_replaced_unasked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text("mine")
    assert main(["tune", *FILES, *ONE, "--write", str(file)]) == 4
    assert "--force" in capsys.readouterr().err
    assert file.read_text() == "mine"
    assert main(["tune", *FILES, *ONE, "--write", str(file), "--force"]) == 0
    assert file.read_text() != "mine"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--joint", "joint_8"], "'joint_8' has no loop to propose gains for"),
        (["--bandwidth", "fast"], "'fast'"),
        (["--bandwidth", "-3"], "is not a frequency above 0"),
        (["--period", "2 m"], "'2 m' is a length"),
        (["--period", "0"], "expected 1 us to 1 s"),
        (["-o", "step.gif"], "is not a figure: use"),
    ],
)
def test_what_cannot_be_is_told(words: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tune", *FILES, *words]) == 4
    assert told in capsys.readouterr().err
