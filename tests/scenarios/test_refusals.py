"""What cannot be run is refused: the right exit code, where and why, no traceback, nothing written."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from manipcli.cli.app import main

ROOT = Path(__file__).parents[2]
HEAD = f"""\
task: refused
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
"""
SCENE = """\
scene:
  desk: {box: {size: [0.6, 1.0, 0.4]}, pose: {xyz: [0.85, 0, 0.2]}, fixed: true}
  cup: {cup: {radius: 36 mm, height: 110 mm}, mass: 150 g, rests_on: desk, at: [0.75, 0.0]}
"""
HOME = "steps:\n  - move: {to: home}\n"


@dataclass(frozen=True)
class Ran:
    code: int
    out: str
    err: str


Call = Callable[..., Ran]


@pytest.fixture
def call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    """The command line in this process, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MANIPCLI_DEBUG", raising=False)

    def call_main(*words: str | Path) -> Ran:
        capfd.readouterr()
        code = main([str(word) for word in words])
        told = capfd.readouterr()
        return Ran(code, told.out, told.err)

    return call_main


def written(folder: Path, text: str | bytes, name: str = "task.yaml") -> Path:
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def files(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*")}


def refused(ran: Ran, code: int) -> str:
    assert ran.code == code, ran
    assert ran.out == ""
    assert "Traceback" not in ran.err
    assert "INT000" not in ran.err
    return str(ran.err)


def unplannable(ran: Ran) -> str:
    """A verdict, so on stdout."""
    assert ran.code == 1, ran
    assert "nothing was run" in ran.out
    assert "Traceback" not in ran.err
    return ran.out


INVALID = {
    "empty": ("", "not an empty file"),
    "binary": (b"\x00\x01\xff\xfe" * 50, "not UTF-8"),
    "list": ("- 1\n- 2\n", "expected a mapping"),
    "unclosed": ("task: [\n", "task.yaml:2:1: error"),
    "tab": ("task:\n\tx: 1\n", "task.yaml:2:1: error"),
    "twice": (f"{HEAD}task: again\n{HOME}", "task.yaml:4:1: error"),
    "tag": (f"{HEAD}steps: !!python/object/apply:os.system [id]\n", "task.yaml:4:8: error"),
    "nan": (f"{HEAD}{HOME}simulation: {{step: .nan}}\n", "task.yaml:6:20: error"),
    "key": (f"{HEAD}{HOME}simulatoin: {{}}\n", "did you mean 'simulation'"),
    "verb": (f"{HEAD}steps:\n  - mvoe: {{to: home}}\n", "did you mean 'move'"),
    "pose": (f"{HEAD}steps:\n  - move: {{to: hoem}}\n", "did you mean 'home'"),
    "object": (f"{HEAD}{SCENE}steps:\n  - lift: {{object: cpu, by: 10 cm}}\n", "did you mean 'cup'"),
    "no robot": ("task: x\nrobot: none.yaml\ncontrollers: none.yaml\nsteps:\n  - wait: 1 s\n", "there is no file"),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", INVALID)
def test_an_invalid_file_is_told_with_its_place(call: Call, tmp_path: Path, case: str) -> None:
    text, told = INVALID[case]
    task = written(tmp_path, text)
    before = files(tmp_path)
    assert told in refused(call("run", task), 4)
    assert files(tmp_path) == before

    answer = json.loads(call("run", task, "--format", "json").out)
    assert answer["verdict"] == "error"
    assert answer["errors"]
    assert all(set(error) >= {"code", "file", "line", "column", "message"} for error in answer["errors"])

    checked = call("check", task)
    assert checked.code == 1
    assert "Traceback" not in checked.err


def test_a_file_that_is_not_there_is_no_traceback(call: Call, tmp_path: Path) -> None:
    written(tmp_path, "", "pour.yaml")
    for path, told in (("poor.yaml", "did you mean 'pour.yaml'"), (".", "folder"), ("/dev/null", "not a regular file")):
        assert told in refused(call("run", path), 4)


HOSTILE = ["../../escape", "a/b", "x\x1b[31m", "n" * 300, ".."]


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_name_writes_nothing_outside_and_nothing_into_the_terminal(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    inner = tmp_path / "deep" / "deeper"
    inner.mkdir(parents=True)
    task = written(inner, HEAD.replace("task: refused", f"task: {json.dumps(name)}") + HOME)
    before = files(tmp_path)
    monkeypatch.chdir(inner)
    ran = call("run", task)
    assert "\x1b" not in ran.out + ran.err
    assert "Traceback" not in ran.err
    assert ran.code == 4, ran
    assert files(tmp_path) == before


UNPLANNABLE = {
    "out of reach": (
        "steps:\n  - move: {pose: {xyz: [1.8, 0, 0.5]}}\n",
        ("'move_1'", "reach"),
    ),
    "into the cup": (
        "steps:\n  - move: {to: {joint_2: 1.5, joint_4: -0.6}}\n",
        ("'move_1'", "'cup'", "'robot/", " s"),
    ),
    "too fast": (
        "steps:\n"
        "  - follow:\n"
        "      joint_names: [joint_1]\n"
        "      points: [{positions: [2.5], time_from_start: {secs: 0, nsecs: 100000000}}]\n",
        ("'follow_1'", "joint_1", "velocity", " s"),
    ),
    "beyond a limit": (
        "steps:\n"
        "  - follow:\n"
        "      joint_names: [joint_1]\n"
        "      points: [{positions: [3.5], time_from_start: {secs: 5}}]\n",
        ("'follow_1'", "joint_1", " s"),
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", UNPLANNABLE)
def test_an_impossible_step_is_refused_before_anything_moves(call: Call, tmp_path: Path, case: str) -> None:
    steps, told = UNPLANNABLE[case]
    task = written(tmp_path, HEAD + SCENE + "start: home\n" + steps)
    before = files(tmp_path)
    for text in (unplannable(call("run", task)), refused(call("plan", task), 1)):
        for word in told:
            assert word in text, text
    answer = json.loads(call("run", task, "--format", "json").out)
    assert (answer["task"], answer["verdict"], answer["log"]) == ("refused", "failed", None)
    assert told[0] in answer["errors"][0]["message"]
    outcomes = [step["outcome"] for step in answer["steps"]]
    assert outcomes.count("failed") == 1
    assert set(outcomes) <= {"failed", "not_run"}
    assert files(tmp_path) == before


@pytest.mark.slow
def test_a_cup_out_of_reach_is_told_with_its_step(call: Call, tmp_path: Path) -> None:
    text = unplannable(call("run", ROOT / "tasks" / "pour.yaml", "--set", "scene.cup.at=[1.12, 0.0]"))
    assert "step 'pick_1': cannot pick 'cup'" in text
    assert "reach" in text
    assert not files(tmp_path)


TYPOS = [
    ("scene.cup.mas=3", "did you mean 'mass'"),
    ("scene.cpu.mass=3", "did you mean 'cup'"),
    ("scene.cup.mass=heavy", "scene.cup.mass=heavy"),
    ("scene.cup.mass=-1", "scene.cup.mass=-1"),
    ("scene.cup.mass", "scene.cup.mass"),
    ("simulatoin.step=1 ms", "did you mean 'simulation'"),
    ("params.titl=1", "did you mean 'tilt'"),
    ("simulation.engine=bullet", "pybullet"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("override", "told"), TYPOS)
def test_a_wrong_override_names_itself_and_what_was_meant(call: Call, tmp_path: Path, override: str, told: str) -> None:
    text = refused(call("run", ROOT / "tasks" / "pour.yaml", "--set", override), 4)
    assert f"--set {override.split('=')[0]}" in text
    assert told in text
    assert not files(tmp_path)


@pytest.mark.slow
def test_a_log_is_not_overwritten_without_being_told(call: Call, tmp_path: Path) -> None:
    task = written(tmp_path, HEAD + "start: home\n" + HOME)
    log = written(tmp_path, "precious", "x.mcap")
    assert "--force" in refused(call("run", task, "--log", log, "-q"), 4)
    assert log.read_text() == "precious"
    assert call("run", task, "--log", log, "--force", "-q").code == 0
    assert log.read_bytes().startswith(b"\x89MCAP0\r\n")


@pytest.mark.slow
def test_a_log_never_replaces_a_file_of_its_task(call: Call, tmp_path: Path) -> None:
    task = written(tmp_path, HEAD + "start: home\n" + HOME)
    before = task.read_bytes()
    link = tmp_path / "link.mcap"
    link.hardlink_to(task)
    for log in (task, link):
        assert "the task reads this file" in refused(call("run", task, "--log", log, "--force", "-q"), 4)
    assert task.read_bytes() == before


@pytest.mark.slow
def test_a_log_that_cannot_be_written_is_told_before_the_simulation(call: Call, tmp_path: Path) -> None:
    task = written(tmp_path, HEAD + HOME)
    (tmp_path / "folder.mcap").mkdir()
    assert "directory" in refused(call("run", task, "--log", "folder.mcap"), 4)
    assert refused(call("run", task, "--log", "/proc/x.mcap"), 4)
    written(tmp_path, "a file where a folder should be", "runs")
    assert "'runs'" in refused(call("run", task), 4)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_read_only_folder_is_told(call: Call, tmp_path: Path) -> None:
    task = written(tmp_path, HEAD + HOME)
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o500)
    assert "ermission" in refused(call("run", task, "--log", closed / "x.mcap"), 4)


def test_what_is_no_log_is_not_judged(call: Call, tmp_path: Path) -> None:
    for name, data in (("a.mcap", b""), ("b.mcap", b"garbage" * 99), ("c.mcap", b"\x89MCAP0\r\n")):
        written(tmp_path, data, name)
        text = refused(call("judge", name), 4)
        assert re.search(r"LOG\d+", text)
        assert name in text
    refused(call("judge", "absent.mcap"), 4)


def test_check_lists_all_findings_of_all_files(call: Call, tmp_path: Path) -> None:
    one = written(tmp_path, HEAD + "steps:\n  - mvoe: {to: home}\n  - move: {to: hoem}\n", "one.yaml")
    two = written(tmp_path, HEAD + HOME + "simulatoin: {}\n", "two.yaml")
    ran = call("check", one, two)
    assert ran.code == 1
    assert len(re.findall(r"error\[", ran.out)) == 3
    for place in ("one.yaml:5:5", "one.yaml:6:16", "two.yaml:6:1"):
        assert place in ran.out, ran.out
