"""Inverse kinematics of a tool frame: Levenberg-Marquardt inside the joint limits, with seeded restarts.

The error of tool frame T against goal G, both in the world, is e = (p_G - p_T, log(R_G R_T^T)) (6), metres and radians
weighed alike. One step solves

    (J^T J + lambda I) dq = J^T e,     lambda = e^T e / 2 + 1e-9        (Sugihara, IEEE T-RO 27(5), 2011)

over the joints that are free: a joint at its limit that would be pushed further out is held, and the step is solved
again. Positions are then clamped to the limits, so every iterate is admissible.

A goal may leave part of the orientation open. e and J then omit that part: the rotation about the goal's z axis (the
error is the angle between the two z axes), or the whole rotation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt

from manipcli.core.errors import NotPlannable, RefusalReason
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.core.text import number_of
from manipcli.core.work import ITERATION
from manipcli.model.configuration import position_limits
from manipcli.model.kinematics import Kinematics
from manipcli.plan.base_move import base_advice
from manipcli.plan.damped_step import damped_step
from manipcli.plan.pose_error import RESOLUTION, Leaving, Open, PoseTolerance, forgive, pose_error

POSITION_TOLERANCE = 1e-5  # m
ANGLE_TOLERANCE = 1e-4  # rad
_ITERATIONS = 40  # of one try; fewer than 30 cost more restarts than they save
_TRIES = 40  # random restarts by default; after these a pose counts as unreachable
_ENOUGH = 3  # solutions, the nearest to the seed is used
_AT_LIMIT = 1e-6  # rad or m
_TURNED = math.radians(60.0)  # an orientation missed by more is out of the arm's reach
_FAR = 50.0  # m: a goal beyond this is probably in millimetres
_ALL = 6  # joints needed for an arbitrary pose
_UNLIMITED = math.pi  # half the interval from which restarts draw a joint without limits


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """Result of one attempt.

    Attributes:
        q: (n) all moving joints of the robot; only the solver's own differ from the seed.
        position_error: [m] distance from tool to goal.
        angle_error: [rad].
        at_limit: the solver's joints that lie at a limit.
    """

    q: Array
    position_error: float
    angle_error: float
    at_limit: tuple[str, ...]

    @property
    def converged(self) -> bool:
        return self.position_error <= POSITION_TOLERANCE and self.angle_error <= ANGLE_TOLERANCE

    def within(self, tolerance: PoseTolerance) -> bool:
        """Whether it is at most this far from the goal."""
        return self.position_error <= tolerance.distance and self.angle_error <= tolerance.rotation

    def explain(self, tolerance: PoseTolerance = RESOLUTION) -> str:
        """Why this attempt is not a solution, for a message."""
        away, turned = 1000.0 * self.position_error, math.degrees(self.angle_error)
        if away < 0.05 and turned < 0.05:
            near = f"{1000.0 * tolerance.distance:.2g} mm and {math.degrees(tolerance.rotation):.2g} deg"
            text = f"the nearest pose is {away:.2g} mm and {turned:.2g} deg off, the tolerance is {near}"
            return f"{text}: an arm of few joints cannot reach every orientation"
        text = f"the nearest pose is {away:.1f} mm and {turned:.1f} deg off"
        if self.at_limit:
            return f"{text}, at the limits of {', '.join(self.at_limit)}"
        return f"{text}, out of reach"


class InverseKinematics:
    """Solves for `joints` so that frame T, fixed in `link`, takes a pose in the world."""

    def __init__(
        self,
        kinematics: Kinematics,
        joints: Sequence[str],
        link: str,
        *,
        X_LT: Transform | None = None,
    ) -> None:
        """
        Args:
            kinematics: of the robot.
            joints: names of the joints that may move (a group's); all others stay where the seed has them.
            link: the link L that carries the tool.
            X_LT: tool frame in L; identity if None.
        """
        robot = kinematics.robot
        self.joints = tuple(joints)
        self.columns = tuple(robot.indices(self.joints))
        self._kinematics = kinematics
        self.link = link
        self._X_LT = Transform.identity() if X_LT is None else X_LT
        first = self.columns[0]
        adjacent = self.columns == tuple(range(first, first + len(self.columns)))
        # A slice of adjacent joints costs a fraction of an array of their indices.
        self._columns = slice(first, first + len(self.columns)) if adjacent else np.array(self.columns, dtype=np.intp)
        # Joints of the chain that mimic the solver's: index among all joints, index of the leader, and how.
        self._followers = tuple(
            (k, self.joints.index(joint.mimic.joint), joint.mimic)
            for k, joint in enumerate(robot.moving_joints)
            if joint.mimic is not None and joint.mimic.joint in self.joints and link in robot.descendants(joint.child)
        )
        self._turning = np.array([robot.joint(name).type != "prismatic" for name in self.joints])
        self._lower, self._upper = position_limits(robot.joint(name) for name in self.joints)
        self._open: Open = "nothing"
        self._tolerance = RESOLUTION
        self._near = False
        self._tries = _TRIES

    def leaving(self, open_: Leaving) -> InverseKinematics:
        """The same solver for goals that leave this part of the orientation open, or that have this tolerance."""
        other = copy(self)
        if isinstance(open_, PoseTolerance):
            other._tolerance, other._open = open_, open_.open
        else:
            other._open = open_
        return other

    def of(self, X_LT: Transform) -> InverseKinematics:
        """The same solver for another frame of its link."""
        other = copy(self)
        other._X_LT = X_LT
        return other

    @contextmanager
    def trying(self, tries: int) -> Iterator[None]:
        """Inside this context the solver makes this number of restarts instead of 40, to look at many poses."""
        before, self._tries = self._tries, tries
        try:
            yield
        finally:
            self._tries = before

    def drawn_in(self, margin: Array) -> InverseKinematics:
        """The same solver with the limits of each joint narrowed by its `margin` (m) [rad or m]."""
        narrower = copy(self)
        narrower._lower, narrower._upper = self._lower + margin, self._upper - margin
        return narrower

    def forward(self, q: npt.ArrayLike) -> Transform:
        """`X_WT` at `q` (n), all moving joints."""
        return self._kinematics.forward(np.asarray(q, dtype=np.float64), self.link) @ self._X_LT

    def solve(
        self,
        X_WT: Transform,
        seed: npt.ArrayLike,
        rng: np.random.Generator,
        *,
        refuse: Callable[[Array], object | None] | None = None,
    ) -> Array:
        """Joint positions (n) with the tool at `X_WT`, near `seed`.

        The first attempt starts from `seed` and is used if it converges. Further attempts start from uniformly random
        positions inside the limits, until three converge or 40 are made; the nearest (Euclidean) to `seed` is used.

        Args:
            X_WT: the goal.
            seed: (n) all moving joints.
            rng: draws the restarts.
            refuse: (n) -> why these positions are rejected (a collision), or None. Rejected solutions do not count. Its
                `parts`, if it has any, are those in the way.

        Raises:
            NotPlannable: no attempt converges; names the least error, the distance to the goal and the joints at their
                limits. Or all solutions are rejected; names the reason.
        """
        seed = np.asarray(seed, dtype=np.float64)
        if not (np.isfinite(X_WT.p).all() and np.isfinite(X_WT.R).all() and np.isfinite(seed).all()):
            raise NotPlannable("the goal pose or the seed of the inverse kinematics is not finite")
        best = self.track(X_WT, seed)
        refusal: object | None = None
        if best.converged:
            refusal = None if refuse is None else refuse(best.q)
            if refusal is None:
                return best.q
        found: list[Solution] = []
        for start in self.random_configurations(seed, rng, self._tries):
            attempt = self.track(X_WT, start)
            if attempt.converged:
                attempt = self._unwound(attempt, seed)
                reason = None if refuse is None else refuse(attempt.q)
                if reason is not None:
                    refusal = refusal or reason
                    continue
                found.append(attempt)
                if len(found) == _ENOUGH:
                    break
            elif attempt.position_error + attempt.angle_error < best.position_error + best.angle_error:
                best = attempt
        if found:
            return min(found, key=lambda solution: float(np.linalg.norm(solution.q - seed))).q
        tolerated, refusal = self._tolerated(best, X_WT, seed, rng, refuse, refusal)
        if tolerated is not None:
            return tolerated
        distance = float(np.linalg.norm(X_WT.p - self._kinematics.robot.X_WB.p))
        place = ", ".join(f"{value:.3f}" for value in X_WT.p)
        rotate = "" if self._open == "rotation" else ", or change the orientation of the tool"
        if refusal is not None:
            raise NotPlannable(
                f"the arm reaches ({place}) m only where {refusal}",
                hint=f"move the goal away from the obstacle{rotate}",
                reason="touches",
                parts=getattr(refusal, "parts", frozenset()),
            )
        hint = f"move the goal nearer{rotate}"
        kind: RefusalReason = "reach"
        if distance > _FAR:
            hint = "in millimetres? write '500 mm', not 500"
        elif self._open == "spin" and (alone := self.leaving("rotation").track(X_WT, seed)).converged:
            off = float(np.degrees(np.arccos(np.clip(self.forward(alone.q).R[:, 2] @ X_WT.R[:, 2], -1.0, 1.0))))
            hint = f"remove `pointing`: the tool then reaches the point, pointing {off:.0f} deg off"
        elif best.angle_error > _TURNED:
            hint, kind = "change the orientation of the tool: the arm cannot reach it here", "orientation"
        if self.few and distance <= _FAR and self._open == "nothing":
            few = number_of(len(self.joints), "joint")
            hint += f"; an arm of {few} reaches few orientations: leave it open with `move: {{point: ...}}`"
            if self.leaving("yaw").track(X_WT, best.q).converged:
                hint += ", or only its yaw, with which it is reached: `tolerance: {about: {axis: [0, 0, 1]}}`"
        nearest = ", ".join(f"{value:.3f}" for value in self.forward(best.q).p)
        raise NotPlannable(
            f"no joint positions reach ({place}) m, {distance:.3f} m from the robot's base: "
            f"{best.explain(self._tolerance)}, with the tool at ({nearest}) m",
            hint=hint,
            reason=kind,
            remedy=None if distance > _FAR else partial(base_advice, self, X_WT, seed),
        )

    def _tolerated(
        self,
        best: Solution,
        X_WT: Transform,
        seed: Array,
        rng: np.random.Generator,
        refuse: Callable[[Array], object | None] | None,
        refusal: object | None,
    ) -> tuple[Array | None, object | None]:
        """Positions (n) within the tolerance of a goal that none reaches, the `best` ones if they are; else why not."""
        starts = () if self._tolerance is RESOLUTION else (seed, *self.random_configurations(seed, rng, self._tries))
        for attempt in (best, *(self.near(X_WT, start) for start in starts)):
            if attempt.within(self._tolerance):
                attempt = self._unwound(attempt, seed)
                reason = None if refuse is None else refuse(attempt.q)
                if reason is None:
                    return attempt.q, None
                refusal = refusal or reason
        return None, refusal

    def random_configurations(self, seed: Array, rng: np.random.Generator, count: int) -> Iterator[Array]:
        """`count` copies of `seed` (n), each with the solver's joints uniform inside their limits, drawn as needed."""
        lower = np.where(np.isfinite(self._lower), self._lower, seed[self._columns] - _UNLIMITED)
        upper = np.where(np.isfinite(self._upper), self._upper, seed[self._columns] + _UNLIMITED)
        for _ in range(count):
            start = np.array(seed)
            start[self._columns] = rng.uniform(lower, upper)
            yield start

    @property
    def few(self) -> bool:
        """Whether there are too few joints for an arbitrary pose."""
        return len(self.joints) < _ALL

    @property
    def base(self) -> Transform:
        """X_WB."""
        return self._kinematics.robot.X_WB

    def track(self, X_WT: Transform, seed: npt.ArrayLike) -> Solution:
        """One attempt from `seed` (n), without restarts, for the next point of a path."""
        q = np.array(seed, dtype=np.float64)
        columns, lower, upper = self._columns, self._lower, self._upper
        self._put(q, np.minimum(np.maximum(q[columns], lower), upper))
        previous = math.inf
        stalled = 0
        work = self._kinematics.work
        for _ in range(_ITERATIONS):
            work.add(ITERATION)
            error, J, axis_error = self._linearise(X_WT, q)
            x, y, z, *_ = error.tolist()
            position_error = math.sqrt(x * x + y * y + z * z)
            if position_error <= 0.3 * POSITION_TOLERANCE and axis_error <= 0.3 * ANGLE_TOLERANCE:
                return self._solution(q, position_error, axis_error)
            cost = 0.5 * float(error @ error)
            stalled = stalled + 1 if cost > 0.999 * previous else 0
            if stalled > 4:
                return self._solution(q, position_error, axis_error)
            previous = cost
            here = q[columns]
            step = damped_step(J, error, cost + 1e-9, here, lower, upper)
            self._put(q, np.minimum(np.maximum(here + step, lower), upper))
        error, _, axis_error = self._linearise(X_WT, q)
        return self._solution(q, float(np.linalg.norm(error[:3])), axis_error)

    def reaches(self, X_WT: Transform, q: npt.ArrayLike) -> bool:
        """Whether the tool is at `X_WT` with the joints at `q` (n), within the tolerance."""
        error, _, angle = self._linearise(X_WT, np.asarray(q, dtype=np.float64))
        return self._solution(np.array(q), float(np.linalg.norm(error[:3])), angle).within(self._tolerance)

    def reachable(self, X_WT: Transform, seed: npt.ArrayLike) -> bool:
        """Whether some joint positions reach `X_WT`, collisions aside; the same answer for the same arguments."""
        try:
            self.solve(X_WT, seed, np.random.default_rng(0))
        except NotPlannable:
            return False
        return True

    def near(self, X_WT: Transform, seed: npt.ArrayLike) -> Solution:
        """As `track`; where the goal is out of reach, any pose within the tolerance, and else the nearest."""
        exact = self.track(X_WT, seed)
        if exact.converged or exact.within(self._tolerance) or self._tolerance is RESOLUTION:
            return exact
        forgiving = copy(self)
        forgiving._near = True
        found = forgiving.track(X_WT, seed)
        error, _, angle = self._linearise(X_WT, np.array(found.q))
        return replace(found, position_error=float(np.linalg.norm(error[:3])), angle_error=angle)

    @property
    def tolerance(self) -> PoseTolerance:
        """Of a goal."""
        return self._tolerance

    def unit(self, joint: int) -> str:
        """Unit of the position of the solver's joint with this index."""
        return "rad" if self._turning[joint] else "m"

    def singularity(self, q: npt.ArrayLike) -> str:
        """The smallest singular value of the tool's Jacobian at `q` (n), as text."""
        return f"smallest singular value {self.least_singular_value(q):.3f}"

    def least_singular_value(self, q: npt.ArrayLike) -> float:
        """Of the tool's Jacobian over the solver's joints at `q` (n); metres and radians weighed alike."""
        q = np.asarray(q, dtype=np.float64)
        J = self._own(self._kinematics.jacobian(q, self.link, self._X_LT), q)
        return float(np.linalg.svd(J, compute_uv=False)[-1])

    def _put(self, q: Array, values: Array) -> None:
        """Write the solver's joints (m), and those that mimic them, into q (n)."""
        q[self._columns] = values
        for k, leader, mimic in self._followers:
            q[k] = mimic.follow(values[leader])

    def _own(self, whole: Array, q: Array) -> Array:
        """(6, m) The Jacobian over the solver's joints, with what mimics them, of that over all joints (6, n) at q."""
        J = np.asfortranarray(whole[:, self._columns])
        for k, leader, mimic in self._followers:
            J[:, leader] += mimic.ratio(q[self._columns][leader]) * whole[:, k]
        return J

    def _solution(self, q: Array, position_error: float, angle_error: float) -> Solution:
        here = q[self._columns]
        at_limit = (here <= self._lower + _AT_LIMIT) | (here >= self._upper - _AT_LIMIT)
        held = tuple(name for name, on in zip(self.joints, at_limit.tolist(), strict=True) if on)
        return Solution(q=frozen(q), position_error=position_error, angle_error=angle_error, at_limit=held)

    def _unwound(self, solution: Solution, seed: Array) -> Solution:
        """The same pose with each rotating joint less than half a turn from `seed`, where its limits allow."""
        here = solution.q[self._columns]
        turned = here - 2.0 * np.pi * np.round((here - seed[self._columns]) / (2.0 * np.pi))
        inside = self._turning & (turned >= self._lower) & (turned <= self._upper)
        q = np.array(solution.q)
        self._put(q, np.where(inside, turned, here))
        return replace(solution, q=frozen(q))

    def _linearise(self, X_WT: Transform, q: Array) -> tuple[Array, Array, float]:
        """Error (6), its Jacobian (6, m) over the solver's joints, and the angle [rad]."""
        R, p, whole = self._kinematics.pose_and_jacobian(q, self.link, self._X_LT)
        error, free, angle = pose_error(X_WT, R, p, self._open, self._tolerance)
        J = self._own(whole, q)
        if free is not None:
            J[3:] -= np.outer(free, free @ J[3:])
        elif self._open == "rotation":
            J[3:] = 0.0
        if self._near:
            forgive(error[:3], J[:3], self._tolerance.distance - POSITION_TOLERANCE)
            angle = forgive(error[3:], J[3:], self._tolerance.rotation - ANGLE_TOLERANCE)
        return error, J, angle
