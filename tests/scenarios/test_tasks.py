"""The tasks of the repository as a user runs them: one command, and its log judged again."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
TASKS = ROOT / "tasks"
NAMES = {
    "task", "verdict", "seed", "engine", "simulated_time", "wall_time", "real_time_factor", "log", "timing", "steps",
    "saturated", "expectations", "errors",
}  # fmt: skip


def one_object(text: str) -> dict[str, Any]:
    """stdout as the one JSON object that it must be, and nothing else."""
    answer, end = json.JSONDecoder().raw_decode(text)
    assert text[end:].strip() == ""
    assert isinstance(answer, dict)
    return answer


def without_places(answer: dict[str, Any]) -> dict[str, Any]:
    """What a verdict says, without where and how fast."""
    return {
        key: value for key, value in answer.items() if key not in ("log", "wall_time", "real_time_factor", "timing")
    }


@pytest.mark.parametrize("task", ["home", "pick_place"])  # `.ci/run` runs all of them, twice
def test_every_task_passes(call_cli: Any, tmp_path: Path, task: str) -> None:
    ran = call_cli("run", TASKS / f"{task}.yaml", cwd=tmp_path)
    assert ran.code == 0, ran
    assert f"✓ {task} passed" in ran.out
    assert (tmp_path / "runs" / f"{task}.mcap").is_file()
    assert not list(tmp_path.rglob("*.partial"))


def test_json_is_one_object_with_every_documented_name(pour_run: Any) -> None:
    answer = one_object(pour_run.ran.out)
    assert set(answer) >= NAMES
    assert (answer["task"], answer["verdict"], answer["seed"], answer["engine"]) == ("pour", "passed", 1, "pybullet")
    assert set(answer["timing"]) == {"load", "plan", "simulate", "judge"}
    assert sum(answer["timing"].values()) == pytest.approx(answer["wall_time"], rel=0.05)
    assert answer["simulated_time"] < 60.0
    simulated = answer["simulated_time"] / answer["timing"]["simulate"]
    assert answer["real_time_factor"] == pytest.approx(simulated, rel=0.05)
    assert answer["errors"] == []
    for step in answer["steps"]:
        assert set(step) >= {"id", "verb", "outcome", "started", "ended", "planned_duration"}
        assert step["outcome"] == "done"
        assert step["started"] <= step["ended"]
    assert [step["verb"] for step in answer["steps"]] == ["pick", "lift", "pour", "place", "move", "wait"]
    for expectation in answer["expectations"]:
        assert set(expectation) >= {"name", "outcome", "margin", "unit", "at"}
        assert expectation["outcome"] == "passed"
        assert expectation["margin"] >= 0.0


def test_progress_goes_to_stderr_and_no_banner_anywhere(pour_run: Any) -> None:
    ids = ["pick_1", "lift_1", "pour_1", "place_1", "move_1", "wait_1"]
    planned, lines = (pour_run.ran.err.splitlines()[part] for part in (slice(6), slice(6, None)))
    assert planned == [f"planning step {k} of 6, '{one}'" for k, one in enumerate(ids, start=1)]
    assert [line.split(" (")[0] for line in lines] == [
        "[1/6] pick_1: done", "[2/6] lift_1: done", "[3/6] pour_1: done", "[4/6] place_1: done", "[5/6] move_1: done",
        "[6/6] wait_1: done",
    ]  # fmt: skip


def test_no_name_of_this_machine_is_in_the_log(pour_run: Any) -> None:
    from mcap.reader import make_reader

    forbidden = [str(ROOT), str(Path.home()), str(pour_run.log.parent)]
    with pour_run.log.open("rb") as stream:
        reader = make_reader(stream)
        texts = [attachment.data for attachment in reader.iter_attachments()]
        texts += [json.dumps(one.metadata).encode() for one in reader.iter_metadata()]
        texts += [message.data for _, channel, message in reader.iter_messages() if "tf" not in channel.topic]
    for text in texts:
        for word in forbidden:
            assert word.encode() not in text


def test_the_log_alone_gives_the_same_verdict(pour_run: Any, call_cli: Any, tmp_path: Path) -> None:
    moved = tmp_path / "elsewhere" / "x.mcap"
    moved.parent.mkdir()
    shutil.copy(pour_run.log, moved)
    ran = call_cli("judge", moved, "--format", "json", cwd=moved.parent)
    assert ran.code == 0
    assert without_places(one_object(ran.out)) == without_places(one_object(pour_run.ran.out))


def test_a_log_is_judged_when_its_sources_are_gone(call_cli: Any, tmp_path: Path) -> None:
    project = tmp_path / "project"
    for folder in ("tasks", "robots", "controllers"):
        shutil.copytree(ROOT / folder, project / folder)
    log = tmp_path / "home.mcap"
    ran = call_cli("run", project / "tasks" / "home.yaml", "--format", "json", "--log", log, cwd=tmp_path)
    shutil.rmtree(project)
    judged = call_cli("judge", log, "--format", "json", cwd=tmp_path)
    assert (ran.code, judged.code) == (0, 0)
    assert without_places(one_object(judged.out)) == without_places(one_object(ran.out))


def test_without_physics_the_steps_are_done_and_objects_not_judged(call_cli: Any, tmp_path: Path) -> None:
    words = ("--set", "simulation.engine=kinematic", "--format", "json", "-q")
    ran = call_cli("run", TASKS / "pour.yaml", *words, cwd=tmp_path)
    answer = one_object(ran.out)
    assert (ran.code, answer["verdict"], answer["engine"]) == (1, "failed", "kinematic")
    assert {step["outcome"] for step in answer["steps"]} == {"done"}
    outcomes = {one["name"]: one["outcome"] for one in answer["expectations"]}
    assert outcomes == {
        "inside": "not_evaluated", "upright": "not_evaluated", "near": "not_evaluated",
        "no_collision": "not_evaluated", "tracking": "not_evaluated", "duration": "passed",
    }  # fmt: skip


def test_the_pour_can_be_varied_from_the_command_line(call_cli: Any, tmp_path: Path) -> None:
    overrides = (
        "scene.cup.mass='60 g'",
        "scene.cup.at=[0.76, -0.015]",
        "scene.cup.friction=0.6",
        "params.tilt=120 deg",
    )
    words = [word for override in overrides for word in ("--set", override)]
    ran = call_cli("run", TASKS / "pour.yaml", "-q", *words, cwd=tmp_path)
    assert ran.code == 0, ran
