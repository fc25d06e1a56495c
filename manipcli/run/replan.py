"""The situation as it is measured, and in what it is not the one that a step was planned for.

Joints that follow trajectories are where they are commanded to be as long as they are near to it: a new trajectory then
begins where the last one ended. An object in the hand is where it is measured in the hand, so that what slipped is put
down where it belongs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Final

import numpy as np

from manipcli.control.roles import is_follower
from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform, frozen, quat_from_matrix
from manipcli.model.collision import Carried
from manipcli.model.grasp import Grasp
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.planner import Planner
from manipcli.simulate.session import SLOW, Session
from manipcli.spec.reactions import ReplanSpec
from manipcli.spec.source.tree import Plain
from manipcli.spec.task import StepSpec
from manipcli.task.plan_task import plan_step

COMMANDED: Final = 1e-4
"""A trajectory that begins further than this [rad or m] from what is commanded would make the robot jump."""


class Measured:
    """What the planner is told of a running world.

    Args:
        session: is asked where everything is.
        planner: of the task.
        limits: which differences count.
        physics: whether bodies move; where they do not, they are where they were predicted to be.

    Attributes:
        grasp: what the hand carries.
    """

    def __init__(self, session: Session, planner: Planner, limits: ReplanSpec, *, physics: bool) -> None:
        self._session = session
        self._planner = planner
        self._limits = limits
        self._physics = physics
        self._lost = ""
        self.grasp = Grasp(planner.kinematics, planner.scene, period=SLOW * session.period)

    def situation(self, believed: PlanningState) -> PlanningState:
        """Where everything is now.

        Args:
            believed: says what the hand holds; it holds nothing any more where that is elsewhere.
        """
        self._lost = ""
        state = self._session.engine.read()
        measured = np.array(state.position)
        position = self._commanded(measured)
        if not self._physics:
            return believed.moved(position)
        planner = self._planner
        bodies = [
            Transform.of(xyz=p, quat_xyzw=q) for p, q in zip(state.body_position, state.body_quat_xyzw, strict=True)
        ]
        now = PlanningState(position, tuple(bodies), carried=None, closed=believed.closed, at_start=False)
        carried = believed.carried
        if carried is None:
            return now
        self._lost = self.grasp.lost(carried, state, self._session.touching)
        if self._lost:
            return now
        X_WO = planner.body_pose(now, carried.body)
        X_LO = planner.kinematics.forward(measured, carried.link).inverse() @ X_WO
        # The robot is told to be where it is commanded to be; so is what it holds, and what lies in that.
        shift = planner.kinematics.forward(position, carried.link) @ X_LO @ X_WO.inverse()
        return replace(self._shifted(now, carried.body, shift), carried=Carried(carried.body, carried.link, X_LO))

    def differences(self, planned: PlanningState, now: PlanningState, step: StepSpec) -> tuple[str, ...]:
        """In what `now` is not what the step was `planned` for, each with how much; () where it is near enough."""
        return (*self._joints(planned, now), *self._held(planned, now), *self._bodies(planned, now, step))

    def plan(
        self, step: StepSpec, planned: PlanningState, now: PlanningState, grasps: Sequence[Array] = ()
    ) -> tuple[StepPlan, PlanningState, str]:
        """The plan, by none of `grasps`, of a step that was `planned` for another situation, from where things are.

        An arm of few joints may be able to move what is held to where it belongs and unable to turn it. Where nothing
        can be planned, a turn in the hand that does not count by itself is left as it is.

        Returns:
            The plan; the situation in which it begins; what is to be told of it, "" where there is nothing.

        Raises:
            NotPlannable: neither can be planned; why the first one cannot.
        """
        try:
            return plan_step(self._planner, step, now, grasps), now, ""
        except NotPlannable:
            left = self._turn_left(planned, now)
            if left is not None:
                turned, told = left
                with suppress(NotPlannable):
                    return plan_step(self._planner, step, turned), turned, told
            raise

    def _turn_left(self, planned: PlanningState, now: PlanningState) -> tuple[PlanningState, str] | None:
        """`now` with what is held turned in the hand as `planned`, and what to tell; None where the turn counts."""
        before, after = planned.carried, now.carried
        if before is None or after is None or before.body != after.body:
            return None
        _, turn = _between(before.X_LO, after.X_LO)
        if turn > self._limits.rotation:
            return None
        planner = self._planner
        X_LO = Transform(R=before.X_LO.R, p=after.X_LO.p)
        X_WO = planner.body_pose(now, after.body)
        shift = planner.kinematics.forward(now.position, after.link) @ X_LO @ X_WO.inverse()
        turned = replace(self._shifted(now, after.body, shift), carried=replace(after, X_LO=X_LO))
        return turned, f"; the arm cannot undo the {_deg(turn)} by which '{after.body}' is turned in the hand"

    def _shifted(self, now: PlanningState, body: str, shift: Transform) -> PlanningState:
        """With a body, and what lies in it, moved in the world."""
        moving = {body, *self._planner.contents(now, body)}
        names = [one.name for one in self._planner.scene.movable]
        moved = (shift @ X if name in moving else X for name, X in zip(names, now.bodies, strict=True))
        return replace(now, bodies=tuple(moved))

    def _commanded(self, measured: Array) -> Array:
        """(n) where joints are commanded to be if that is near, else where they are, also beyond soft limits."""
        session, robot = self._session, self._planner.robot
        position = measured.copy()
        manager = session.manager
        for controller, output in zip(manager.controllers, manager.outputs, strict=True):
            if output is None or not manager.started or not is_follower(controller):
                continue
            columns = robot.indices(controller.joints)
            near = np.abs(output.position - measured[columns]) <= self._limits.joints
            position[columns] = np.where(near, output.position, measured[columns])
        lower, upper = np.transpose([joint.limits.range for joint in robot.moving_joints])
        return frozen(np.clip(position, lower, upper))

    def _joints(self, planned: PlanningState, now: PlanningState) -> Iterator[str]:
        """The joint that is furthest off. Fingers of a closed hand are where the object lets them be."""
        robot, hand = self._planner.robot, self._planner.gripper_joints
        independent = [joint.name for joint in robot.moving_joints if joint.independent]
        arm = [name for name in independent if name not in hand]
        fingers = [] if planned.closed else [name for name in independent if name in hand]
        for names, most in ((arm, COMMANDED), (fingers, self._limits.joints)):
            columns = robot.indices(tuple(names))
            off = np.abs(now.position[columns] - planned.position[columns])
            if len(off) and off.max() > most:
                k = int(np.argmax(off))
                here, there = now.position[columns][k], planned.position[columns][k]
                unit = robot.joint(names[k]).unit
                yield f"joint '{names[k]}' is at {round(here, 4):g} {unit} and not at {round(there, 4) + 0.0:g} {unit}"

    def _held(self, planned: PlanningState, now: PlanningState) -> Iterator[str]:
        before, after = planned.carried, now.carried
        if before is not None and (after is None or after.body != before.body):
            away = float(np.linalg.norm(self._pose(now, before.body).p - self._pose(planned, before.body).p))
            why = self._lost or f"it is {_mm(away)} from its planned place"
            yield f"'{before.body}' is not in the hand: {why}"
        elif after is not None and before is None:
            yield f"the hand holds '{after.body}'"
        elif before is not None and after is not None:
            slip, turn = _between(before.X_LO, after.X_LO)
            if slip > self._limits.slip or turn > self._limits.rotation:
                yield f"'{after.body}' sits {_mm(slip)} and {_deg(turn)} off in the hand"

    def _bodies(self, planned: PlanningState, now: PlanningState, step: StepSpec) -> Iterator[str]:
        """Bodies that stand elsewhere. What lies in the container that it was planned to lie in matters to no way;
        only to a step that names it."""
        scene = self._planner.scene
        named = _texts(step.body.model_dump())
        named |= {frame.parent for frame in scene.frames if frame.name in named}
        where, planned_where = self._containers(now), self._containers(planned)
        held = {each.body for each in (planned.carried, now.carried) if each is not None}
        for body in scene.movable:
            name = body.name
            if name in held or (name not in named and name in where and where[name] == planned_where.get(name)):
                continue
            away, turn = _between(self._pose(planned, name), self._pose(now, name), round_as=body.kind)
            if away > self._limits.position or turn > self._limits.rotation:
                yield f"'{name}' is {_mm(away)} and {_deg(turn)} from where it was to be"

    def _containers(self, situation: PlanningState) -> dict[str, str]:
        """In what each body lies, of those that lie in something."""
        planner = self._planner
        return {
            inside: body.name
            for body in planner.scene.bodies
            if body.interior is not None
            for inside in planner.contents(situation, body.name)
        }

    def _pose(self, situation: PlanningState, name: str) -> Transform:
        return self._planner.body_pose(situation, name)


def after(planned: StepPlan, before: PlanningState, *, done: int) -> PlanningState:
    """What the hand is believed to hold when `done` motions of a plan that began in `before` were done, and the next
    one was not; where things are has to be measured."""
    carried, closed = before.carried, before.closed
    for k, motion in enumerate(planned.motions[: done + 1]):
        if motion.grip is not None and motion.grip.force is not None:
            closed, carried = True, planned.end.carried if k < done else None
        elif motion.grip is not None and (closed or carried is not None):
            closed, carried = False, None
    return replace(before, carried=carried, closed=closed)


def _between(a: Transform, b: Transform, *, round_as: str = "") -> tuple[float, float]:
    """Distance [m] of two poses, and the angle [rad] between them, but for turns that do not show on a round body."""
    away = float(np.linalg.norm(a.p - b.p))
    if round_as == "sphere":
        return away, 0.0
    x, y, z, w = quat_from_matrix(a.R.T @ b.R)
    if round_as in ("cup", "cylinder"):
        return away, 2.0 * math.asin(min(1.0, math.hypot(x, y)))  # between the two axes
    return away, 2.0 * math.atan2(math.hypot(x, y, z), abs(w))


def _texts(value: Plain | tuple[object, ...] | object) -> set[str]:
    """Every text in plain data."""
    if isinstance(value, str):
        return {value}
    if isinstance(value, dict):
        return set().union(*map(_texts, value.values()))
    if isinstance(value, list | tuple):
        return set().union(*map(_texts, value))
    return set()


def _mm(length: float) -> str:
    return f"{1000.0 * length:.1f} mm"


def _deg(angle: float) -> str:
    return f"{math.degrees(angle):.1f} deg"
