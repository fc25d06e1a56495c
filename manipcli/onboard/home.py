"""A start configuration: free of collision, well inside the limits, where the tool can move in every direction."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.core.text import digits
from manipcli.core.units import readable
from manipcli.model.collision import CollisionChecker, pairs
from manipcli.model.configuration import with_mimics
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Scene

SAMPLES: Final = 1500
TRIED: Final = 300
"""Configurations checked for collisions, the best first."""
LASTING: Final = 0.9
"""Pairs of links near each other in this share of the configurations are built so."""
ROBOT: Final = "robot/"
CENTRAL: Final = 0.8
"""Share of the range of each joint, around its middle, in which a start may be."""
HALF_TURN: Final = np.pi
"""[rad] Range to each side of a joint without limits; of a limited one at most so much counts."""
CLEARANCES: Final = (0.02, 0.01, 0.005)
"""[m] between parts, the largest first; the links of some wrists are always near each other."""
TIDY: Final = 0.85
"""A rounder configuration is used if its score is at least this share of the best."""
HIGH: Final = 0.15
"""[m] The tool is at least so high above the floor, or half as high as at zero."""


@dataclass(frozen=True, slots=True, eq=False)
class Home:
    """A start configuration: `q` (n), why, and `touching`: pairs of links that touch nearly everywhere."""

    q: Array
    evidence: str
    touching: tuple[tuple[str, str], ...] = ()


class HomeSearch:
    """Scores of configurations of an arm."""

    def __init__(
        self,
        robot: RobotModel,
        scene: Scene,
        joints: tuple[str, ...],
        *,
        q: Array,
        ignore: tuple[tuple[str, str], ...] = (),
        down: bool,
    ) -> None:
        """
        Args:
            robot: with its tool.
            scene: its floor is an obstacle.
            joints: of the arm.
            q: (n) all joints; those of the arm are replaced.
            ignore: pairs of links that may touch.
            down: prefer that the tool's z axis points down, as to pick from a table.
        """
        assert robot.tool is not None
        kinematics, link = Kinematics(robot), robot.tool.link
        self._link, self._X_LT, self._q, self._down = link, robot.tool.X_LT, q, down
        self._robot, self._columns = robot, robot.indices(joints)
        ranges = np.array([robot.joint(name).limits.within_soft for name in joints])
        self.lower = np.where(np.isfinite(ranges[:, 0]), ranges[:, 0], -HALF_TURN)
        self.upper = np.where(np.isfinite(ranges[:, 1]), ranges[:, 1], HALF_TURN)
        self._limited = np.isfinite(ranges).all(axis=1)
        middle = np.where(self._limited, (self.lower + self.upper) / 2.0, 0.0)
        self.middle = np.where((self.lower < -0.1) & (self.upper > 0.1), np.clip(0.0, self.lower, self.upper), middle)
        self._kinematics, self._scene = kinematics, scene
        self._ignored = tuple(ignore)
        moved = robot.descendants(robot.joint(joints[0]).child)
        self._still = [link.name for link in robot.links if link.name not in moved]
        self._highest = 0.5 * max(float(kinematics.forward(q, link).p[2]), 0.0)
        self.ignore(())

    def ignore(self, pairs: Sequence[tuple[str, str]]) -> None:
        """From now on these pairs of links may touch, too."""
        self._ignored += tuple(pairs)
        self._checker = CollisionChecker(self._kinematics, self._scene, ignore=self._ignored)
        self.keep(CLEARANCES[0])

    def keep(self, clearance: float) -> None:
        """From now on parts are apart by this clearance [m]."""
        self.clearance = clearance
        floor = [pair for body in self._scene.bodies for pair in pairs(self._still, body.name)]
        self.query = self._checker.at(margin=clearance, ignore=(*floor, *_pairs_of(self._still)))

    def whole(self, arm: Array) -> Array:
        """(n) all joints with those of the arm at `arm` (m)."""
        q = np.array(self._q)
        q[self._columns] = arm
        return with_mimics(self._robot, q)

    def score(self, arm: Array) -> float:
        """Manipulability, times the least margin to a limit, times the direction of the tool; 0 on the floor."""
        q = self.whole(arm)
        R, p, J = self._kinematics.pose_and_jacobian(q, self._link, self._X_LT)
        if p[2] < min(HIGH, self._highest):
            return 0.0
        reduced = J[:, self._columns]
        singular = np.linalg.svd(reduced[:3] if len(self._columns) < 6 else reduced, compute_uv=False)
        bend = max(1e-3, float(singular[-1] / max(singular[0], 1e-9))) if len(self._columns) >= 3 else 1.0
        half = np.maximum((self.upper - self.lower) / 2.0, 1e-9)  # a joint whose two limits are equal stays there
        inside = np.where(self._limited, 1.0 - np.abs(arm - (self.lower + self.upper) / 2.0) / half, 1.0)
        room = float(np.clip(inside.min() / 0.3, 0.0, 1.0))
        pointing = 0.2 + 0.8 * max(0.0, -float(R[2, 2])) ** 2 if self._down else 1.0
        near = 1.0 / (1.0 + 0.15 * float(np.square(arm - self.middle).sum()))
        return bend * room * pointing * near

    def lasting(self, configurations: Sequence[Array]) -> tuple[tuple[str, str], ...]:
        """The pairs of links that are near each other in nearly all of the configurations (m)."""
        counts: Counter[tuple[str, str]] = Counter()
        for arm in configurations:
            for hit in self.query.every(self.whole(arm)):
                if hit.a.startswith(ROBOT) and hit.b.startswith(ROBOT):
                    counts[hit.a.removeprefix(ROBOT), hit.b.removeprefix(ROBOT)] += 1
        return tuple(pair for pair, count in counts.items() if count >= LASTING * len(configurations))

    def within(self, arm: Array) -> bool:
        """Whether a configuration is inside the limits."""
        return bool(np.all((arm >= self.lower) & (arm <= self.upper)))

    def free(self, arm: Array) -> bool:
        """Whether the robot is clear of itself and the floor."""
        return not self.query.touches(self.whole(arm))


def guess_home(search: HomeSearch, *, seed: int = 0) -> Home | None:
    """The best of many random configurations, made round; None if none is free."""
    rng = np.random.default_rng(seed)
    centre, half = (search.lower + search.upper) / 2.0, CENTRAL * (search.upper - search.lower) / 2.0
    drawn = [search.middle, *rng.uniform(centre - half, centre + half, (SAMPLES, len(half)))]
    scores = np.array([search.score(arm) for arm in drawn])
    order = np.argsort(-scores, kind="stable")
    lasting: tuple[tuple[str, str], ...] = ()
    best = _first_free(search, drawn, scores, order)
    if best is None:
        lasting = search.lasting([drawn[int(k)] for k in order[:TRIED]])
        search.ignore(lasting)
        best = _first_free(search, drawn, scores, order)
    if best is None:
        return None
    best = _tidied(search, np.array(best))
    return Home(search.whole(best), _evidence(search, best, scores), lasting)


def _first_free(search: HomeSearch, drawn: Sequence[Array], scores: Array, order: npt.NDArray[np.intp]) -> Array | None:
    """The best configuration without contacts, with the largest clearance for which there is one."""
    for clearance in CLEARANCES:
        search.keep(clearance)
        tried = (drawn[int(k)] for k in order if scores[k] > 0.0)
        best = next((arm for arm in itertools.islice(tried, TRIED) if search.free(arm)), None)
        if best is not None:
            return best
    return None


def _tidied(search: HomeSearch, arm: Array) -> Array:
    """Nearly as good, with round values and joints in the middle of their range where possible."""
    least = search.score(arm)
    for k in range(len(arm)):
        for value in _rounder(search, arm, k):
            other = np.array(arm)
            other[k] = value
            score = search.score(other)
            if search.lower[k] <= value <= search.upper[k] and score >= TIDY * least and search.free(other):
                arm, least = other, max(score, TIDY * least)
                break
    return arm


def _rounder(search: HomeSearch, arm: Array, k: int) -> Iterator[float]:
    """Values of a joint to try: the middle, then multiples of 15 and of 5 degrees, or of 5 and 1 cm."""
    yield float(search.middle[k])
    turning = search.upper[k] - search.lower[k] > 1.0
    for unit in (np.radians(15.0), np.radians(5.0)) if turning else (0.05, 0.01):
        yield float(np.round(arm[k] / unit) * unit)


def _evidence(search: HomeSearch, arm: Array, scores: Array) -> str:
    q = search.whole(arm)
    J = search._kinematics.jacobian(q, search._link, search._X_LT)[:, search._columns]
    least = float(np.linalg.svd(J if len(search._columns) >= 6 else J[:3], compute_uv=False)[-1])
    half = (search.upper - search.lower) / 2.0
    inside = np.where(search._limited, half - np.abs(arm - (search.lower + search.upper) / 2.0), np.inf)
    room = f"{digits(float(inside.min()))} from the nearest limit, " if np.isfinite(inside.min()) else ""
    return (
        f"best of {len(scores)} configurations (seed 0): {room}all parts {readable(search.clearance, 'm')} apart, "
        f"smallest singular value of the tool's Jacobian {digits(least)}"
    )


def _pairs_of(links: Sequence[str]) -> tuple[tuple[str, str], ...]:
    """Pairs of parts of these links."""
    return tuple((f"{ROBOT}{a}", f"{ROBOT}{b}") for a, b in itertools.combinations(links, 2))
