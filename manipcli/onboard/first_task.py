"""A first task for a robot, found by trying: plans and runs of candidates until one passes."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from manipcli import pipeline
from manipcli.core.errors import InvalidInput, NotPlannable
from manipcli.core.geometry import Array
from manipcli.core.text import number_of
from manipcli.core.units import readable
from manipcli.model.kinematics import Kinematics
from manipcli.onboard.home import CLEARANCES, HomeSearch
from manipcli.onboard.reachable import ABOVE, Spots, reachable_spots
from manipcli.onboard.robot_draft import BLOCK, NOTHING_TO_HOLD_WITH, RobotDraft
from manipcli.onboard.writer import Entry, Value, written
from manipcli.task.load_task import LoadOptions

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
MOVES: Final = 12
"""Pairs of poses that are tried."""
LOW: Final = 0.06
"""[m] As `reachable.ABOVE`, for small arms that do not reach so high with the tool down."""
PICKING: Final = "picking and placing a block"


@dataclass(frozen=True, slots=True)
class FirstTask:
    """A task that passes, or the last one that was tried.

    Attributes:
        name: of the task and its file.
        text: of the file.
        poses: named poses that it needs in the robot file.
        does: what it does, in words.
        passed: whether its run passed.
        notes: what was tried before, and why it failed.
        dropped: why a run of picking failed although it was planned, so that other controllers may help; else "".
    """

    name: str
    entries: Mapping[str, Entry]
    poses: Mapping[str, Entry]
    does: str
    passed: bool
    notes: tuple[str, ...]
    dropped: str = ""


@dataclass(frozen=True, slots=True)
class _Candidate:
    name: str
    entries: dict[str, Entry]
    does: str
    poses: Mapping[str, Entry]


class TaskSearch:
    """Tries tasks in a folder with the robot and controllers files."""

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
        self._options: LoadOptions = {"package_path": package_path, "allow_outside": allow_outside}
        self._progress = on_progress
        self._causes: list[str] = []

    def unsteady(self) -> str | None:
        """Why the robot does not hold still with these controllers, or a hand alone does not close; None if it does."""
        self._causes.clear()
        candidates = [self._waits()]
        if self._draft.parts.arm is None:
            candidates += itertools.islice(self._closes(), 1)
        for candidate in candidates:
            self._progress(f"{candidate.does}: a run")
            if self._plans(candidate) and not self._passes(candidate):
                return self._causes[-1]  # a task without a plan is not the fault of controllers
        return None

    def search(self) -> FirstTask:
        """The most ambitious task that passes: pick and place, else moves, else open and close."""
        notes: list[str] = []
        last: _Candidate | None = None
        dropped = ""
        for kind, candidates in (
            (PICKING, self._picks()),
            ("moving between poses", self._moves()),
            ("opening and closing the hand", self._closes()),
            ("holding still", iter((self._waits(),))),
        ):
            self._causes.clear()
            runs = plans = 0
            for candidate in candidates:
                last = candidate
                plans += 1
                self._progress(f"{candidate.does} ({plans})")
                planned = self._plans(candidate)
                runs += planned
                if planned:
                    self._progress(f"{candidate.does}: a run")
                if planned and self._passes(candidate):
                    return FirstTask(
                        candidate.name, candidate.entries, candidate.poses, candidate.does, True, tuple(notes), dropped
                    )
                if plans >= MOST_PLANS or runs >= MOST_RUNS:
                    break
            if plans or self._causes:
                cause = max(self._causes, key=self._causes.count) if self._causes else "unknown"
                dropped = cause if kind == PICKING and runs else dropped
                notes.append(f"{kind} failed in {number_of(plans, 'attempt')} ({number_of(runs, 'run')}): {cause}")
        assert last is not None
        return FirstTask(last.name, last.entries, last.poses, last.does, False, tuple(notes), dropped)

    def _path(self, candidate: _Candidate) -> Path:
        self._write_robot(candidate.poses)
        path = self._folder / "tasks" / f"{candidate.name}.yaml"
        path.parent.mkdir(exist_ok=True)
        path.write_text(written(candidate.entries))
        return path

    def _plans(self, candidate: _Candidate) -> bool:
        try:
            pipeline.plan_task(pipeline.load_task(self._path(candidate), **self._options))
        except NotPlannable as refusal:
            self._causes.append(f"{refusal.step}: {refusal.cause}")
            return False
        except InvalidInput as refused:
            self._causes.append(refused.findings[0].message)
            return False
        return True

    def _passes(self, candidate: _Candidate) -> bool:
        try:
            report = pipeline.run_task(
                self._path(candidate), log=self._folder / "first.mcap", force=True, **self._options
            )
        except InvalidInput as refused:
            self._causes.append(refused.findings[0].message)
            return False
        if report.verdict.verdict != "passed":
            self._causes.append(report.verdict.text)
        return report.verdict.verdict == "passed"

    def _picks(self) -> Iterator[_Candidate]:
        draft = self._draft
        arm, frame = draft.parts.arm, draft.frame
        if arm is None or frame is None or draft.parts.hand is None:
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

    def _waits(self) -> _Candidate:
        entries = {**_head("wait", "The robot holds still."), "steps": Entry([{"wait": "0.5 s"}])}
        return _Candidate("wait", entries, "the robot holds still", {})

    def _closes(self) -> Iterator[_Candidate]:
        if self._draft.parts.hand is None:
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
