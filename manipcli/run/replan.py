"""Re-planning from the measured state: its differences to the state a step was planned from, and the new plan.

Bodies are where the robot believes them to be. Joints that follow trajectories count as at their commanded position if
they are near it, so that a new trajectory starts at the end of the last one. An object in the hand has its measured
pose in the hand, so that it is placed correctly after slip.
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
from manipcli.run.belief import Belief
from manipcli.simulate.session import SLOW, Session
from manipcli.spec.reactions import ReplanSpec
from manipcli.spec.source.tree import Plain
from manipcli.spec.step import StepSpec
from manipcli.task.plan_steps import plan_step

COMMANDED: Final = 1e-4
"""[rad or m] Largest distance of the start of a trajectory from the commanded position, without a jump."""


class Measured:
    """The planning state of a running world.

    Args:
        session: gives the measured state.
        planner: of the task.
        limits: differences above which a step is re-planned.
        physics: whether the engine moves bodies; otherwise their predicted poses are used.
        belief: about the poses of bodies.

    Attributes:
        grasp: the grasp of the carried object.
    """

    def __init__(
        self, session: Session, planner: Planner, limits: ReplanSpec, *, physics: bool, belief: Belief
    ) -> None:
        self._session = session
        self._planner = planner
        self._limits = limits
        self._physics = physics
        self._belief = belief
        self._lost = ""
        period = SLOW * session.period
        self.grasp = Grasp(planner.kinematics, planner.scene, period=period, attachment=session.holder)

    def situation(self, believed: PlanningState) -> PlanningState:
        """The measured planning state.

        Args:
            believed: names the carried object; the result carries nothing if that object was lost.
        """
        self._lost = ""
        state = self._belief.look(self._session.engine.read())
        measured = np.array(self._session.sensors.positions(state))
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
            self._belief.let_go(state)
            return now
        X_WO = planner.body_pose(now, carried.body)
        X_LO = planner.kinematics.forward(measured, carried.link).inverse() @ X_WO
        # The planner uses the commanded position, so the carried object and its contents are shifted to it.
        shift = planner.kinematics.forward(position, carried.link) @ X_LO @ X_WO.inverse()
        return replace(self._shifted(now, carried.body, shift), carried=Carried(carried.body, carried.link, X_LO))

    def differences(self, planned: PlanningState, now: PlanningState, step: StepSpec) -> tuple[str, ...]:
        """Texts of the differences of `now` to the `planned` state of a step, with amounts; () within the limits."""
        return (*self._joints(planned, now), *self._held(planned, now), *self._bodies(planned, now, step))

    def refused(self, planned: PlanningState, now: PlanningState, cause: str, step: StepSpec, *, forced: bool) -> str:
        """The text of a failed re-planning: a lost or slipped object first, which is the cause of what follows.

        Args:
            planned: the planned start of the step.
            now: the measured one.
            cause: why the step has no plan.
            step: that has no plan.
            forced: whether the task cannot choose to keep the original plan.
        """
        held = "; ".join(self._held(planned, now))
        if held and planned.carried is not None and now.carried is None:
            return f"the grasp was lost before this step: {held}"
        why = "; ".join(self.differences(planned, now, step))
        if held:
            return f"{why}; no plan starts from there: {cause}"
        hint = "" if forced else "; `replan: false` keeps the original plan"
        return f"re-planning from the measured state failed{f' ({why})' if why else ''}: {cause}{hint}"

    def plan(
        self, step: StepSpec, planned: PlanningState, now: PlanningState, grasps: Sequence[Array] = ()
    ) -> tuple[StepPlan, PlanningState, str]:
        """Plan a step from the measured state, without the grasps in `grasps`.

        An arm with few joints may be able to correct the position of a carried object but not its rotation. If planning
        fails, it is repeated without correcting a rotation in the hand that is within the limits.

        Returns:
            The plan; the state it starts from; a note for reports, "" without one.

        Raises:
            NotPlannable: both attempts failed; with the cause of the first.
        """
        try:
            return plan_step(self._planner, step, now, grasps), now, ""
        except NotPlannable:
            uncorrected = self._uncorrected(planned, now)
            if uncorrected is not None:
                rotated, note = uncorrected
                with suppress(NotPlannable):
                    return plan_step(self._planner, step, rotated), rotated, note
            raise

    def _uncorrected(self, planned: PlanningState, now: PlanningState) -> tuple[PlanningState, str] | None:
        """`now` with the `planned` rotation of the carried object in the hand, and a note; None beyond the limit."""
        before, after = planned.carried, now.carried
        if before is None or after is None or before.body != after.body:
            return None
        _, rotation = between(before.X_LO, after.X_LO)
        if rotation > self._limits.rotation:
            return None
        planner = self._planner
        X_LO = Transform(R=before.X_LO.R, p=after.X_LO.p)
        X_WO = planner.body_pose(now, after.body)
        shift = planner.kinematics.forward(now.position, after.link) @ X_LO @ X_WO.inverse()
        rotated = replace(self._shifted(now, after.body, shift), carried=replace(after, X_LO=X_LO))
        return rotated, f"; the arm cannot correct the rotation of '{after.body}' by {deg(rotation)} in the hand"

    def _shifted(self, now: PlanningState, body: str, shift: Transform) -> PlanningState:
        """`now` with a body and its contents moved in the world."""
        moving = {body, *self._planner.contents(now, body)}
        names = [movable.name for movable in self._planner.scene.movable]
        moved = (shift @ X if name in moving else X for name, X in zip(names, now.bodies, strict=True))
        return replace(now, bodies=tuple(moved))

    def _commanded(self, measured: Array) -> Array:
        """(n) the commanded position of each joint if it is near the measured one, else the measured one."""
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
        """The joint with the largest difference, for arm and fingers; fingers of a closed hand are not compared."""
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
                yield f"joint '{names[k]}' is at {round(here, 4):g} {unit} instead of {round(there, 4) + 0.0:g} {unit}"

    def _held(self, planned: PlanningState, now: PlanningState) -> Iterator[str]:
        before, after = planned.carried, now.carried
        if before is not None and (after is None or after.body != before.body):
            away = float(np.linalg.norm(self._pose(now, before.body).p - self._pose(planned, before.body).p))
            why = self._lost or f"it is {mm(away)} from its planned pose"
            yield f"'{before.body}' is not in the hand: {why}"
        elif after is not None and before is None:
            yield f"the hand holds '{after.body}' instead of nothing"
        elif before is not None and after is not None:
            slip, rotation = between(before.X_LO, after.X_LO)
            if slip > self._limits.slip or rotation > self._limits.rotation:
                yield f"'{after.body}' slipped {mm(slip)} and {deg(rotation)} in the hand"

    def _bodies(self, planned: PlanningState, now: PlanningState, step: StepSpec) -> Iterator[str]:
        """Bodies away from their planned pose. A body inside its planned container is compared only if the step names
        it: it does not affect paths."""
        scene = self._planner.scene
        named = _texts(step.body.model_dump())
        named |= {frame.parent for frame in map(scene.frame, named) if frame is not None}
        where, planned_where = self._containers(now), self._containers(planned)
        held = {each.body for each in (planned.carried, now.carried) if each is not None}
        for body in scene.movable:
            name = body.name
            if name in held or (name not in named and name in where and where[name] == planned_where.get(name)):
                continue
            away, rotation = between(self._pose(planned, name), self._pose(now, name), round_as=body.kind)
            if away > self._limits.position or rotation > self._limits.rotation:
                yield f"'{name}' is {mm(away)} and {deg(rotation)} from its planned pose"

    def _containers(self, situation: PlanningState) -> dict[str, str]:
        """Body -> the container that it is in."""
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
    """The expected grasp after the first `done` motions of a plan that started in `before`; poses must be measured."""
    carried, closed = before.carried, before.closed
    for k, motion in enumerate(planned.motions[: done + 1]):
        if motion.closes:
            closed, carried = True, planned.end.carried if k < done else None
        elif motion.opens and (closed or carried is not None):
            closed, carried = False, None
    return replace(before, carried=carried, closed=closed)


def between(a: Transform, b: Transform, *, round_as: str = "") -> tuple[float, float]:
    """Distance [m] and angle [rad] between two poses, without rotations about the symmetry axes of a round body."""
    away = float(np.linalg.norm(a.p - b.p))
    if round_as == "sphere":
        return away, 0.0
    x, y, z, w = quat_from_matrix(a.R.T @ b.R)
    if round_as in ("cup", "cylinder"):
        return away, 2.0 * math.asin(min(1.0, math.hypot(x, y)))  # between the two axes
    return away, 2.0 * math.atan2(math.hypot(x, y, z), abs(w))


def _texts(value: Plain | tuple[object, ...] | object) -> set[str]:
    """All strings in plain data."""
    if isinstance(value, str):
        return {value}
    if isinstance(value, dict):
        return set().union(*map(_texts, value.values()))
    if isinstance(value, list | tuple):
        return set().union(*map(_texts, value))
    return set()


def mm(length: float) -> str:
    """A length [m] in millimetres."""
    return f"{1000.0 * length:z.1f} mm"


def deg(angle: float) -> str:
    """An angle [rad] in degrees."""
    return f"{math.degrees(angle):z.1f} deg"
