"""Does the robot touch itself or the scene? Exact for primitive shapes, convex hulls for meshes (conservative).

`CollisionChecker(kinematics, scene)` holds the shapes; `checker.at(...)` fixes where the bodies stand, what the robot
carries and which contacts are allowed, and that `CollisionQuery` answers for as many joint positions as wanted:

    query = checker.at(poses, carried=Carried("cup", link="palm", X_LO=X_LO), ignore=pairs(hand_links, "cup"))
    hit = query.check(q)                                 # CollisionHit | None
    hit = query.check_trajectory(columns, q, times, positions)

Parts are named as contacts are: `robot/<link>`, or the body. A carried body is part of the robot: it moves with its
link and is checked against the scene and the other links. Never checked: links that no moving joint, or only one,
separates; links that already touch with all joints at zero; things at rest against each other.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array, Transform
from manipcli.model.kinematics import Kinematics
from manipcli.scene.scene import Scene
from manipcli.shapes.proximity import coal_shape

if TYPE_CHECKING:
    import pinocchio as pin

    from manipcli.shapes.proximity import CollisionGeometry

RESOLUTION = 0.01  # rad or m: how far any joint moves between two checked positions of a trajectory
_SEEN = 5e-5  # m: less is 0.0 mm to one digit

Pair = tuple[str, str]


@dataclass(frozen=True, slots=True)
class Carried:
    """A movable body that moves with `link`: its frame O stays at `X_LO`."""

    body: str
    link: str
    X_LO: Transform


@dataclass(frozen=True, slots=True)
class CollisionHit:
    """Two parts nearer than the margin. `distance` [m] is negative where they overlap; `time` [s] on a trajectory."""

    a: str
    b: str
    distance: float
    time: float = 0.0

    @property
    def amount(self) -> str:
        """How far apart they are, or how deep in each other."""
        return f"{1000.0 * abs(self.distance):.1f} mm" if abs(self.distance) >= _SEEN else "less than 0.1 mm"

    def __str__(self) -> str:
        if abs(self.distance) < _SEEN:
            return f"{self.a} and {self.b} touch"
        return f"{self.a} and {self.b} {'overlap by' if self.distance < 0.0 else 'come as near as'} {self.amount}"


def pairs(links: Iterable[str], *bodies: str) -> frozenset[Pair]:
    """The pairs of each robot link with each body: what `ignore` takes to allow a grasp."""
    return frozenset((f"robot/{link}", body) for link in links for body in bodies)


class CollisionChecker:
    """The shapes of a robot and a scene."""

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
        self._links: list[_Part] = []
        model = kinematics.model
        for link in kinematics.robot.links:
            frame = model.frames[model.getFrameId(link.name)]
            for g in link.collisions:
                placement = frame.placement * _se3(g.X_LS)
                self._links.append(
                    _Part(f"robot/{link.name}", "link", frame.parentJoint, placement, coal_shape(g.shape))
                )
        self._near = _neighbours(model)
        self._ignored = {frozenset((f"robot/{a}", f"robot/{b}")) for a, b in ignore}
        self._ignored |= self._touching_at_zero()

    def at(
        self,
        poses: Sequence[Transform] | None = None,
        *,
        carried: Carried | None = None,
        ignore: Iterable[Pair] = (),
        margin: float = 0.0,
        absent: Iterable[str] = (),
        only: str | None = None,
    ) -> CollisionQuery:
        """Fix where things stand.

        Args:
            poses: `X_WO` of each of `scene.movable`, in that order; None: where the task puts them.
            carried: a movable body that the robot holds.
            ignore: pairs of parts whose contact is allowed (`pairs` makes them); order does not matter.
            margin: parts nearer than this [m] count as touching; a negative one forgives so much overlap.
            absent: bodies that are not there (what lies in a carried cup).
            only: a part; pairs without it are not checked.
        """
        where = {body.name: body.X_WO for body in self.scene.bodies}
        if poses is not None:
            where |= {body.name: pose for body, pose in zip(self.scene.movable, poses, strict=True)}
        parts = list(self._links)
        gone = frozenset(absent)
        for body, shapes in self._bodies.items():
            if body in gone:
                continue
            role: Literal["carried", "scene"] = "scene"
            joint, X_JO = 0, _se3(where[body])
            if carried is not None and carried.body == body:
                model = self._kinematics.model
                frame = model.frames[model.getFrameId(carried.link)]
                role = "carried"
                joint, X_JO = frame.parentJoint, frame.placement * _se3(carried.X_LO)
            parts += [_Part(body, role, joint, X_JO * _se3(X_OS), shape) for X_OS, shape in shapes]
        allowed = self._ignored | {frozenset(pair) for pair in ignore}
        if carried is not None:
            allowed |= {frozenset((f"robot/{carried.link}", carried.body))}
        return CollisionQuery(self._kinematics, parts, self._near, allowed, margin, only=only)

    def _touching_at_zero(self) -> set[frozenset[str]]:
        """Links that touch with every joint at zero (or at its limit nearest to zero): so made, so allowed."""
        moving = self._kinematics.robot.moving_joints
        zero = CollisionQuery(self._kinematics, self._links, self._near, self._ignored, 0.0)
        return {frozenset((hit.a, hit.b)) for hit in zero.every([joint.limits.nearest(0.0) for joint in moving])}


class CollisionQuery:
    """Fixed obstacles, a fixed load, fixed allowances; see `CollisionChecker.at`."""

    def __init__(
        self,
        kinematics: Kinematics,
        parts: Sequence[_Part],
        near: frozenset[tuple[int, int]],
        allowed: set[frozenset[str]],
        margin: float,
        *,
        only: str | None = None,
    ) -> None:
        import pinocchio as pin

        self._pin = pin
        self._kinematics = kinematics
        self._names = [part.name for part in parts]
        self._geometry = pin.GeometryModel()
        for k, part in enumerate(parts):
            self._geometry.addGeometryObject(
                pin.GeometryObject(f"{part.name}#{k}", part.joint, part.placement, part.shape)
            )
        carried = [k for k, part in enumerate(parts) if part.role == "carried"]
        for i, a in enumerate(parts):
            # Bodies of the scene never meet each other here: of many, the pairs are not even looked at.
            for j in [k for k in carried if k > i] if a.role == "scene" else range(i + 1, len(parts)):
                b = parts[j]
                if only is not None and only not in (a.name, b.name):
                    continue
                if _may_meet(a, b, near) and frozenset((a.name, b.name)) not in allowed:
                    self._geometry.addCollisionPair(pin.CollisionPair(i, j))
        self._data = kinematics.model.createData()
        self._state = pin.GeometryData(self._geometry)
        for request in self._state.collisionRequests:
            request.security_margin = margin
            request.enable_contact = True
        self._broad = pin.BroadPhaseManager_DynamicAABBTreeCollisionManager(
            kinematics.model, self._geometry, self._state
        )

    def check(self, q: npt.ArrayLike) -> CollisionHit | None:
        """The deepest touching pair at joint positions `q` (n), all moving joints; None if there is none."""
        return min(self.every(q), key=lambda hit: hit.distance) if self.touches(q) else None

    def touches(self, q: npt.ArrayLike) -> bool:
        """Whether anything touches at `q` (n): the fast question."""
        q = np.asarray(q, dtype=np.float64)
        return bool(self._pin.computeCollisions(self._kinematics.model, self._data, self._broad, q, True))

    def every(self, q: npt.ArrayLike) -> tuple[CollisionHit, ...]:
        """Every touching pair of parts at `q` (n), the deepest contact of each, sorted by name."""
        pin, geometry = self._pin, self._geometry
        q = np.asarray(q, dtype=np.float64)
        pin.computeCollisions(self._kinematics.model, self._data, geometry, self._state, q, False)
        deepest: dict[Pair, float] = {}
        for pair, result in zip(geometry.collisionPairs, self._state.collisionResults, strict=True):
            if result.isCollision():
                a, b = sorted((self._names[pair.first], self._names[pair.second]))
                depth = min(float(contact.penetration_depth) for contact in result.getContacts())
                deepest[a, b] = min(depth, deepest.get((a, b), np.inf))
        return tuple(CollisionHit(a=a, b=b, distance=depth) for (a, b), depth in sorted(deepest.items()))

    def check_trajectory(
        self,
        columns: Sequence[int],
        q: npt.ArrayLike,
        times: Array,
        positions: Array,
    ) -> CollisionHit | None:
        """The first hit on the way, with its time; first, last, and every point `RESOLUTION` after the one before.

        Args:
            columns: where the joints of the trajectory stand in `q`.
            q: (n) all moving joints; the others stay here.
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


@dataclass(frozen=True, slots=True)
class _Part:
    """One shape of a robot's link or of a body: `placement` in the joint frame of `joint` (0: the world)."""

    name: str
    role: Literal["link", "carried", "scene"]
    joint: int
    placement: pin.SE3
    shape: CollisionGeometry


def _may_meet(a: _Part, b: _Part, near: frozenset[tuple[int, int]]) -> bool:
    """Whether two parts move against each other, and not just because one joint turns."""
    if a.role == b.role == "link":
        return a.joint != b.joint and (a.joint, b.joint) not in near
    if a.role == b.role:
        return False
    return a.joint != b.joint or "link" not in (a.role, b.role)


def _neighbours(model: pin.Model) -> frozenset[tuple[int, int]]:
    """Joints of which one hangs directly on the other, both ways round."""
    down = {(model.parents[child], child) for child in range(1, model.njoints)}
    return frozenset(down | {(child, parent) for parent, child in down})


def _se3(X: Transform) -> pin.SE3:
    import pinocchio as pin

    return pin.SE3(X.R, X.p)
