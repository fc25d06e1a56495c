"""`--engines` and `--check-step` of `run` and `test`, on real runs."""

from __future__ import annotations

import html
import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

RunCli = Callable[..., Any]

ROOT = Path(__file__).parents[2]
HEAD = f"""\
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
"""
WAIT = f"task: nod\n{HEAD}steps:\n  - wait: 0.2 s\nexpect:\n  - duration: {{below: 6 s}}\n"
BOUNCE = f"""\
task: bounce
{HEAD}simulation: {{settle: 0 s, mujoco: {{restitution: ignore}}}}
scene:
  plate: {{box: {{size: [0.3, 0.3, 0.1]}}, pose: {{xyz: [1, 0, 0.05]}}, fixed: true, restitution: 1}}
  ball: {{sphere: {{radius: 2 cm}}, mass: 50 g, pose: {{xyz: [1, 0, 0.42]}}, restitution: 0.7}}
steps:
  - wait: 0.3 s
  - wait: 0.2 s
    id: after
expect:
  - eventually: {{above: {{object: ball, of: plate, by: 5 cm}}}}
    during: after
    id: bounces
"""
"""A ball falls 0.3 m and rises again by 0.7^2 of that, 0.15 m, where the engine has a restitution."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "nod.yaml").write_text(WAIT)
    (tmp_path / "bounce.yaml").write_text(BOUNCE)
    return tmp_path


@pytest.mark.parametrize(
    ("words", "message", "hint"),
    [
        (["--engines", "pybullet,kinematik"], "unknown engine 'kinematik'", "did you mean 'kinematic'?"),
        (["--engines", "pybullet,pybullet"], "pybullet: given twice", "name each engine once"),
        (["--engines", "pybullet"], "one engine; there is nothing to compare", "add --check-step"),
        (["--engines", "pybullet,"], "--engines pybullet,: an engine has no name", "such as --engines pybullet,mujoco"),
        (["--engines", ""], "--engines '': no engine", "such as --engines pybullet,mujoco"),
        (["--engines", ","], "--engines ,: no engine", "such as --engines pybullet,mujoco"),
        (
            ["--engines", "pybullet,kinematic", "--set", "simulation.engine=pybullet"],
            "--set simulation.engine=pybullet: no effect with --engines",
            "remove one of the two",
        ),
    ],
)
@pytest.mark.parametrize("command", ["run", "test"])
def test_engines_that_cannot_be_compared(
    call_cli: RunCli, folder: Path, command: str, words: list[str], message: str, hint: str
) -> None:
    ran = call_cli(command, "nod.yaml", *words, cwd=folder)
    assert ran.code == 4
    assert message in ran.err
    assert hint in ran.err
    assert not (folder / "runs").exists()


@pytest.mark.parametrize("words", [["--log", "-"], ["--junit", "a.xml"]])
def test_outputs_of_one_run_are_refused(call_cli: RunCli, folder: Path, words: list[str]) -> None:
    ran = call_cli("run", "nod.yaml", "--check-step", *words, cwd=folder)
    assert ran.code == 4
    assert f"{' '.join(words[: 1 + (words[1] == '-')])}: no effect with --engines and --check-step" in ran.err


def test_runs_that_agree_pass_and_keep_their_logs(call_cli: RunCli, folder: Path) -> None:
    ran = call_cli("run", "nod.yaml", "--engines", "kinematic", "--check-step", cwd=folder)
    assert ran.code == 0, ran.err
    logs = sorted(path.name for path in (folder / "runs").iterdir())
    assert logs == ["nod@kinematic-half_step.mcap", "nod@kinematic.mcap"]
    *_, last = ran.out.splitlines()
    assert last == "✓ nod: kinematic and kinematic-half_step agree: all passed"
    steps = [" 0.5 ms " in line for line in ran.out.splitlines() if " runs/nod@" in line]
    assert steps == [False, True]


def test_json_has_every_number_of_every_run(call_cli: RunCli, folder: Path) -> None:
    words = ("--engines", "kinematic,pybullet", "--log", "x.mcap", "--format", "json")
    ran = call_cli("run", "nod.yaml", *words, cwd=folder)
    assert ran.code == 0
    made: dict[str, Any] = json.loads(ran.out)
    assert (made["verdict"], made["agrees"], made["compared"]) == ("passed", True, ["kinematic", "pybullet"])
    (margin,) = [row for row in made["numbers"] if row["kind"] == "margin"]
    assert margin["values"] == [run["expectations"][0]["margin"] for run in made["runs"]]
    assert [Path(run["log"]).name for run in made["runs"]] == ["x@kinematic.mcap", "x@pybullet.mcap"]
    again = call_cli("run", "nod.yaml", *words, cwd=folder)
    assert again.code == 4, "logs of --log are replaced only with --force"
    assert "run in " not in again.err, "nothing was run"
    assert call_cli("run", "nod.yaml", *words, "--force", cwd=folder).code == 0


def test_an_engine_without_restitution_disagrees(call_cli: RunCli, folder: Path) -> None:
    pytest.importorskip("mujoco")
    words = ("--engines", "pybullet,mujoco", "--report", "page.html")
    ran = call_cli("run", "bounce.yaml", *words, cwd=folder)
    assert ran.code == 1
    first = ran.out.splitlines()[0]
    assert first.startswith("✗ bounce.yaml:13:5: engines disagree: 'bounces' passed with ")
    # At rest, the gap is 0, less how far the ball sinks in (below 1 mm).
    assert re.search(r" to spare with pybullet, failed by 5[01]\.\d mm with mujoco$", first)
    assert "engines disagree: 'bounces'" in html.unescape((folder / "page.html").read_text("utf-8"))
    without = ("--set", "scene.ball.restitution=0", "--format", "json")
    made = json.loads(call_cli("run", "bounce.yaml", *words, *without, cwd=folder).out)
    assert (made["verdict"], made["agrees"]) == ("failed", True), "both fail"


def test_a_verdict_that_depends_on_the_step_fails(call_cli: RunCli, folder: Path) -> None:
    """Oracle: semi-implicit Euler falls g t (t + h) / 2 in t = n h, which is g t h / 2 too far: 2.0 mm at 0.399 s, the
    last tick of the step, with h = 1 ms, and 1.0 mm with h = 0.5 ms. The expectation allows 1.5 mm."""
    fall = 9.81 * 0.399**2 / 2.0
    (folder / "fall.yaml").write_text(
        f"task: fall\n{HEAD}simulation: {{settle: 0 s}}\n"
        "scene:\n  ball: {sphere: {radius: 2 cm}, mass: 50 g, pose: {xyz: [1, 0, 2]}}\n"
        "steps:\n  - wait: 0.4 s\n"
        f"expect:\n  - near: {{object: ball, to: [1, 0, {2.0 - fall}], within: 1.5 mm}}\n"
        "    at: wait_1\n    id: falls\n"
    )
    ran = call_cli("run", "fall.yaml", "--check-step", cwd=folder)
    assert ran.code == 1
    assert ran.out.splitlines()[0] == (
        "✗ fall.yaml:10:5: the verdict depends on the step: 'falls' failed by 0.46 mm with pybullet, "
        "passed with 0.52 mm to spare with pybullet-half_step"
    )


def test_an_engine_that_refuses_the_task_ends_before_any_run(call_cli: RunCli, folder: Path) -> None:
    pytest.importorskip("mujoco")
    words = ("--engines", "pybullet,mujoco", "--set", "simulation.mujoco.restitution=refuse")
    ran = call_cli("run", "bounce.yaml", *words, "--report", "page.html", cwd=folder)
    assert ran.code == 4
    assert "bounce.yaml:7:" in ran.err
    assert "restitution" in ran.err
    assert not (folder / "runs").exists()
    assert "restitution" in (folder / "page.html").read_text("utf-8")


@pytest.mark.usefixtures("runs_in_threads")
def test_tests_run_once_per_engine_and_compare(call_cli: RunCli, folder: Path) -> None:
    """kinematic has no physics: its verdict differs where a body is judged."""
    words = ("bounce.yaml", "--engines", "pybullet,kinematic", "-n", "2", "--junit", "j.xml")
    ran = call_cli("test", *words, "--format", "json", cwd=folder)
    assert ran.code == 1
    cases = {case["id"]: case for case in json.loads(ran.out)["cases"]}
    outcomes = {id_.partition("::")[2]: case["outcome"] for id_, case in cases.items()}
    assert outcomes == {
        "bounce[pybullet]": "passed", "bounce[kinematic]": "failed", "bounce[agreement]": "differs",
    }  # fmt: skip
    agreement = cases["bounce.yaml::bounce[agreement]"]
    assert (agreement["troubles"][0]["file"], agreement["troubles"][0]["line"]) == ("bounce.yaml", 13)
    assert agreement["agreement"]["compared"] == ["pybullet", "kinematic"]
    failed = [
        case.get("name") for case in ET.parse(folder / "j.xml").iter("testcase") if case.find("failure") is not None
    ]
    assert sorted(map(str, failed)) == ["bounce[agreement]", "bounce[kinematic]"]

    # Only what failed, once more: the agreement runs what it compares.
    ran = call_cli("test", *words[:3], "-n", "2", "--lf", "-k", "agreement", cwd=folder)
    assert ran.code == 1
    (line,) = (line for line in ran.out.splitlines() if line.startswith("✗ differs"))
    assert line.split()[2] == "bounce.yaml::bounce[agreement]"
    assert "1 differs in" in ran.out


@pytest.mark.usefixtures("runs_in_threads")
def test_one_engine_of_a_test_is_selected_by_its_id(call_cli: RunCli, folder: Path) -> None:
    words = ("--engines", "pybullet,kinematic", "-n", "1")
    ran = call_cli("test", "nod.yaml::nod[kinematic]", *words, cwd=folder)
    assert ran.code == 0
    assert "1 passed in" in ran.out
    ran = call_cli("test", "nod.yaml", *words, "-k", "engine_kinematic", cwd=folder)
    assert "1 passed in" in ran.out
