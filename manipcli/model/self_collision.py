"""Self-collision matrix of a robot: which pairs of links can collide, by sampling and, where it is cheap, by proof.

Every pair of links with collision shapes has one kind, as in MoveIt's setup assistant:

- `adjacent`: at most one moving joint between them; never checked.
- `ignored`: named under `collision_ignore`; never checked.
- `always`: they overlap in every sample and with all joints at zero; never checked.
- `default`: they overlap with all joints at zero, by no more than `TOUCHING` or in most configurations too; or they are
  closer than `CLOSE` there, with one link between them; never checked.
- `sometimes`: they overlap in some samples; checked.
- `never`: they overlap in no sample; checked all the same, because samples are no proof, and because leaving these
  pairs out makes a query no faster (the broad phase sorts them out). `proven` marks the pairs that cannot come near
  each other anywhere within the joint limits.

What planning checks does not depend on the matrix: `lasting_overlaps` and `spaced_by_one` are the rules of both.
"""

from __future__ import annotations

import heapq
import threading
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations, count
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.model.configuration import with_mimics
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.shapes.proximity import coal_shape

if TYPE_CHECKING:
    import pinocchio as pin

Flags = npt.NDArray[np.bool_]
Kind = Literal["adjacent", "ignored", "always", "default", "sometimes", "never"]
CHECKED: Final = ("sometimes", "never")
"""Kinds of pairs that planning checks."""
SAMPLES: Final = 10_000
CONFIDENCE: Final = 0.95
UNLIMITED: Final = np.pi
"""[rad or m] A joint without limits is sampled from minus to plus this: a whole turn."""
APART: Final = 0.005
"""[m] Proven pairs stay further apart than this, which is more than the default clearance of plans."""
PROBES: Final = 100
"""Configurations that decide whether links that overlap at zero belong together or can come apart."""
TOUCHING: Final = 1e-3
"""[m] Overlap up to which two links only touch."""
CLOSE: Final = 0.004
"""[m] Links with one link between them that are closer than this with all joints at zero are built so.

It is the default clearance of plans: a robot could not even start there."""
MOST_CELLS: Final = 4000
"""Distances computed for one proof, at most; a pair that needs more is not proven."""


@dataclass(frozen=True, slots=True)
class LinkPair:
    """Two links. `share`: of the samples in which they overlap, 0 to 1; None for pairs that are not sampled."""

    a: str
    b: str
    kind: Kind
    share: float | None = None
    proven: bool = False

    @property
    def checked(self) -> bool:
        """Whether planning checks the pair."""
        return self.kind in CHECKED


@dataclass(frozen=True, slots=True)
class SelfCollisionMatrix:
    """Every pair of links with collision shapes, by name; `samples`: random configurations within the joint limits."""

    pairs: tuple[LinkPair, ...]
    samples: int

    @property
    def rarest(self) -> float:
        """The share of configurations in which a pair of kind `never` overlaps is below this with `CONFIDENCE`.

        If the share is p, no overlap in N samples has the probability (1 - p)^N.
        """
        return float(1.0 - (1.0 - CONFIDENCE) ** (1.0 / self.samples))


def sampled_matrix(robot: RobotModel, *, samples: int = SAMPLES, seed: int = 0) -> SelfCollisionMatrix:
    """The matrix of a robot; deterministic for a seed.

    Args:
        robot: the robot, with the files of its meshes.
        samples: number of random configurations.
        seed: of the generator.
    """
    lower, upper = _ranges(robot)
    links = _Links(Kinematics(robot), lower, upper)
    pairs = list(combinations(sorted(links.shapes), 2))
    tested, lasting = _tested(robot, links)
    overlaps = links.tester(tested)
    hits = np.zeros(len(tested))
    rng = np.random.default_rng(seed)
    for q in with_mimics(robot, rng.uniform(lower, upper, (samples, len(lower)))):
        hits += overlaps(q)
    found = dict(zip(tested, (hits / samples).tolist(), strict=True))

    def of(pair: tuple[str, str]) -> LinkPair:
        if pair not in found:
            return LinkPair(*pair, "adjacent" if links.adjacent(*pair) else "ignored")
        share = found[pair]
        if pair in lasting:
            return LinkPair(*pair, "always" if share == 1.0 else "default", share)
        if share > 0.0:
            return LinkPair(*pair, "sometimes", share)
        return LinkPair(*pair, "never", 0.0, proven=links.apart(*pair))

    return SelfCollisionMatrix(tuple(map(of, pairs)), samples)


@lru_cache(maxsize=4)
def checked_pairs(robot: RobotModel) -> tuple[tuple[str, str], ...]:
    """The pairs of links that planning checks, by name, without sampling: what an engine has to keep apart, too.

    Planning also leaves out the pairs within a hand, whose fingers may meet.
    """
    links = _links(robot)
    tested, lasting = _tested(robot, links)
    return tuple(pair for pair in tested if pair not in lasting)


def overlapping(robot: RobotModel, pairs: Sequence[tuple[str, str]], q: Array) -> Mapping[tuple[str, str], float]:
    """Those of the pairs that overlap by more than `TOUCHING` at `q` (n), with the depth [m]."""
    links = _links(robot)
    touching = [pair for pair, hit in zip(pairs, links.tester(pairs)(q), strict=True) if hit]
    depths = {pair: -links.distance(*pair, q) for pair in touching}
    return {pair: depth for pair, depth in depths.items() if depth > TOUCHING}


def _links(robot: RobotModel) -> _Links:
    return _links_of_thread(robot, threading.get_ident())


@lru_cache(maxsize=4)
def _links_of_thread(robot: RobotModel, thread: int) -> _Links:
    """The links, kept: with detailed meshes, they take 30 ms to build. A query moves them, so threads share none."""
    return _Links(Kinematics(robot), *_ranges(robot))


def _tested(robot: RobotModel, links: _Links) -> tuple[list[tuple[str, str]], set[tuple[str, str]]]:
    """The pairs that are neither adjacent nor ignored, and those of them that are modelled into each other."""
    ignored = {frozenset(pair) for pair in robot.collision_ignore}
    pairs = combinations(sorted(links.shapes), 2)
    tested = [pair for pair in pairs if not links.adjacent(*pair) and frozenset(pair) not in ignored]
    zero = np.array([joint.limits.nearest(0.0) for joint in robot.moving_joints])
    touching = [pair for pair, hit in zip(tested, links.tester(tested)(zero), strict=True) if hit]
    lasting = lasting_overlaps(robot, {pair: links.distance(*pair, zero) for pair in touching})
    spaced = spaced_by_one(links.model, set(tested) - set(touching))
    return tested, lasting | {pair for pair in spaced if links.distance(*pair, zero) < CLOSE}


def lasting_overlaps(robot: RobotModel, at_zero: Mapping[tuple[str, str], float]) -> set[tuple[str, str]]:
    """Those of the pairs that overlap with all joints at zero which are modelled so: planning never checks them.

    They only touch there, as closed fingers do, or they overlap in at least half of `PROBES` configurations. Others
    merely collide at zero: a Panda's hand is then 41 mm in its forearm, and apart from it in 91 % of configurations.

    Args:
        robot: the robot.
        at_zero: distance [m], negative for an overlap, of each pair of links that overlaps at zero.
    """
    deep = [pair for pair, distance in at_zero.items() if distance < -TOUCHING]
    found = at_zero.keys() - deep
    if deep:
        lower, upper = _ranges(robot)
        overlaps = _Links(Kinematics(robot), lower, upper, only={name for pair in deep for name in pair}).tester(deep)
        probes = with_mimics(robot, np.random.default_rng(0).uniform(lower, upper, (PROBES, len(lower))))
        hits = np.sum([overlaps(q) for q in probes], axis=0)
        found |= {pair for pair, number in zip(deep, hits, strict=True) if 2 * number >= PROBES}
    return found


def spaced_by_one(model: pin.Model, pairs: Iterable[tuple[str, str]]) -> frozenset[tuple[str, str]]:
    """Those pairs of links with one link between them on their chain. Planning never checks the ones that are apart
    with all joints at zero, but closer than `CLOSE`."""
    parents = [int(parent) for parent in model.parents]

    def spaced(a: str, b: str) -> bool:
        i, j = (model.frames[model.getFrameId(name)].parentJoint for name in (a, b))
        return bool(i != j and (parents[parents[i]] == j or parents[parents[j]] == i))

    return frozenset(pair for pair in pairs if spaced(*pair))


def _ranges(robot: RobotModel) -> tuple[Array, Array]:
    """(n,) lower and upper ends of the positions; a mimic joint reaches what its leader makes of it."""
    lower = np.array([-UNLIMITED if j.limits.lower is None else j.limits.lower for j in robot.moving_joints])
    upper = np.array([UNLIMITED if j.limits.upper is None else j.limits.upper for j in robot.moving_joints])
    ends = np.sort([with_mimics(robot, lower), with_mimics(robot, upper)], axis=0)
    return ends[0], ends[1]


class _Links:
    """Collision shapes of the links of a robot whose joints are between `lower` and `upper` (n,)."""

    def __init__(
        self, kinematics: Kinematics, lower: Array, upper: Array, *, only: Collection[str] | None = None
    ) -> None:
        import pinocchio as pin

        self._lower, self._upper = lower, upper
        self._pin = pin
        self.model = model = kinematics.model
        self._data = model.createData()
        self._geometry = pin.GeometryModel()
        self.shapes: dict[str, list[int]] = {}
        self._joint: dict[str, int] = {}
        for link in kinematics.robot.links:
            if only is not None and link.name not in only:
                continue
            frame = model.frames[model.getFrameId(link.name)]
            for k, each in enumerate(link.collisions):
                placement = frame.placement * pin.SE3(np.array(each.X_LS.R), np.array(each.X_LS.p))
                made = pin.GeometryObject(f"{link.name}#{k}", frame.parentJoint, placement, coal_shape(each.shape))
                self.shapes.setdefault(link.name, []).append(self._geometry.addGeometryObject(made))
                self._joint[link.name] = frame.parentJoint

    def adjacent(self, a: str, b: str) -> bool:
        """Whether at most one moving joint is between two links."""
        i, j = self._joint[a], self._joint[b]
        return i == j or self.model.parents[i] == j or self.model.parents[j] == i

    def tester(self, pairs: Sequence[tuple[str, str]]) -> Callable[[Array], Flags]:
        """A function of a configuration (n,): whether each of the pairs overlaps (k,)."""
        geometry, owners = self._with_pairs(pairs)
        data = geometry.createData()
        results = list(data.collisionResults)  # views: they change with each computation

        def overlaps(q: Array) -> Flags:
            self._pin.computeCollisions(self.model, self._data, geometry, data, q, False)
            touching = [result.isCollision() for result in results]
            return np.asarray(np.bincount(owners, weights=touching, minlength=len(pairs)) > 0.0)

        return overlaps

    def _with_pairs(self, pairs: Sequence[tuple[str, str]]) -> tuple[pin.GeometryModel, Array]:
        """The shapes with these pairs of links; the number of the pair that each pair of shapes belongs to."""
        geometry = self._geometry.copy()
        owners: list[int] = []
        for k, (a, b) in enumerate(pairs):
            for i in self.shapes[a]:
                for j in self.shapes[b]:
                    geometry.addCollisionPair(self._pin.CollisionPair(i, j))
                    owners.append(k)
        return geometry, np.array(owners, dtype=np.int64)

    def distance(self, a: str, b: str, q: Array) -> float:
        """Distance [m] of two links at `q` (n,), negative for an overlap."""
        geometry, _ = self._with_pairs([(a, b)])
        return self._least(geometry, geometry.createData(), q)

    def _least(self, geometry: pin.GeometryModel, data: pin.GeometryData, q: Array) -> float:
        """The least distance [m] of all pairs of shapes."""
        self._pin.forwardKinematics(self.model, self._data, q)
        self._pin.updateGeometryPlacements(self.model, self._data, geometry, data)
        count = len(geometry.collisionPairs)
        return float(min(self._pin.computeDistance(geometry, data, k).min_distance for k in range(count)))

    def apart(self, a: str, b: str) -> bool:
        """Whether two links are proven to be more than `APART` apart for all joint values.

        Branch and bound over the joints between the links: a motion by d_k of joint k moves a point of the link at
        distance r_k from its axis by at most d_k r_k, so that a box of joint values is free if the distance at its
        middle exceeds the sum of d_k r_k over half its edges. Other boxes are halved, the least free ones first.
        """
        joints, reach = self._between(a, b)
        geometry, _ = self._with_pairs([(a, b)])
        data = geometry.createData()
        q = (self._lower + self._upper) / 2.0

        def excess(middle: Array, half: Array) -> float:
            q[joints] = middle
            near = self._least(geometry, data, q)
            return -np.inf if near <= APART else float(near - half @ reach - APART)

        number = count()
        middle, half = q[joints], (self._upper - self._lower)[joints] / 2.0
        cells = [(excess(middle, half), next(number), middle, half)]
        for _ in range(MOST_CELLS // 2):
            if not cells:
                return True
            free, _, middle, half = heapq.heappop(cells)
            if free > 0.0:
                return True  # the least free box is free
            if free == -np.inf:
                return False
            k = int(np.argmax(half * reach))
            narrow = half.copy()
            narrow[k] /= 2.0
            for sign in (-1.0, 1.0):
                there = middle.copy()
                there[k] += sign * narrow[k]
                heapq.heappush(cells, (excess(there, narrow), next(number), there, narrow))
        return False

    def _between(self, a: str, b: str) -> tuple[list[int], Array]:
        """Columns in q of the joints between two links, and how far at most [m] a link is from each axis (1 for a joint
        that slides).

        The less of the two links: to move one past the other is to move the other past it. The distance is at most the
        sum of the lengths between the joints and the radius of the link.
        """
        up, down = self._chain(self._joint[a]), self._chain(self._joint[b])
        shared = {*up} & {*down}
        rising = [joint for joint in up if joint not in shared]
        falling = [joint for joint in reversed(down) if joint not in shared]
        joints = [*rising, *falling]
        lengths = [self._length(joint) for joint in joints]
        reach = []
        for k, joint in enumerate(joints):
            below = k >= len(rising)  # a joint's length leads to its parent, which is towards a only on this side
            to_a = self._radius(a) + sum(lengths[: k + below])
            to_b = self._radius(b) + sum(lengths[k + below :])
            reach.append(1.0 if self._slides(joint) else min(to_a, to_b))
        return [self.model.joints[joint].idx_q for joint in joints], np.array(reach)

    def _chain(self, joint: int) -> list[int]:
        """The joint and all above it."""
        found = []
        while joint:
            found.append(joint)
            joint = self.model.parents[joint]
        return found

    def _radius(self, link: str) -> float:
        """Distance [m] of the farthest point of the link's shapes from the origin of its joint."""
        found = 0.0
        for k in self.shapes[link]:
            each = self._geometry.geometryObjects[k]
            box = each.geometry
            box.computeLocalAABB()
            centre = each.placement.act(np.array(box.aabb_center))
            found = max(found, float(np.linalg.norm(centre)) + float(box.aabb_radius))
        return found

    def _length(self, joint: int) -> float:
        """Greatest distance [m] between the origins of a joint and of its parent joint."""
        placed = float(np.linalg.norm(self.model.jointPlacements[joint].translation))
        k = self.model.joints[joint].idx_q
        return placed + (float(max(abs(self._lower[k]), abs(self._upper[k]))) if self._slides(joint) else 0.0)

    def _slides(self, joint: int) -> bool:
        return "Prismatic" in self.model.joints[joint].shortname()
