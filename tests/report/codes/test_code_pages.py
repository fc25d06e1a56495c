"""Every code has a page, and every example is what it says: the faulty one gets the code, the sound one does not."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping
from pathlib import Path

import pytest

from manipcli import pipeline
from manipcli.cli import app
from manipcli.core.errors import ExitCode, InvalidInput, ManipcliError
from manipcli.description.lint.checks import CHECKS
from manipcli.report.codes.code_page import CodePage, Kind, code_pages, render_markdown, render_text
from manipcli.spec.source.tree import MappingNode
from manipcli.spec.source.yaml import parse

ROOT = Path(__file__).parents[3]
SOURCE = [path for path in (ROOT / "manipcli").rglob("*.py") if "codes" not in path.parts]
LITERAL = re.compile(
    r"""["']((?:BLE|CTRL|INIT|INT|LIVE|LOG|PLAN|PLOT|REPLAY|ROBOT|RUN|SENS|SIM|SRDF|TASK|TRAJ|TRAN|TUNE|URDF|USE|VIEW|XACRO|YAML)\d{3})["']"""
)
BASES: Mapping[Kind, str] = {
    "task": f"""\
task: example
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
simulation: {{engine: kinematic}}
steps: [{{wait: 0.1 s}}]
""",
    "robot": "robot: example\ndescription: arm.urdf\n",
    "controllers": "",
}
TASK_OF_CONTROLLERS = f"""\
task: example
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: example.yaml
steps: [{{wait: 0.1 s}}]
"""
"""The task that is checked for an example of a controllers file."""
ARM = """<robot name="arm">
  <link name="base"/>
  <link name="upper"><inertial><mass value="1"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="10"/></joint>
</robot>
"""
"""`arm.urdf` beside the examples of robot and controllers files."""
PAGES = code_pages()
CHECKED = {check.code for check in CHECKS}
TEXT = "\n".join(path.read_text(encoding="utf-8") for path in SOURCE)
NUMBERED = ("control", "model", "preflight", "scene", "spec", "task")
"""Folders whose codes are made of the area of a file and a number."""
NUMBERS = {
    number for path in SOURCE if path.relative_to(ROOT / "manipcli").parts[0] in NUMBERED
    for number in re.findall(r"\b\d{3}\b", path.read_text(encoding="utf-8"))
}  # fmt: skip
PRESENT = [
    page for page in PAGES.values()
    if page.code in TEXT or (page.code.startswith(("CTRL", "ROBOT", "TASK")) and page.code[-3:] in NUMBERS)
]  # fmt: skip
"""Pages of codes that are in the source: a page may be written first."""
SLOW = ("reach", "shrink", "sweep", "test", "tune")
"""Commands whose sound examples take seconds: only the faulty ones are run."""
SHIPPED = "manipcli check tasks/"
"""Commands about the tasks of this repository."""
COMMANDS = [page for page in PRESENT if page.kind == "command" and not page.bad.startswith(SHIPPED)]
CHECKS_OF_TASKS = [page for page in PRESENT if page.kind == "command" and page.bad.startswith(SHIPPED)]
SNIPPETS = [page for page in PAGES.values() if page.kind == "python"]
FILES = [page for page in PRESENT if page.kind in BASES or (page.kind in ("urdf", "xacro") and page.good)]


def surround(page: CodePage, folder: Path) -> None:
    """Writes the files that examples name."""
    (folder / "arm.urdf").write_text(ARM)
    for name in ("robots", "controllers"):
        if not (folder / name).exists():
            (folder / name).symlink_to(ROOT / name)
    for name, content in page.files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(content)


def written(page: CodePage, text: str, folder: Path) -> Path:
    """The example as a complete file: the keys of its base that it does not have are added."""
    surround(page, folder)
    if page.kind in ("urdf", "xacro"):
        path = folder / ("example.urdf.xacro" if page.kind == "xacro" else "example.urdf")
        path.write_text(text)
        return path
    base = parse(BASES[page.kind], "base")
    try:
        own = parse(text, "example")
    except InvalidInput:  # an example of invalid YAML is a whole file
        own = None
    keys = set(own.entries) if isinstance(own, MappingNode) else set()
    added = [
        line for line in BASES[page.kind].splitlines()
        if isinstance(base, MappingNode) and line.partition(":")[0] not in keys and own is not None
    ]  # fmt: skip
    path = folder / "example.yaml"
    path.write_text("\n".join([*added, text]) + "\n")
    if page.kind == "controllers":
        path = folder / "task.yaml"
        path.write_text(TASK_OF_CONTROLLERS)
    return path


@pytest.mark.parametrize("page", FILES, ids=lambda page: page.code)
def test_the_faulty_example_gets_the_code_and_the_sound_one_no_error(page: CodePage, tmp_path: Path) -> None:
    if page.bad and page.code not in CHECKED:
        found = pipeline.check_files([written(page, page.bad, tmp_path)])
        assert page.code in {finding.code for finding in found}, found
    if page.good:
        found = pipeline.check_files([written(page, page.good, tmp_path)])
        assert page.code not in {finding.code for finding in found}, found
        assert not [finding for finding in found if finding.severity == "error"], found


@pytest.mark.parametrize("page", CHECKS_OF_TASKS, ids=lambda page: page.code)
def test_the_faulty_check_of_a_task_gets_the_code_and_the_sound_one_no_error(
    page: CodePage, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT)
    app.main(shlex.split(page.bad)[1:])
    assert f"[{page.code}]" in "".join(capsys.readouterr())
    if page.good:
        assert app.main(shlex.split(page.good)[1:]) == ExitCode.PASSED
        assert f"[{page.code}]" not in "".join(capsys.readouterr())


@pytest.mark.parametrize("page", SNIPPETS, ids=lambda page: page.code)
def test_the_faulty_python_raises_the_code_and_the_sound_one_nothing(page: CodePage) -> None:
    with pytest.raises(ManipcliError) as raised:
        exec(page.bad, {})
    assert page.code in {finding.code for finding in raised.value.findings}
    if page.good:
        exec(page.good, {})


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, bytes]:
    """Logs of short runs by robot, for examples that read one; a wrist is drawn faster than an arm."""
    made = {}
    for robot in ("arm7_hand3", "differential_wrist"):
        folder = tmp_path_factory.mktemp("log")
        (folder / "task.yaml").write_text(BASES["task"].replace("arm7_hand3", robot))
        assert app.main(["run", str(folder / "task.yaml"), "--log", str(folder / "run.mcap")]) == ExitCode.PASSED
        made[robot] = (folder / "run.mcap").read_bytes()
    return made


@pytest.mark.parametrize("page", COMMANDS, ids=lambda page: page.code)
def test_the_faulty_command_gets_the_code_and_the_sound_one_passes(
    page: CodePage, logs: Mapping[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    surround(page, tmp_path)
    (tmp_path / "task.yaml").write_text(BASES["task"])
    (tmp_path / "run.mcap").write_bytes(logs["arm7_hand3" if "manipcli run" in page.bad else "differential_wrist"])
    monkeypatch.chdir(tmp_path)
    for command in filter(None, (page.bad, page.good)):
        settings, _, words = command.partition("manipcli ")
        if command == page.good and words.startswith(SLOW):
            continue
        for name, _, value in (setting.partition("=") for setting in settings.split()):
            monkeypatch.setenv(name, value)
        code = app.main(shlex.split(words))
        found = page.code in "".join(capsys.readouterr())
        assert found == (command == page.bad)
        assert (code != ExitCode.PASSED) == found


def test_every_code_in_the_source_has_a_page() -> None:
    written_down = {code for path in SOURCE for code in LITERAL.findall(path.read_text(encoding="utf-8"))}
    assert sorted(written_down - set(PAGES)) == []


@pytest.mark.parametrize("page", PAGES.values(), ids=lambda page: page.code)
def test_every_page_is_whole(page: CodePage) -> None:
    assert page.title and not page.title.endswith("."), "a few words"
    assert page.why.endswith("."), "one or two sentences"
    if page.kind != "situation":
        assert page.bad
    assert page.code in render_text(page) and page.code in render_markdown(page)


def test_the_docs_are_those_of_the_pages() -> None:
    for code, page in PAGES.items():
        assert (ROOT / "docs" / "reference" / "codes" / f"{code}.md").read_text(encoding="utf-8") == render_markdown(
            page
        )


def test_the_command_prints_a_page(capsys: pytest.CaptureFixture[str]) -> None:
    assert app.main(["explain", "task203"]) == ExitCode.PASSED
    assert capsys.readouterr().out.startswith("TASK203: unknown parameter")
    assert app.main(["explain", "TSAK203"]) == ExitCode.USAGE
    assert "did you mean 'TASK203'" in capsys.readouterr().err
