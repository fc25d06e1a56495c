"""The schema of a modeline: kept current with the names of the task, and nothing else is ever replaced."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from manipcli.preflight.check_files import schema
from manipcli.preflight.editor_schema import modeline, updated_schema

ROOT = Path(__file__).parents[2]
TASK = f"""task: t
robot: {ROOT}/robots/panda/robot.yaml
controllers: {ROOT}/controllers/panda.yaml
scene:
  brick: {{box: {{size: [4 cm, 4 cm, 4 cm]}}, mass: 80 g, pose: {{}}}}
steps:
  - move: {{to: home}}
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A project with a task and a schema of tasks without names."""
    project = tmp_path / "project"
    (project / "tasks").mkdir(parents=True)
    (project / "pyproject.toml").touch()
    (project / "task.json").write_text(json.dumps(schema("task")))
    return project


def task(project: Path, named: str) -> Path:
    path = project / "tasks" / "task.yaml"
    path.write_text(f"# yaml-language-server: $schema={named}\n{TASK}")
    return path


def test_it_gets_the_names_of_the_task_once(project: Path) -> None:
    path = task(project, "../task.json")
    update = updated_schema(path, folder=Path("/"))
    assert (update.file, update.written, update.why_not) == (project / "task.json", True, "")
    assert json.loads((project / "task.json").read_text()) == schema("task", task=path)
    assert '"brick"' in (project / "task.json").read_text()
    assert not updated_schema(path, folder=Path("/")).written


def test_it_keeps_what_was_written_in_the_same_round(project: Path) -> None:
    before = (project / "task.json").read_bytes()
    update = updated_schema(task(project, "../task.json"), folder=Path("/"), leave={project / "task.json"})
    assert not update.written
    assert (project / "task.json").read_bytes() == before


def test_a_half_written_task_leaves_it(project: Path) -> None:
    path = task(project, "../task.json")
    path.write_text(path.read_text().replace("scene:", "scene: {{["))
    before = (project / "task.json").read_bytes()
    assert not updated_schema(path, folder=Path("/")).written
    assert (project / "task.json").read_bytes() == before


FOREIGN = {
    "an object": '{"a": 1}',
    "a list": "[1, 2]",
    "not JSON": "{",
    "not text": "\xff\xfe",
    "only the title": '{"title": "manipcli task"}',
    "robots": json.dumps(dict(schema("robot"))),
    "deep": "[" * 100_000,
}


@pytest.mark.parametrize("text", FOREIGN.values(), ids=FOREIGN)
def test_another_file_is_left_as_it_is(project: Path, text: str) -> None:
    (project / "other.json").write_text(text, encoding="latin-1")
    update = updated_schema(task(project, "../other.json"), folder=Path("/"))
    assert update.file is None
    assert update.why_not
    assert (project / "other.json").read_text(encoding="latin-1") == text


@pytest.mark.parametrize(
    ("named", "why"),
    [
        ("https://example.org/task.json", "not a local .json"),
        ("../README.md", "not a local .json"),
        ("../none.json", "there is no schema"),
        ("../../task.json", "outside the project"),
        ("../link.json", "outside the project"),
        ("/etc/passwd.json", "outside the project"),
        ("..json", "there is no schema"),
    ],
)
def test_what_is_outside_or_missing_is_named(project: Path, named: str, why: str) -> None:
    outside = project.parent / "task.json"
    outside.write_text((project / "task.json").read_text())
    (project / "link.json").symlink_to(outside)
    before = outside.read_bytes()
    update = updated_schema(task(project, named), folder=Path("/"))
    assert (update.file, update.written) == (None, False)
    assert why in update.why_not
    assert outside.read_bytes() == before


def test_the_working_directory_is_a_project_too(project: Path) -> None:
    (project / "pyproject.toml").unlink()
    path = task(project, "../task.json")
    assert "outside" in updated_schema(path, folder=project / "tasks").why_not
    assert updated_schema(path, folder=project).written


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("# yaml-language-server: $schema=a.json\ntask: t", "a.json"),
        ("# A comment.\n#yaml-language-server:$schema = ../b.json  \n", "../b.json"),
        ("task: t  # yaml-language-server: $schema=a.json", None),
        ("", None),
        ("\n" * 30 + "# yaml-language-server: $schema=a.json", None),
    ],
)
def test_the_modeline(text: str, named: str | None) -> None:
    assert modeline(text) == named
