"""Builder of a step's motions, each from the end of the last: timed, within the limits and free of collisions."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import partial

import numpy as np
import numpy.typing as npt

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.model.collision import CollisionQuery
from manipcli.model.configuration import with_mimics
from manipcli.plan import constrained_motion as timed
from manipcli.plan.attachment import attached, freed
from manipcli.plan.blind_grasp import blindly_closed
from manipcli.plan.closed_around import closed_around
from manipcli.plan.compliance import Compliance
from manipcli.plan.free_motion import Goals, branches, free_trajectory, labelled, refusing, tried
from manipcli.plan.hand import closed_hand, handless, no_gripper, posture_values
from manipcli.plan.inverse_kinematics import InverseKinematics
from manipcli.plan.letting_go import refuse_pressing
from manipcli.plan.limit_check import verify
from manipcli.plan.line import Walk
from manipcli.plan.motion import CLOSING, LOOKING, OPENING, Grip, Look, Motion, PlanningState, StepPlan
from manipcli.plan.motion_limits import MotionLimits
from manipcli.plan.path import follow_poses, joint_path, linear_path, rotated
from manipcli.plan.planner import NOTHING, Pairs, Planner
from manipcli.plan.pose_error import Leaving
from manipcli.plan.prediction import carried_along, spilled
from manipcli.plan.sweep import grip_time, refuse_collision
from manipcli.plan.trajectory import JointTrajectory
from manipcli.plan.trajectory_sampling import resampled

GRAZE = 1e-4
"""[m] How much nearer than before a withdrawing finger may come: rounding, and the arm's own curve."""


class MotionBuilder:
    """The motions of one step. A refusal names the label of its motion, unless the step has only that motion."""

    def __init__(self, planner: Planner, state: PlanningState, *, verb: str = "", allowed: Pairs = NOTHING) -> None:
        """
        Args:
            planner: what to plan with.
            state: where the first motion begins.
            verb: of the step; a motion of this label is the step itself.
            allowed: pairs that may touch in all motions.
        """
        self._planner = planner
        self._now = state
        self._verb = verb
        self._allowed = allowed | planner.allowed
        self._motions: list[Motion] = []
        self.compliance: Compliance | None = None  # of the next motions, see `compliant`

    @property
    def now(self) -> PlanningState:
        """Where the motions so far lead."""
        return self._now

    def plan(self) -> StepPlan:
        """The motions so far, and where they lead."""
        return StepPlan(motions=tuple(self._motions), end=self._now)

    def copy(self) -> MotionBuilder:
        """A copy, to plan alternatives from here."""
        other = MotionBuilder(self._planner, self._now, verb=self._verb, allowed=self._allowed)
        other._motions, other.compliance = [*self._motions], self.compliance
        return other

    def adopt(self, other: MotionBuilder, state: PlanningState | None = None) -> None:
        """Continue where a copy has led, or with a predicted `state` there."""
        self._motions, self._now = other._motions, other._now if state is None else state

    def let_go(self, posture: str) -> PlanningState:
        """The present state with the hand at a pose and empty; collisions are not checked."""
        grip = self._grip(self._posture(posture))
        empty = replace(self._now, carried=None, closed=False)
        return empty if grip is None else empty.moved(self._with(grip.joints, grip.target))

    def joints(
        self, label: str, names: Sequence[str], target: Sequence[float], *, speed: float = 1.0, free: bool = True
    ) -> None:
        """Move straight in joint space, or with `free` around obstacles; the hand moves at the same time, and arrives.

        Raises:
            NotPlannable: joints of the hand are named after it was closed.
        """
        hand = self._planner.gripper_joints
        values = dict(zip(names, target, strict=True))
        arm = [name for name in names if name not in hand]
        if self._now.closed and len(arm) < len(names):
            raise closed_hand(next(name for name in names if name in hand), self._now.carried)
        grip = self._grip({name: values[name] for name in names if name in hand}, must_arrive=True)
        if arm:
            goal = np.array([values[name] for name in arm])
            self._free(label, self._limits(arm, speed), goal, grip, (lambda _: goal[None]) if free else None)
        else:
            self._add(label, None, grip)

    def unreachable(self, label: str, X_WT: Transform, *, hand: str) -> NotPlannable | None:
        """Why no free configuration of the arm has the tool at `X_WT` and the hand at its pose `hand`; None if any has.

        Adds no motion: it checks whether the end of a path can be reached, before the path is planned.
        """
        try:
            with self._labelled(label):
                self._solved(X_WT, self._grip(self._posture(hand)), self._planner.solver)
        except NotPlannable as refusal:
            return refusal
        return None

    def reach(
        self,
        label: str,
        X_WT: Transform,
        *,
        speed: float = 1.0,
        hand: str | None = None,
        free: bool = False,
        searched: bool = True,
        leaving: Leaving = "nothing",
        avoid: Sequence[Array] = (),
        solver: InverseKinematics | None = None,
    ) -> None:
        """Move the tool to a pose, straight in joint space, and the hand to its pose `hand` at the same time.

        Configurations of the arm that are in collision are skipped; with `free`, also those whose straight joint-space
        path is. So are those near one of `avoid`, (n) each. Part of the orientation may be left open. Where no straight
        path is free, one is searched to any configuration, unless the arm must take the nearest (`searched`). With a
        `solver` for another frame, that frame moves to the pose instead of the tool.
        """
        if free:
            self._planner.free_start(self._now, self._allowed)
        line = X_WT if solver is None else None
        solver = (self._planner.solver if solver is None else solver).leaving(leaving)
        grip = None if hand is None else self._grip(self._posture(hand))
        with self._labelled(label):
            goal = self._solved(X_WT, grip, solver, free=free, avoid=avoid)
        limits = self._limits(solver.joints, speed)

        def goals(rng: np.random.Generator) -> Array:
            return branches(solver, X_WT, goal, rng, query=self.query(), limits=limits)

        self._free(label, limits, goal[list(solver.columns)], grip, goals if searched else None, line=line)

    def straight(
        self,
        label: str,
        X_WT: Transform,
        *,
        speed: float,
        allowed: Pairs = NOTHING,
        leaving: Leaving = "nothing",
    ) -> None:
        """Move the tool on a straight line to a pose; part of the orientation may be left open along the whole line.

        A line that is the step itself may run along joint limits.
        """
        with self._labelled(label):
            walk = partial(linear_path, q=self._now.position, X_WT=X_WT)
            trajectory = self._timed(label, walk, speed, insist=label == self._verb, leaving=leaving)
        self._add(label, trajectory, None, allowed=allowed)

    def along(self, label: str, poses: Sequence[Transform], *, speed: float, leaving: Leaving = "nothing") -> None:
        """Move the tool through near poses, from the present one; part of the orientation may be left open."""
        with self._labelled(label):
            walk = partial(follow_poses, q=self._now.position, poses=poses)
            trajectory = self._timed(label, walk, speed, insist=label == self._verb, leaving=leaving)
        self._add(label, trajectory, None)

    def through(self, label: str, names: Sequence[str], waypoints: Array) -> None:
        """Move along a smooth curve through `waypoints` (k, n) as fast as the limits allow; the first is here."""
        with self._labelled(label):
            limits = self._limits(names, 1.0)
            trajectory = timed.smooth_motion(self._planner, self._now, label, limits, joint_path(waypoints))
        self._add(label, trajectory, None)

    def withdraw(self, X_WT: Transform, body: str, *, speed: float, grazing: bool) -> None:
        """Move the tool on a straight line to a pose, away from a `body` that the now open hand was closed on.

        With `grazing` the hand keeps no clearance to that body, and where they overlap it must not get deeper: for a
        body that does not sit in the middle of the hand.
        """
        with self._labelled("withdraw"):
            trajectory = self._timed("withdraw", partial(linear_path, q=self._now.position, X_WT=X_WT), speed)
        allowed = NOTHING
        if grazing:
            planner = self._planner
            allowed = planner.hand_contacts(body)
            query = planner.grasping(self._now, body, margin=min(0.0, planner.distance(self._now, body)) - GRAZE)
            refuse_collision(planner, self._now, query, "withdraw", trajectory, None)
        self._add("withdraw", trajectory, None, allowed=allowed)

    def turn(self, label: str, axis: Array, angle: float, *, speed: float) -> None:
        """Rotate the tool in place about an `axis` (3,) of the world by `angle` [rad], which may exceed half a turn."""
        self.along(label, rotated(self._planner.tool_pose(self._now), axis, angle), speed=speed)

    def back(self, label: str, *, emptied: bool) -> None:
        """Repeat the last trajectory backwards.

        Limits are symmetric and the path was free forwards: torques are checked, as friction acts the other way, and
        collisions only if what is held was `emptied` since: its contents then lie elsewhere.
        """
        done = next(motion.trajectory for motion in reversed(self._motions) if motion.trajectory is not None)
        trajectory = timed.reversed_motion(self._planner, self._now, label, done)
        (self._add if emptied else self._accept)(label, trajectory, None)

    def follow(self, label: str, points: JointTrajectory, *, limits: MotionLimits) -> None:
        """Follow given points from the end of the last motion, sampled at every control tick and at their end.

        Args:
            label: of the motion.
            points: what lies between them is linear, cubic or quintic.
            limits: of the curve; infinite where it has none to keep.

        Raises:
            NotPlannable: it exceeds them, takes longer than `LONGEST`, or is in collision.
        """
        trajectory = resampled(points, limits, self._planner.period)
        with self._labelled(label):
            verify(trajectory, limits, given=points)
            timed.refuse_violation(self._planner, self._now, label, trajectory)
        self._add(label, trajectory, None)

    def close(self, posture: str, *, force: float, must_hold: bool, body: str | None, roomier: str = "") -> None:
        """Close the hand towards a posture until each finger meets `force` [N]; `body` is held from then on.

        The fingers are predicted to stop where the first link of each touches the body, or any if it is not known.

        Args:
            posture: named.
            force: at which a finger stops.
            must_hold: whether holding nothing is a failure.
            body: what it closes on, if known.
            roomier: the hint if the fingers are in collision: how to grasp where they have more room.

        Raises:
            NotPlannable: no gripper controller moves the hand, or it `must_hold` the body and does not touch it.
        """
        planner = self._planner
        if handless(planner.robot, posture):
            motion, self._now = attached(planner, self._now, body, self._allowed)
            return self._motions.append(motion)
        grip = self._grip(self._posture(posture), force=force, must_hold=must_hold)
        if grip is None:
            raise no_gripper(posture)
        before, duration = self._now, grip_time(planner, self._now, grip)
        if body is None:
            self._now = replace(before.moved(blindly_closed(planner, before, grip)), closed=True)
            self._motions.append(Motion(CLOSING, None, grip, duration, begins=before, allowed=self._allowed))
            return
        allowed = self._allowed | planner.hand_contacts(body)
        now = closed_around(
            planner, self._now, body, grip, posture, allowed=self._allowed, must_hold=must_hold, roomier=roomier
        )
        takes = None if planner.robot.holding is None else body
        self._motions.append(Motion(CLOSING, None, grip, duration, begins=before, allowed=allowed, takes=takes))
        self._now = now

    def open(self, posture: str, *, around: str | None = None, must_arrive: bool = False) -> None:
        """Open the hand to a pose; the held object stays where it is. It may touch that, or the body it is `around`.

        With `must_arrive` the step fails if something stops the hand.

        Raises:
            NotPlannable: no gripper controller moves the hand, it collides with something else than the object, or it
                `must_arrive` at a pose that still presses on the object.
        """
        if handless(self._planner.robot, posture):
            motion, self._now = freed(self._now)
            return self._motions.append(motion)
        grip = self._grip(self._posture(posture), must_arrive=must_arrive)
        if grip is None:
            raise no_gripper(posture)
        allowed = NOTHING
        if self._now.carried is not None:
            if must_arrive:
                refuse_pressing(self._planner, self._now, self._with(grip.joints, grip.target), grip.joints, posture)
            allowed |= self._planner.hand_contacts(self._now.carried.body)
        if around is not None:
            allowed |= self._planner.hand_contacts(around)
        self._now = replace(self._now, carried=None, closed=False)
        self._add(OPENING, None, grip, allowed=allowed)
        self._motions[-1] = replace(self._motions[-1], lets_go=self._planner.robot.holding is not None)

    def dwell(self, label: str, duration: float, *, awaits: bool = True) -> None:
        """Hold still for `duration` [s], and if it `awaits` until the step's `until` holds."""
        self._motions.append(Motion(label, None, None, duration, awaits, compliance=self.compliance))

    def look(self, looks: Look, duration: float) -> None:
        """Hold still until the picture in which a body is located has arrived, at most after `duration` [s]."""
        self._motions.append(Motion(LOOKING, trajectory=None, grip=None, duration=duration, looks=looks))

    def spill(self, into: str, most: int | None = None) -> None:
        """Predict the contents of the carried object, or `most` of them, on the floor of the container `into`."""
        self._now = spilled(self._planner, self._now, into, most)

    def _labelled(self, label: str) -> AbstractContextManager[None]:
        return labelled(label, self._verb, self._motions)

    def _solved(
        self,
        X_WT: Transform,
        grip: Grip | None,
        solver: InverseKinematics,
        *,
        free: bool = False,
        avoid: Sequence[Array] = (),
    ) -> Array:
        """Collision-free position (n) with the tool at `X_WT`, and the hand where `grip` moves it."""
        planner = self._planner
        seed = self._now.position if grip is None else self._with(grip.joints, grip.target)
        refuse = refusing(planner, self.query(), seed, free=free, avoid=avoid)
        return solver.solve(X_WT, seed, planner.rng, refuse=refuse)

    def query(self, allowed: Pairs = NOTHING) -> CollisionQuery:
        """What the next motion must not touch, but for these pairs."""
        return self._planner.query(self._now, allowed | self._allowed)

    def _posture(self, name: str) -> dict[str, float]:
        return posture_values(self._planner.robot, name)

    def _limits(self, names: Sequence[str], speed: float) -> MotionLimits:
        return MotionLimits.of(self._planner.robot, names, velocity_scale=speed, acceleration_scale=speed)

    def _free(
        self, label: str, limits: MotionLimits, target: Array, grip: Grip | None, goals: Goals | None,
        line: Transform | None = None,
    ) -> None:  # fmt: skip
        """Add a motion straight to `target`; where it is in collision and `goals` are given, around obstacles.

        `line`: the tool pose at the target, if the arm may arrive there in another configuration.
        """
        query, end = self.query(), self._with(limits.names, target)
        with self._labelled(label):
            straight = timed.straight_motion(self._planner, self._now, label, limits, end, query=query, line=line)
        free = free_trajectory(self._planner, self._now, query, straight, grip, limits, label, self._verb, goals, end)
        self._accept(label, free, grip)
        if free is not straight and (search := self._planner.searching()) is not None:
            self._motions[-1] = replace(self._motions[-1], searched=search.spec.type, straight=straight)

    def _timed(
        self, label: str, walk: Walk, speed: float, *, insist: bool = False, leaving: Leaving = "nothing"
    ) -> JointTrajectory:
        limits = self._limits(self._planner.solver.joints, speed)
        return timed.tool_motion(self._planner, self._now, label, limits, walk, insist=insist, leaving=leaving)

    def _add(
        self, label: str, trajectory: JointTrajectory | None, grip: Grip | None, *, allowed: Pairs = NOTHING
    ) -> None:
        """Accept a motion if it is free of collisions."""
        query, move = self.query(allowed), self._verb == "move"
        with tried(*self._motions, Motion(label, trajectory, None, 0.0, begins=self._now)):
            refuse_collision(self._planner, self._now, query, label, trajectory, grip, move=move)
        self._accept(label, trajectory, grip, allowed=allowed)

    def _accept(
        self, label: str, trajectory: JointTrajectory | None, grip: Grip | None, *, allowed: Pairs = NOTHING
    ) -> None:
        before = self._now
        duration = 0.0 if grip is None else grip_time(self._planner, before, grip)
        if trajectory is not None:
            duration = max(duration, trajectory.duration)
        if grip is not None:
            self._now = self._now.moved(self._with(grip.joints, grip.target))
        if trajectory is not None:
            self._now = self._now.moved(self._with(trajectory.names, trajectory.positions[-1]))
            self._now = carried_along(self._planner, before, self._now)
        motion = Motion(label, trajectory, grip, duration, begins=before, allowed=allowed | self._allowed)
        self._motions.append(replace(motion, compliance=self.compliance))

    def _with(self, names: Sequence[str], values: npt.ArrayLike) -> Array:
        """The present position with other values of some joints; joints that mimic them follow."""
        q = np.array(self._now.position)
        q[self._planner.robot.indices(tuple(names))] = values
        return with_mimics(self._planner.robot, q)

    def _grip(
        self,
        targets: dict[str, float],
        *,
        force: float | None = None,
        must_hold: bool = False,
        must_arrive: bool = False,
    ) -> Grip | None:
        """A goal for the joints of the gripper controller, or None if no target is one of them."""
        joints = self._planner.gripper_joints
        if not any(name in targets for name in joints):
            return None
        here = dict(zip(joints, self._now.position[self._planner.robot.indices(joints)], strict=True))
        target = frozen([targets.get(name, here[name]) for name in joints])
        return Grip(joints, target, force, must_hold=must_hold, must_arrive=must_arrive)
