"""`manipcli init`: a project that works at once, and never one over another."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from manipcli.cli.app import main
from manipcli.cli.commands.init import FILES, TEMPLATES
from manipcli.core.version import __version__

ROOT = Path(__file__).parents[2]


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Path:
    """A new project, as the working directory."""
    monkeypatch.chdir(tmp_path)
    assert main(["init", "my demo"]) == 0
    told = capsys.readouterr()
    assert [line.removeprefix("written: my demo/") for line in told.out.splitlines()][: len(FILES)] == [*FILES]
    assert told.err == "next: cd 'my demo' && manipcli test\n"
    monkeypatch.chdir(tmp_path / "my demo")
    return tmp_path / "my demo"


@pytest.mark.slow
def test_its_files_are_sound(project: Path) -> None:
    files = sorted(str(path) for kind in ("tasks", "robots", "controllers") for path in (project / kind).iterdir())
    assert main(["check", *files]) == 0
    readme = (project / "README.md").read_text()
    assert readme.startswith("# my demo\n")
    named = re.findall(r"`((?:tasks|robots|controllers)\S*?\.yaml)`", readme)
    assert {*named} == {"tasks/pick_place.yaml", "robots/panda.yaml", "controllers/panda.yaml"}


def test_every_yaml_file_names_a_schema_that_is_there(project: Path) -> None:
    for kind in ("task", "robot", "controllers"):
        (path,) = (project / f"{kind.removesuffix('s')}s").iterdir()
        first = path.read_text().splitlines()[0]
        match = re.fullmatch(r"# yaml-language-server: \$schema=(\S+)", first)
        assert match is not None
        schema = json.loads((path.parent / match.group(1)).read_text())
        assert schema["title"] == f"manipcli {kind}"
        # Every key of the file is one of the schema.
        assert {*yaml.safe_load(path.read_text())} <= {*schema["properties"]}


@pytest.mark.slow
def test_nothing_is_replaced_unless_that_is_wanted(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    own, gone = project / "tasks" / "pick_place.yaml", project / "README.md"
    own.write_text("mine")
    gone.unlink()
    assert main(["init"]) == 4
    assert "tasks/pick_place.yaml" in capsys.readouterr().err
    assert own.read_text() == "mine"
    assert not gone.exists()
    assert main(["init", "--force"]) == 0
    assert own.read_text() != "mine"
    assert capsys.readouterr().err == "next: manipcli test\n"


def test_a_folder_whose_name_is_no_text_is_a_project_all_the_same(tmp_path: Path) -> None:
    folder = tmp_path / "Gr\udcf6\udcdfe"  # bytes of Latin-1, as Python says them
    assert main(["init", str(folder)]) == 0
    assert (folder / "README.md").read_text("utf-8").startswith("# Gr??e\n")


@pytest.mark.parametrize(
    ("there", "words", "told"),
    [
        ("p/tasks", ["p"], "'p/tasks' is a file; expected a folder"),
        ("p/tasks", ["p", "--force"], "'p/tasks' is a file; expected a folder"),
        ("p", ["p"], "'p' is a file; expected a folder"),
        ("p/robots/panda.yaml/x", ["p", "--force"], "'p/robots/panda.yaml' is a folder; expected a file"),
    ],
)
def test_what_is_in_the_way_is_told_before_anything_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
    there: str, words: list[str], told: str,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    (tmp_path / there).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / there).write_text("mine")
    assert main(["init", *words]) == 4
    assert f"error[USE088]: {told}; nothing was written" in capsys.readouterr().err
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == [tmp_path / there]


@pytest.mark.slow
def test_what_a_folder_has_before_it_is_a_project_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("README.md", ".gitignore"):
        (tmp_path / name).write_text("mine")
    assert main(["init"]) == 0
    out, err = capsys.readouterr()
    told = out.splitlines()
    assert "note: .gitignore lacks `runs/`, `report/`: add it, or git shows" in err
    assert [line for line in told if line.startswith("kept: ")] == ["kept: README.md", "kept: .gitignore"]
    assert "written: README.md" not in told
    assert {(tmp_path / name).read_text() for name in ("README.md", ".gitignore")} == {"mine"}
    assert main(["check", "tasks/pick_place.yaml"]) == 0


def test_a_gitignore_that_leads_nowhere_is_kept_and_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / ".gitignore").symlink_to("gone")
    assert main(["init"]) == 0
    told = capsys.readouterr()
    assert "kept: .gitignore" in told.out.splitlines()
    assert told.err == "next: manipcli test\n"


def test_a_folder_below_the_top_of_a_repository_is_told_where_its_workflow_belongs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / ".git").mkdir()
    (tmp_path / "-sub").mkdir()
    (tmp_path / "-sub" / ".gitignore").write_text("/runs\nreport/\n")
    assert main(["init", "--", "-sub"]) == 0
    note, following = capsys.readouterr().err.splitlines()
    top = tmp_path / ".github" / "workflows" / "manipcli.yml"
    assert note.startswith("note: GitHub runs workflows only from the top of a repository: move -sub/.github/")
    assert f"manipcli.yml to {top}, add to its job" in note
    assert "`defaults: {run: {working-directory: -sub}}`" in note
    assert following == "next: cd ./-sub && manipcli test"


def test_without_an_installation_there_is_no_workflow_that_installs_another_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("manipcli.cli.commands.init._installation", lambda: None)
    assert main(["init"]) == 0
    assert "note: no workflow" in capsys.readouterr().err
    assert not Path(".github").exists()
    assert ".github" not in Path("README.md").read_text()


def test_every_template_is_written_somewhere() -> None:
    templates = {str(path.relative_to(TEMPLATES)) for path in TEMPLATES.rglob("*") if path.is_file()}
    assert templates == {*FILES.values()}


def test_the_workflow_calls_options_that_there_are() -> None:
    workflow = yaml.safe_load((TEMPLATES / "github/workflows/manipcli.yml").read_text())
    (called,) = [step["run"] for step in workflow["jobs"]["tasks"]["steps"] if "manipcli test" in step.get("run", "")]
    done = subprocess.run(
        [sys.executable, "-m", "manipcli", "test", "--help"], capture_output=True, text=True, check=True, cwd=ROOT
    )
    options = re.findall(r"--\w+", called)
    assert len(options) == 3
    assert [option for option in options if option not in done.stdout] == []


def test_the_robot_is_that_of_the_repository() -> None:
    for template, original in (("robots/panda.yaml", "robots/panda/robot.yaml"), ("controllers/panda.yaml",) * 2):
        schema, _, rest = (TEMPLATES / template).read_text().partition("\n")
        assert schema.startswith("# yaml-language-server: ")
        assert rest == (ROOT / original).read_text()


def test_the_example_shows_the_same_workflow() -> None:
    shown = ROOT / "examples" / "09_continuous_integration" / "manipcli.yml"
    template = (TEMPLATES / "github/workflows/manipcli.yml").read_text()
    assert shown.read_text() == template.replace("INSTALL", f"./vendor/manipcli-{__version__}-py3-none-any.whl")
