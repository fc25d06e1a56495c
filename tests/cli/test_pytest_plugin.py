"""The plugin as a project meets it that has manipcli installed: pytest in a folder of tasks, in one of none."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path
from xml.etree.ElementTree import parse

import pytest

# Loaded here once: what pytest loads while it runs inside a test, it forgets.
import manipcli.batch.discovery
import manipcli.batch.process
import manipcli.spec.load
import manipcli.spec.task  # noqa: F401
from manipcli.batch.job import Job, Settings
from manipcli.cli.pytest_plugin import TaskFailed, _settings
from manipcli.cli.task_session import TaskSession
from manipcli.report.suite.suite import Case, CaseReport, CaseWord, Trouble

pytest_plugins = ["pytester"]

ROOT = Path(__file__).parents[2]
PLUGIN = "manipcli.cli.pytest_plugin"
INSTALLED = any(point.value == PLUGIN for point in entry_points(group="pytest11"))
LOADED = () if INSTALLED else ("-p", PLUGIN)
"""Where manipcli runs from its source, and is not installed, the plugin is named."""
ALONE = tuple(
    word
    for plugin in ("hypothesispytest", "xdist", "randomly", "unraisableexception", "threadexception")
    for word in ("-p", f"no:{plugin}")
)
"""Without plugins that take longer than these tests, or that change the order of tests."""

TASK = f"""\
task: {{name}}
tags: [{{tags}}]
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
simulation: {{{{engine: kinematic}}}}
steps:
  - wait: 0.2 s
expect:
  - duration: {{{{below: {{below}}}}}}
  - at_pose: {{{{pose: home, within: 0.05 rad}}}}
"""


@pytest.fixture
def project(pytester: pytest.Pytester) -> pytest.Pytester:
    """Tasks that pass, fail and are broken, and files that are none."""
    files = {
        "tasks/good.yaml": TASK.format(name="good", tags="slow, nightly", below="10 s"),
        "tasks/late.yaml": TASK.format(name="late", tags="", below="0.1 s"),
        "tasks/broken.yaml": "task: broken\nrobot: r.yaml\nsteps: [\n",
        "tasks/robot.yaml": "robot: r\ndescription: r.urdf\n",
        "tasks/.hidden.yaml": "task: hidden\nrobot: r.yaml\n",
        "runs/old.yaml": "task: old\nrobot: r.yaml\n",
        "hello.yaml": "task: hello\n",
        "null.yaml": "task: ~\nrobot: r.yaml\n",
        "ci.yaml": "on: push\n",
    }
    for name, text in files.items():
        path = pytester.path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    return pytester


def collected(project: pytest.Pytester, *words: str) -> list[str]:
    result = project.runpytest_inprocess(*LOADED, *ALONE, "--collect-only", "-q", "--strict-markers", *words)
    return [line for line in result.outlines if "::" in line]


def test_task_files_and_no_others_are_tests(project: pytest.Pytester) -> None:
    everything = ["tasks/broken.yaml::broken", "tasks/good.yaml::good", "tasks/late.yaml::late"]
    assert collected(project) == everything
    assert collected(project, "tasks") == everything
    assert collected(project, "tasks/good.yaml::good") == ["tasks/good.yaml::good"]
    assert collected(project, "runs") == ["runs/old.yaml::old"]  # it was named
    assert collected(project, "hello.yaml", "null.yaml") == ["hello.yaml::hello", "null.yaml::null"]


def test_the_files_are_those_of_the_command(project: pytest.Pytester) -> None:
    with TaskSession([Path()], Settings()) as session:
        assert collected(project) == [*session.jobs]


@pytest.mark.parametrize(
    ("outcome", "why", "first"),
    [
        ("hung", "hung: no progress for 4 s", "hung: no progress for 4 s"),
        ("crashed", "crashed by signal 11", "crashed by signal 11"),
        ("failed", "duration: fails by 0.1 s", "failed: duration: fails by 0.1 s"),
    ],
)
def test_a_failure_says_its_outcome_once(pytester: pytest.Pytester, outcome: CaseWord, why: str, first: str) -> None:
    (pytester.path / "t.yaml").write_text("task: t\nrobot: r.yaml\n")
    (item,), _ = pytester.inline_genitems(*LOADED, *ALONE, "t.yaml")
    with pytest.raises(TaskFailed) as raised:
        raise TaskFailed(CaseReport(Case("t.yaml", "t"), outcome, 1.0, "", troubles=(Trouble(why),)))
    assert str(item.repr_failure(raised)).splitlines()[0] == first


def test_links_lead_to_no_test_twice(project: pytest.Pytester) -> None:
    (project.path / "tasks" / "sub").mkdir()
    (project.path / "tasks" / "sub" / "loop").symlink_to("..")
    (project.path / "tasks" / "sub" / "link.yaml").symlink_to("../good.yaml")
    assert len(collected(project)) == 3
    assert collected(project, "tasks/sub/link.yaml") == ["tasks/sub/link.yaml::good"]  # it was named


def test_what_looks_like_a_task_and_is_none_is_told(project: pytest.Pytester) -> None:
    (project.path / "tasks" / "torn.yaml").write_text("task: torn\nrobo: r.yaml\nsteps: []\n")
    result = project.runpytest_inprocess(*LOADED, *ALONE, "--collect-only")
    assert "tasks/torn.yaml has `task:` but no `robot:`; not run" in result.outlines
    beside = project.runpytest_inprocess(*LOADED, *ALONE, "--collect-only", "tasks/good.yaml")
    assert "torn" not in beside.stdout.str()  # nobody asked for it


def test_tags_and_engine_are_markers_that_need_no_registration(project: pytest.Pytester) -> None:
    assert collected(project, "-m", "nightly and engine_kinematic") == ["tasks/good.yaml::good"]
    assert "tasks/good.yaml::good" not in collected(project, "-m", "not slow")
    assert collected(project, "-k", "late") == ["tasks/late.yaml::late"]


def test_a_conftest_can_skip_tasks_by_their_tags(pytester: pytest.Pytester) -> None:
    pytester.makeconftest(
        """
        import pytest

        def pytest_collection_modifyitems(items):
            for item in items:
                if "slow" in item.keywords:
                    item.add_marker(pytest.mark.skip(reason="needs --runslow"))
        """
    )
    pytester.makefile(".yaml", a="# slow\n" + TASK.format(name="a", tags="slow", below="10 s"))
    result = pytester.runpytest_inprocess(*LOADED, *ALONE, "-rs")
    result.assert_outcomes(skipped=1)
    result.stdout.fnmatch_lines(["SKIPPED*a.yaml: needs --runslow"])
    (item,), _ = pytester.inline_genitems(*LOADED, *ALONE)
    assert item.location == ("a.yaml", 1, "a")  # its line counts from 0


def test_a_tag_with_the_name_of_a_mark_of_pytest_is_a_word_alone(pytester: pytest.Pytester) -> None:
    pytester.makefile(".yaml", a=TASK.format(name="a", tags="skip, xfail, usefixtures", below="10 s"))
    everything = pytester.inline_genitems(*LOADED, *ALONE)[0]
    assert [mark.name for item in everything for mark in item.iter_markers()] == ["engine_kinematic"]
    assert collected(pytester, "-k", "skip and xfail") == ["a.yaml::a"]


def test_samples_are_tests_of_their_own(project: pytest.Pytester) -> None:
    path = project.path / "tasks" / "good.yaml"
    path.write_text(path.read_text() + "vary: {simulation.settle: {uniform: [0.1 s, 0.2 s]}}\n")
    ids = collected(project, "--manipcli-samples", "2", "tasks/good.yaml", "tasks/late.yaml")
    assert ids == ["tasks/good.yaml::good[0]", "tasks/good.yaml::good[1]", "tasks/late.yaml::late"]


@pytest.mark.parametrize(("word", "seconds"), [("0", math.inf), ("2.5", 2.5)])
def test_silence_and_timeout_are_options(pytester: pytest.Pytester, word: str, seconds: float) -> None:
    config = pytester.parseconfig(*LOADED, *ALONE, f"--manipcli-silence={word}", f"--manipcli-timeout={word}")
    settings = _settings(config, Path())
    assert (settings.silence, settings.timeout) == (seconds, seconds)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("--manipcli-samples=0", "an integer of 1 or more"),
        ("--manipcli-samples=-1", "an integer of 1 or more"),
        ("--manipcli-timeout=-1", "a number of seconds (0: never)"),
        ("--manipcli-silence=nan", "a number of seconds (0: never)"),
    ],
)
def test_a_number_that_means_nothing_is_wrong_usage(pytester: pytest.Pytester, words: str, expected: str) -> None:
    result = pytester.runpytest_inprocess(*LOADED, *ALONE, words)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    option, _, value = words.partition("=")
    result.stderr.fnmatch_lines([f"*error: argument {option}: '{value}' is not {expected}"])


Given = list[Job]


@pytest.fixture
def given(monkeypatch: pytest.MonkeyPatch) -> Given:
    """What would be run, and how; nothing is."""
    asked: Given = []

    def run(job: Job, **_: object) -> CaseReport:
        asked.append(job)
        return CaseReport(job.case, "crashed", 1.0, "", "not run")

    monkeypatch.setattr("manipcli.batch.process.run_job", run)
    return asked


def test_a_python_test_finds_tasks_beside_it_then_below_the_root(pytester: pytest.Pytester, given: Given) -> None:
    for name in ("sub/both.yaml", "both.yaml", "below.yaml"):
        (pytester.path / name).parent.mkdir(exist_ok=True)
        (pytester.path / name).write_text("task: t\nrobot: r.yaml\n")
    names = ["both.yaml", "below.yaml", str(pytester.path / "both.yaml")]
    (pytester.path / "sub" / "test_it.py").write_text(
        f"import pytest\n@pytest.mark.parametrize('name', {names})\ndef test_it(run_task, name): run_task(name)\n"
    )
    result = pytester.runpytest_inprocess(*LOADED, *ALONE, "sub/test_it.py")
    result.assert_outcomes(failed=3)
    assert [str(job.path) for job in given] == ["sub/both.yaml", "below.yaml", "both.yaml"]
    assert {(job.settings.keep_logs, job.settings.folder.name) for job in given} == {(True, "0")}


def test_findings_name_files_as_the_rest_of_a_failure_does(pytester: pytest.Pytester, given: Given) -> None:
    (pytester.path / "tasks").mkdir()
    (pytester.path / "tasks" / "t.yaml").write_text("task: t\nrobot: r.yaml\n")
    pytester.runpytest_inprocess(*LOADED, *ALONE, "tasks").assert_outcomes(failed=1)
    assert [(job.path, job.case.file) for job in given] == [(Path("tasks/t.yaml"), "tasks/t.yaml")]


@pytest.mark.parametrize(("words", "folder"), [([], "runs/test"), (["--manipcli-logs", "else/where"], "else/where")])
def test_logs_go_below_where_pytest_was_called_wherever_a_test_went(
    pytester: pytest.Pytester, given: Given, words: list[str], folder: str
) -> None:
    pytester.makeconftest("import os\ndef pytest_runtest_setup(item): os.chdir('/')\n")
    pytester.makefile(".yaml", t="task: t\nrobot: r.yaml\n")
    pytester.runpytest_inprocess(*LOADED, *ALONE, *words).assert_outcomes(failed=1)
    (job,) = given
    assert (Path("/") / job.settings.folder, job.settings.keep_logs) == (pytester.path / folder, False)


def test_the_plugin_loads_nothing_but_itself() -> None:
    script = f"import sys, {PLUGIN}; print(*(name for name in sys.modules if name.startswith('manipcli')))"
    environment = {"PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, env=environment)
    assert set(done.stdout.split()) == {
        "manipcli", "manipcli.core", "manipcli.core.lazy", "manipcli.core.version", "manipcli.cli", PLUGIN,
    }  # fmt: skip


def test_foreign_yaml_loads_nothing_but_the_first_look(pytester: pytest.Pytester) -> None:
    pytester.makefile(".yaml", ci="on: push\n", tasks="tasks: {a: 1}\n")
    pytester.makepyfile(
        "import sys\ndef test_it(): print('loaded', *sorted(m for m in sys.modules if 'manipcli' in m))"
    )
    result = pytester.runpytest_subprocess(*LOADED, *ALONE, "-s")
    result.assert_outcomes(passed=1)
    loaded = (
        f"manipcli manipcli.batch manipcli.batch.first_look manipcli.cli {PLUGIN} "
        "manipcli.core manipcli.core.lazy manipcli.core.version"
    )
    result.stdout.fnmatch_lines([f"*loaded {loaded}"])


@pytest.mark.slow
@pytest.mark.usefixtures("runs_in_threads")
def test_a_failure_tells_what_was_expected_and_how_to_see_it_again(project: pytest.Pytester) -> None:
    result = project.runpytest_inprocess(*LOADED, *ALONE, "-v", "-rP", "--junit-xml=out.xml", "--strict-markers")
    result.assert_outcomes(passed=1, failed=2)
    told = result.stdout.str()
    assert re.search(r"failed: duration: fails by \d+ ms|failed: duration: fails by 0\.\d+ s", told)
    assert "tasks/late.yaml:9:5: duration: fails by" in told
    assert "✓ at_pose: 2.9 deg to spare" in told
    assert "reproduce: manipcli run tasks/late.yaml" in told
    assert "tasks/broken.yaml:4:1: error[YAML100]" in told
    assert "Traceback" not in told
    assert "pytest_plugin.py" not in told
    assert (project.path / "runs" / "test" / "tasks" / "late.mcap").is_file()
    assert not (project.path / "runs" / "test" / "tasks" / "good.mcap").exists()
    cases = {case.get("name"): case for case in parse(project.path / "out.xml").getroot().iter("testcase")}
    assert set(cases) == {"broken", "good", "late"}
    assert "duration: fails by" in str(cases["late"].findtext("failure"))
    assert not [case for case in cases.values() if case.find("properties") is not None]  # no schema has them


@pytest.mark.slow
@pytest.mark.usefixtures("runs_in_threads")
def test_a_python_test_runs_a_task_and_looks_at_its_report(project: pytest.Pytester) -> None:
    project.makepyfile(
        """
        from pathlib import Path
        import manipcli
        import pytest

        def test_report(run_task):
            report = run_task("tasks/good.yaml", overrides=["steps.0.wait=0.4 s"], seed=7)
            again = run_task(Path("tasks") / "good.yaml", overrides="steps.0.wait=0.1 s")
            assert (report.verdict.verdict, report.verdict.seed) == ("passed", 7)
            assert report.verdict.simulated_time > again.verdict.simulated_time
            assert manipcli.read_recording(Path(report.log)).states.time[-1] > 0.4

        def test_failure_is_no_exception(run_task):
            assert run_task("tasks/late.yaml").verdict.verdict == "failed"

        def test_failure_shows_what_went_wrong(run_task):
            run = run_task("tasks/late.yaml")
            assert repr(run).startswith("<failed late '")
            assert run.passed, run.text

        def test_refusal_is_one(run_task):
            with pytest.raises(manipcli.InvalidInput, match="broken.yaml:4:1"):
                run_task("tasks/broken.yaml")
        """
    )
    result = project.runpytest_inprocess(*LOADED, *ALONE, "test_a_python_test_runs_a_task_and_looks_at_its_report.py")
    result.assert_outcomes(passed=3, failed=1)
    told = result.stdout.str()
    for line in ("tasks/late.yaml:9:5: duration: fails by", "✓ at_pose: 2.9 deg to spare", "log: /", "picture: /"):
        assert line in told


@pytest.mark.slow
def test_two_workers_share_the_tasks(project: pytest.Pytester) -> None:
    (project.path / "tasks" / "late.yaml").unlink()
    result = project.runpytest_subprocess(*LOADED, "-n", "2", "-v")
    result.assert_outcomes(passed=1, failed=1)
    assert "reproduce: manipcli run tasks/broken.yaml" in result.stdout.str()
