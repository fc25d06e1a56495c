"""A first task for a robot, found by trying: runs of candidates until one passes.

Each run is a process, so that a crash or a hang of native code fails a candidate, and not the search.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import numpy as np

from manipcli.batch.forks import ForkPool
from manipcli.batch.job import Job, Settings
from manipcli.batch.process import run_job
from manipcli.core.geometry import Array
from manipcli.core.text import number_of
from manipcli.core.units import readable
from manipcli.model.hand.measure import BLOCK
from manipcli.model.kinematics import Kinematics
from manipcli.onboard.home import CLEARANCES, HomeSearch
from manipcli.onboard.reachable import ABOVE, Spots, reachable_spots
from manipcli.onboard.robot_draft import NOTHING_TO_HOLD_WITH, RobotDraft
from manipcli.onboard.writer import Entry, Value, written
from manipcli.report.suite.suite import Case

MOST_PLANS: Final = 10
MOST_RUNS: Final = 3
MARGIN: Final = 0.12
"""[m] of a desk around the places on it."""
DENSITY: Final = 500.0
"""[kg/m3] of the block: wood."""
UNDONE: Final = 0.25
"""Share of its way that a hand may miss from closed: fingers that come to rest on each other."""
SHARES: Final = (1.0, 0.75, 0.5)
"""Of the way to closed, tried in turn."""
LEAST_UNDONE: Final = {"rad": 0.09, "m": 0.003}
NO_ARM: Final = "the robot has no arm"
NO_HAND: Final = "the robot has no hand"
MOVES: Final = 12
"""Pairs of poses that are tried."""
LOW: Final = 0.06
"""[m] As `reachable.ABOVE`, for small arms that do not reach so high with the tool down."""
PICKING: Final = "picks and places a block"


Shown = Literal["passed", "failed", "not tried"]


@dataclass(frozen=True, slots=True)
class Ability:
    """What a run showed of the robot.

    Attributes:
        what: the robot does, or should do.
        shown: by a run.
        why: the run that showed it; else why no run did.
        runs: number of runs that failed.
    """

    what: str
    shown: Shown
    why: str
    runs: int = 0


@dataclass(frozen=True, slots=True)
class FirstTask:
    """A task that passes, or the last one that was tried.

    Attributes:
        name: of the task and its file.
        entries: of the file.
        poses: named poses that it needs in the robot file.
        does: what it does, in words.
        passed: whether its run passed, and the robot does more in it than hold still.
        abilities: what was shown and what not, the least first.
    """

    name: str
    entries: Mapping[str, Entry]
    poses: Mapping[str, Entry]
    does: str
    passed: bool
    abilities: tuple[Ability, ...]

    @property
    def dropped(self) -> str:
        """Why runs of picking failed although they were planned, so that other controllers may help; else ""."""
        failed = (each.why for each in self.abilities if each.what == PICKING and each.shown == "failed" and each.runs)
        return next(failed, "")


@dataclass(frozen=True, slots=True)
class _Candidate:
    name: str
    entries: dict[str, Entry]
    does: str
    poses: Mapping[str, Entry]


class TaskSearch(AbstractContextManager["TaskSearch"]):
    """Tries tasks in a folder with the robot and controllers files; its end ends the process that forks the runs."""

    def __init__(
        self,
        folder: Path,
        draft: RobotDraft,
        *,
        write_robot: Callable[[Mapping[str, Entry]], None],
        package_path: tuple[Path, ...],
        allow_outside: bool,
        on_progress: Callable[[str], None],
    ) -> None:
        """
        Args:
            folder: has `robot.yaml` and `controllers.yaml`.
            draft: the robot.
            write_robot: writes `robot.yaml` with further poses.
            package_path, allow_outside: see `load_task`.
            on_progress: receives what is being tried.
        """
        self._folder, self._draft, self._write_robot = folder, draft, write_robot
        self._settings = Settings(
            package_path=package_path,
            allow_outside=allow_outside,
            folder=folder / "runs",
            baseline=False,
            pictures=False,
        )
        self._progress = on_progress
        self._causes: list[str] = []
        self._pool = ForkPool([])
        self._pool.open(least=0)

    def __exit__(self, *_: object) -> None:
        self._pool.close()

    def unsteady(self) -> str | None:
        """Why the robot does not hold still with these controllers, or a hand alone does not close; None if it does."""
        self._causes.clear()
        candidates = [self._waits()]
        if self._draft.parts.arm is None:
            candidates += itertools.islice(self._closes(), 1)
        for candidate in candidates:
            self._progress(candidate.does)
            if self._tried(candidate) == "failed":
                return self._causes[-1]  # a task without a plan is not the fault of controllers
        return None

    def search(self) -> FirstTask:
        """The most ambitious task that passes: picking and placing, else moves, else opening and closing."""
        best: _Candidate | None = None
        poses: dict[str, Entry] = {}
        abilities: list[Ability] = []
        for what, candidates in (
            (PICKING, self._picks()),
            ("moves between poses", self._moves()),
            ("opens and closes the hand", self._closes()),
            ("holds still", iter((self._waits(),))),
        ):
            own = what == "opens and closes the hand" and best is not None and best.name == "moves"
            if best is not None and not own:
                abilities.append(Ability(what, "passed", f"in the run of {best.name}"))
                continue
            found, ability = self._first(what, candidates)
            abilities.append(ability)
            if found is not None:
                best, poses = best or found, {**found.poses, **poses}
        passed = best is not None and best.name != "wait"
        best = best or self._waits()
        return FirstTask(best.name, best.entries, poses, best.does, passed, tuple(reversed(abilities)))

    def _first(self, what: str, candidates: Iterator[_Candidate]) -> tuple[_Candidate | None, Ability]:
        """The first candidate that passes."""
        self._causes.clear()
        runs = tried = 0
        for candidate in candidates:
            tried += 1
            self._progress(f"{candidate.does} ({tried})")
            outcome = self._tried(candidate)
            if outcome == "passed":
                return candidate, Ability(what, "passed", f"{candidate.does}: {candidate.name}")
            runs += outcome == "failed"
            if tried >= MOST_PLANS or runs >= MOST_RUNS:
                break
        cause = max(self._causes, key=self._causes.count) if self._causes else "unknown"
        if not tried:
            return None, Ability(what, "not tried", cause)
        attempts = f"{number_of(tried, 'attempt')}, {number_of(runs, 'run')}"
        return None, Ability(what, "failed", f"{attempts}: {cause}", runs)

    def _tried(self, candidate: _Candidate) -> Literal["passed", "failed", "unplanned"]:
        """The outcome of a run; the cause of another one than "passed" is the last of `_causes`."""
        self._write_robot(candidate.poses)
        path = self._folder / "tasks" / f"{candidate.name}.yaml"
        path.parent.mkdir(exist_ok=True)
        path.write_text(written(candidate.entries), encoding="utf-8")
        report = run_job(Job(Case(path.name, candidate.name), path, self._settings), pool=self._pool)
        if report.passed:
            return "passed"
        cause = [finding.message for finding in report.findings] or [report.text]
        self._causes.append(cause[0])
        planned = report.outcome in ("crashed", "hung") or report.log is not None
        return "failed" if planned else "unplanned"

    def _picks(self) -> Iterator[_Candidate]:
        draft = self._draft
        arm, frame = draft.parts.arm, draft.frame
        if arm is None or frame is None or draft.parts.hand is None:
            self._causes.append(NO_ARM if arm is None else NO_HAND)
            return
        if not any(draft.robot.link(link).collisions for branch in draft.parts.hand.branches for link in branch):
            self._causes.append(NOTHING_TO_HOLD_WITH)
            return
        edge = block_edge(frame.narrowest, frame.widest)
        if edge is None:
            self._causes.append(
                f"between the fingers there are only {readable(frame.narrowest, 'm')} to {readable(frame.widest, 'm')}"
            )
            return
        assert draft.search is not None
        count = 0
        for above in (ABOVE, LOW):
            if above == LOW:
                draft.search.keep(CLEARANCES[-1])
            kinematics = Kinematics(draft.robot)
            for one in reachable_spots(
                kinematics, draft.search, arm.joints, draft.home, tool_height=edge / 2, above=above
            ):
                count += 1
                yield _pick(one, edge, above)
            if count:
                break
        if not count:
            self._causes.append("no place was found that the tool reaches from the top or from the side")

    def _moves(self) -> Iterator[_Candidate]:
        draft = self._draft
        if draft.search is None or draft.parts.arm is None:
            self._causes.append(NO_ARM)
            return
        columns = draft.robot.indices(draft.parts.arm.joints)
        others = _elsewhere(draft.search, draft.home[columns])
        hand: dict[str, Value] = {draft.hand_name: "open"} if draft.parts.hand else {}
        for a, b in itertools.islice(zip(others[::2], others[1::2], strict=False), MOVES):
            poses = {
                name: Entry({draft.arm_name: [round(float(value), 3) for value in arm], **hand}, why)
                for name, arm, why in (
                    ("first", a, "for the first task: free, and inside the limits"),
                    ("second", b, ""),
                )
            }
            names = ["first", "second", "home"]
            entries = {
                **_head("moves", "The arm moves between named poses."),
                "steps": Entry([{"move": {"to": name}} for name in names]),
                "expect": Entry([{"at_pose": {"pose": "home", "group": draft.arm_name, "within": "2 deg"}}]),
            }
            yield _Candidate("moves", entries, "the arm moves between three poses", poses)
        if not others:
            self._causes.append("no other configuration was found that is free of collision and inside the limits")

    def _waits(self) -> _Candidate:
        entries = {**_head("wait", "The robot holds still."), "steps": Entry([{"wait": "0.5 s"}])}
        return _Candidate("wait", entries, "the robot holds still", {})

    def _closes(self) -> Iterator[_Candidate]:
        if self._draft.parts.hand is None:
            self._causes.append(NO_HAND)
            return
        robot, hand = self._draft.robot, self._draft.parts.hand
        group = self._draft.hand_name
        units = {robot.joint(name).unit for name in hand.joints}
        within: dict[str, Value] = {}
        nearly: dict[str, Value] = {}  # closed fingers rest on each other, but have gone most of the way
        closure = self._draft.closure
        assert closure is not None
        for share in SHARES:
            way = share * (closure.closed - closure.opened)
            poses = {}
            if share < 1.0:
                closed: list[Value] = [round(float(value), 4) for value in closure.opened + way]
                why = f"{share:.0%} of the way without overlaps; at its end the hand came to rest before closed"
                poses["closed"] = Entry({group: closed}, why, True)
            for unit, field, near in (("rad", "within", "5 deg"), ("m", "slide", "3 mm")):
                if unit in units:
                    within[field] = near
                    own = [robot.joint(name).unit == unit for name in hand.joints]
                    most = max(UNDONE * float(np.abs(way)[own].max()), LEAST_UNDONE[unit])
                    nearly[field] = f"{float(f'{most:.2g}'):g} {unit}"
            entries = {
                **_head("open_close", "The hand closes and opens."),
                "steps": Entry([{"move": {"to": "closed"}}, {"move": {"to": "open"}}]),
                "expect": Entry(
                    [
                        {"at_pose": {"pose": "closed", "group": group, **nearly}, "at": "move_1"},
                        {"at_pose": {"pose": "open", "group": group, **within}},
                    ]
                ),
            }
            yield _Candidate("open_close", entries, "the hand closes and opens", poses)


def block_edge(narrowest: float, widest: float) -> float | None:
    """[m] Edge of a block that fits between the fingers: 4 cm if possible; None if none does."""
    low, high = max(narrowest + 0.005, 0.01), 0.8 * widest
    return None if low > high else round(min(max(BLOCK, low), high), 3)


def _head(name: str, comment: str) -> dict[str, Entry]:
    return {
        "task": Entry(name, comment),
        "robot": Entry("../robot.yaml"),
        "controllers": Entry("../controllers.yaml"),
    }


def _pick(spots: Spots, edge: float, above: float) -> _Candidate:
    h = spots.height
    mass = round(DENSITY * edge**3, 3)
    scene: dict[str, Entry] = {}
    support = "floor"
    (px, py), (gx, gy) = spots.pick, spots.place
    if h > 0.0:
        support = "desk"
        x, y = sorted((px, gx)), sorted((py, gy))
        size = [round(b - a + 2 * MARGIN, 3) for a, b in (x, y)]
        centre = [round((a + b) / 2, 3) for a, b in (x, y)]
        scene["desk"] = Entry(
            {"box": {"size": [*size, round(h, 3)]}, "pose": {"xyz": [*centre, round(h / 2, 4)]}, "fixed": True}
        )
    near: dict[str, Value] = {} if above == ABOVE else {"distance": f"{50.0 * above:g} cm"}
    back: dict[str, Value] = {} if above == ABOVE else {"retreat": f"{50.0 * above:g} cm"}
    word = "down" if spots.approach == "top" else "level"
    scene["block"] = Entry(
        {
            "box": {"size": [edge, edge, edge]},
            "mass": mass,
            "friction": 0.9,
            "rests_on": support,
            "at": [px, py],
        },
        f"reached with the tool {word}, here, {readable(above, 'm')} higher, "
        "and at the other place (inverse kinematics)",
    )
    entries = {
        **_head("pick_place", f"A block of {readable(edge, 'm')} is picked and placed elsewhere on the {support}."),
        "scene": Entry(scene),
        "steps": Entry(
            [
                {"pick": {"object": "block", "approach": {"from": spots.approach, **near}}},
                {"lift": {"object": "block", "by": [f"{50.0 * above:g} cm", f"{100.0 * above:g} cm"]}},
                {"place": {"object": "block", "at": [gx, gy], "onto": support, **back}},
                {"move": {"to": "home"}},
            ]
        ),
        "expect": Entry([{"near": {"object": "block", "to": [gx, gy, round(h + edge / 2, 4)], "within": "1.5 cm"}}]),
    }
    does = f"a block of {readable(edge, 'm')} is picked from the {spots.approach} and placed on the {support}"
    return _Candidate("pick_place", entries, does, {})


def _elsewhere(search: HomeSearch, home: Array) -> list[Array]:
    """Configurations (m) to move to: good ones, away from home and from each other, nearer ones first."""
    rng = np.random.default_rng(1)
    spread = np.minimum(0.8, 0.25 * (search.upper - search.lower))
    drawn = np.clip(home + rng.uniform(-1.0, 1.0, (400, len(home))) * spread, search.lower, search.upper)
    scores = np.array([search.score(arm) for arm in drawn])
    least = 0.2 * max(search.score(home), 1e-9)
    found: list[Array] = []
    for k in np.argsort(-scores, kind="stable"):
        arm = drawn[int(k)]
        if scores[k] < least or len(found) == 2 * MOVES:
            break
        apart = min((float(np.abs(arm - other).max()) for other in (home, *found)), default=1.0)
        if apart > 0.4 * float(spread.max()) and search.free(arm):
            found.append(arm)
    return found
