"""The task of a log as files again: they run to the log of the run, and to the same bytes from then on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import trimesh
import yaml

from manipcli.core.errors import InvalidInput
from manipcli.logs.diff import PLACES
from manipcli.logs.mesh_search import MeshSearch
from manipcli.logs.task_files import _packages, task_files
from manipcli.record.foreign.compare import compare_logs
from manipcli.record.read.reading import open_recording
from tests.conftest import PourRun

RunCli = Callable[..., Any]
Pendulum = Callable[..., Path]
TASK: dict[str, Any] = {
    "task": "swing",
    "robot": "robot.yaml",
    "controllers": "controllers.yaml",
    "simulation": {"engine": "kinematic"},
    "params": {"far": "0.4 rad"},
    "vary": {"scene.ball.mass": {"uniform": [0.1, 0.2]}},
    "scene": {
        "wedge": {"mesh": {"file": "things/wedge.stl"}, "pose": {"xyz": [1, 0, 0.15]}, "fixed": True},
        "ball": {"sphere": {"radius": 0.05}, "mass": 0.1, "pose": {"xyz": [1, 0.5, 0.05]}},
    },
    "steps": [{"id": "go", "move": {"to": {"hinge": "$far"}}}, {"wait": {"duration": 0.1}}],
    "expect": [{"id": "short", "duration": {"below": "5 s"}}],
}
CONTROLLERS = {"arm": {"type": "joint_trajectory", "joints": ["hinge"], "command_interface": "position"}}


@pytest.fixture
def project(pendulum: Pendulum) -> Path:
    """A task of a pendulum whose mass and inertia the robot file states, and of a mesh."""
    mended = (
        "inertials: {links: {arm: {mass: 1.5, centre: [0, 0, -0.25], inertia: {ixx: 0.03, iyy: 0.03, izz: 0.002}}}}\n"
        "collision: {base: none}\n"
    )
    folder = pendulum(mended, urdf='<link name="tip"/><joint name="end" type="fixed"><parent link="arm"/>'
                                   '<child link="tip"/></joint>')  # fmt: skip
    (folder / "things").mkdir()
    trimesh.creation.box((0.1, 0.2, 0.3)).export(folder / "things/wedge.stl")
    (folder / "task.yaml").write_text(yaml.safe_dump(TASK, sort_keys=False))
    (folder / "controllers.yaml").write_text(yaml.safe_dump({"controllers": CONTROLLERS}))
    return folder


@pytest.mark.parametrize("sample", [(), ("--sample", "3")])
def test_the_files_of_a_log_run_to_its_messages(project: Path, sample: tuple[str, ...], call_cli: RunCli) -> None:
    def run(task: str, log: str) -> Path:
        ran = call_cli("run", task, "--embed-meshes", *sample, "--log", log, cwd=project)
        assert ran.code == 0, ran.err
        return project / log

    def export(log: str, folder: str) -> None:
        made = call_cli("export", log, "--files", folder, cwd=project)
        assert made.code == 0, made.err
        assert f"`manipcli run {folder}/task.yaml{''.join(f' {word}' for word in sample)}`" in made.err

    first = run("task.yaml", "first.mcap")
    (project / "things").rename(project / "hidden")  # the meshes come from the log
    export("first.mcap", "again")
    second = run("again/task.yaml", "second.mcap")
    found = compare_logs(first, second, besides=PLACES)
    assert found.same, [(one.name, one.first) for one in found.topics if one.different or any(one.only)]
    export("second.mcap", "once_more")
    assert run("once_more/task.yaml", "third.mcap").read_bytes() == second.read_bytes()


def test_a_mesh_that_is_not_found_is_an_error(pour_run: PourRun, tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InvalidInput, match="not found: the task would not run") as refused:
        task_files(open_recording(pour_run.log), pour_run.log, package_path=(), allow_outside=False)
    assert "--package-path" in str(refused.value.findings[0].hint)


@pytest.mark.parametrize(
    "uri",
    [
        "package://../escape.stl",
        "package://a/../../escape.stl",
        "package://a%2F..%2F../b.stl",
        "package://%2Fetc/escape.stl",
        "package://a/b%5C..%5C..%5Cescape.stl",
        "package://a/b%00.stl",
        "/etc/escape.stl",
        "file:///etc/escape.stl",
        "package://alone",
    ],
)
def test_no_mesh_is_written_outside_the_folder(uri: str, tmp_path: Path) -> None:
    mesh = tmp_path / "mesh.stl"
    mesh.write_bytes(b"solid")
    with pytest.raises(InvalidInput, match="is not a file of a package"):
        _packages({uri: mesh}, Path("hostile.mcap"), MeshSearch(tmp_path / "hostile.mcap"))


def test_no_mesh_replaces_a_file_of_the_task(tmp_path: Path) -> None:
    mesh = tmp_path / "mesh.stl"
    mesh.write_bytes(b"solid")
    with pytest.raises(InvalidInput, match="is not a file of a package"):
        _packages({"package://a/package.xml": mesh}, Path("hostile.mcap"), MeshSearch(tmp_path / "hostile.mcap"))
