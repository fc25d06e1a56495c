"""A bundle: a task loads to the same from a copy of its files in another place, with links and packages."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from manipcli.batch.job import Settings
from manipcli.core.errors import InvalidInput
from manipcli.core.opened_files import opened_by
from manipcli.sweep.bundle import bundle_of, bundled
from manipcli.sweep.journal import changes, identity
from manipcli.sweep.sampling import Sampling

ROOT = Path(__file__).parents[2]
TASK = """\
task: held
robot: ../robots/arm7_hand3/robot.yaml
controllers: ../controllers/arm7_hand3.yaml
simulation: {engine: kinematic}
steps: [{wait: 50 ms}]
vary: {simulation.settle: {uniform: [0, 0.1]}}
"""


def surround(project: Path, shared: Path) -> None:
    """A project with links to robots and controllers; copies, of which every file is read by everybody."""
    (project / "tasks").mkdir(parents=True)
    shutil.copytree(ROOT / "robots" / "arm7_hand3", shared / "robots" / "arm7_hand3")
    shutil.copytree(ROOT / "controllers", shared / "controllers")
    for name in ("robots", "controllers"):
        (project / name).symlink_to(shared / name)


def test_a_task_loads_to_the_same_from_its_bundle(tmp_path: Path) -> None:
    project = tmp_path / "project"
    surround(project, tmp_path / "shared")
    task = project / "tasks" / "held.yaml"
    task.write_text(TASK)
    written, opened = opened_by(lambda: Sampling(task, Settings()).written)
    bundle = bundle_of(written, [path for path, _ in opened.stamps], task)
    there, packages = bundle.unpack(tmp_path / "worker")
    project.rename(tmp_path / "gone")
    with pytest.raises(InvalidInput):
        Sampling(task, Settings())
    loaded, read = opened_by(lambda: Sampling(there, Settings(package_path=packages)).written)
    assert changes(identity(written), identity(loaded)) == ""
    robots = [path for path, _ in read.stamps if "robots" in path.parts]
    assert robots
    assert all(path.is_relative_to(tmp_path / "worker") for path in robots)
    assert len(identity(written)["URDF of the robot"]) == 64
    there.write_text(TASK.replace("0.1]", "0.2]"))
    other = Sampling(there, Settings(package_path=packages)).written
    assert "vary.simulation.settle.uniform was [0.0, 0.1], is [0.0, 0.2]" in changes(identity(written), identity(other))


def test_meshes_of_an_installed_package_have_the_same_names_on_a_worker(tmp_path: Path) -> None:
    task = tmp_path / "tasks" / "held.yaml"
    task.parent.mkdir()
    shutil.copytree(ROOT / "robots" / "panda", tmp_path / "robots" / "panda")
    shutil.copytree(ROOT / "controllers", tmp_path / "controllers")
    task.write_text(TASK.replace("arm7_hand3", "panda"))
    sampling = Sampling(task, Settings())
    there, packages = bundled(sampling, task).unpack(tmp_path / "worker")
    loaded = Sampling(there, Settings(package_path=packages)).written
    assert changes(identity(sampling.written), identity(loaded)) == ""
    assert any(key.startswith("mesh package://pybullet_data/") for key in identity(loaded))


def test_an_absolute_path_cannot_travel(tmp_path: Path) -> None:
    task = tmp_path / "held.yaml"
    task.write_text(TASK.replace("..", str(ROOT)))
    with pytest.raises(InvalidInput, match="'robot' is an absolute path"):
        bundle_of(Sampling(task, Settings()).written, [], task)


def test_a_task_that_is_named_with_dots_can_travel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    project = tmp_path / "project"
    surround(project, tmp_path / "shared")
    (project / "tasks" / "held.yaml").write_text(TASK)
    monkeypatch.chdir(project)
    name = Path("elsewhere/../tasks/held.yaml")
    (project / "elsewhere").mkdir()
    sampling = Sampling(name, Settings())
    there, packages = bundled(sampling, name).unpack(tmp_path / "worker")
    loaded = Sampling(there, Settings(package_path=packages)).written
    assert changes(identity(sampling.written), identity(loaded)) == ""
