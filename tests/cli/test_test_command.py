"""`manipcli test` as a user and as CI meet it: verdicts, exit codes, files, signals."""

from __future__ import annotations

import json
import math
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import parse

import pytest

from manipcli.batch.job import Job
from manipcli.batch.process import Process
from manipcli.cli.app import main
from manipcli.report.suite.suite import Case, CaseReport

ROOT = Path(__file__).parents[2]
TASK = f"""\
task: {{name}}
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
simulation: {{{{engine: kinematic}}}}
steps:
  - wait: {{wait}}
expect:
  - duration: {{{{below: {{below}}}}}}
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(folder: Path, name: str, *, wait: str = "0.2 s", below: str = "10 s") -> None:
    (folder / f"{name}.yaml").write_text(TASK.format(name=name, wait=wait, below=below))


def test_nothing_to_run_is_5(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "robot.yaml").write_text("robot: r\n")
    assert main(["test"]) == 5
    assert re.fullmatch(r"✗ nothing to run in \d\.\d s, 1 process\n", capsys.readouterr().out)
    write(folder, "a")
    assert main(["test", "-k", "nothing_like_it"]) == 5
    assert capsys.readouterr().out.startswith("-k 'nothing_like_it' matches none of 1 test\n✗ nothing to run in ")


@pytest.mark.parametrize(
    "words",
    [
        ["absent"],
        ["-k", "a and"],
        ["-n", "0"],
        ["--samples", "0"],
        ["--timeout", "soon"],
        ["--timeout", "-1"],
        ["--silence", "-1 s"],
        ["--junit", "/dev/null/x.xml"],
        ["--report", "a.yaml"],
        ["--junit", "-"],
        ["--report", "-"],
    ],
)
def test_wrong_usage_is_4_and_runs_nothing(folder: Path, capsys: pytest.CaptureFixture[str], words: list[str]) -> None:
    write(folder, "a")
    assert main(["test", *words]) == 4
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.count("error[USE") == 1
    assert not (folder / "runs").exists()


@pytest.mark.parametrize("name", ["a.yaml", "a.baseline.json", "robots/r.yaml"])
def test_only_earlier_results_are_replaced_by_results(
    folder: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    (folder / "robots").mkdir()
    write(folder, "a")
    (folder / name).write_text("task: a\nrobot: r.yaml\nsteps: [\n")
    assert main(["test", ".", "--junit", name]) == 4
    assert f"error[USE089]: --junit '{name}' exists and is not JUnit XML" in capsys.readouterr().err
    assert (folder / name).read_text() == "task: a\nrobot: r.yaml\nsteps: [\n"


@pytest.mark.parametrize("option", ["--junit", "--report"])
def test_where_nothing_can_be_written_is_told_before_anything_is_run(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, option: str
) -> None:
    write(folder, "a")
    (folder / "ro").mkdir()
    monkeypatch.setattr(os, "access", lambda place, _: not str(place).endswith("ro"))  # root may write anywhere
    assert main(["test", option, "ro/x"]) == 4
    told = capsys.readouterr()
    assert (told.out, "' is not writable" in told.err) == ("", True)


def test_a_result_that_cannot_be_written_takes_nothing_from_what_is_told(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "b.yaml").write_text("task: b\nrobot: r.yaml\nsteps: [\n")
    assert main(["test", "--junit", "/dev/full", "--report", "pages", "--format", "json"]) == 4
    answer = json.loads(capsys.readouterr().out)
    assert [case["outcome"] for case in answer["cases"]] == ["invalid"]
    assert answer["notes"] == ["not written: /dev/full: No space left on device"]
    assert (folder / "pages" / "index.html").exists()
    write(folder, "b")
    done = CaseReport(Case("b.yaml", "b"), "passed", 1.0, "")
    monkeypatch.setattr("manipcli.batch.process.run_jobs", lambda *_, **__: (done for _ in range(1)))
    assert main(["test", "--junit", "/dev/full"]) == 3  # all passed, and who waits for the file does not know it


def test_a_baseline_of_no_task_is_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "old.baseline.json").write_text('{"duration": 1.0, "margins": {}, "steps": {}}')
    assert main(["test"]) == 5
    assert capsys.readouterr().out.startswith("old.baseline.json: no task has this baseline; ")


def test_an_earlier_result_or_an_empty_file_is_replaced(folder: Path) -> None:
    (folder / "out.xml").touch()
    (folder / "b.yaml").write_text("task: b\nrobot: r.yaml\nsteps: [\n")
    for _ in range(2):
        assert main(["test", "--junit", "out.xml"]) == 4
        assert len(parse(folder / "out.xml").getroot().findall(".//failure")) == 1


def test_logs_go_where_something_can_be_written(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "runs").touch()
    (folder / "b.yaml").write_text("task: b\nrobot: r.yaml\nsteps: [\n")
    assert main(["test"]) == 4
    told = capsys.readouterr()
    assert (told.out, "error[USE086]: --logs 'runs/test': " in told.err) == ("", True)
    assert "hint: name another folder with --logs DIR" in told.err
    assert main(["test", "--logs", "else/where"]) == 4
    assert "✗ 1 invalid" in capsys.readouterr().out
    assert (folder / "else" / "where" / ".cache").is_dir()


@dataclass
class Given(list[Job]):
    """What is run: nothing is. What `c` is called fails. `at_once`: of each call."""

    at_once: list[int] = field(default_factory=list)

    def run(self, jobs: Iterable[Job], *, at_once: int, **_: object) -> Iterator[CaseReport]:
        self.at_once.append(at_once)
        for job in jobs:
            self.append(job)
            yield CaseReport(job.case, "failed" if job.case.task == "c" else "passed", 1.0, "")


@pytest.fixture
def given(monkeypatch: pytest.MonkeyPatch) -> Given:
    jobs = Given()
    monkeypatch.setattr("manipcli.batch.process.run_jobs", jobs.run)
    return jobs


def test_a_silence_and_a_timeout_of_0_mean_never(folder: Path, given: Given) -> None:
    write(folder, "a")
    assert main(["test", "--silence", "0", "--timeout", "0 s"]) == 0
    assert (given[0].settings.silence, given[0].settings.timeout) == (math.inf, math.inf)


@pytest.mark.parametrize(
    ("words", "cores", "at_once"), [([], 2, 2), ([], 8, 3), (["-n", "1"], 2, 1), (["-n", "9"], 2, 3)]
)
def test_as_many_run_at_once_as_this_process_may_use_cores(
    folder: Path, given: Given, monkeypatch: pytest.MonkeyPatch, words: list[str], cores: int, at_once: int
) -> None:
    for name in "abc":
        write(folder, name)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(cores)))
    main(["test", *words])
    monkeypatch.delattr(os, "sched_getaffinity")  # as elsewhere than on Linux
    monkeypatch.setattr(sys, "platform", "darwin")
    monkeypatch.setattr(os, "cpu_count", lambda: cores)
    main(["test", *words])
    assert given.at_once == [at_once, at_once]


@pytest.mark.parametrize(
    ("names", "words", "told", "summary"),
    [
        ("abc", [], "abc", "1 failed, 2 passed in"),
        ("acd", ["-x"], "ac", "1 failed, 1 passed, 1 not run in"),
        ("abc", ["-x"], "abc", "1 failed, 2 passed in"),  # nothing was left to stop
    ],
)
def test_the_first_failure_stops_only_what_is_left(
    folder: Path, given: Given, capsys: pytest.CaptureFixture[str], names: str, words: list[str], told: str,
    summary: str,
) -> None:  # fmt: skip
    """The one in `c` fails."""
    for name in names:
        write(folder, name)
    assert main(["test", "-n", "1", *words]) == 1
    last = capsys.readouterr().out.splitlines()[-1]
    assert summary in last
    assert ("first failure" in last) is ("not run" in summary)
    assert main(["test", "-n", "1", *words, "--format", "json"]) == 1
    ids = [case["id"] for case in json.loads(capsys.readouterr().out)["cases"]]
    assert ids == [f"{n}.yaml::{n}" for n in told]


@pytest.mark.parametrize(
    ("words", "ids"),
    [
        (["--lf"], ["c.yaml::c[1]"]),
        (["--lf", "--samples", "1"], ["c.yaml::c[0]", "a.yaml::a"]),  # of these none failed
        ([], ["a.yaml::a", "c.yaml::c"]),
        (["c.yaml::c[11]"], ["c.yaml::c[11]"]),
        (["a.yaml", "c.yaml::c[3]", "-k", "c.yaml::c"], ["c.yaml::c[3]"]),
    ],
)
def test_samples_are_chosen_by_their_ids_and_by_having_failed_last(
    folder: Path, given: Given, words: list[str], ids: list[str]
) -> None:
    write(folder, "a")
    write(folder, "c")
    with (folder / "c.yaml").open("a") as file:
        file.write("vary: {simulation.settle: {uniform: [0.1 s, 0.2 s]}}\n")
    main(["test", "-n", "1", "c.yaml::c[1]"])
    given.clear()
    main(["test", "-n", "1", *words])
    assert [job.case.id for job in given] == ids


def test_nothing_of_the_users_own_pytest_is_picked_up(
    folder: Path, given: Given, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    write(folder, "a")
    (folder / "conftest.py").write_text("raise SystemExit(3)")
    (folder / "__init__.py").write_text("raise SystemExit(3)")
    (folder / "test_it.py").write_text("def test_it(): assert False")
    (folder / "pytest.ini").write_text("[pytest]\naddopts = --no-such-option\n")
    monkeypatch.setenv("PYTEST_ADDOPTS", "--no-such-option")
    monkeypatch.setenv("PYTEST_PLUGINS", "no_such_plugin")
    assert main(["test", "--format", "json"]) == 0
    assert os.environ["PYTEST_ADDOPTS"] == "--no-such-option"
    told = capfd.readouterr()
    assert [case["id"] for case in json.loads(told.out)["cases"]] == ["a.yaml::a"]
    assert told.err == "✓ passed   a.yaml::a    1.00 s\n"


def test_tasks_outside_of_the_working_directory_have_ids_of_their_own(
    folder: Path, given: Given, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "here").mkdir()
    for place in ("x", "y"):
        (folder / place).mkdir()
        write(folder / place, "a")
    monkeypatch.chdir(folder / "here")
    assert main(["test", "../x", "../y/a.yaml", "-n", "1"]) == 0
    assert [job.case.id for job in given] == [f"{folder}/x/a.yaml::a", f"{folder}/y/a.yaml::a"]


def test_a_broken_task_is_told_with_its_place(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "b.yaml").write_text("task: b\nrobot: r.yaml\nsteps: [\n")
    assert main(["test", "--github"]) == 4
    out = capsys.readouterr().out
    assert "b.yaml:4:1: error[YAML100]" in out
    assert "::error file=b.yaml,line=4,col=1,title=b invalid::" in out
    assert main(["test", "--format", "json"]) == 4
    told = capsys.readouterr()
    assert json.loads(told.out)["cases"][0]["outcome"] == "invalid"
    assert "b.yaml::b" in told.err


def test_collect_only_lists_what_would_run(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(folder, "a")
    write(folder, "b")
    assert main(["test", "--collect-only", "-k", "a or b"]) == 0
    assert capsys.readouterr().out == "a.yaml::a\nb.yaml::b\n2 tests in 2 files\n"
    assert main(["test", "--collect-only", "-k", "b", "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"total": 1, "tests": ["b.yaml::b"]}
    assert not (folder / "runs").exists()
    assert main(["test", "--collect-only", "-k", "none"]) == 5


@pytest.mark.slow
@pytest.mark.usefixtures("runs_in_threads")
def test_good_and_bad_tasks_with_everything_written(folder: Path, call_cli: Any) -> None:
    write(folder, "good")
    write(folder, "late", below="0.1 s")
    words = ["--junit", "out.xml", "--report", "pages", "--github", "-n", "2"]
    ran = call_cli("test", *words, cwd=folder)
    assert ran.code == 1, ran
    assert re.search(r"✓ passed   good.yaml::good +\d+\.\d\d s  duration: \d+\.\d s to spare", ran.out)
    assert re.search(r"✗ failed   late.yaml::late +\d+\.\d\d s  duration: fails by", ran.out)
    assert "::error file=late.yaml,line=8,col=5,title=late failed::duration: fails by" in ran.out
    assert "reproduce: manipcli run late.yaml" in ran.out
    assert re.search(r"✗ 1 failed, 1 passed in \d+\.\d s, 2 processes", ran.out)
    kept = {
        str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file() and ".cache" not in path.parts
    }
    assert kept == {
        "good.yaml", "late.yaml", "out.xml", "pages/index.html", "pages/good.html", "pages/late.html",
        "runs/test/late.mcap", "runs/test/late.png",
    }  # fmt: skip
    assert (folder / "runs" / "test" / "late.png").read_bytes().startswith(b"\x89PNG")
    links = re.findall(r'href="([^"]+\.html)"', (folder / "pages" / "index.html").read_text())
    assert links == ["late.html", "good.html"]
    for link in links:
        assert '<a href="index.html">All runs</a>' in (folder / "pages" / link).read_text()
    root = parse(folder / "out.xml").getroot()
    cases = {case.get("file"): case for case in root.iter("testcase")}
    assert {file: case.get("line") for file, case in cases.items()} == {"good.yaml": "1", "late.yaml": "8"}
    assert [file for file, case in cases.items() if case.find("failure") is not None] == ["late.yaml"]

    again = call_cli("test", "--last-failed", "--format", "json", cwd=folder)
    answer = json.loads(again.out)
    assert again.code == 1
    assert [case["id"] for case in answer["cases"]] == ["late.yaml::late"]
    assert answer["cases"][0]["troubles"][0]["line"] == 8
    mended = call_cli("test", "--last-failed", "-q", "--set", "expect.0.duration.below=9 s", cwd=folder)
    assert mended.code == 0, mended
    assert mended.out.startswith("✓ 1 passed")
    assert not (folder / "runs" / "test" / "late.mcap").exists()


@pytest.mark.slow
@pytest.mark.usefixtures("runs_in_threads")
def test_a_step_that_cannot_be_planned_is_told_at_its_line(folder: Path, call_cli: Any) -> None:
    write(folder, "far")
    path = folder / "far.yaml"
    path.write_text(path.read_text().replace("  - wait: 0.2 s", "  - move: {pose: {xyz: [9, 0, 0]}}"))
    ran = call_cli("test", "--github", cwd=folder)
    assert ran.code == 1, ran
    assert "::error file=far.yaml,line=6,col=5,title=far failed::move_1: failed: cannot be planned" in ran.out
    assert "log:" not in ran.out


@pytest.mark.slow
def test_the_first_failure_stops_where_that_is_asked(folder: Path, call_cli: Any) -> None:
    write(folder, "a", below="0.1 s")
    write(folder, "b", wait="500 s")
    ran = call_cli("test", "-x", "-n", "2", cwd=folder)
    assert ran.code == 1
    assert "1 not run" in ran.out
    assert "stopped at the first failure" in ran.out
    assert not list((folder / "runs").rglob("b.*"))


class Started:
    """The command in the background, and the processes that it has started."""

    def __init__(self, folder: Path, *words: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "manipcli", "test", *words], cwd=folder, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )  # fmt: skip
        self.folder = folder

    def child(self) -> int:
        """The process of the run, once it simulates."""
        deadline = time.monotonic() + 240.0
        while not [path for path in self.folder.rglob("*.mcap.partial") if path.stat().st_size > 300_000]:
            assert time.monotonic() < deadline
            assert self.process.poll() is None
            time.sleep(0.02)
        child = self.process.pid  # with a worker between, where several run at a time
        while children := Path(f"/proc/{child}/task/{child}/children").read_text().split():
            child = int(children[0])
        return child

    def end(self) -> tuple[int, str]:
        out, err = self.process.communicate(timeout=240.0)
        assert "Traceback" not in out + err
        return self.process.returncode, out


Signal = Callable[[signal.Signals], None]


@pytest.fixture
def signalled(monkeypatch: pytest.MonkeyPatch) -> Signal:
    """Sends a signal to the process of the run `a`, once it simulates; until then no silence is too long."""
    hear = Process.hear

    def send(number: signal.Signals) -> None:
        sent: list[int] = []

        def heard(process: Process) -> CaseReport | None:
            report = hear(process)
            if process.job.case.task != "a" or sent:
                return report
            partial = process.job.partial
            if partial.exists() and partial.stat().st_size > 300_000:
                sent.append(process._process.pid)
                os.kill(process._process.pid, number)
            process._heard = time.monotonic()
            return report

        monkeypatch.setattr(Process, "hear", heard)

    return send


@pytest.mark.slow
def test_a_crash_of_native_code_costs_one_test(folder: Path, signalled: Signal, call_cli: Any) -> None:
    write(folder, "a", wait="500 s")
    write(folder, "b")
    signalled(signal.SIGSEGV)
    ran = call_cli("test", "-n", "1", "--junit", "out.xml", cwd=folder)
    code, out = ran.code, ran.out
    assert code == 1
    assert re.search(r"✗ crashed  a.yaml::a .* crashed by signal 11 \(SIGSEGV\); step 1 of 1, 'wait_1' at \d+\.", out)
    assert "✓ passed   b.yaml::b" in out
    assert "log: runs/test/a.mcap.partial" in out
    assert "picture: runs/test/a.png" in out
    assert (folder / "runs" / "test" / "a.png").read_bytes().startswith(b"\x89PNG")
    assert "output: runs/test/a.txt" in out
    assert "Segmentation fault" in (folder / "runs" / "test" / "a.txt").read_text()
    assert parse(folder / "out.xml").getroot().find(".//failure") is not None


@pytest.mark.slow
def test_a_hang_is_ended_and_named(folder: Path, signalled: Signal, call_cli: Any) -> None:
    write(folder, "a", wait="500 s")
    signalled(signal.SIGSTOP)
    ran = call_cli("test", "--silence", "1 s", cwd=folder)
    assert ran.code == 1
    assert re.search(r"✗ hung     a.yaml::a .* hung: no progress for 1 s; step 1 of 1, 'wait_1' at \d+\.", ran.out)


@pytest.mark.slow
def test_a_run_that_takes_too_long_is_ended_and_named(folder: Path, call_cli: Any) -> None:
    write(folder, "a", wait="3600 s")
    ran = call_cli("test", "--timeout", "1 s", cwd=folder)
    assert ran.code == 1
    assert "hung: timeout after 1 s; " in ran.out


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interruption_ends_the_runs_and_still_sums_up(folder: Path, number: signal.Signals) -> None:
    write(folder, "a", wait="500 s")
    started = Started(folder)
    child = started.child()
    started.process.send_signal(number)
    code, out = started.end()
    assert code == 2
    assert re.search(r"✗ 1 not run in \d+\.\d s, 1 process; interrupted", out)
    assert "interrupted: a.yaml::a: step 1 of 1, 'wait_1' at " in out
    assert not Path(f"/proc/{child}").exists()
    assert not list((folder / "runs").rglob("a.*"))


@pytest.mark.slow
def test_a_run_ends_when_whoever_started_it_is_gone(folder: Path) -> None:
    write(folder, "a", wait="500 s")
    started = Started(folder)
    child = started.child()
    started.process.kill()
    started.process.communicate()
    deadline = time.monotonic() + 120.0
    while Path(f"/proc/{child}").exists():
        assert time.monotonic() < deadline
        time.sleep(0.02)
