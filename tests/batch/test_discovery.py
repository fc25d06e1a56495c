"""Which files are tests: those with a name under the top-level key `task` and a robot, and no others."""

from __future__ import annotations

import os
import threading
from pathlib import Path

import pytest

from manipcli.batch.discovery import read_case, samples_of, shown_path
from manipcli.batch.first_look import first_look
from manipcli.batch.job import Settings
from manipcli.cli.task_session import TaskSession
from manipcli.core.errors import InvalidInput

TASKS = {
    "a.yaml": "task: a\nrobot: r.yaml\n",
    "tasks/late.yml": "robot: r.yaml\nsteps: []\ntask: late  # the order is free\n",
    "tasks/quoted.yaml": '"task": quoted\n"robot": r.yaml\n',
    "tasks/flow.yaml": "{task: flow, robot: r.yaml}\n",
    "tasks/more.yaml": '{\n  "robot": "r.yaml",\n  "steps": [{"wait": 1}],\n  "task": "more"\n}\n',
    "tasks/nullable.yaml": "task: nullable\nrobot: r.yaml\n",
    "tasks/windows.yaml": "\ufeff# a comment\r\ntask: windows\r\nrobot: r.yaml\r\n",
    "tasks/LOUD.YAML": "task: loud\nrobot: r.yaml\n",
    "tasks/empty.yaml": "task:  # later\nrobot: r.yaml\nsteps: []\n",
    "tasks/three.yaml": "task: 3\nrobot: r.yaml\ncontrollers: c.yaml\n",
    "tasks/accent.yaml": "task: été\nrobot: r.yaml\nsteps: []\n",
    "tasks/indented.yaml": "# all of it\n  task: indented\n  robot: r.yaml\n",
    "tasks/mac.yaml": "# old\rtask: mac\rrobot: r.yaml\r",
    "tasks/broken.yaml": "task: broken\nrobot: r.yaml\nsteps: [\n",
}
OTHERS = {
    "robots/r.yaml": "robot: r\ndescription: r.urdf\n",
    "controllers/c.yaml": "controllers: {}\n",
    "ci.yaml": "on: push\njobs:\n  task:\n    steps: []\n",
    "ansible.yaml": "- name: x\n  task: y\n",
    "taskfile.yml": "version: 3\ntasks:\n  task: no\n",
    "group.yaml": "task:\n  name: a mapping\nrobot: r.yaml\n",
    "comment.yaml": "# task: no\ntask: # nothing\nrobot: r.yaml\n",
    "robotless.yaml": "task: hello\nsteps: {robot: r}\nvars:\n  robot: r\n",
    "hydra.yaml": "task:\n  # chosen\n  name: Lift\nrobot: panda\nscene: kitchen\nsimulation: {dt: 1}\n",
    "list_below.yaml": "task:\n- a\nrobot: r\nsteps: 5\n",
    "azure.yml": "trigger: [main]\nsteps:\n- task: UsePythonVersion@0\n",
    "template.yaml": "task: {{ name }}\nrobot: r\nsteps: []\n",
    "map.yaml": "task: {a: b}\nrobot: r.yaml\n",
    "list.yaml": "task: [1, 2]\nrobot: r.yaml\n",
    "null.yaml": "task: ~\nrobot: r.yaml\n",
    "word.yaml": "task: null # as well\nrobot: r.yaml\n",
    "number.yaml": "task: 5\nrobot: r.yaml\n",
    "notes.txt": "task: no\nrobot: r.yaml\n",
    "nested.yaml": "# all of it\n  a:\n    task: no\n    robot: r.yaml\n",
    ".hidden/h.yaml": "task: h\nrobot: r.yaml\n",
    "tasks/.hidden.yaml": "task: h\nrobot: r.yaml\n",
    "runs/old.yaml": "task: old\nrobot: r.yaml\n",
    "node_modules/m.yaml": "task: m\nrobot: r.yaml\n",
    "my_env/lib/v.yaml": "task: v\nrobot: r.yaml\n",
    "my_env/pyvenv.cfg": "home = /usr/bin\n",
}


def task_files(paths: list[Path]) -> tuple[Path, ...]:
    """Those that `manipcli test` finds."""
    with TaskSession(paths, Settings()) as session:
        return tuple(Path(shown_path(file)) for file in session.files)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, text in {**OTHERS, **TASKS}.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text.encode())
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_task_files_below_a_folder_and_no_others(folder: Path) -> None:
    assert {str(path) for path in task_files([Path()])} == set(TASKS)


@pytest.mark.parametrize(
    "text",
    [
        "task: t\ncontrollers: c.yaml\nsteps: []\n",
        "Robot: r.yaml\ntask: t\nsteps: []\n",
        "task: 3\nstart: home\n",
        "task:\nscene: {}\n",
        "{task: t, robt: r, expect: []}",
    ],
)
def test_what_looks_like_a_task_without_its_robot_is_told(
    folder: Path, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "tasks" / "left.yaml").write_text(text)
    assert Path("tasks/left.yaml") not in task_files([Path("tasks"), Path("runs")])
    assert capsys.readouterr().err == "tasks/left.yaml has `task:` but no `robot:`; not run\n"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("taks: t\nrobot: r.yaml\ncontrollers: c.yaml\nsteps: []\n", True),
        ("{Task: t, robot: r, controllers: c, steps: []}", True),
        ("robot: r.yaml\nsteps: []\n", False),
        ("robot: r\ndescription: r.urdf\ncontrollers: c.yaml\n", False),
    ],
)
def test_what_looks_like_a_task_without_its_name_is_told(
    folder: Path, text: str, told: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "tasks" / "left.yaml").write_text(text)
    assert Path("tasks/left.yaml") not in task_files([Path("tasks")])
    wanted = "tasks/left.yaml has `robot:`, `controllers:` and `steps:` but no `task:`; not run\n"
    assert capsys.readouterr().err == wanted * told


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-be"])
def test_a_task_in_utf_16_is_one_that_cannot_be_read(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "t.yaml"
    text = "task: t\nrobot: r.yaml\nsteps: []\n"
    path.write_bytes((text if encoding == "utf-16" else f"\ufeff{text}").encode(encoding))
    assert task_files([tmp_path]) == (path,)
    assert "UTF-8" in str(read_case(path).findings[0].hint)


def test_a_folder_that_is_named_is_entered_whatever_it_is_called(folder: Path) -> None:
    assert [path.name for path in task_files([Path("runs"), Path(".hidden")])] == ["old.yaml", "h.yaml"]


def test_a_file_is_run_once_however_it_is_named(folder: Path) -> None:
    (folder / "link.yaml").symlink_to("a.yaml")
    named = [Path("a.yaml"), folder / "a.yaml", Path("link.yaml"), Path("./tasks/../a.yaml")]
    assert task_files(named) == (Path("a.yaml"),)


@pytest.mark.parametrize(
    ("named", "code"), [("robots/r.yaml", "USE105"), ("absent.yaml", "USE101"), ("notes.txt", "USE105")]
)
def test_a_file_that_is_named_and_is_no_task_is_refused(folder: Path, named: str, code: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        task_files([Path(named), Path("tasks")])
    assert [finding.code for finding in refused.value.findings] == [code]


@pytest.mark.parametrize("named", ["robotless.yaml", "map.yaml", "null.yaml", "number.yaml", "comment.yaml"])
def test_a_file_that_is_named_is_a_case_that_tells_what_is_wrong(folder: Path, named: str) -> None:
    assert task_files([Path(named)]) == (Path(named),)
    case = read_case(Path(named))
    assert case.task == ("hello" if named == "robotless.yaml" else Path(named).stem)
    assert [one.code for one in case.findings] == ([] if named == "robotless.yaml" else ["TASK200"])


@pytest.mark.parametrize("text", ["? task\n: t\n? robot\n: r.yaml\n", f"#{'-' * 70_000}\ntask: t\nrobot: r.yaml\n"])
def test_a_file_that_is_named_is_a_task_however_it_is_written(tmp_path: Path, text: str) -> None:
    path = tmp_path / "t.yaml"
    path.write_text(text)
    assert task_files([path]) == (path,)
    assert read_case(path).task == "t"


def test_only_the_beginning_of_a_foreign_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / "large.yaml"
    path.write_text("robot: r\n" + "a: 1\n" * 100_000 + "task: late\n")
    assert first_look(path) == "other"
    assert first_look(tmp_path / "absent.yaml") == "other"


def test_a_case_knows_name_tags_and_engine(tmp_path: Path) -> None:
    path = tmp_path / "t.yaml"
    path.write_text(
        "# about it\ntask: t\ntags: [slow, nightly]\nsimulation: {engine: kinematic}\nvary: {scene.a.mass: 1}\n"
    )
    case = read_case(path, shown="tasks/t.yaml")
    assert (case.id, case.line) == ("tasks/t.yaml::t", 2)
    assert case.tags == ("slow", "nightly", "engine_kinematic")
    assert [one.id for one in samples_of(case, 2)] == ["tasks/t.yaml::t[0]", "tasks/t.yaml::t[1]"]
    assert samples_of(case, None) == (case,)


def test_a_task_that_does_not_vary_is_run_once(tmp_path: Path) -> None:
    path = tmp_path / "t.yaml"
    path.write_text("task: t\n")
    case = read_case(path)
    assert case.tags == ("engine_pybullet",)
    assert samples_of(case, 5) == (case,)


def test_a_file_that_cannot_be_read_is_a_case_with_its_findings(folder: Path) -> None:
    case = read_case(folder / "tasks" / "broken.yaml", shown="tasks/broken.yaml")
    assert case.id == "tasks/broken.yaml::broken"
    (finding,) = case.findings
    assert finding.place is not None
    assert (finding.place.file, finding.place.line) == ("tasks/broken.yaml", 4)


def test_a_baseline_whose_task_was_renamed_is_found(folder: Path) -> None:
    text = '{"duration": 1.0, "margins": {}, "steps": {}}'
    for name in ("a.baseline.json", "b.baseline.json", "c@yml.baseline.json", "runs/d.baseline.json"):
        (folder / "own" / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / "own" / name).write_text(text)
    (folder / "own" / "other.baseline.json").write_text("{}")  # that of another tool
    files = [folder / "own" / "a.yaml", folder / "own" / "c.yml"]
    for file in files:
        file.write_text("task: t\nrobot: r.yaml\n")
    with TaskSession([Path("own")], Settings()) as session:
        (note,) = session.notes
    assert note.startswith("own/b.baseline.json: no task has this baseline; ")
    with TaskSession(files[:1], Settings()) as session:
        assert session.notes == ()


def test_a_pipe_is_no_task_and_holds_nobody_up(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "x.yaml")
    hung = threading.Timer(60.0, lambda: os.close(os.open(tmp_path / "x.yaml", os.O_WRONLY | os.O_NONBLOCK)))
    hung.start()  # ends a wait for who writes, so that this fails and does not hang
    assert task_files([tmp_path]) == ()
    with pytest.raises(InvalidInput, match="not a regular file"):
        task_files([tmp_path / "x.yaml"])
    assert hung.is_alive()
    hung.cancel()


def test_a_link_to_itself_is_no_task(tmp_path: Path) -> None:
    (tmp_path / "loop.yaml").symlink_to("loop.yaml")
    assert task_files([tmp_path]) == ()
    with pytest.raises(InvalidInput, match="symbolic links"):
        task_files([tmp_path / "loop.yaml"])
