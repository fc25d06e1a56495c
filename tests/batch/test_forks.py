"""Runs that are forked from a server: as independent of each other, and of the server, as new processes."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from multiprocessing import Pipe
from pathlib import Path

import pytest

from manipcli.batch.forks import ForkPool, available
from manipcli.batch.job import Beat, Job, Settings
from manipcli.batch.process import run_jobs
from manipcli.report.suite.suite import Case, CaseReport

pytestmark = pytest.mark.skipif(not available(), reason="only Linux forks")

ROOT = Path(__file__).parents[2]
SERVER = f"""
import os, signal, sys, threading, time
sys.path[:] = {sys.path!r}
from multiprocessing.connection import Connection
from manipcli.batch.fork_server import main
from manipcli.batch.job import Beat, End
def run(descriptor, prepared):
    parent = Connection(descriptor)
    job = parent.recv()
    for pid in (os.getpid(), os.getppid()):
        open(job.path.parent / f"{{pid}}.pid", "w").close()
    parent.send(Beat("begun", 2.5))
    def end():
        parent.send(End(None))
    exec(job.case.task, globals() | locals())
main(int(sys.argv[-1]), run=run)
"""
"""A server whose children do what the name of the task says."""
NEW = f"""
import os, sys
sys.path[:] = {sys.path!r}
from multiprocessing.connection import Connection
from manipcli.batch.job import Beat, End
parent = Connection(int(sys.argv[-1]))
job = parent.recv()
parent.send(Beat("in a new process"))
exec(job.case.task, {{"end": lambda: parent.send(End(None)), "os": os, "sys": sys, "new": True}})
"""
"""A new process that does the same."""


def jobs(folder: Path, *codes: str, silence: float = 60.0) -> list[Job]:
    settings = Settings(folder=folder / "runs", silence=silence)
    return [Job(Case(f"t{k}.yaml", code), folder / f"t{k}.yaml", settings) for k, code in enumerate(codes)]


def run(
    todo: list[Job], *, server: str = SERVER, observer: Callable[[Job, Beat], None] | None = None
) -> list[CaseReport]:
    """The reports of two parallel runs with the servers above, in the order of the jobs."""
    programs = ((sys.executable, "-c", NEW), (sys.executable, "-c", server))
    reports = [*run_jobs(todo, at_once=2, observer=observer, command=programs[0], server=programs[1])]
    return sorted(reports, key=lambda report: report.case.file)


def pids(folder: Path) -> list[int]:
    """The processes that were forked, and their servers."""
    return [int(path.stem) for path in folder.glob("*.pid")]


def gone(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"


def eventually(true: Callable[[], bool]) -> bool:
    deadline = time.monotonic() + 60.0
    while not true():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.01)
    return True


def test_every_end_of_a_child_costs_one_run_and_is_reported_as_of_a_new_process(tmp_path: Path) -> None:
    todo = jobs(
        tmp_path, "os.kill(os.getpid(), signal.SIGSEGV)", "os._exit(7)", "sys.exit('no physics')", "1 / 0",
        "os.kill(os.getpid(), signal.SIGKILL)", "end()",
    )  # fmt: skip
    reports = run(todo)
    texts = [reports[k].text for k in range(6)]
    assert [reports[k].outcome for k in range(6)] == ["crashed"] * 5 + ["invalid"]
    assert texts[0].startswith("crashed by signal 11 (SIGSEGV); ")
    assert texts[1] == "ended with exit code 7 before it was done: it printed nothing"
    assert texts[2] == "ended with exit code 1 before it was done: no physics"
    assert texts[3] == "ended with exit code 1 before it was done: ZeroDivisionError: division by zero"
    assert texts[4].startswith("crashed by signal 9 (SIGKILL); ")
    assert texts[4].endswith("check that there is enough memory")
    assert len(pids(tmp_path)) == 6 + 1
    assert all(map(gone, pids(tmp_path)))
    assert not any(report.notes for report in reports)


def test_a_child_ends_with_its_exit_functions_and_its_whole_output(tmp_path: Path) -> None:
    ended = tmp_path / "ended"
    leaves = f"import atexit, pathlib\natexit.register(pathlib.Path({str(ended)!r}).touch)\nprint('said')"
    report = run(jobs(tmp_path, leaves, "end()"))[0]
    assert len(pids(tmp_path)) == 2 + 1  # forked
    assert report.output is not None
    assert Path(report.output).read_text() == "said\n"
    assert ended.exists()


def test_a_child_has_its_own_session_and_output_and_no_files_of_others(tmp_path: Path) -> None:
    stays = f"while not os.path.exists({str(tmp_path / 'done')!r}): time.sleep(0.01)\nend()"
    told = (
        "files = [int(fd) for fd in os.listdir('/proc/self/fd') if os.path.lexists(f'/proc/self/fd/{fd}')]\n"
        f"open({str(tmp_path / 'done')!r}, 'w').close()\n"
        "others = {*files} - {parent.fileno(), 0, 1, 2}\n"
        "sys.exit(f'{os.getsid(0) == os.getpid()} {os.readlink(\"/proc/self/fd/1\")} {sys.stdin.read()!r} {others}')"
    )
    reports = run(jobs(tmp_path, stays, told))
    assert reports[1].output is not None
    assert Path(reports[1].output).read_text() == f"True {reports[1].output} '' set()\n"
    assert reports[0].outcome == "invalid"


def test_a_hang_is_ended_with_its_last_words_and_the_others_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("manipcli.batch.process.LAST_WORDS", 2.0)
    stuck = (
        "import faulthandler; faulthandler.register(signal.SIGUSR1)\n"
        "def stuck_here():\n while True: time.sleep(1)\nstuck_here()"
    )
    stopped = "os.kill(os.getpid(), signal.SIGSTOP)"
    reports = run(jobs(tmp_path, stuck, "end()", stopped, "end()", silence=1.0))
    assert [reports[k].outcome for k in range(4)] == ["hung", "invalid", "hung", "invalid"]
    assert reports[0].output is not None and "stuck_here" in Path(reports[0].output).read_text()
    assert len(pids(tmp_path)) == 4 + 1
    assert all(map(gone, pids(tmp_path)))


def test_a_server_that_dies_takes_no_run_with_it_and_is_named(tmp_path: Path) -> None:
    """The run that kills its server ends well, one that crashes then has no exit code, and the others are started
    without a server."""
    begun, killed = str(tmp_path / "begun"), str(tmp_path / "killed")
    until = "while not os.path.exists({!r}): time.sleep(0.01)\n"
    kills = f"{until.format(begun)}os.kill(os.getppid(), signal.SIGKILL); open({killed!r}, 'w').close(); end()"
    crashes = f"open({begun!r}, 'w').close()\n{until.format(killed)}os._exit(9)"
    new = "sys.exit('new') if 'new' in globals() else sys.exit('forked')"
    reports = run(jobs(tmp_path, kills, crashes, new, new))
    assert [reports[k].outcome for k in range(4)] == ["invalid", "crashed", "crashed", "crashed"]
    assert "exit code unknown as the fork server ended" in reports[1].text
    assert [reports[k].text.rpartition(" ")[2] for k in (2, 3)] == ["new", "new"]
    notes = [note for k in range(4) for note in reports[k].notes]
    assert notes == ["the fork server was ended by signal 9 (SIGKILL); runs are started without it"]


@pytest.mark.parametrize(
    ("server", "note"),
    [
        ("raise SystemExit('oh')", "the fork server ended with exit code 1: oh; runs are started without it"),
        (SERVER.replace("main(", "threading.Thread(target=time.sleep, args=(60,), daemon=True).start(); main("), None),
    ],
)  # fmt: skip
def test_where_no_process_can_be_forked_new_ones_are_started(tmp_path: Path, server: str, note: str | None) -> None:
    """Also where the server has threads: a lock that one of them holds would stay locked in a child."""
    new = "sys.exit('new') if 'new' in globals() else sys.exit('forked')"
    reports = run(jobs(tmp_path, new, new), server=server)
    assert [reports[k].text.rpartition(" ")[2] for k in (0, 1)] == ["new", "new"]
    assert [*reports[0].notes, *reports[1].notes] == ([] if note is None else [note])


def test_an_interrupt_leaves_no_process_and_no_file(tmp_path: Path) -> None:
    codes = ["open(job.partial, 'w').close(); parent.send(Beat('written')); time.sleep(100)"] * 2
    written: set[str] = set()

    def interrupt(job: Job, beat: Beat) -> None:
        written.update([job.case.file] if beat.activity == "written" else [])
        if len(written) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(jobs(tmp_path, *codes), observer=interrupt)
    assert not list((tmp_path / "runs").iterdir())
    assert len(pids(tmp_path)) == 2 + 1
    assert all(map(gone, pids(tmp_path)))


def test_servers_and_children_end_with_their_parent(tmp_path: Path) -> None:
    """Also if it is killed: their sockets to it are closed."""
    program = (
        "import sys; from pathlib import Path; from manipcli.batch.process import run_jobs\n"
        "from manipcli.batch.job import Job, Settings; from manipcli.report.suite.suite import Case\n"
        "todo = [Job(Case(f't{k}.yaml', 'parent.poll(None)'), Path(f't{k}.yaml'), Settings()) for k in range(2)]\n"
        f"[*run_jobs(todo, at_once=2, server=(sys.executable, '-c', {SERVER!r}))]"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    parent = subprocess.Popen([sys.executable, "-c", program], cwd=tmp_path, env=environment)
    assert eventually(lambda: len(pids(tmp_path)) == 2 + 1)
    assert not any(map(gone, pids(tmp_path)))
    parent.kill()
    parent.wait()
    assert eventually(lambda: all(map(gone, pids(tmp_path))))


MASS = "scene.cup.mass: {uniform: [50 g, 300 g]}"
VARIED = f"""\
task: varied
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
simulation: {{engine: kinematic}}
scene:
  desk: {{box: {{size: [0.6, 1.0, 0.4]}}, pose: {{xyz: [0.85, 0, 0.2]}}, fixed: true}}
  cup: {{box: {{size: [0.06, 0.06, 0.1]}}, mass: 150 g, rests_on: desk, at: [0.75, 0.0]}}
steps:
  - wait: 0.1 s
vary:
  {MASS}
"""


@pytest.fixture
def pool(tmp_path: Path) -> Iterator[Callable[[str], tuple[ForkPool, list[Job]]]]:
    """A pool for 6 samples of a task with this text."""
    pools: list[ForkPool] = []

    def opened(text: str) -> tuple[ForkPool, list[Job]]:
        file = tmp_path / "varied.yaml"
        file.write_text(text)
        code = "sys.exit(f'{prepared is not None} {prepared is not None and prepared.plan is not None}')"
        todo = [Job(Case("v.yaml", code, k), file, Settings(folder=tmp_path / "runs")) for k in range(6)]
        pools.append(ForkPool(todo, command=(sys.executable, "-c", SERVER)))
        pools[-1].open()
        return pools[-1], todo

    yield opened
    for each in pools:
        each.close()


def answer(pool: ForkPool, job: Job, output: Path) -> str:
    """What the forked process of a job prints."""
    ours, childs = Pipe()
    with ours, output.open("wb") as file:
        with childs:
            process = pool.start(job, childs.fileno(), file.fileno())
        assert process is not None
        ours.send(job)
        process.wait(60.0)
    return output.read_text().strip()


@pytest.mark.parametrize(
    ("text", "given"),
    [
        (VARIED, "True True"),
        (VARIED.replace(MASS, "scene.cup.at: {offset: {uniform: [0, 1 cm]}}"), "True False"),
        (VARIED.replace("wait: 0.1 s", "wait: soon"), "False False"),
    ],
)  # fmt: skip
def test_samples_of_one_task_are_forked_from_a_template_that_has_loaded_it(
    tmp_path: Path, pool: Callable[[str], tuple[ForkPool, list[Job]]], text: str, given: str
) -> None:
    """And planned it, where that can serve. Until it is ready, and where it has failed, they are forked from the first
    server."""
    opened, todo = pool(text)
    assert answer(opened, todo[0], tmp_path / "0") == "False False"
    (template,) = opened._templates.values()
    assert template is not None
    process = template._process
    try:
        template.ready(60.0)
    except Exception:  # noqa: BLE001 (it has died, as it must for the last text)
        assert given == "False False"
    assert answer(opened, todo[1], tmp_path / "1") == given
    assert answer(opened, todo[2], tmp_path / "2") == given
    opened.close()
    assert gone(process.pid)


def test_a_forked_sample_has_the_bytes_of_one_that_is_run_alone(tmp_path: Path) -> None:
    file = tmp_path / "varied.yaml"
    file.write_text(VARIED)
    settings = Settings(folder=tmp_path / "runs", keep_logs=True)
    todo = [Job(Case("v.yaml", "varied", k, tags=("engine_kinematic",)), file, settings) for k in range(5)]
    reports = [*run_jobs(todo, at_once=1)]
    assert [report.outcome for report in reports] == ["passed"] * 5
    from manipcli.pipeline import run_task

    for k in (0, 4):  # one from each server
        run_task(file, sample=k, log=tmp_path / "alone.mcap", force=True)
        assert todo[k].log.read_bytes() == (tmp_path / "alone.mcap").read_bytes()
    assert todo[4].log.read_bytes() != todo[0].log.read_bytes()
