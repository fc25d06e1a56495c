"""docs/reference/json.md names the keys that programs get, all of them and no others."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from manipcli.cli.app import main
from manipcli.core.errors import Diagnostic, Loc, Place
from manipcli.core.refused_candidates import RefusedCandidates
from manipcli.judge.agreement import compare
from manipcli.judge.drawn import Drawn
from manipcli.judge.measured_run import MeasuredRun, Variant
from manipcli.judge.saturations import Saturations
from manipcli.judge.verdict import Attempt, BlockOutcome, ExpectationOutcome, StepOutcome, Verdict
from manipcli.logs import plot as chart
from manipcli.model.hand.tool_hand import tool_hand
from manipcli.report.agreement.agreement_json import render_json
from manipcli.report.agreement.compared_runs import ComparedRuns
from manipcli.report.json import render_findings, render_run
from manipcli.report.run_report import RunReport, Timing
from manipcli.report.suite.suite import Case, CaseReport, Suite, Trouble
from manipcli.report.suite.suite_json import render_suite
from manipcli.report.tool_hand import tool_object
from manipcli.task.load_view import load_sight

DOCS = Path(__file__).parents[2] / "docs" / "reference" / "json.md"
STEP = StepOutcome("pick_1", "pick", "done", 0.0, 6.1, 5.9, attempts=(Attempt("done", 0.0, 6.1),))
NEAR = ExpectationOutcome("near", "failed", -0.01, "m", 20.1, relative=-0.5)
WRONG = Diagnostic("TASK201", "unknown key", Place("a.yaml", 3, 5))
VERDICT = Verdict(
    "pour", "failed", 7, "pybullet", 0.3, (STEP,), (NEAR,), errors=(WRONG,),
    candidates=(RefusedCandidates("pick_1", "reach", 2, "reach: too far", ("yaw 15",)),),
    blocks=(BlockOutcome("if_1", "if", 0, 1, None, "done", 0.0, 6.1, 1, "then"),), implied=(NEAR,),
    drawn=Drawn(3, (("scene.cup.mass", 0.25),)), saturations=Saturations({"joint_1": 3}, {"motor_1": 2}),
)  # fmt: skip
RUN = RunReport(VERDICT, Timing(0.1, 0.2, 2.5, 0.2), "runs/pour.mcap")
CASE = CaseReport(
    Case("a.yaml", "a"), "failed", 1.0, "", run=RUN, warnings=(WRONG,), troubles=(Trouble("x", Place("a.yaml", 1, 1)),)
)
OBJECTS = {
    "sample", "timing", "steps", "blocks", "steps.attempts", "saturated", "expectations", "implied", "errors",
    "cases", "cases.tightest", "cases.troubles", "logs", "logs.fields",
    "findings", "disagreements", "numbers", "motions", "motions.limited_by", "motions.clearance", "motions.bound_by",
    "motions.margins", "motions.manipulability", "candidates", "pairs", "grasps",
    "tool", "tool.hand", "tool.hand.tips", "tool.hand.poses",
}  # fmt: skip
"""Their rows tell of keys, those of others of values."""
BY_NAME = {"values", "joints", "actuators", "limits"}
"""Their keys are names of the task."""


def _rows() -> Iterator[list[tuple[str, str]]]:
    """The cells of each table."""
    for table in re.findall(r"(?:^\|.*\n)+", DOCS.read_text("utf-8"), re.MULTILINE):
        lines = [line.strip("|\n ").split(" | ", 1) for line in table.splitlines()[2:]]
        yield [(first, second) for first, second in lines]


def _documented(rows: list[tuple[str, str]]) -> Iterator[str]:
    """`steps`, `steps.id`: what stands in brackets only explains, and so do values."""
    for first, second in rows:
        names = [name.replace("[]", "") for name in re.findall(r"`([^`]+)`", first)]
        yield from names
        if names[0] in OBJECTS:
            yield from (f"{names[0]}.{word}" for word in re.findall(r"`(\w+)`", re.sub(r"\([^()]*\)", "", second)))


def _written(value: Any, path: str = "") -> Iterator[str]:
    if isinstance(value, list):
        for one in value:
            yield from _written(one, path)
    elif isinstance(value, dict) and path.rpartition(".")[2] not in BY_NAME:
        for key, one in value.items():
            name = f"{path}.{key}".lstrip(".")
            yield name
            yield from _written(one, name)


@pytest.mark.parametrize("which", [0, 1])
def test_keys_are_those_that_are_written(which: int) -> None:
    text = render_run(RUN) if which == 0 else render_suite(Suite((CASE,), 1, 1, 1.0))
    elsewhere = ("cases.run.", "cases.warnings.")
    written = {one for one in _written(json.loads(text)) if not one.startswith(elsewhere)}
    assert set(_documented(list(_rows())[which])) == written


def test_keys_of_compared_runs() -> None:
    place: dict[Loc, Place] = {("judged", 0): Place("a.yaml", 9, 5)}
    failed = MeasuredRun(Variant("pybullet"), VERDICT, 1e-3, 3.0, log="a.mcap", forces={"pick_1": 20.0}, places=place)
    passed = replace(NEAR, outcome="passed", margin=0.01)
    other = MeasuredRun(Variant("mujoco"), replace(VERDICT, expectations=(passed,)), 1e-3, 1.0, log="b.mcap")
    compared = ComparedRuns(compare([failed, other]), (RUN, RUN))
    written = {one for one in _written(json.loads(render_json(compared))) if not one.startswith("runs.")}
    assert set(_documented(list(_rows())[5])) == written


def test_keys_of_what_can_be_plotted(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    line = chart.FieldLine("joint_states.position", "sensor_msgs/msg/JointState", 3)
    monkeypatch.setattr(chart, "field_lines", lambda _: (line,))
    assert main(["plot", "a.mcap", "--fields", "--format", "json"]) == 0
    assert set(_documented(list(_rows())[2])) == set(_written(json.loads(capsys.readouterr().out)))


def test_keys_of_what_is_checked() -> None:
    robot = load_sight(DOCS.parents[2] / "robots" / "panda" / "robot.yaml").robot
    tool = tool_object(robot.tool, tool_hand(robot))
    text = render_findings([WRONG], ["a.yaml"], more={"tool": tool})
    assert set(_documented(list(_rows())[3])) == set(_written(json.loads(text)))


@pytest.mark.slow
def test_keys_of_the_self_collision_matrix(capsys: pytest.CaptureFixture[str]) -> None:
    robot = DOCS.parents[2] / "robots" / "differential_wrist" / "robot.yaml"
    assert main(["check", str(robot), "--collisions", "--format", "json"]) == 0
    assert set(_documented(list(_rows())[6])) == set(_written(json.loads(capsys.readouterr().out)))


def test_keys_of_what_is_planned(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", str(DOCS.parents[2] / "examples" / "02_pick_a_block" / "task.yaml"), "--format", "json"]) == 0
    assert set(_documented(list(_rows())[4])) == set(_written(json.loads(capsys.readouterr().out)))
