"""The files that the bodies of a task come from: found from the task, and found again by a log of its project."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from manipcli.core.errors import InvalidInput
from manipcli.logs.mesh_search import MeshSearch
from manipcli.run.run_log import mesh_files
from manipcli.task.load_task import load_task

ROOT = Path(__file__).parents[2]
MESH = next((ROOT / "robots").rglob("*.stl"))
PART = """<robot name="part"><link name="part">
  <inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
  <collision><geometry>{shape}</geometry></collision>
</link></robot>"""


def project(folder: Path, *bodies: str) -> Path:
    """A task in `tasks/`, meshes in `meshes/` and `tasks/own/`, descriptions in `bodies/`."""
    for name in ("tasks/own", "meshes", "bodies", "runs"):
        (folder / name).mkdir(parents=True)
    shutil.copy(MESH, folder / "meshes" / "a.stl")
    shutil.copy(MESH, folder / "tasks" / "own" / "b.stl")
    scene = "".join(
        f"  body_{k}: {{{body}, fixed: true, pose: {{xyz: [2, {k}, 1]}}}}\n" for k, body in enumerate(bodies)
    )
    file = folder / "tasks" / "task.yaml"
    file.write_text(
        f"task: files\nrobot: {ROOT}/robots/panda/robot.yaml\ncontrollers: {ROOT}/controllers/panda.yaml\n"
        f"scene:\n{scene}steps: [{{wait: 1}}]\n"
    )
    return file


def test_what_a_task_names_may_lie_beside_its_folder_and_its_runs_find_it(tmp_path: Path) -> None:
    file = project(
        tmp_path, "mesh: {file: ../meshes/a.stl}", "mesh: {file: own/b.stl}", "urdf: {file: ../bodies/c.urdf}"
    )
    (tmp_path / "bodies" / "c.urdf").write_text(PART.format(shape='<box size="1 1 1"/>'))
    task = load_task(file)
    found = {uri: path for uri, path in mesh_files(task).items() if path.is_relative_to(tmp_path)}
    assert found == {
        "package://meshes/a.stl": tmp_path / "meshes" / "a.stl",
        "package://tasks/own/b.stl": tmp_path / "tasks" / "own" / "b.stl",
    }
    search = MeshSearch(tmp_path / "runs" / "files.mcap")
    again = search.scene(task.scene)
    assert search.notes == ()
    assert [body.geometries for body in again.bodies] == [body.geometries for body in task.scene.bodies]


def test_a_description_of_a_body_looks_for_packages_where_it_is_told_to(tmp_path: Path) -> None:
    file = project(tmp_path / "project", "urdf: {file: ../bodies/c.urdf}")
    (tmp_path / "project" / "bodies" / "c.urdf").write_text(
        PART.format(shape='<mesh filename="package://gear/a.stl"/>')
    )
    (tmp_path / "elsewhere" / "gear").mkdir(parents=True)
    shutil.copy(MESH, tmp_path / "elsewhere" / "gear" / "a.stl")
    with pytest.raises(InvalidInput) as refused:
        load_task(file)
    assert "--package-path" in str(refused.value.findings[0].hint)
    task = load_task(file, package_path=[tmp_path / "elsewhere"])
    assert tmp_path / "elsewhere" / "gear" / "a.stl" in mesh_files(task).values()


def test_a_description_of_a_body_reads_nothing_outside_unless_it_may(tmp_path: Path) -> None:
    file = project(tmp_path, "urdf: {file: ../bodies/c.urdf}")
    (tmp_path / "bodies" / "c.urdf").write_text(PART.format(shape='<mesh filename="../meshes/a.stl"/>'))
    with pytest.raises(InvalidInput) as refused:
        load_task(file)
    assert "outside" in refused.value.findings[0].message
    assert tmp_path / "meshes" / "a.stl" in mesh_files(load_task(file, allow_outside=True)).values()
