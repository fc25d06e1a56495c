"""Collision checking of the robot with itself and the scene: exact primitives, convex hulls of meshes (conservative).

`CollisionChecker(kinematics, scene)` holds the shapes. `checker.at(...)` sets the poses of the bodies, the carried
body and the allowed contacts, and returns a `CollisionQuery` for any number of joint positions:

    query = checker.at(poses, carried=Carried("cup", link="palm", X_LO=X_LO), ignore=pairs(hand_links, "cup"))
    hit = query.check(q)                                 # CollisionHit | None
    hit = query.check_trajectory(columns, q, times, positions)

Parts are named as in contacts: `robot/<link>`, or the body. A carried body is part of the robot: it moves with its
link and is checked against the scene and the other links. Never checked: links with at most one moving joint between
them; links that overlap with all joints at zero and in most configurations (`self_collision.lasting_overlaps`), or are
within 4 mm there with one link between them; bodies of the scene against each other; the links of a jointed thing.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array, Transform
from manipcli.core.work import PAIRS, TOUCH
from manipcli.model.collision_pairs import Part, checked_pairs, margins_of
from manipcli.model.kinematics import Kinematics
from manipcli.model.motion_bound import MotionBound, Mover
from manipcli.model.self_collision import CLOSE, lasting_overlaps, spaced_by_one
from manipcli.scene.joints import things
from manipcli.scene.scene import Scene
from manipcli.shapes.proximity import bounding_ball, coal_shape

if TYPE_CHECKING:
    import pinocchio as pin


RESOLUTION = 0.01  # rad or m: largest joint motion between two checked positions of a trajectory
_LIGHTEST = 0.05  # weight of a pair that moves little
_SEEN = 5e-5  # m: smaller values would be printed as 0.0 mm

Pair = tuple[str, str]


@dataclass(frozen=True, slots=True)
class Carried:
    """A movable body attached to `link`: its frame O is at `X_LO`."""

    body: str
    link: str
    X_LO: Transform


@dataclass(frozen=True, slots=True)
class CollisionHit:
    """Two parts closer than the margin. `distance` [m] is negative for an overlap; `time` [s] on a trajectory."""

    a: str
    b: str
    distance: float
    time: float = 0.0

    @property
    def amount(self) -> str:
        """Clearance or depth of the overlap, with unit."""
        return f"{1000.0 * abs(self.distance):.1f} mm" if abs(self.distance) >= _SEEN else "less than 0.1 mm"

    def __str__(self) -> str:
        if abs(self.distance) < _SEEN:
            return f"{self.a} and {self.b} touch"
        return f"{self.a} and {self.b} {'overlap by' if self.distance < 0.0 else 'have a clearance of'} {self.amount}"


def pairs(links: Iterable[str], *bodies: str) -> frozenset[Pair]:
    """The pairs of each robot link with each body, for `ignore`: allows a grasp."""
    return frozenset((f"robot/{link}", body) for link in links for body in bodies)


class CollisionChecker:
    """The shapes of a robot and a scene. `spaced`: pairs of links that are never checked, see `spaced_by_one`."""

    def __init__(self, kinematics: Kinematics, scene: Scene, *, ignore: Iterable[Pair] = ()) -> None:
        """
        Args:
            kinematics: of the robot.
            scene: its bodies are the obstacles.
            ignore: pairs of link names that are never checked (`collision_ignore` of the robot file).
        """
        self.scene = scene
        self._kinematics = kinematics
        self._bodies = {body.name: [(g.X_LS, coal_shape(g.shape)) for g in body.geometries] for body in scene.bodies}
        self._links: list[Part] = []
        model = kinematics.model
        for link in kinematics.robot.links:
            frame = model.frames[model.getFrameId(link.name)]
            for g in link.collisions:
                placement = frame.placement * _se3(g.X_LS)
                self._links.append(
                    Part(f"robot/{link.name}", "link", frame.parentJoint, placement, coal_shape(g.shape))
                )
        self._near = _neighbours(model)
        self._ignored = _of_links(ignore)
        self._ignored |= _of_links(lasting_overlaps(kinematics.robot, self._at_zero(0.0)))
        close = self._at_zero(CLOSE)
        self.spaced = spaced_by_one(model, [pair for pair, distance in close.items() if distance >= 0.0])
        self._ignored |= _of_links(self.spaced)
        self._ignored |= {frozenset(pair) for thing in things(scene.joints) for pair in combinations(thing, 2)}

    def at(
        self,
        poses: Sequence[Transform] | None = None,
        *,
        carried: Carried | None = None,
        ignore: Iterable[Pair] = (),
        margin: float = 0.0,
        contents: Sequence[Carried] = (),
        margins: Mapping[frozenset[str], float] = {},
        absent: Iterable[str] = (),
        only: str | None = None,
    ) -> CollisionQuery:
        """A query with given poses, load and allowed contacts.

        Args:
            poses: `X_WO` of each of `scene.movable`, in that order; None: the poses of the task.
            carried: a movable body that the robot holds.
            contents: bodies that move with it.
            margins: other margins [m] of single pairs of parts.
            ignore: pairs of parts whose contact is allowed (see `pairs`), in any order.
            margin: parts closer than this [m] are in contact; a negative margin permits that overlap.
            absent: bodies that are not checked.
            only: a part; pairs without it are not checked.
        """
        where = {body.name: body.X_WO for body in self.scene.bodies}
        if poses is not None:
            where |= {body.name: pose for body, pose in zip(self.scene.movable, poses, strict=True)}
        parts = list(self._links)
        gone = frozenset(absent)
        held = {each.body: each for each in (() if carried is None else (carried, *contents))}
        for body, shapes in self._bodies.items():
            if body in gone:
                continue
            role: Literal["carried", "scene"] = "scene"
            joint, X_JO = 0, _se3(where[body])
            if body in held:
                model = self._kinematics.model
                frame = model.frames[model.getFrameId(held[body].link)]
                role = "carried"
                joint, X_JO = frame.parentJoint, frame.placement * _se3(held[body].X_LO)
            parts += [Part(body, role, joint, X_JO * _se3(X_OS), shape) for X_OS, shape in shapes]
        allowed = self._ignored | {frozenset(pair) for pair in ignore}
        if carried is not None:
            allowed |= {frozenset((f"robot/{carried.link}", carried.body))}
        return CollisionQuery(self._kinematics, parts, self._near, allowed, margin, margins=margins, only=only)

    def _at_zero(self, margin: float) -> dict[Pair, float]:
        """Distance [m] of the links closer than `margin` with every joint at zero, or at its nearest limit."""
        zero = CollisionQuery(self._kinematics, self._links, self._near, self._ignored, margin)
        hits = zero.every([joint.limits.nearest(0.0) for joint in self._kinematics.robot.moving_joints])
        return {(hit.a.removeprefix("robot/"), hit.b.removeprefix("robot/")): hit.distance for hit in hits}


def _of_links(pairs: Iterable[Pair]) -> set[frozenset[str]]:
    return {frozenset((f"robot/{a}", f"robot/{b}")) for a, b in pairs}


class CollisionQuery:
    """A collision query with fixed obstacles, load and allowed contacts; see `CollisionChecker.at`."""

    def __init__(
        self,
        kinematics: Kinematics,
        parts: Sequence[Part],
        near: frozenset[tuple[int, int]],
        allowed: set[frozenset[str]],
        margin: float,
        *,
        margins: Mapping[frozenset[str], float] = {},
        only: str | None = None,
    ) -> None:
        import pinocchio as pin

        self._pin = pin
        self._kinematics = kinematics
        self.margin = margin
        self._own_margins = margins
        self._inflated: dict[tuple[float, ...], InflatedQuery] = {}
        self._nearer: dict[float, CollisionQuery] = {}
        self._parts = tuple(parts)
        self._made = (kinematics, self._parts, near, allowed)
        self._only = only
        self._names = [part.name for part in parts]
        self._geometry = pin.GeometryModel()
        for k, part in enumerate(parts):
            self._geometry.addGeometryObject(
                pin.GeometryObject(f"{part.name}#{k}", part.joint, part.placement, part.shape)
            )
        self._pairs = checked_pairs(parts, kinematics.model, near, allowed, only)
        self._geometry.setCollisionPairs(self._pairs)
        self._data = kinematics.model.createData()
        self._state = pin.GeometryData(self._geometry)
        for request in self._state.collisionRequests:
            request.enable_contact = True
        self._margins = margins_of(self._names, margin, margins)
        self._kept: object = None  # the broad phase whose margins the requests have
        self._broad = self._managed(self._margins)

    def _managed(self, margins: Array) -> object:
        """A broad phase of the pairs with these margins (parts, parts)."""
        self._state.setSecurityMargins(self._geometry, margins, True, False)
        self._kept = self._pin.BroadPhaseManager_DynamicAABBTreeCollisionManager(
            self._kinematics.model, self._geometry, self._state
        )
        return self._kept

    def _require(self, broad: object, margins: Array) -> None:
        """Sets the margins with which `broad` was made."""
        if self._kept is not broad:
            self._state.setSecurityMargins(self._geometry, margins, True, False)
            self._kept = broad

    def _touches(self, q: Array, broad: object, margins: Array) -> bool:
        """Whether any parts touch at `q` with the margins that `broad` was made with."""
        self._kinematics.work.add(TOUCH)
        self._require(broad, margins)
        return bool(self._pin.computeCollisions(self._kinematics.model, self._data, broad, q, True))

    @property
    def shapes(self) -> tuple[pin.GeometryModel, Sequence[str]]:
        """The checked pairs of shapes, and the part of each shape. Do not modify."""
        return self._geometry, self._names

    @property
    def kinematics(self) -> Kinematics:
        """Of the robot."""
        return self._kinematics

    @property
    def pairs(self) -> frozenset[Pair]:
        """The pairs of parts that are checked."""
        names = self._names
        return frozenset((names[pair.first], names[pair.second]) for pair in self._geometry.collisionPairs)

    def check(self, q: npt.ArrayLike) -> CollisionHit | None:
        """The deepest touching pair at joint positions `q` (n) of all moving joints; None without a contact."""
        return min(self.every(q), key=lambda hit: hit.distance) if self.touches(q) else None

    def touches(self, q: npt.ArrayLike) -> bool:
        """Whether any parts touch at `q` (n); faster than `check`."""
        return self._touches(np.asarray(q, dtype=np.float64), self._broad, self._margins)

    def every(self, q: npt.ArrayLike) -> tuple[CollisionHit, ...]:
        """Every touching pair of parts at `q` (n) with its deepest contact, sorted by name."""
        pin, geometry = self._pin, self._geometry
        q = np.asarray(q, dtype=np.float64)
        self._kinematics.work.add(TOUCH + len(geometry.collisionPairs) // PAIRS)
        self._require(self._broad, self._margins)
        pin.computeCollisions(self._kinematics.model, self._data, geometry, self._state, q, False)
        deepest: dict[Pair, float] = {}
        for pair, result in zip(geometry.collisionPairs, self._state.collisionResults, strict=True):
            if result.isCollision():
                a, b = sorted((self._names[pair.first], self._names[pair.second]))
                depth = min(float(contact.penetration_depth) for contact in result.getContacts())
                deepest[a, b] = min(depth, deepest.get((a, b), np.inf))
        return tuple(CollisionHit(a=a, b=b, distance=depth) for (a, b), depth in sorted(deepest.items()))

    @property
    def least_margin(self) -> float:
        """The smallest margin [m] of any pair."""
        return min((self.margin, *self._own_margins.values()))

    def nearer(self, share: float) -> CollisionQuery:
        """The same query with this share of every margin."""
        if share not in self._nearer:
            margins = {pair: share * margin for pair, margin in self._own_margins.items()}
            self._nearer[share] = CollisionQuery(*self._made, share * self.margin, margins=margins, only=self._only)
        return self._nearer[share]

    def inflated(self, levels: Sequence[float]) -> InflatedQuery:
        """The same query with larger margins [m]; see `InflatedQuery`."""
        key = tuple(levels)
        if key not in self._inflated:
            self._inflated[key] = InflatedQuery(self, key)
        return self._inflated[key]

    def check_trajectory(
        self,
        columns: Sequence[int],
        q: npt.ArrayLike,
        times: Array,
        positions: Array,
    ) -> CollisionHit | None:
        """The first hit on a trajectory, with its time; checks points at most `RESOLUTION` apart, and both ends.

        Args:
            columns: indices of the trajectory's joints in `q`.
            q: (n) positions of all moving joints; joints outside the trajectory keep these.
            times: (k,) [s].
            positions: (k, m) of the trajectory's joints; neighbours much closer than `RESOLUTION`.
        """
        whole = np.array(q, dtype=np.float64)
        walked = np.concatenate(([0.0], np.cumsum(np.max(np.abs(np.diff(positions, axis=0)), axis=1))))
        chosen = np.unique(np.searchsorted(walked, np.append(np.arange(0.0, walked[-1], RESOLUTION), walked[-1])))
        for k in chosen.tolist():
            whole[list(columns)] = positions[k]
            if self.touches(whole):
                return replace(min(self.every(whole), key=lambda hit: hit.distance), time=float(times[k]))
        return None


class InflatedQuery:
    """A query with several margins: at level c every pair has its margin, plus `levels[c]` times the pair's weight; the
    first of the levels is 0.

    The weight is the pair's motion for equal speeds of all joints, relative to the pair that moves most.

    Attributes:
        bound: bounds of the motion of the movers.
        summed: (movers, pairs) 1 where a mover's motion changes the distance of a pair; pairs of one link with bodies
            of the scene are one column.
        weights: (pairs).
    """

    def __init__(
        self,
        query: CollisionQuery,
        levels: Sequence[float],
    ) -> None:
        self._query = query
        parts, moves = query._parts, _moves(query._kinematics.model)
        i, j = np.nonzero(query._pairs)
        joint = np.array([part.joint for part in parts], dtype=np.intp)
        # A mover is a part, seen from a joint; of a pair, each part that moves as seen from the other is one.
        seen = np.concatenate((i * len(moves) + joint[j], j * len(moves) + joint[i]))
        moving = np.concatenate((moves[joint[i], joint[j]], moves[joint[j], joint[i]]))
        movers, rows = np.unique(np.where(moving, seen, -1), return_inverse=True)
        first, second = np.sort(rows.reshape(2, -1), axis=0)
        columns, column = np.unique(first * len(movers) + second, return_inverse=True)
        self.summed = np.zeros((len(movers), len(columns)))
        for k in divmod(columns, max(1, len(movers))):
            self.summed[k, np.arange(len(columns))] = 1.0
        self.summed = self.summed[movers >= 0]
        balls = [bounding_ball(part.shape) for part in parts]
        self.bound = MotionBound(
            query._kinematics, [_mover(parts, balls, *divmod(int(mover), len(moves))) for mover in movers[movers >= 0]]
        )
        reach = self.bound.reach.sum(axis=1) @ self.summed
        self.weights = np.maximum(reach / max(1e-9, float(reach.max(initial=0.0))), _LIGHTEST)
        weights = np.zeros((len(parts), len(parts)))
        weights[i, j] = self.weights[column]
        self._margins = [query._margins + c * weights for c in levels]
        self._broad: list[object] = [query._broad, *([None] * (len(levels) - 1))]

    def touches(self, q: Array, level: int) -> bool:
        """Whether any parts are closer than their margin of this level."""
        query, margins = self._query, self._margins[level]
        if self._broad[level] is None:
            self._broad[level] = query._managed(margins)
        return query._touches(q, self._broad[level], margins)


def _moves(model: pin.Model) -> npt.NDArray[np.bool_]:
    """[a][b]: whether some joint moves what is fixed to joint a relative to what is fixed to b (0: the world)."""
    chains: list[set[int]] = [set()]
    for k in range(1, model.njoints):
        chains.append({*chains[model.parents[k]], k})
    return np.array([[not a <= b for b in chains] for a in chains], dtype=bool)


def _mover(parts: Sequence[Part], balls: Sequence[tuple[Array, float]], k: int, seen_from: int) -> Mover:
    centre, radius = balls[k]
    return Mover(parts[k].joint, seen_from, parts[k].placement.act(centre), radius)


def _neighbours(model: pin.Model) -> frozenset[tuple[int, int]]:
    """Pairs of a joint and its parent joint, in both orders."""
    down = {(model.parents[child], child) for child in range(1, model.njoints)}
    return frozenset(down | {(child, parent) for parent, child in down})


def _se3(X: Transform) -> pin.SE3:
    import pinocchio as pin

    return pin.SE3(X.R, X.p)
