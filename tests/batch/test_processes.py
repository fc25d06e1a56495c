"""Each run in a process of its own: whatever it does, the others go on and it is named."""

from __future__ import annotations

import errno
import os
import pickle
import signal
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from multiprocessing import Pipe
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, cast

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from manipcli.batch.child import _Beats, _end_of
from manipcli.batch.job import Beat, End, Job, Settings, limit
from manipcli.batch.process import Process, run_job, run_jobs
from manipcli.cli.task_session import remove_empty
from manipcli.core.errors import Diagnostic, Place
from manipcli.judge.verdict import ExpectationOutcome, StepOutcome, Verdict
from manipcli.record.faults import RecordingFailed
from manipcli.report.run_report import RunReport, Timing
from manipcli.report.suite.suite import Case, CaseReport, Trouble

if TYPE_CHECKING:
    from manipcli.task.plan_steps import PlannedStep

CHILD = f"""
import os, signal, sys, time
sys.path[:] = {sys.path!r}
from multiprocessing.connection import Connection
from manipcli.batch.job import Beat, End
parent = Connection(int(sys.argv[-1]))
job = parent.recv()
parent.send(Beat("step 1 of 1, 'lift_1'", 2.5))
def begin():
    open(job.settings.folder.parent / "began", "w").close()
exec(job.case.task)
"""
"""Speaks with its parent as the real one does, and does what the name of the task says."""
END = "parent.send(End(None, (), ()))"


def jobs(tmp_path: Path, *codes: str, **settings: float) -> list[Job]:
    chosen = replace(Settings(folder=tmp_path / "runs"), silence=30.0, **settings)  # type: ignore[arg-type]
    return [Job(Case(f"t{k}.yaml", code), tmp_path / f"t{k}.yaml", chosen) for k, code in enumerate(codes)]


def run(
    todo: Sequence[Job], *, at_once: int = 1, observer: Callable[[Job, Beat], None] | None = None
) -> list[CaseReport]:
    return [*run_jobs(todo, at_once=at_once, observer=observer, command=(sys.executable, "-c", CHILD))]


@pytest.fixture
def clock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock of processes stops until a child has called `begin()`: however slow its start is, it takes no time."""
    began: list[float] = []

    def monotonic() -> float:
        if not began and (tmp_path / "began").exists():
            began.append(time.monotonic())
        return time.monotonic() - began[0] if began else 0.0

    monkeypatch.setattr("manipcli.batch.process.time", SimpleNamespace(monotonic=monotonic))


def test_jobs_run_in_parallel_and_are_reported_in_the_order_in_which_they_end(tmp_path: Path) -> None:
    """The first one waits for a file of the third, which starts when the second one has ended."""
    late = f"while not os.path.exists({str(tmp_path / 'x')!r}): time.sleep(0.01)\n{END}"
    starts: list[str] = []

    def observe(job: Job, beat: Beat) -> None:
        if beat.activity == "starting" and job.case.id not in starts:
            starts.append(job.case.id)

    todo = jobs(tmp_path, late, END, f"open({str(tmp_path / 'x')!r}, 'w').close(); {END}")
    reports = run(todo, at_once=2, observer=observe)
    assert starts == [job.case.id for job in todo]
    assert reports[0].case.file == "t1.yaml"
    assert {report.outcome for report in reports} == {"invalid"}
    assert len(reports) == 3


def test_closing_ends_what_is_running_and_removes_its_files(tmp_path: Path) -> None:
    pid = tmp_path / "pid"
    stays = f"open({str(tmp_path / 'new')!r}, 'w').write(str(os.getpid())); "
    stays += f"os.rename({str(tmp_path / 'new')!r}, {str(pid)!r}); time.sleep(100)"
    ends = f"while not os.path.exists({str(pid)!r}): time.sleep(0.01)\n{END}"
    reports = run_jobs(jobs(tmp_path, stays, ends), at_once=2, command=(sys.executable, "-c", CHILD))
    assert next(reports).case.file == "t1.yaml"
    reports.close()
    with pytest.raises(ProcessLookupError):
        os.kill(int(pid.read_text()), 0)
    assert not list((tmp_path / "runs").iterdir())


@pytest.mark.parametrize("number", [signal.SIGSEGV, signal.SIGABRT, signal.SIGKILL])
def test_a_crash_costs_one_run_and_names_signal_and_step(tmp_path: Path, number: signal.Signals) -> None:
    one, other = sorted(run(jobs(tmp_path, f"os.kill(os.getpid(), {int(number)})", END)), key=lambda r: r.case.file)
    assert one.outcome == "crashed"
    assert f"crashed by signal {int(number)} ({number.name}); step 1 of 1, 'lift_1' at 2.50 s" in one.text
    assert other.outcome == "invalid"  # it came to its end, and said that there was nothing to run


def test_a_crash_has_the_line_of_its_step_and_a_page_with_what_it_left(tmp_path: Path) -> None:
    code = (
        "parent.send(Beat('step 1', 2.5, written='t0.yaml:8:5')); print('<last> words', flush=True)\n"
        "open(job.log.with_name(job.log.name + '.partial'), 'w').close(); os.abort()"
    )
    (job,) = jobs(tmp_path, code)
    (report,) = run([replace(job, settings=replace(job.settings, pages=tmp_path / "pages"))])
    assert report.troubles[0].place == Place("t0.yaml", 8, 5)
    assert report.page == str(tmp_path / "pages" / "t0.html")
    page = Path(report.page).read_text("utf-8")
    assert "crashed by signal 6" in page
    assert "t0.yaml:8:5" in page
    assert 'href="../runs/t0.mcap.partial"' in page
    assert "&lt;last&gt; words" in page


@pytest.mark.parametrize("written", ["", "--set steps.0.wait=1 s:0:0"])
def test_what_is_written_nowhere_has_no_line(written: str) -> None:
    assert Beat("loading", written=written).place("t.yaml") is None


def test_an_exit_without_an_end_is_a_crash_with_the_last_words(tmp_path: Path) -> None:
    (report,) = run(jobs(tmp_path, "print('before'); sys.exit('no physics here')"))
    assert (report.outcome, report.text) == (
        "crashed",
        "ended with exit code 1 before it was done: no physics here",
    )
    assert report.output is not None
    assert Path(report.output).read_text().splitlines() == ["before", "no physics here"]


def test_a_disk_that_is_full_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its run says so to its parent: the file of its last words lies on the same disk."""
    (job,) = jobs(tmp_path, "")
    full = RecordingFailed(job.partial, "No space left on device", time=0.5)

    def refused(*_: object, **__: object) -> None:
        raise full

    monkeypatch.setattr("manipcli.pipeline.run_task", refused)
    _ours, childs = Pipe()
    end = _end_of(job, _Beats(childs))
    assert (end.report, end.findings, [one.at for one in end.troubles]) == (None, (), [0.5])
    code = f"import pickle; open(job.partial, 'w').close(); parent.send(pickle.loads({pickle.dumps(end)!r}))"
    (job,) = jobs(tmp_path, code)
    (report,) = run([replace(job, settings=replace(job.settings, pages=tmp_path / "pages"))])
    assert (report.outcome, report.text) == ("error", str(full))
    assert (report.log, report.output) == (str(job.partial), None)
    assert report.page is not None and "No space left on device" in Path(report.page).read_text("utf-8")


@pytest.mark.parametrize("wanted", [None, "3"])
def test_a_run_is_out_of_reach_of_its_terminal_and_has_one_thread_for_libraries(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wanted: str | None
) -> None:
    """What is said of an earlier run of the same name is gone, and what somebody said of threads is kept."""
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "t0.txt").write_text("what an earlier crash left\n")
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    if wanted is not None:
        monkeypatch.setenv("OMP_NUM_THREADS", wanted)
    told = "{os.getsid(0) == os.getpid()} {os.environ['OMP_NUM_THREADS']} {sys.stdin.read()!r}"
    (report,) = run(jobs(tmp_path, f"sys.exit(f{told!r})"))
    assert report.output is not None
    assert Path(report.output).read_text() == f"True {wanted or 1} ''\n"


def test_a_run_whose_files_cannot_be_written_costs_itself_alone(tmp_path: Path) -> None:
    long, other = jobs(tmp_path, END, "os.abort()")
    long = replace(long, case=replace(long.case, file=f"{'x' * 245}.yaml"))
    one, other_report = run([long, other])
    assert (one.case, one.outcome, other_report.outcome) == (long.case, "error", "crashed")
    assert "File name too long" in one.troubles[0].message


def test_a_process_that_never_begins_is_a_crash(tmp_path: Path) -> None:
    for _ in range(3):  # whether it is gone before it is spoken to is a matter of luck
        report = run_job(jobs(tmp_path, END)[0], command=("/bin/false",))
        assert (report.outcome, report.text) == (
            "crashed",
            "ended with exit code 1 before it was done: it printed nothing",
        )


HALF = "os.write(int(sys.argv[-1]), (1000).to_bytes(4, 'big') + b'half')\n"


def test_a_crash_in_the_middle_of_a_message_costs_one_run(tmp_path: Path) -> None:
    one, other = sorted(run(jobs(tmp_path, f"{HALF}os.abort()", END)), key=lambda r: r.case.file)
    assert (one.outcome, other.outcome) == ("crashed", "invalid")
    assert "SIGABRT" in one.text


def test_half_a_message_and_what_stays_after_the_end_hold_nobody_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("manipcli.batch.process.HALF_SAID", 0.3)
    stays = f"{END}\nparent.close(); time.sleep(100)"
    one, other = sorted(run(jobs(tmp_path, f"{HALF}time.sleep(100)", stays)), key=lambda r: r.case.file)
    assert (one.outcome, one.text) == (
        "hung",
        "hung: it stopped in the middle of a message; step 1 of 1, 'lift_1' at 2.50 s",
    )
    assert (other.outcome, other.text) == ("invalid", "the task cannot be run")


@pytest.mark.usefixtures("clock")
def test_silence_is_a_hang_and_leaves_where_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stuck = (
        "import faulthandler; faulthandler.register(signal.SIGUSR1)\n"
        "def stuck_here():\n begin()\n while True: time.sleep(1)\nstuck_here()"
    )
    monkeypatch.setattr("manipcli.batch.process.LAST_WORDS", 2.0)
    todo = [replace(job, settings=replace(job.settings, silence=0.5)) for job in jobs(tmp_path, stuck)]
    (report,) = run(todo)
    assert report.outcome == "hung"
    assert report.text == "hung: no progress for 0.5 s; step 1 of 1, 'lift_1' at 2.50 s"
    assert report.output is not None
    assert "stuck_here" in Path(report.output).read_text()


@pytest.mark.parametrize("forever", [limit(0.0), 1e300])
@pytest.mark.parametrize("watched", [False, True])
def test_no_limit_is_none(tmp_path: Path, forever: float, watched: bool) -> None:
    (job,) = jobs(tmp_path, f"time.sleep(0.3); {END}", timeout=forever)
    job = replace(job, settings=replace(job.settings, silence=forever))
    observer = (lambda _, __: None) if watched else None
    (report,) = run([job], observer=observer)
    assert report.outcome == "invalid"


def test_a_step_that_is_planned_again_and_the_end_of_one_are_signs_of_life() -> None:
    ours, childs = Pipe()
    step = cast("PlannedStep", SimpleNamespace(id="pick_1", place="t.yaml:8:5"))
    beats = _Beats(childs)
    beats.step_started(step, 1, 2)
    beats.tick(2.5, 1.0)
    beats.message("planned again", detail=True)
    beats.step_ended(StepOutcome("pick_1", "pick", "done", started=2.0, ended=2.5, planned_duration=0.5))
    heard = [cast("Beat", ours.recv()) for _ in range(4)]
    assert {beat.place("tasks/t.yaml") for beat in heard} == {Place("tasks/t.yaml", 8, 5)}
    told = [str(beat) for beat in heard]
    one = "step 2 of 2, 'pick_1'"
    assert told == [one, f"{one} at 2.50 s", f"{one} at 2.50 s", f"after {one} at 2.50 s"]


@pytest.mark.slow
@pytest.mark.usefixtures("clock")
def test_signs_of_life_are_no_silence_but_do_not_stop_the_clock(tmp_path: Path) -> None:
    busy = "begin()\nwhile True: time.sleep(0.02); parent.send(Beat('busy'))"
    todo = [replace(job, settings=replace(job.settings, silence=1.0)) for job in jobs(tmp_path, busy, timeout=2.2)]
    began = time.monotonic()
    (report,) = run(todo)
    assert time.monotonic() - began >= 2.2
    assert report.text == "hung: timeout after 2.2 s; busy"


@pytest.mark.slow
@pytest.mark.usefixtures("clock")
def test_what_is_made_of_a_run_that_is_over_is_not_its_time(tmp_path: Path) -> None:
    code = f"begin(); parent.send(Beat('judged', judged=True)); time.sleep(2.5); {END}"
    (job,) = jobs(tmp_path, code, timeout=2.0)
    (report,) = run([replace(job, settings=replace(job.settings, silence=2.0))])
    assert report.outcome == "invalid"
    assert report.duration < 2.0


def test_warnings_arrive_with_the_end(tmp_path: Path) -> None:
    doubt = Diagnostic("CTRL153", "weak", Place("c.yaml", 1, 2), severity="warning")
    end = pickle.dumps(End(None, warnings=(doubt,)))
    (report,) = run(jobs(tmp_path, f"import pickle; parent.send(pickle.loads({end!r}))"))
    assert report.warnings == (doubt,)
    _, childs = Pipe()
    beats = _Beats(childs)
    beats.warned([doubt])
    assert beats.warnings == (doubt,)


@pytest.mark.usefixtures("clock")
def test_a_process_that_takes_no_signal_is_ended_too(tmp_path: Path) -> None:
    (job,) = jobs(tmp_path, "begin(); os.kill(os.getpid(), signal.SIGSTOP)")
    (report,) = run([replace(job, settings=replace(job.settings, silence=0.2))])
    assert report.outcome == "hung"


def test_an_interrupt_leaves_no_process_and_no_file(tmp_path: Path) -> None:
    code = "open(job.partial, 'w').close(); parent.send(Beat(f'{os.getpid()}')); time.sleep(100)"
    seen: list[str] = []

    def interrupt(_: Job, beat: Beat) -> None:
        seen.append(beat.activity)
        if beat.activity.isdecimal():
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(jobs(tmp_path, code), observer=interrupt)
    assert not list((tmp_path / "runs").iterdir())
    with pytest.raises(ProcessLookupError):
        os.kill(int(seen[-1]), 0)


VERDICT = Verdict(
    task="t", verdict="passed", seed=1, engine="pybullet", simulated_time=1.0, steps=(),
    expectations=(ExpectationOutcome("near", "passed", 0.01, "m", 1.0),),
)  # fmt: skip


@pytest.mark.parametrize(
    ("verdict", "outcome", "kept"), [("passed", "passed", False), ("failed", "failed", True), ("error", "error", True)]
)
def test_the_verdict_arrives_whole_and_only_what_failed_keeps_its_log(
    tmp_path: Path, verdict: str, outcome: str, kept: bool
) -> None:
    sent = RunReport(
        replace(VERDICT, verdict=verdict),
        log="x",
        timing=Timing(0, 0, 1, 0),  # type: ignore[arg-type]
    )
    code = f"import pickle; open(job.log, 'w').close(); parent.send(pickle.loads({_pickled(sent)!r}))"
    (report,) = run(jobs(tmp_path, code))
    assert (report.outcome, report.run) == (outcome, sent if kept else replace(sent, log=None))
    assert (tmp_path / "runs" / "t0.mcap").exists() == kept == (report.log is not None)
    assert report.output is None


def _pickled(report: RunReport) -> bytes:
    troubles = () if report.verdict.verdict == "passed" else (Trouble("x", Place("t0.yaml", 1, 1)),)
    return pickle.dumps(End(report, troubles=troubles))


def test_nothing_in_the_working_directory_is_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("manipcli.batch.process.CHILD", f"import json{CHILD}")
    Path("json.py").write_text("raise SystemExit('not the library')")
    report = run_job(jobs(tmp_path, END)[0])
    assert (report.outcome, report.text) == ("invalid", "the task cannot be run")


def test_what_a_crash_left_is_drawn_with_the_meshes_of_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("json.py").write_text("raise SystemExit('not the library')")
    drawer = tmp_path / "other" / "manipcli" / "batch"
    drawer.mkdir(parents=True)
    for package in (drawer.parent, drawer):
        (package / "__init__.py").touch()
    (drawer / "failure_report.py").write_text("def draw(log, picture, **how): picture.write_text(f'{log.name} {how}')")
    monkeypatch.syspath_prepend(tmp_path / "other")
    (job,) = jobs(tmp_path, "open(job.partial, 'w').close(); os.abort()")
    settings = replace(job.settings, package_path=(tmp_path,), allow_outside=True)
    (report,) = run([replace(job, settings=settings)])
    assert report.picture is not None
    how = {"package_path": [tmp_path], "allow_outside": True}
    assert Path(report.picture).read_text() == f"t0.mcap.partial {how}"


def test_a_task_that_another_batch_is_running_is_an_error_and_leaves_its_files(tmp_path: Path) -> None:
    (job,) = jobs(tmp_path, "open(job.partial, 'w').close(); time.sleep(100)")
    other = Process(job, command=(sys.executable, "-c", CHILD))
    try:
        deadline = time.monotonic() + 120.0
        while not job.partial.exists():
            assert time.monotonic() < deadline
            time.sleep(0.01)
        (report,) = run([job])
        assert (report.outcome, report.log, report.output, report.run) == ("error", None, None, None)
        assert "another process is running this task" in report.troubles[0].message
        assert job.partial.exists()
    finally:
        other.forget()
    assert not job.output.exists()
    (report,) = run([replace(job, case=replace(job.case, task=END))])
    assert report.outcome == "invalid"  # it came to its end, and said that there was nothing to run


def test_no_process_to_be_had_is_not_another_batch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object, **__: object) -> None:
        raise OSError(errno.EAGAIN, "Resource temporarily unavailable")  # a BlockingIOError

    monkeypatch.setattr("manipcli.batch.process.subprocess.Popen", refused)
    (report,) = run(jobs(tmp_path, END))
    assert report.outcome == "error"  # and not the fault of the file
    assert report.text.startswith("the task cannot be run: ")
    assert "Resource temporarily unavailable" in report.troubles[0].message


def test_a_folder_without_locks_runs_its_tasks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def unsupported(*_: object) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr("manipcli.core.lock.flock", unsupported)
    (report,) = run(jobs(tmp_path, END))
    assert report.text == "the task cannot be run"  # it came to its end, and said that there was nothing to run


def test_what_an_earlier_run_left_is_not_taken_for_what_this_one_leaves(tmp_path: Path) -> None:
    (tmp_path / "runs").mkdir()
    for suffix in (".mcap", ".png", ".mcap.partial", ".html"):
        (tmp_path / "runs" / f"t0{suffix}").write_text("old")
    (job,) = jobs(tmp_path, "sys.exit(3)")
    (report,) = run([replace(job, settings=replace(job.settings, pages=tmp_path / "runs"))])
    assert (report.log, report.picture) == (None, None)
    assert report.page is not None
    assert "ended with exit code 3" in Path(report.page).read_text("utf-8")


def test_folders_that_hold_nothing_are_removed(tmp_path: Path) -> None:
    (tmp_path / "runs" / "test" / "a" / "b").mkdir(parents=True)
    (tmp_path / "runs" / "test" / "c").mkdir()
    (tmp_path / "runs" / "test" / "c" / "x.mcap").touch()
    remove_empty(tmp_path / "runs" / "test")
    assert {path.name for path in tmp_path.rglob("*")} == {"runs", "test", "c", "x.mcap"}
    (tmp_path / "runs" / "test" / "c" / "x.mcap").unlink()
    remove_empty(tmp_path / "runs" / "test")
    assert {path.name for path in tmp_path.rglob("*")} == {"runs"}


def test_a_file_that_cannot_be_read_starts_no_process(tmp_path: Path) -> None:
    (job,) = jobs(tmp_path, "never")
    finding = Diagnostic("YAML100", "quotes", Place("t0.yaml", 3, 4), hint="close them")
    note = Diagnostic("YAML105", "tabs", Place("t0.yaml", 1, 1), severity="note")
    (report,) = run([replace(job, case=replace(job.case, findings=(note, finding)))])
    assert (report.outcome, report.troubles) == (
        "invalid",
        (Trouble("error[YAML100]: quotes (hint: close them)", finding.place),),
    )
    assert report.warnings == (note,)
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize(
    ("file", "sample", "log"),
    [
        ("tasks/pour.yaml", None, "tasks/pour.mcap"),
        ("tasks/pour.yml", None, "tasks/pour@yml.mcap"),
        ("tasks/pour.yaml", 17, "tasks/pour@17.mcap"),
        ("../other/pour.yaml", None, "__/other/pour.mcap"),
        ("/abs/pour.v2.yaml", None, "_/abs/pour.v2.mcap"),
    ],
)
def test_a_log_is_named_by_its_task(file: str, sample: int | None, log: str) -> None:
    assert Job(Case(file, "pour", sample), Path(file), Settings()).log == Path("runs/test") / log


STEMS = st.text("x1-@.ymal_", min_size=1, max_size=5).filter(lambda stem: not stem.startswith("."))
FILES = st.builds(
    lambda root, folders, stem, suffix: root + "".join(f"{name}/" for name in folders) + stem + suffix,
    st.sampled_from(["", "/"]),
    st.lists(st.sampled_from(["..", "_", "__", "___", "____", "t", "@", "x.yaml"]), max_size=2),
    STEMS | st.sampled_from(["index", "x", "x@yml", "x@1", "x-1", "x.yml"]),
    st.sampled_from([".yaml", ".yml"]),
)
CASES = st.tuples(FILES, st.none() | st.integers(0, 11))


@given(CASES, CASES)
@example(("x.yaml", None), ("x.yml", None))
@example(("pour.yaml", 1), ("pour-1.yaml", None))
@example(("pour.yml", 1), ("pour@yml.yaml", 1))
@example(("/t/x.yaml", None), ("t/x.yaml", None))
@example(("../x.yaml", None), ("__/x.yaml", None))
@example(("index.yaml", None), ("index@yaml.yaml", None))
def test_no_two_cases_share_a_file(one: tuple[str, int | None], other: tuple[str, int | None]) -> None:
    settings = Settings(pages=Path("pages"))
    a, b = (Job(Case(file, "t", sample), Path(file), settings) for file, sample in (one, other))
    of_a, of_b = ({job.log, job.partial, job.picture, job.output, job.page} for job in (a, b))
    assert len(of_a) == len(of_b) == 5
    assert not {".." for path in of_a if ".." in path.parts}
    assert Path("pages/index.html") not in of_a | of_b
    assert of_a == of_b if one == other else not of_a & of_b


def test_a_page_leads_back_to_the_index() -> None:
    deep = Case("../a b/t.yaml", "t")
    assert Job(deep, Path(), Settings(pages=Path("rep"))).index == "../../index.html"
    assert Job(deep, Path(), Settings()).index == ""


def test_the_command_that_does_it_again_can_be_pasted_into_a_shell() -> None:
    settings = Settings(overrides=("scene.cup.mass=80 g",), seed=4, package_path=(Path("p q"),), allow_outside=True)
    assert Job(Case("my tasks/a.yaml", "a", 17), Path("x"), settings).command() == (
        "manipcli run 'my tasks/a.yaml' --seed 4 --sample 17 --set 'scene.cup.mass=80 g' --package-path 'p q' "
        "--allow-outside"
    )
    assert Job(Case("-x'.yaml", "x"), Path("x"), Settings()).command("test") == """manipcli test './-x'"'"'.yaml'"""


def test_what_is_worse_than_its_baseline_is_seen_again_by_testing(tmp_path: Path) -> None:
    good = RunReport(VERDICT, Timing(0, 0, 1, 0), log="x")
    end = pickle.dumps(End(good, troubles=(Trouble("worse than the baseline: the task takes 2 s"),)))
    (report,) = run(jobs(tmp_path, f"import pickle; parent.send(pickle.loads({end!r}))"))
    assert (report.outcome, report.command) == ("failed", "manipcli test t0.yaml")
