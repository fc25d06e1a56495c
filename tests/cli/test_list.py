"""`manipcli list`: the words that the registries hold, and the files that lie below this folder."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from manipcli.cli.app import main
from manipcli.simulate.engines import mujoco

FILES = {
    "tasks/b.yaml": "task: b\nrobot: r.yaml\n",
    "tasks/a.yml": "task: a\n",
    "robots/r.yaml": "robot: r\n",
    "controllers/own.yaml": "controllers: {}\n",
    "controllers/ros1.yaml": "arm_controller: {type: effort_controllers/JointTrajectoryController}\n",
    "controllers/ros2.yaml": "controller_manager: {ros__parameters: {}}\n",
    ".hidden/c.yaml": "task: c\n",
    "tasks/sub.yaml": "params: {x: {type: number}}\nsteps: [{wait: $x}]\n",
    "broken.yaml": "task: [\n",
    "other.yaml": "- 1\n",
    "docker-compose.yml": "services: {db: {image: a/b, volumes: [{type: bind}]}}\n",
    "mkdocs.yml": "site_name: x\ntheme: {palette: {scheme: slate}}\n",
    "workflow.yml": "on: {workflow_dispatch: {inputs: {x: {type: string}}}}\njobs: {a: {steps: [{uses: a/b}]}}\n",
    "navigation.yaml": "planner: {ros__parameters: {tolerance: 0.5}}\n",
    "controllers/dotted.yaml": "arm: {ros__parameters: {joints: [a], arm.type: a/B}}\n",
    "controllers/bare.yaml": "arm: {type: joint_trajectory, joints: [a]}\n",
    "notes.yxml": "task: no\n",
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, text in FILES.items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("kind", "names"),
    [
        ("tasks", ["tasks/a.yml", "tasks/b.yaml"]),
        ("robots", ["robots/r.yaml"]),
        (
            "controllers",
            ["controllers/bare.yaml", "controllers/dotted.yaml"]
            + [f"controllers/{name}.yaml" for name in ("own", "ros1", "ros2")],
        ),
    ],
)
def test_files_are_known_by_their_top_level_key(
    folder: Path, capsys: pytest.CaptureFixture[str], kind: str, names: list[str]
) -> None:
    assert main(["list", kind]) == 0
    assert capsys.readouterr().out.splitlines() == names


@pytest.mark.parametrize(
    ("kind", "some"),
    [
        ("steps", {"move", "pick", "pour", "repeat", "if", "do"}),
        ("conditions", {"inside", "upright", "near"}),
        ("expectations", {"inside", "tracking", "duration", "step_done", "no_collision"}),
        ("engines", {"pybullet", "kinematic"}),
        ("shapes", {"box", "sphere", "cylinder", "cup", "tray"}),
    ],
)
def test_words_are_those_of_the_registries(capsys: pytest.CaptureFixture[str], kind: str, some: set[str]) -> None:
    assert main(["list", kind, "--format", "json"]) == 0
    words = json.loads(capsys.readouterr().out)[kind]
    assert {*words} >= some
    assert "pose" not in words
    assert main(["list", kind]) == 0
    lines = capsys.readouterr().out.splitlines()
    if kind in ("steps", "conditions", "expectations", "engines"):
        assert lines.pop(0).split() == ["word", "meaning"]
        assert all(line.endswith((".", "`.")) and len(line.split()) > (1 if kind == "engines" else 3) for line in lines)
    assert [line.split()[0] for line in lines] == words


@pytest.mark.parametrize("installed", [True, False])
def test_an_engine_without_its_package_is_listed_with_its_extra(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, installed: bool
) -> None:
    monkeypatch.setattr(mujoco, "installed", lambda: installed)
    assert main(["list", "engines"]) == 0
    lines = {line.split()[0]: line for line in capsys.readouterr().out.splitlines()}
    assert ("Not installed; install it: pip install 'manipcli[mujoco]'." in lines["mujoco"]) == (not installed)
    assert lines["kinematic"].endswith("  Ideal tracking, no physics.")


TASK = str(Path(__file__).parents[2] / "tasks" / "pour.yaml")


@pytest.mark.slow
def test_the_controllers_of_a_task_and_who_claims_what(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "controllers", TASK]) == 0
    header, *rows = capsys.readouterr().out.splitlines()
    assert header.split() == ["controller", "type", "at", "the", "start", "rate", "claims"]
    (arm,) = [row for row in rows if row.startswith("arm_controller")]
    assert "joint_trajectory  active" in arm
    assert "1000 Hz  effort of joint_1, joint_2, joint_3, ..., joint_7 (7 joints)" in arm
    assert main(["list", "controllers", TASK, "--format", "json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    first = answer["controllers"][0]
    assert (first["name"], first["type"], first["state"], first["update_rate"]) == (
        "arm_controller", "joint_trajectory", "active", 1000.0,
    )  # fmt: skip
    assert first["claimed"] == first["interfaces"] == [f"joint_{k}/effort" for k in range(1, 8)]


def test_a_file_after_another_kind_is_a_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "robots", TASK]) == 4
    assert "only `list controllers TASK` does" in capsys.readouterr().err
    assert main(["list", "controllers", "no.yaml"]) == 4


def test_all_kinds_at_once(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list", "--format", "json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["robots"] == ["robots/r.yaml"]
    assert "move" in answer["steps"]
    assert main(["list"]) == 0
    assert "robots: robots/r.yaml" in capsys.readouterr().out
