"""The command line's promises: exit codes, one JSON object whatever happens, and never a traceback."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NoReturn

import numpy as np
import pytest
import typer
from pydantic_core import SchemaError
from typer.testing import CliRunner

import manipcli
from manipcli.cli.app import COMMANDS, GROUPS, main
from manipcli.cli.command_help import epilog
from manipcli.cli.volume import with_volume
from manipcli.core import collector
from manipcli.core.errors import Diagnostic, InvalidInput, ManipcliError, NotPlannable, Place, SimulationFailed
from manipcli.core.geometry import Transform
from manipcli.description.elements import Joint, JointLimits
from manipcli.judge.verdict import ExpectationOutcome, StepOutcome, Verdict
from manipcli.model.collision import CollisionHit
from manipcli.model.robot import RobotModel
from manipcli.plan.motion_margins import Binding, Margin, MotionMargins
from manipcli.plan.trajectory import JointTrajectory
from manipcli.record.faults import RecordingFailed
from manipcli.report.run_report import RunReport, Timing

NEAR = CollisionHit("cup", "robot/palm", 0.0123, time=1.5)
PASSED = Verdict(
    task="pour",
    verdict="passed",
    seed=7,
    engine="pybullet",
    simulated_time=20.5,
    steps=(StepOutcome("pick_1", "pick", "done", 0.0, 6.1, 5.9),),
    expectations=(ExpectationOutcome("upright", "passed", 0.05, "rad", 20.1),),
)


def _report(verdict: Verdict) -> RunReport:
    return RunReport(verdict, Timing(0.1, 0.2, 2.5, 0.2), log="runs/pour.mcap")


@pytest.fixture
def pipeline(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """A stand-in whose functions each test sets: here only what the commands do with it is tested."""
    stand_in = SimpleNamespace()
    monkeypatch.setitem(sys.modules, "manipcli.pipeline", stand_in)
    monkeypatch.setattr(manipcli, "pipeline", stand_in, raising=False)
    return stand_in


def _raising(error: BaseException) -> Callable[..., NoReturn]:
    def fail(*_: object, **__: object) -> NoReturn:
        raise error

    return fail


@pytest.mark.parametrize(
    ("verdict", "code"),
    [
        (PASSED, 0),
        (replace(PASSED, verdict="failed"), 1),
        (replace(PASSED, verdict="error", errors=(Diagnostic("RUN101", "stopped"),)), 2),
        (replace(PASSED, verdict="error", errors=(Diagnostic("SIM100", "gone"),)), 3),
    ],
)
def test_the_verdict_decides_the_exit_code(
    pipeline: SimpleNamespace, capsys: pytest.CaptureFixture[str], verdict: Verdict, code: int
) -> None:
    pipeline.run_task = lambda *_, **__: _report(verdict)
    pipeline.judge_log = lambda _: verdict
    assert main(["run", "t.yaml"]) == code
    assert main(["judge", "x.mcap"]) == code


IN_A_CLASS = RuntimeError("Error calling __set_name__ on 'cached_property' instance 'maps' in 'Made'")
IN_A_CLASS.__cause__ = KeyboardInterrupt()
IN_A_MODEL = SchemaError("Error building `literal` serializer:\n  KeyboardInterrupt: ")
ERRORS = [
    (
        InvalidInput([Diagnostic("TASK203", "no such joint", Place("t.yaml", 14, 9), hint="did you mean 'a'?")]),
        4,
        "error",
    ),
    (NotPlannable("out of reach", step="pick_1"), 1, "failed"),
    (SimulationFailed("cup exploded", time=1.0), 1, "failed"),
    (ManipcliError("odd"), 3, "error"),
    (KeyboardInterrupt(), 2, "error"),
    (IN_A_MODEL, 2, "error"),
    (SchemaError("Error building `literal` serializer"), 3, "error"),
    (IN_A_CLASS, 2, "error"),
    (PermissionError(13, "Permission denied", "/nowhere/x.mcap"), 4, "error"),
    (OSError(28, "No space left on device"), 3, "error"),
    (FileNotFoundError(2, "No such file or directory"), 4, "error"),
    (FileNotFoundError(2, "No usable temporary directory found in ['/tmp']"), 4, "error"),
    (ZeroDivisionError("division\nby zero"), 3, "error"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("error", "code", "verdict"), ERRORS, ids=lambda value: type(value).__name__)
def test_an_error_becomes_a_message_and_an_exit_code(
    pipeline: SimpleNamespace,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    error: BaseException,
    code: int,
    verdict: str,
) -> None:
    monkeypatch.delenv("MANIPCLI_DEBUG", raising=False)
    pipeline.run_task = _raising(error)

    assert main(["run", "t.yaml"]) == code
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.count("error[") == 1
    assert "Traceback" not in told.err

    assert main(["run", "t.yaml", "--format", "json"]) == code
    told = capsys.readouterr()
    assert told.err == ""
    answer = json.loads(told.out)
    assert answer["verdict"] == verdict
    assert [set(one) >= {"code", "file", "line", "column", "message"} for one in answer["errors"]] == [True]


def test_an_error_in_a_file_says_where_and_hints(pipeline: SimpleNamespace, capsys: pytest.CaptureFixture[str]) -> None:
    pipeline.run_task = _raising(ERRORS[0][0])
    main(["run", "t.yaml"])
    more = "more about a code: manipcli explain TASK203"
    assert capsys.readouterr().err == f"t.yaml:14:9: error[TASK203]: no such joint\n  hint: did you mean 'a'?\n{more}\n"


def test_the_traceback_is_there_for_who_asks(
    pipeline: SimpleNamespace, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MANIPCLI_DEBUG", "1")
    pipeline.run_task = _raising(ZeroDivisionError("x"))
    assert main(["run", "t.yaml"]) == 3
    assert "Traceback" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words",
    [
        ["rnu"],
        ["run"],
        ["run", "t.yaml", "--seeed", "1"],
        ["run", "t.yaml", "--seed", "-1"],
        ["run", "t.yaml", "--format", "xml"],
        ["list", "robotss"],
        ["schema", "engine"],
        ["--nope"],
    ],
)
def test_wrong_usage_is_4_and_one_message(capsys: pytest.CaptureFixture[str], words: list[str]) -> None:
    assert main(words) == 4
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.startswith("error[USE001]: ")
    assert "--help" in told.err


def test_wrong_usage_is_told_without_the_words_of_libraries(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "pour.yaml", "--format", "xml"]) == 4
    assert capsys.readouterr().err.startswith("error[USE001]: Invalid value for '--format': 'xml' is not one of ")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["plan", "t.yaml", "--seed", "x"], "'--seed': expected a whole number\n"),
        (["plan", "t.yaml", "--seed", "-1"], "'--seed': must be at least 0\n"),
        (["diff", "a", "b", "--tolerance", "x"], "'--tolerance': expected a number\n"),
        (["tune", "r", "c", "--damping", "90"], "'--damping': must be at most 10\n"),
    ],
)
def test_a_number_that_is_none_or_out_of_range_is_told_as_in_files(
    capsys: pytest.CaptureFixture[str], words: list[str], told: str
) -> None:
    assert main(words) == 4
    assert told in capsys.readouterr().err


def test_a_log_that_is_not_there_is_looked_for_beside_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "pour.mcap").touch()
    for given, hint in (
        ("por.mcap", "did you mean 'pour.mcap'?"),
        ("zzz.mcap", "logs in this folder: pour.mcap"),
        ("no/a.mcap", f"folder '{tmp_path / 'no'}' does not exist"),
    ):
        assert main(["judge", str(tmp_path / given)]) == 4
        assert hint in capsys.readouterr().err


def test_wrong_usage_answers_in_json_when_asked(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "--format=json"]) == 4
    assert json.loads(capsys.readouterr().out)["errors"][0]["code"] == "USE001"


@pytest.mark.parametrize("words", [[], ["--help"], ["--version"], ["run", "--help"]])
def test_help_and_version_are_results(capsys: pytest.CaptureFixture[str], words: list[str]) -> None:
    assert main(words) == 0
    told = capsys.readouterr()
    assert told.out
    assert told.err == ""


def test_run_hands_every_option_on(pipeline: SimpleNamespace, capsys: pytest.CaptureFixture[str]) -> None:
    given: dict[str, object] = {}

    def run_task(path: Path, **options: object) -> RunReport:
        given.update(options, path=path)
        return _report(PASSED)

    pipeline.run_task = run_task
    words = (
        "run t.yaml --log a.mcap --force --embed-meshes --seed 3 --sample 7 --design lhs:9 --set a.b=1 --set c=x=y "
        "--package-path p --from a --state b.mcap --until c"
    )
    assert main([*words.split(), "--allow-outside", "-q"]) == 0
    del given["progress"]
    assert given == {
        "path": Path("t.yaml"),
        "log": Path("a.mcap"),
        "force": True,
        "embed_meshes": True,
        "seed": 3,
        "sample": 7,
        "design": "lhs:9",
        "overrides": ("a.b=1", "c=x=y"),
        "package_path": (Path("p"),),
        "allow_outside": True,
        "from_step": "a",
        "state": Path("b.mcap"),
        "until": "c",
    }
    assert capsys.readouterr().err == ""


def test_a_run_tells_one_line_a_step_where_there_is_no_terminal(
    pipeline: SimpleNamespace, capsys: pytest.CaptureFixture[str]
) -> None:
    def run_task(path: Path, *, progress: object, **_: object) -> RunReport:
        for k, step in enumerate(PASSED.steps):
            progress.step_started(step, k, len(PASSED.steps))  # type: ignore[attr-defined]
            progress.tick(1.0, 0.5)  # type: ignore[attr-defined]
            progress.step_ended(step)  # type: ignore[attr-defined]
        return _report(PASSED)

    pipeline.run_task = run_task
    assert main(["run", "t.yaml"]) == 0
    assert capsys.readouterr().err == "[1/1] pick_1: done (0.00 s to 6.10 s)\n"


def test_check_of_a_file_that_is_not_there_is_a_wrong_call(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for path in (tmp_path / "absent.yaml", tmp_path / "absent.urdf", tmp_path):
        assert main(["check", str(path)]) == 4
        assert "1 file checked, 1 error" in capsys.readouterr().out
    broken = tmp_path / "broken.yaml"
    broken.write_text("task: t\nrobot: absent.yaml\ncontrollers: absent.yaml\nsteps: [{wait: 1 s}]\n")
    assert main(["check", str(broken)]) == 1


@pytest.mark.parametrize(("severity", "code"), [("error", 1), ("warning", 0)])
def test_check_fails_on_errors_only(
    pipeline: SimpleNamespace, capsys: pytest.CaptureFixture[str], severity: str, code: int
) -> None:
    pipeline.check_files = lambda _, **__: (Diagnostic("TASK1", "x", severity=severity),)
    pipeline.kind_of = lambda path: None
    assert main(["check", "a.yaml", "b.yaml"]) == code
    assert "2 files checked" in capsys.readouterr().out
    assert main(["check", "a.yaml", "--format", "json"]) == code
    assert json.loads(capsys.readouterr().out)["findings"][0]["severity"] == severity


def _robot() -> RobotModel:
    limits = JointLimits(velocity=2.0, acceleration=10.0)
    joint = Joint("j1", "revolute", "a", "b", Transform.identity(), np.array([0.0, 0.0, 1.0]), limits)
    return RobotModel("r", "a", (), (joint,), (), (), (), Transform.identity(), "")


def _motion() -> SimpleNamespace:
    times = np.array([0.0, 1.0, 2.0])
    velocities = np.array([[0.0], [1.5], [0.0]])
    trajectory = JointTrajectory.of_arrays(
        ("j1",), times, np.array([[0.0], [0.5], [1.0]]), velocities, np.zeros((3, 1))
    )
    return SimpleNamespace(
        step_id="move_1", verb="move", label="move", trajectory=trajectory, duration=2.0, branch="", beside=False
    )


def test_plan_names_the_joint_that_limits_and_writes_every_point(
    pipeline: SimpleNamespace, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    pipeline.load_task = lambda *_, **__: SimpleNamespace(spec=SimpleNamespace(task="home"), robot=_robot())
    margins = MotionMargins(Binding("j1", "velocity", 0.6), (Margin("j1", "velocity", 0.75, 0.5, 1.0),))
    plan = SimpleNamespace(
        motions=(_motion(),),
        steps=(
            SimpleNamespace(
                id="move_1", verb="move", candidate="", dropped=(), beside=False, plan=SimpleNamespace(stream=None)
            ),
        ),
        every=(),
        branches={},
        combinations=(),
        branch="",
        items=(),
        duration=2.0,
        path_kinds=lambda: ("straight",),
        clearances=lambda: (NEAR,),
        margins=lambda: (margins,),
        grasps=tuple,
        stated_clearances=tuple,
    )
    plan.stretches = (plan,)
    pipeline.plan_task = lambda _, **__: plan
    csv = tmp_path / "plan.csv"
    assert main(["plan", "t.yaml", "--csv", str(csv)]) == 0
    assert "j1 velocity, 60 % of the time" in (out := capsys.readouterr().out)
    assert "75.0 %" in out and "12.3 mm" in out and "cup and robot/palm at 1.50 s" in out
    rows = csv.read_text().splitlines()
    assert rows[0] == "step,motion,time,j1_position,j1_velocity,j1_acceleration"
    assert rows[2] == "move_1,move,1.000000,0.5,1.5,0"
    assert len(rows) == 4

    assert main(["plan", "t.yaml", "--format", "json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["motions"][0]["clearance"] == {"between": ["cup", "robot/palm"], "distance": 0.0123, "time": 1.5}
    assert answer["motions"][0]["limited_by"] == {"joint": "j1", "quantity": "velocity", "used": 0.75}


def test_plan_that_cannot_write_its_csv_says_so(
    pipeline: SimpleNamespace, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    pipeline.load_task = lambda *_, **__: SimpleNamespace(spec=SimpleNamespace(task="home"), robot=_robot())
    pipeline.plan_task = lambda _, **__: SimpleNamespace(motions=(), clearances=tuple, stretches=())
    (tmp_path / "taken").touch()
    assert main(["plan", "t.yaml", "--csv", str(tmp_path / "taken" / "plan.csv")]) == 4
    assert "cannot create folder" in capsys.readouterr().err


def test_a_reader_that_goes_away_is_no_error() -> None:
    script = f"{sys.executable} -m manipcli --version >&- 2>&-; echo $?"
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "0"

    script = f"set -o pipefail; {sys.executable} -m manipcli --version | true"
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_working_folder_that_was_removed_is_told(tmp_path: Path) -> None:
    gone = tmp_path / "gone"
    script = f"mkdir '{gone}' && cd '{gone}' && rmdir '{gone}' && {sys.executable} -m manipcli test"
    done = subprocess.run(
        ["bash", "-c", script],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )
    assert done.returncode == 4
    assert done.stderr.startswith("error[USE004]: the working directory has been removed\n")


def test_a_computer_without_a_folder_for_temporary_files_is_told(
    pipeline: SimpleNamespace, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", None)
    monkeypatch.setattr(tempfile, "_candidate_tempdir_list", lambda: ["/nowhere"])
    pipeline.run_task = lambda *_, **__: tempfile.gettempdir()
    assert main(["run", "t.yaml"]) == 4
    assert capsys.readouterr().err == (
        "error[USE006]: No usable temporary directory found in ['/nowhere']\n  hint: set TMPDIR to a writable folder\n"
    )


def test_a_name_that_the_locale_cannot_write_is_told(
    pipeline: SimpleNamespace, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As with `LC_ALL=C PYTHONUTF8=0`: the name of the log comes from a file that is UTF-8 all the same."""
    monkeypatch.setattr(sys, "getfilesystemencoding", lambda: "ascii")
    pipeline.run_task = _raising(UnicodeEncodeError("ascii", "t\xe4.mcap", 1, 2, "ordinal not in range(128)"))
    assert main(["run", "t.yaml"]) == 4
    told = "error[USE005]: 't\xe4.mcap' cannot be a file name: the encoding of the locale is ascii\n"
    assert capsys.readouterr().err.startswith(told)


def test_a_full_disk_is_told_and_not_passed_over() -> None:
    done = subprocess.run(
        ["bash", "-c", f"{sys.executable} -m manipcli --version > /dev/full"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 3
    told = "error[INT001]: standard output: the disk is full (No space left on device)\n"
    assert done.stderr == told


@pytest.mark.parametrize("words", [["list", "steps"], ["list", "steps", "--format", "json"], ["schema", "robot"]])
def test_what_is_on_a_full_disk_is_named_and_no_bug(
    words: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with Path("/dev/full").open("w") as full:
        monkeypatch.setattr(sys, "stdout", full)
        assert main(words) == 3
    assert capsys.readouterr().err == "error[INT001]: standard output: the disk is full (No space left on device)\n"


def test_a_file_on_a_full_disk_is_named(pipeline: SimpleNamespace, capsys: pytest.CaptureFixture[str]) -> None:
    pipeline.load_task = lambda *_, **__: SimpleNamespace(spec=SimpleNamespace(task="home"), robot=_robot())
    pipeline.plan_task = lambda _, **__: SimpleNamespace(motions=(), clearances=tuple, stretches=())
    assert main(["plan", "t.yaml", "--csv", "/dev/full"]) == 3
    assert capsys.readouterr().err == "error[INT001]: /dev/full: the disk is full (No space left on device)\n"


def test_what_is_known_of_a_run_whose_log_the_disk_refused_is_told(
    pipeline: SimpleNamespace, capsys: pytest.CaptureFixture[str]
) -> None:
    failure = RecordingFailed(Path("runs/pour.mcap.partial"), "No space left on device", time=1.5)
    failure.known = {"task": "pour", "seed": 7, "engine": "pybullet", "log": "runs/pour.mcap.partial"}
    pipeline.run_task = _raising(failure)
    assert main(["run", "t.yaml", "--format", "json"]) == 3
    answer = json.loads(capsys.readouterr().out)
    assert {key: answer[key] for key in failure.known} == failure.known
    assert (answer["verdict"], answer["errors"][0]["code"]) == ("error", "LOG200")


@pytest.mark.parametrize("command", COMMANDS)
def test_the_help_of_a_command_is_as_if_all_were_shown(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    whole = typer.Typer(rich_markup_mode=None, context_settings={"help_option_names": ["-h", "--help"]})
    whole.callback()(lambda: None)
    groups = {group: typer.Typer(rich_markup_mode=None) for group in GROUPS}
    for group, inner in groups.items():
        whole.add_typer(inner, name=group)
    for name, function in COMMANDS.items():
        group, _, last = name.rpartition(" ")
        groups.get(group, whole).command(last, epilog=epilog(name))(with_volume(function))
    expected = CliRunner().invoke(whole, [*command.split(), "--help"], prog_name="manipcli").output
    assert main([*command.split(), "--help"]) == 0
    shown = capsys.readouterr().out
    assert shown.split() == expected.split()  # the width of the lines may differ
    assert f"manipcli {command} [OPTIONS]" in shown


def test_a_shell_completes_commands_and_options(run_cli: Callable[..., Any], tmp_path: Path) -> None:
    def completions(line: str, word: int) -> set[str]:
        asked = {"_MANIPCLI_COMPLETE": "complete_bash", "COMP_WORDS": line, "COMP_CWORD": str(word)}
        return set(run_cli(cwd=tmp_path, env=os.environ | asked).out.split())

    assert completions("manipcli run --se", 2) == {"--seed", "--set"}
    assert completions("manipcli che", 1) == {"check", "check-urdf"}


@pytest.mark.parametrize("debug", [False, True])
def test_a_command_shows_no_warning_of_a_library(monkeypatch: pytest.MonkeyPatch, debug: bool) -> None:
    monkeypatch.setattr(sys, "argv", ["manipcli", "--version"])
    monkeypatch.setattr(collector, "spare", lambda: None)
    monkeypatch.setenv("MANIPCLI_DEBUG", "1" if debug else "")
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        assert main() == 0
        np.divide(1e308, np.array([1e-9]))
    assert bool(told) == debug
