"""The examples of commands, run: the faulty one gets its code. And those of SRDFs, read."""

from __future__ import annotations

import shlex
import shutil
from pathlib import Path

import pytest

from manipcli.cli import app
from manipcli.core.errors import InvalidInput
from manipcli.description.srdf import read_srdf
from manipcli.onboard.from_srdf import stated_parts
from manipcli.pipeline import load_sight
from manipcli.report.codes.code_page import CodePage, code_pages
from tests.report.codes.test_code_pages import ARM, ROOT

TASK = """\
task: example
robot: robots/arm7_hand3/robot.yaml
controllers: controllers/arm7_hand3.yaml
simulation: {engine: kinematic}
steps:
  - {id: first, wait: 0.1 s}
  - {id: second, wait: 0.1 s}
"""
"""`task.yaml` of the examples; its log is `runs/example.mcap`."""
AREAS = ("INIT", "LOG", "PLAN", "PLOT", "REPLAY", "ROBOT", "SRDF", "TUNE", "USE12", "VIEW")
PAGES = [page for page in code_pages().values() if page.code.startswith(AREAS)]
COMMANDS = [page for page in PAGES if page.kind == "command"]
SRDFS = [page for page in PAGES if page.kind == "srdf"]


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a robot, a task and its log."""
    folder = tmp_path_factory.mktemp("project")
    for name in ("robots", "controllers"):
        shutil.copytree(ROOT / name, folder / name)
    (folder / "arm.urdf").write_text(ARM)
    (folder / "task.yaml").write_text(TASK)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert app.main(["run", "task.yaml"]) == 0
    return folder


@pytest.mark.parametrize("page", COMMANDS, ids=lambda page: page.code)
def test_the_faulty_command_gets_the_code(
    page: CodePage, project: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "project"
    shutil.copytree(project, folder)
    for name, content in page.files.items():
        (folder / name).write_text(content)
    monkeypatch.chdir(folder)
    assert app.main(shlex.split(page.bad)[1:]) != 0
    assert f"[{page.code}]" in capsys.readouterr().err


@pytest.mark.parametrize("page", SRDFS, ids=lambda page: page.code)
def test_the_faulty_srdf_gets_the_code_and_the_sound_one_none(page: CodePage, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM)
    file = tmp_path / "arm.srdf"
    robot = load_sight(tmp_path / "arm.urdf").robot
    found: list[set[str]] = []
    for text in (page.bad, page.good):
        file.write_text(text)
        try:
            stated_parts(robot, read_srdf(file))
            found.append(set())
        except InvalidInput as error:
            found.append({finding.code for finding in error.findings})
    assert found == [{page.code}, set()]
