"""Planner of one task: robot, scene, inverse kinematics and collision queries. Motions are built by `MotionBuilder`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from copy import copy
from functools import partial
from itertools import combinations
from typing import NamedTuple

import numpy as np

from manipcli.core.errors import NotPlannable, RefusalReason
from manipcli.core.geometry import Transform, frozen
from manipcli.model.collision import Carried, CollisionChecker, CollisionHit, CollisionQuery, Pair, pairs
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import RobotModel
from manipcli.plan.aboard import aboard
from manipcli.plan.claimed_joints import arm_joints
from manipcli.plan.contents import contents_of
from manipcli.plan.hand import moved_links
from manipcli.plan.inverse_kinematics import InverseKinematics
from manipcli.plan.lifts_off import freed
from manipcli.plan.links_apart import links_apart
from manipcli.plan.motion import PlanningState
from manipcli.plan.path_planners.rrt_connect import RrtConnectSpec
from manipcli.plan.path_search import PathSearch
from manipcli.plan.sight import Sight
from manipcli.scene.scene import Scene
from manipcli.scene.start_overlap import TOLERANCE
from manipcli.spec.keep import KeepSpec
from manipcli.spec.planner import PlannerSpec

Pairs = frozenset[Pair]
"""Pairs of parts that may touch; a part is a body, or `robot/<link>`."""

NOTHING: Pairs = frozenset()
CLEARANCE = 0.004
"""[m] Distance that the robot keeps from everything it must not touch: more than its controllers deviate."""
TOUCHING = 0.0045
"""[m] Bodies nearer than this count as touching: what a held object may leave or approach. It is above the clearance,
so that every body within the clearance is exempt."""
NO_WAY_AROUND = "first `move` to a pose from which the path is free"
"""The hint for a motion that is in collision."""
PUT_APART = "move them apart: set `start: POSE` in the task, or `mount` in the robot file to move its base"
"""The hint for a robot that is too near to something before it moves."""
ROBOT = "robot/"
_QUERIES = 8  # kept; the candidates of a step share a few


class InTheWay(NamedTuple):
    """A hit as text, and the two parts."""

    text: str
    parts: frozenset[str]

    def __str__(self) -> str:
        return self.text


class Planner:
    """Everything that does not change from step to step."""

    def __init__(
        self,
        robot: RobotModel,
        scene: Scene,
        *,
        period: float,
        rng: np.random.Generator,
        gripper_joints: tuple[str, ...],
        gripper_speed: float,
        clearance: float = CLEARANCE,
        clearances: Mapping[frozenset[str], float] = {},
        paths: PlannerSpec | None = None,
        sights: Mapping[str, Sight] = {},
    ) -> None:
        """
        Args:
            robot, scene: the world; `robot.tool` carries the tool frame T.
            period: control period [s].
            rng: draws the restarts of the inverse kinematics.
            gripper_joints: joints that a gripper controller moves; all others follow trajectories.
            gripper_speed: of the hand's references [rad/s or m/s].
            clearance: distance [m] that parts keep which must not touch.
            clearances: the same for single pairs of parts.
            paths: settings of the search for paths around obstacles; None: the defaults.
            sights: the depth cameras by name.
        """
        self.clearance = clearance
        self.clearances = clearances
        self.sights = sights
        self.starts: dict[str, Transform] = {}
        """Poses at the start of bodies that were located before anything moved them."""
        self.allowed = NOTHING
        self.robot = robot
        self.scene = scene
        self.period = period
        self.rng = rng
        self.gripper_joints = gripper_joints
        self.gripper_speed = gripper_speed
        self.kinematics = Kinematics(robot, gravity=scene.gravity)
        # Fingers may meet each other: their controller stops them.
        hand = moved_links(robot, gripper_joints)
        hand |= {joint.parent for joint in robot.joints if joint.name in gripper_joints}
        ignore = (*robot.collision_ignore, *combinations(sorted(hand), 2))
        self.checker = CollisionChecker(self.kinematics, scene, ignore=ignore)
        self.keep: tuple[KeepSpec, ...] = ()
        self._solver: InverseKinematics | None = None
        self._queries: dict[tuple[object, ...], CollisionQuery] = {}
        self._paths = RrtConnectSpec() if paths is None else paths
        self._search: PathSearch | None = None
        self._obstructed = False

    def searching_paths(self) -> Planner | None:
        """A view that searches paths where a free motion is obstructed; None if no motion was, or none is searched."""
        if not (self._obstructed and self._paths.samples):
            return None
        view = self._view()
        view._search = PathSearch.of(self._paths, self.rng)
        return view

    def searching(self, *, obstructed: bool = True) -> PathSearch | None:
        """The search for a motion that is `obstructed` on its straight path; None while only those are tried."""
        self._obstructed |= obstructed
        return self._search

    @property
    def searches(self) -> bool:
        """Whether paths are searched where no straight one is found."""
        return bool(self._paths.samples)

    @property
    def solver(self) -> InverseKinematics:
        """Inverse kinematics of the tool over the arm: the independent joints above it that are not the hand's.

        Raises:
            NotPlannable: the robot has no tool frame, or no joint moves it.
        """
        if self._solver is None:
            tool = self.robot.tool
            if tool is None:
                raise NotPlannable(
                    f"robot '{self.robot.name}' has no tool frame", hint="add `tool: {link: ...}` to the robot file"
                )
            joints = arm_joints(self.robot, self.gripper_joints)
            if not joints:
                raise NotPlannable(
                    f"no joint of robot '{self.robot.name}' moves its tool link '{tool.link}'",
                    hint="set another link under `tool` in the robot file",
                )
            self._solver = InverseKinematics(self.kinematics, joints, tool.link, X_LT=tool.X_LT)
        return self._solver

    @property
    def tool_link(self) -> str:
        """The link that carries the tool, and what the hand holds."""
        return self.solver.link

    def allowing(self, pairs: Pairs) -> Planner:
        """A view for one attempt at a step, in which these pairs may touch; it shares everything else."""
        other = self._view()
        other.allowed = self.allowed | pairs
        other._obstructed, other._search = False, None
        return other

    def keeping(self, keep: tuple[KeepSpec, ...]) -> Planner:
        """The same planner for a step with these constraints; it shares everything else."""
        other = self._view()
        other.keep = keep
        return other

    def _view(self) -> Planner:
        with suppress(NotPlannable):
            _ = self.solver  # made once, for both
        return copy(self)

    def keeps(self, a: str, b: str) -> float:
        """The clearance [m] that two parts keep."""
        return self.clearances.get(frozenset((a, b)), self.clearance)

    def tool_pose(self, state: PlanningState) -> Transform:
        """X_WT."""
        return self.solver.forward(state.position)

    def body_pose(self, state: PlanningState, name: str) -> Transform:
        """X_WO of a body."""
        body = self.scene.body(name)
        return body.X_WO if body.fixed else state.bodies[self.scene.movable.index(body)]

    def frame(self, name: str, state: PlanningState) -> Transform:
        """X_WF of `world`, `base`, `tool`, `robot/LINK`, a body, a part of one, or a named frame."""
        if name in ("world", "base"):
            return self.robot.X_WB if name == "base" else Transform.identity()
        if name == "tool":
            return self.tool_pose(state)
        frame = self.scene.frame(name)
        if frame is not None:
            return self.frame(frame.parent, state) @ frame.X_PF
        if name.startswith(ROBOT):
            return self.kinematics.forward(state.position, name.removeprefix(ROBOT))
        return self.body_pose(state, name)

    def held(self, state: PlanningState, body: str) -> None:
        """Check that this object is held.

        Raises:
            NotPlannable: it is not.
        """
        carried = state.carried
        if carried is not None and carried.body == body:
            return
        if carried is not None:
            holds = f"holds '{carried.body}'"
        else:
            holds = "is closed, but not on it" if state.closed else "holds nothing"
        raise NotPlannable(
            f"'{body}' is not held: the hand {holds}", hint=f"`pick` it first, or `grasp: {{object: {body}}}`"
        )

    def free_hand(self, state: PlanningState, body: str) -> None:
        """Check that the hand can take this object.

        Raises:
            NotPlannable: the hand already holds something.
        """
        carried = state.carried
        if carried is None:
            return
        if carried.body == body:
            raise NotPlannable(f"'{body}' is already in the hand", hint="remove this step, or `place` the object first")
        raise NotPlannable(
            f"the hand cannot take '{body}': it holds '{carried.body}'", hint=f"`place` '{carried.body}' first"
        )

    def hand_contacts(self, body: str) -> Pairs:
        """Every pair of a link of the hand with this body."""
        last = self.robot.joint(self.solver.joints[-1])
        return pairs(self.robot.descendants(last.child), body)

    def may_touch(self, state: PlanningState, bodies: Sequence[str]) -> Pairs:
        """Every pair of these bodies with the hand, and with what it holds."""
        held = () if state.carried is None else (state.carried.body,)
        return frozenset(
            pair for body in bodies for pair in {*self.hand_contacts(body), *((name, body) for name in held)}
        )

    def held_in_tool(self, state: PlanningState) -> Transform:
        """X_TO of the held object."""
        assert state.carried is not None  # callers ask `held` first
        X_WO = self.body_pose(state, state.carried.body)
        return self.tool_pose(state).inverse() @ X_WO

    def contents(self, state: PlanningState, container: str) -> tuple[str, ...]:
        """The movable bodies in a container; see `contents_of`."""
        body, X_WC = self.scene.body(container), self.body_pose(state, container)
        return contents_of(self.scene, body, X_WC, state.bodies, partial(self.touching, state))

    def aboard(self, state: PlanningState, body: str) -> tuple[str, ...]:
        """The movable bodies that move with a body; see `aboard`."""
        return aboard(self.scene, body, state.bodies, partial(self.contents, state), partial(self.touching, state))

    def query(self, state: PlanningState, allowed: Pairs = NOTHING) -> CollisionQuery:
        """Collision query in this state with the scene and the robot itself, with the clearances of the task.

        The hand may touch the held object. What that contains moves with it, and may touch what the object may.

        Args:
            allowed: further pairs that may touch.
        """
        carried = state.carried
        allowed |= self.allowed
        contents: tuple[Carried, ...] = ()
        if carried is not None:
            allowed |= self.hand_contacts(carried.body)
            X_LW = carried.X_LO @ self.body_pose(state, carried.body).inverse()
            contents = tuple(
                Carried(name, carried.link, _rounded(X_LW @ self.body_pose(state, name)))
                for name in self.aboard(state, carried.body)
            )
            on_body = {name for pair in allowed if carried.body in pair for name in pair} - {carried.body}
            allowed |= {(each.body, name) for each in contents for name in on_body}
        moving = {each.body for each in (() if carried is None else (carried, *contents))}
        standing = tuple(
            None if body.name in moving else X_WO for body, X_WO in zip(self.scene.movable, state.bodies, strict=True)
        )
        key = (standing, carried, allowed, contents)
        if key not in self._queries:
            if len(self._queries) == _QUERIES:
                del self._queries[next(iter(self._queries))]
            at = partial(self.checker.at, margin=self.clearance, margins=self.clearances)
            self._queries[key] = at(state.bodies, carried=carried, contents=contents, ignore=allowed)
        return self._queries[key]

    def free_start(self, state: PlanningState, allowed: Pairs = NOTHING) -> None:
        """Check that only `allowed` pairs are too near already; otherwise no path from here can be found.

        Raises:
            NotPlannable: names the pair.
        """
        hit = self.query(state, allowed).check(state.position)
        if hit is not None:
            raise self.refusal(state, hit, "is", "before the motion")

    def outside(self, state: PlanningState) -> None:
        """Check that the robot is inside no body, where the engine would throw them apart or wedge them.

        Raises:
            NotPlannable: names the body and the deepest link.
        """
        hits = [
            hit
            for hit in self.query(state).every(state.position)
            if hit.distance < -TOLERANCE and hit.a.startswith(ROBOT) != hit.b.startswith(ROBOT)
        ]
        if hits:
            raise self.refusal(state, min(hits, key=lambda hit: hit.distance), "is", "at the start")

    def refusal(
        self, state: PlanningState, hit: CollisionHit, verb: str, when: str, *, move: bool = False
    ) -> NotPlannable:
        """The refusal for a hit on a path that begins in `state`: `a` `verb` too near to `b`, `when`.

        In a `move` the contact may be intended.
        """
        carried = state.carried
        begins, held = hit.time <= 0.0, carried is not None and carried.body in (hit.a, hit.b)
        hint = NO_WAY_AROUND
        if begins and held and carried is not None:
            hint = freed(self.scene, partial(self.body_pose, state), carried.body, hit)
        elif hit.a.startswith(ROBOT) and hit.b.startswith(ROBOT):
            hint = links_apart(hit) if begins else f"{NO_WAY_AROUND}; or {links_apart(hit)}"
        elif begins and state.at_start:
            hint = PUT_APART
        elif begins:
            if body := self._touchable(state, hit):
                hint = f"add `touch: [{body}]` to the `move` that leaves it"
        elif move and (body := self._touchable(state, hit)):
            hint = f"{NO_WAY_AROUND}; or add `touch: [{body}]`, if the hand is to push it or press on it"
        if begins and held:
            cause = f"'{hit.a}' still touches '{hit.b}' {when}"
        elif hit.distance < 0.0:
            cause = f"'{hit.a}' and '{hit.b}' overlap by {hit.amount} {when}"
        else:
            near = f"{hit.amount} apart"
            cause = f"'{hit.a}' {verb} within {self._clearance_text(hit)} of '{hit.b}' ({near}) {when}"
        reason: RefusalReason | None = "in_the_way" if hint == NO_WAY_AROUND else None
        return NotPlannable(cause, hint=hint, reason=reason, parts=frozenset((hit.a, hit.b)))

    def _touchable(self, state: PlanningState, hit: CollisionHit) -> str:
        """The body that the hand, or what it holds, hit; "" where something else did."""
        pair = frozenset((hit.a, hit.b))
        bodies = [name for name in (hit.a, hit.b) if not name.startswith(ROBOT)]
        return next((body for body in bodies if pair in map(frozenset, self.may_touch(state, [body]))), "")

    def in_the_way(self, hit: CollisionHit) -> InTheWay:
        """A hit as text; with the clearance where the two do not overlap."""
        text = str(hit)
        if hit.distance >= 0.0:
            text = f"{hit.a} comes within {self._clearance_text(hit)} of {hit.b} ({hit.amount} apart)"
        return InTheWay(text, frozenset((hit.a, hit.b)))

    def _clearance_text(self, hit: CollisionHit) -> str:
        return f"{1000.0 * self.keeps(hit.a, hit.b):.3g} mm"

    def touching(self, state: PlanningState, body: str) -> Pairs:
        """The pairs of a movable body with its support and what it touches."""
        root = self.robot.root
        X_LO = self.robot.X_WB.inverse() @ self.body_pose(state, body)
        carried = Carried(body=body, link=root, X_LO=X_LO)
        margin = TOUCHING if self.clearance <= CLEARANCE else self.clearance + TOUCHING - CLEARANCE
        there = self.checker.at(state.bodies, carried=carried, margin=margin, only=body)
        return frozenset((hit.a, hit.b) for hit in there.every(state.position))

    def grasping(self, state: PlanningState, body: str, *, margin: float = 0.0) -> CollisionQuery:
        """Collision query of the empty hand with this body alone, with a `margin` [m]."""
        return self.checker.at(state.bodies, only=body, margin=margin)

    def distance(self, state: PlanningState, body: str) -> float:
        """Distance [m] of the empty robot from this body, negative where they overlap; at most `CLEARANCE`."""
        hits = self.grasping(state, body, margin=CLEARANCE).every(state.position)
        return min((hit.distance for hit in hits), default=CLEARANCE)


def _rounded(X: Transform) -> Transform:
    """The pose without the rounding of the products that gave it, so that queries with the same contents are shared."""
    return Transform(R=frozen(np.round(X.R, 12)), p=frozen(np.round(X.p, 12)))
