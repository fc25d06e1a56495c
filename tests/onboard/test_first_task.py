"""The first task of a robot: the most that passes, and what was shown of the robot and what not."""

from __future__ import annotations

from pathlib import Path

import pytest

from manipcli.batch.forks import ForkPool
from manipcli.batch.job import Job
from manipcli.model.kinematics import Kinematics
from manipcli.onboard import first_task, reachable
from manipcli.onboard.first_task import FirstTask, TaskSearch
from manipcli.onboard.onboard import floor_scene
from manipcli.onboard.robot_draft import RobotDraft, draft_robot
from manipcli.onboard.summary import summary
from manipcli.report.suite.suite import CaseReport
from manipcli.report.text import FAIL, PASS
from tests.onboard import small_robots as small
from tests.onboard.test_guesses import built

LINKS = [f"l{k}" for k in range(7)]
PICK, MOVES, CLOSES, HOLDS = (
    "picks and places a block",
    "moves between poses",
    "opens and closes the hand",
    "holds still",
)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> RobotDraft:
    parts = (small.arm(LINKS), small.palm("p", parent="l6"), small.gripper("p"))
    return draft_robot(built(tmp_path_factory.mktemp("whole"), small.robot(*parts)), floor_scene())


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> RobotDraft:
    return draft_robot(built(tmp_path_factory.mktemp("bare"), small.robot(small.arm(LINKS))), floor_scene())


def searched(folder: Path, draft: RobotDraft, monkeypatch: pytest.MonkeyPatch, *passing: str) -> FirstTask:
    """The first task where the runs of these tasks pass, and those of all others crash."""

    def run_job(job: Job, *, pool: ForkPool) -> CaseReport:
        passed = job.case.task in passing
        return CaseReport(job.case, "passed" if passed else "crashed", 0.0, "", text="crashed by SIGSEGV")

    monkeypatch.setattr(first_task, "run_job", run_job)
    monkeypatch.setattr(reachable, "EXAMINED", 10)
    monkeypatch.setattr(ForkPool, "open", lambda self, *, least: None)
    options = {"package_path": (), "allow_outside": False, "on_progress": lambda _: None}
    with TaskSearch(folder, draft, write_robot=lambda _: None, **options) as search:  # type: ignore[arg-type]
        return search.search()


def shown(task: FirstTask) -> dict[str, str]:
    return {ability.what: ability.shown for ability in task.abilities}


ALL = dict.fromkeys((HOLDS, CLOSES, MOVES, PICK), "passed")


@pytest.mark.parametrize(
    ("passing", "name", "abilities"),
    [
        (("pick_place", "moves", "open_close", "wait"), "pick_place", ALL),
        (("moves", "open_close", "wait"), "moves", ALL | {PICK: "failed"}),
        (("moves", "wait"), "moves", ALL | {PICK: "failed", CLOSES: "failed"}),
        (("open_close", "wait"), "open_close", ALL | {PICK: "failed", MOVES: "failed"}),
    ],
)
def test_what_no_run_showed_is_not_said_to_be_shown(
    tmp_path: Path,
    whole: RobotDraft,
    monkeypatch: pytest.MonkeyPatch,
    passing: tuple[str, ...],
    name: str,
    abilities: dict[str, str],
) -> None:
    task = searched(tmp_path, whole, monkeypatch, *passing)
    assert (task.name, task.passed, shown(task)) == (name, True, abilities)
    lines = "\n".join(summary(found=(), checks=(), notes=(), task=task))
    assert ("crashed by SIGSEGV" in lines) == ("failed" in abilities.values())
    assert f"{PASS} first task" in lines


def test_a_robot_that_only_holds_still_is_no_success(
    tmp_path: Path, bare: RobotDraft, monkeypatch: pytest.MonkeyPatch
) -> None:
    task = searched(tmp_path, bare, monkeypatch, "wait")
    assert not task.passed
    assert shown(task) == {HOLDS: "passed", CLOSES: "not tried", MOVES: "failed", PICK: "not tried"}
    *_, last = summary(found=(), checks=(), notes=(), task=task)
    assert last == f"{FAIL} first task: the robot holds still; no run showed more"
    nothing = searched(tmp_path, bare, monkeypatch)
    assert {*shown(nothing).values()} == {"failed", "not tried"}
    assert not nothing.passed


def test_a_robot_of_kilometres_has_no_endless_grid_of_places(
    whole: RobotDraft, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its description is in millimetres, say."""
    monkeypatch.setattr(reachable, "_farthest", lambda *_: 1e6)
    monkeypatch.setattr(reachable, "EXAMINED", 1)
    assert whole.search is not None
    assert whole.parts.arm is not None
    joints = whole.parts.arm.joints
    assert not [*reachable.reachable_spots(Kinematics(whole.robot), whole.search, joints, whole.home, tool_height=0.02)]
