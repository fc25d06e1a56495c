"""A sweep: its journal survives what interrupts it, and its results are a function of task, seed and number."""

from __future__ import annotations

import json
import random
import re
import resource
import sys
from collections.abc import Callable, Generator, Iterable
from pathlib import Path

import pytest

from manipcli.batch.job import Settings
from manipcli.core.errors import InvalidInput
from manipcli.sweep.analysis import Analysis
from manipcli.sweep.journal import Journal, identity, read_journal
from manipcli.sweep.local import SweepStopped, local_backend
from manipcli.sweep.results import Margin, SampleResult
from manipcli.sweep.sampling import Sampling
from manipcli.sweep.statistics import Rate
from manipcli.sweep.sweep import Progress, Sweep, collected, read_until, run_sweep
from manipcli.sweep.sweep_page import render_page
from manipcli.sweep.table import render_csv
from manipcli.sweep.text import progress_text, render_json, render_text
from manipcli.task.load_task import load_task
from tests.conftest import RunCli

ROOT = Path(__file__).parents[2]
TASK = f"""\
task: held
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
simulation: {{engine: kinematic, control_period: 10 ms, step: 10 ms, settle: 0}}
frames: {{mark: {{pose: {{xyz: [0.6, 0.4, 0.025]}}}}}}
scene:
  block: {{box: {{size: [5 cm, 5 cm, 5 cm]}}, fixed: true, pose: {{xyz: [0.6, 0.4, 0.025]}}}}
steps: [{{wait: 50 ms}}]
expect: [{{near: {{object: block, to: mark, within: 1 cm}}}}]
vary:
  scene.block.pose.xyz: {{offset: {{uniform: [[0, 0, 0], [2 cm, 0, 0]]}}}}
  scene.block.friction: {{uniform: [0.5, 1.0]}}
"""
"""It passes where the block is within 1 cm of its mark."""


@pytest.fixture(scope="module")
def sampling(tmp_path_factory: pytest.TempPathFactory) -> Sampling:
    path = tmp_path_factory.mktemp("task") / "held.yaml"
    path.write_text(TASK)
    return Sampling(path, Settings())


def offset(sampling: Sampling, number: int) -> float:
    """[m] of the block from its mark."""
    return sampling.values(number)[0] - 0.6


def result(sampling: Sampling, number: int) -> SampleResult:
    """What an ideal run gives: the margin in closed form."""
    margin = 0.01 - offset(sampling, number)
    found = Margin("near", "m", margin, margin / 0.01, margin < 0.0)
    return SampleResult(number, "failed" if found.missed else "passed", "far" * found.missed, "", 0.1, (found,))


class Backend:
    """Gives ideal results in a random order, as many as it is allowed to; counts them."""

    def __init__(self, sampling: Sampling, *, seed: int = 0, most: int = 10**9) -> None:
        self.sampling, self.seed, self.most = sampling, seed, most
        self.ran: list[int] = []

    def __call__(self, numbers: Iterable[int], *, beat: Callable[[], None]) -> Generator[SampleResult, None, None]:
        todo, rng = [*numbers], random.Random(self.seed)
        while todo:
            number = todo.pop(rng.randrange(min(4, len(todo))))  # four workers: one of the next four ends first
            if len(self.ran) == self.most:
                raise KeyboardInterrupt
            self.ran.append(number)
            beat()
            yield result(self.sampling, number)


def swept(sampling: Sampling, folder: Path, backend: Backend, count: int = 40, **options: float) -> Sweep:
    with Journal(folder / "j.jsonl", identity(sampling.written), resume=True) as journal:
        return run_sweep(sampling, count, journal, backend, **options)


def test_neither_order_nor_interruptions_change_a_byte_of_the_csv(sampling: Sampling, tmp_path: Path) -> None:
    whole = render_csv(Analysis(swept(sampling, tmp_path / "a", Backend(sampling))))
    for seed, most in ((1, 0), (2, 7), (3, 1), (4, 11)):
        with pytest.raises(KeyboardInterrupt):
            swept(sampling, tmp_path / "b", Backend(sampling, seed=seed, most=most))
    last = Backend(sampling, seed=5)
    assert render_csv(Analysis(swept(sampling, tmp_path / "b", last))) == whole
    assert len(last.ran) == 40 - (0 + 7 + 1 + 11)
    rows = whole.splitlines()
    assert [int(row.partition(",")[0]) for row in rows[1:]] == [*range(40)]
    assert rows[0].endswith("smallest_margin,margin near [m],scene.block.pose.xyz.0,scene.block.friction")
    assert float(rows[18].split(",")[-1]) == dict(sampling.written.drawn(17).values)["scene.block.friction"]


def test_a_sweep_ends_at_the_same_sample_whatever_came_first(sampling: Sampling, tmp_path: Path) -> None:
    passed, n = [result(sampling, k).passed for k in range(400)], 1
    while Rate(sum(passed[:n]), n).width > 0.25:
        n += 1
    ends = [
        len(swept(sampling, tmp_path / str(seed), Backend(sampling, seed=seed), 400, width=0.25).results)
        for seed in range(4)
    ]
    assert ends == [n] * 4
    assert n < 400


def test_a_journal_of_another_format_is_refused(sampling: Sampling, tmp_path: Path) -> None:
    path, whose = tmp_path / "j.jsonl", identity(sampling.written)
    with Journal(path, whose, resume=False) as journal:
        run_sweep(sampling, 1, journal, Backend(sampling))
    path.write_text(path.read_text().replace('"journal": 1', '"journal": 99', 1))
    with pytest.raises(InvalidInput, match="line 1 is not one of its objects"):
        Journal(path, whose, resume=True)


def test_a_journal_cut_at_any_byte_keeps_its_whole_lines(sampling: Sampling, tmp_path: Path) -> None:
    path, whose = tmp_path / "j.jsonl", {"manipcli": "1"}
    with Journal(path, whose, resume=False) as journal:
        run_sweep(sampling, 3, journal, Backend(sampling))
    data = path.read_bytes()
    head = data.index(b"\n") + 1
    for cut in (*range(head, len(data), 7), *(k for k in range(head, len(data)) if data[k - 1] == 10)):
        path.write_bytes(data[:cut])
        read, length = read_journal(path)
        assert len(read.results) == min(data[head:cut].count(b"\n"), 3)
        assert data[:cut].endswith(b"\n") == (length == cut)
    path.write_bytes(data[: len(data) - 40])
    again = Backend(sampling)
    with Journal(path, whose, resume=True) as journal:
        run_sweep(sampling, 3, journal, again)
    assert len(again.ran) == 1
    assert all(json.loads(line) for line in path.read_text().splitlines())


def test_a_changed_task_is_refused_with_what_changed(sampling: Sampling, tmp_path: Path) -> None:
    swept(sampling, tmp_path, Backend(sampling), 3)
    path = tmp_path / "held.yaml"
    path.write_text(TASK.replace("fixed: true", "mass: 90 g").replace("within: 1 cm", "within: 2 cm"))
    other = Sampling(path, Settings())
    changed = (
        "the task has changed since .*: scene.block.fixed was true, is false; expect.0.near.within was 0.01, is 0.02; "
        "scene.block.mass was absent, is 0.09$"
    )
    with pytest.raises(InvalidInput, match=changed):
        swept(other, tmp_path, Backend(other), 3)
    path.write_text(f"# only a comment\n{TASK}")
    same = Backend(sampling)
    swept(Sampling(path, Settings()), tmp_path, same, 3)
    assert same.ran == []


def test_an_unfinished_sweep_is_not_replaced_by_accident(sampling: Sampling, tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        swept(sampling, tmp_path, Backend(sampling, most=2), 3)
    whose, path = identity(sampling.written), tmp_path / "j.jsonl"
    with pytest.raises(InvalidInput, match="has 2 results of an unfinished sweep"):
        Journal(path, whose, resume=False)
    swept(sampling, tmp_path, Backend(sampling), 3)
    with Journal(path, whose, resume=False) as journal:
        assert journal.results == {}


def test_a_full_disk_ends_the_sweep_and_what_was_written_counts(sampling: Sampling, tmp_path: Path) -> None:
    swept(sampling, tmp_path / "whole", Backend(sampling), 5)
    lengths = [len(line) + 1 for line in (tmp_path / "whole" / "j.jsonl").read_bytes().splitlines()]
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (sum(lengths[:3]) + 30, before[1]))  # two results and part of a third
    try:
        with pytest.raises(OSError, match="File too large"):
            swept(sampling, tmp_path, Backend(sampling), 5)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    rest = Backend(sampling)
    assert len(swept(sampling, tmp_path, rest, 5).results) == 5
    assert len(rest.ran) == 3


def test_two_sweeps_do_not_write_one_journal(sampling: Sampling, tmp_path: Path) -> None:
    whose, path = identity(sampling.written), tmp_path / "j.jsonl"
    with Journal(path, whose, resume=False) as first:
        first.add(result(sampling, 0))
        for options in ({"resume": True}, {"resume": False}, {"resume": False, "force": True}):
            with pytest.raises(InvalidInput, match="another sweep is writing"):
                Journal(path, whose, **options)
        first.add(result(sampling, 1))
    with Journal(path, whose, resume=True) as second:
        assert [*second.results] == [0, 1]


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("sample", -1),
        ("sample", True),
        ("sample", 1.5),
        ("outcome", "good"),
        ("outcome", {}),
        ("simulated", "1"),
        ("simulated", False),
        ("margins", {"near": 1}),
        ("margins", [["near", "m", "0.1", 1.0, False]]),
        ("margins", [["near", "m", 0.1, 1.0, 0]]),
        ("margins", [["near", "m", 0.1]]),
        ("margins", ["abcde"]),
    ],
)
def test_a_journal_with_a_damaged_result_is_refused_with_its_line(
    sampling: Sampling, tmp_path: Path, field: str, value: object
) -> None:
    lines = [{"journal": 1, "task": {}}, result(sampling, 0).to_json(), result(sampling, 1).to_json() | {field: value}]
    path = tmp_path / "j.jsonl"
    path.write_text("".join(f"{json.dumps(line)}\n" for line in lines))
    with pytest.raises(InvalidInput, match="line 3 is not one of its objects"):
        read_journal(path)


def test_a_journal_of_deep_lists_is_refused(tmp_path: Path) -> None:
    (tmp_path / "j.jsonl").write_text("[" * 100_000 + "\n")
    with pytest.raises(InvalidInput, match="line 1"):
        read_journal(tmp_path / "j.jsonl")


def test_the_analysis_finds_what_matters_and_the_page_has_every_sample(sampling: Sampling, tmp_path: Path) -> None:
    analysis = Analysis(swept(sampling, tmp_path, Backend(sampling), 60))
    first, second = analysis.influences
    assert first.column.name == "scene.block.pose.xyz.0"
    assert first.correlation is not None and first.passing is not None and second.correlation is not None
    assert first.correlation.rho == pytest.approx(-1.0)
    assert first.passing.rho < -0.7
    assert not second.matters
    (spread,) = analysis.spreads
    assert spread.met == analysis.sweep.rate.passed
    worst = min(range(60), key=lambda k: result(sampling, k).smallest)
    assert analysis.worst[0].number == worst
    text = render_text(analysis)
    assert f"--sample {worst}\n" in text
    assert re.search(r"held: \d+ of 60 passed: [\d.]+ % \(95 % interval", text)
    page = render_page(analysis, tmp_path)
    data = json.loads(re.search(r'id="data">(.*?)</script>', page, re.DOTALL)[1])  # type: ignore[index]
    assert [sample["number"] for sample in data["samples"]] == [*range(60)]
    assert not re.search(r"https?://(?!www\.w3\.org)", page)
    assert json.loads(render_json(analysis))["passed"] == analysis.sweep.rate.passed


def test_progress_says_what_is_left() -> None:
    progress = Progress(asked=200, done=120, passed=118, before=20, elapsed=50.0)
    assert progress_text(progress) == "120 of 200: 118 passed, 2 failed, 2.0 per second, 40 s left"


def test_a_missing_sample_is_told(sampling: Sampling, tmp_path: Path) -> None:
    with Journal(tmp_path / "j.jsonl", identity(sampling.written), resume=False) as journal:
        for number in (0, 2):
            journal.add(result(sampling, number))
        assert "missing: 2 of 4 samples: 1, 3" in render_text(Analysis(collected(sampling, journal, 4)))


CHILD = f"""
import os, sys
sys.path[:] = {sys.path!r}
from multiprocessing.connection import Connection
from pathlib import Path
from manipcli.batch.job import End
parent = Connection(int(sys.argv[-1]))
job = parent.recv()
tries = Path(job.settings.folder, f"tries{{job.case.sample}}")
tries.open("a").write("x")
if job.case.sample == 1 or (job.case.sample == 0 and len(tries.read_text()) < 3):
    os.kill(os.getpid(), 11)
if job.case.sample == 9:
    from manipcli.report.suite.suite import Trouble
    parent.send(End(None, troubles=(Trouble("disk full"),)))
else:
    parent.send(End(None))
"""
"""A child that crashes in sample 1, twice in sample 0, and has no disk for sample 9."""


def test_a_crash_costs_its_sample_and_only_after_three_attempts(tmp_path: Path) -> None:
    path = tmp_path / "held.yaml"
    path.write_text(TASK)
    sampling = Sampling(path, Settings(folder=tmp_path / "runs", pictures=False))
    (tmp_path / "runs").mkdir()
    backend = local_backend(sampling.job, at_once=2, command=(sys.executable, "-c", CHILD))
    found = {result.number: result for result in backend(range(3), beat=lambda: None)}
    assert {number: each.outcome for number, each in found.items()} == {
        0: "invalid", 1: "crashed", 2: "invalid",  # `invalid`: the child sent no run
    }  # fmt: skip
    assert found[1].cause == "crashed by signal 11 (SIGSEGV)"
    tries = {number: len((tmp_path / "runs" / f"tries{number}").read_text()) for number in range(3)}
    assert tries == {0: 3, 1: 3, 2: 1}
    with pytest.raises(SweepStopped, match="sample 9 was not run: disk full"):
        [*backend([9], beat=lambda: None)]


def test_the_command_sweeps_and_a_sample_alone_has_the_same_log(call_cli: RunCli, tmp_path: Path) -> None:
    (tmp_path / "held.yaml").write_text(TASK)
    words = ("sweep", "held.yaml", "--design", "sobol", "--samples", "4", "--keep", "all", "--csv", "a.csv", "-n", "2")
    ran = call_cli(*words, "--at-least", "50%", cwd=tmp_path)
    assert ran.code == 0, ran.err
    assert ran.out.startswith("held: 2 of 4 passed: 50.0 %")  # Sobol's first points halve each dimension
    assert call_cli("run", "held.yaml", "--sample", "3", "--design", "sobol:4", cwd=tmp_path).code in (0, 1)
    kept = tmp_path / "runs" / "sweep" / "sobol-4" / "held@3.mcap"
    assert kept.read_bytes() == (tmp_path / "runs" / "held.mcap").read_bytes()
    rows = (tmp_path / "a.csv").read_text().splitlines()
    for number, row in enumerate(rows[1:]):
        drawn = load_task(tmp_path / "held.yaml", sample=number, design="sobol:4").drawn
        assert drawn is not None
        (x, *_) = dict(drawn.values)["scene.block.pose.xyz"]  # type: ignore[misc]
        assert row.split(",")[1] == ("passed" if x < 0.61 else "failed")
        assert float(row.split(",")[6]) == pytest.approx(0.61 - x)
        assert row.split(",")[-2] == repr(x)
    assert call_cli("sweep", "a.csv", "a.csv", cwd=tmp_path).code == 0


@pytest.mark.parametrize("text", ["width=0", "width=100%", "with=5%", "5%", "width=x"])
def test_a_width_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(InvalidInput, match="is not a width"):
        read_until(text)
