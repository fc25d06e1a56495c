"""Closes and opens a hand: each finger's reference moves at a speed and stops on contact, on stall, or at its target.

    controllers:
      hand_controller:
        type: gripper
        joints: [finger_1_proximal, finger_1_distal]
        gains: {finger_1_proximal: {p: 3, d: 0.03}, finger_1_distal: {p: 2, d: 0.015}}
        speed: 1 rad/s
        max_effort: 2

u = PID(e, de/dt), clamped to the maximum effort; what holds the fingers against gravity comes on top. Where a finger
stops, its reference stays: the spring of the gains keeps pressing with what it had built up.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from manipcli.control.action import ErrorCode, Feedback, FingerStop, GoalHandle, GripperGoal
from manipcli.control.controller import ControllerMember, ControllerOutput, FeedForward, Fit, JointState
from manipcli.control.gains import build_pid, idle_gains, joint_gains, strangers
from manipcli.control.pid import Compat
from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array
from manipcli.model.condition import Problem
from manipcli.model.robot import Joint, RobotModel
from manipcli.plan.hand import fingers
from manipcli.spec.controllers import GainsSpec, GripperSpec, Interface, Role

STALL_VELOCITY: Final = 0.02
STALL_SPEED: Final = 0.001
"""A finger joint slower than this is stalled, where nobody says [rad/s; m/s]."""
GOAL_ANGLE: Final = 0.05
GOAL_DISTANCE: Final = 0.002
"""A finger joint this near to its target has arrived, where nobody says [rad; m]: far less than a hand's stroke."""
REACHED = 1e-9
"""rad or m: a reference this close to its target has arrived."""

UNTIL_CHANGED = 1 << 62
"""Ticks: more than any run has."""


class GripperController:
    """One goal at a time; holds in between. The goal succeeds when every finger has stopped; see `GoalResult.fingers`.

    A finger has *contact* when the sum of its joints' contact forces meets the goal's force, after a low pass of the
    time constant `contact_time`, so that the knock of the first touch does not count as a grip; it is *stalled* when
    none of its joints that are further than `goal_tolerance` from their targets moved faster than `stall_velocity`
    for `stall_time`; it has *reached* when all its joints are within `goal_tolerance` and their references are there.

    Args:
        name: of the controller.
        joints: (n) distinct names.
        gains: by joint name.
        fingers: joint indices of each finger, where a goal does not say; empty: each joint is a finger.
        speed: [rad/s or m/s] of the references.
        max_effort: (n) or a number, N m or N; None: unlimited here.
        stall_velocity, goal_tolerance: see above; (n) or a number, rad/s or m/s and rad or m.
        stall_time: see above [s].
        contact_time: [s] of the low pass on contact forces; 0 takes them as they are.
        feed_forward: what the caller of `update` shall pass for this controller.
        compat: order of the PID integration.

    Raises:
        InvalidArgument: joints repeated, gains of an unknown joint or all zero, fingers that do not part the joints.
    """

    role: Role = "hand"
    interfaces: tuple[Interface, ...] = ("effort",)

    def __init__(
        self,
        *,
        name: str,
        joints: Sequence[str],
        gains: Mapping[str, GainsSpec],
        fingers: tuple[tuple[int, ...], ...] = (),
        speed: float = 1.0,
        max_effort: npt.ArrayLike | None = None,
        stall_velocity: npt.ArrayLike = 0.02,
        stall_time: float = 0.2,
        goal_tolerance: npt.ArrayLike = 0.05,
        contact_time: float = 0.02,
        feed_forward: FeedForward = "none",
        compat: Compat | None = None,
    ) -> None:
        self.name = name
        self.joints = tuple(joints)
        self.feed_forward: FeedForward = feed_forward
        n = len(self.joints)
        if n == 0 or len(set(self.joints)) != n:
            raise InvalidArgument("CTRL101", f"controller '{name}': its joints must be distinct, and at least one")
        self._pid = build_pid(name, self.joints, joint_gains(name, self.joints, gains), compat)
        self._default_fingers = self._parted(fingers)
        self._speed = speed
        unlimited = np.full(n, math.inf)
        self._default_effort = unlimited if max_effort is None else np.broadcast_to(max_effort, (n,)).astype(np.float64)
        self._stall_velocity: list[float] = np.broadcast_to(stall_velocity, (n,)).tolist()
        self._goal_tolerance: list[float] = np.broadcast_to(goal_tolerance, (n,)).tolist()
        self._stall_time, self._contact_time = stall_time, contact_time

        self._output = ControllerOutput.of(n, 1)
        self._reference, self._velocity, self._command = (
            self._output.position,
            self._output.velocity,
            self._output.command,
        )
        self._error, self._error_rate, self._step, self._measured = np.zeros((4, n))
        self._activated = False
        self._time = self._began = 0.0
        self._goal: GoalHandle | None = None
        self._starts = False
        self._set_effort(self._default_effort)
        self._target = np.zeros(n)
        self._fingers = self._default_fingers
        self._force: float | None = None
        self._stops: list[FingerStop | None] = []
        self._moved: list[float] = []
        self._felt: list[float] = []
        self._texts: list[str] = []
        self._moving = np.zeros(n)
        self._targets: list[float] = [0.0] * n
        self._ticks_left = 0
        self._period = math.nan

    def _parted(self, fingers: tuple[tuple[int, ...], ...]) -> tuple[tuple[int, ...], ...]:
        n = len(self.joints)
        if not fingers:
            return tuple((j,) for j in range(n))
        if sorted(j for finger in fingers for j in finger) != list(range(n)) or not all(fingers):
            raise InvalidArgument(
                "CTRL130", f"controller '{self.name}': fingers {fingers} do not part the joints 0 to {n - 1}"
            )
        return fingers

    def _set_effort(self, effort: Array) -> None:
        self._effort, self._minus_effort = effort, -effort

    def send_goal(self, goal: GripperGoal) -> GoalHandle:
        """Accepts a goal, which begins at the next update; a goal before it ends as aborted.

        Raises:
            InvalidArgument: a target of another length or not finite, fingers that do not part the joints, a force or
                an effort that is not positive.
        """
        n = len(self.joints)
        target = np.array(goal.target, dtype=np.float64)
        if target.shape != (n,) or not np.isfinite(target).all():
            raise InvalidArgument("CTRL131", f"target {target.tolist()}: expected {n} finite numbers, one a joint")
        if goal.force is not None and not goal.force > 0.0:
            raise InvalidArgument("CTRL132", f"force is {goal.force} N; expected more than 0, or None")
        fingers = self._parted(goal.fingers) if goal.fingers else self._default_fingers
        effort = self._default_effort
        if goal.max_effort is not None:
            effort = np.broadcast_to(np.asarray(goal.max_effort, dtype=np.float64), (n,)).copy()
            if not (effort > 0.0).all():
                raise InvalidArgument("CTRL133", f"max_effort {effort.tolist()}: expected more than 0")
        if self._goal is not None:
            self._goal.end("aborted", ErrorCode.INVALID_GOAL, "preempted by a new goal", self._time)
        self._set_effort(effort)
        self._target, self._force, self._fingers = target, goal.force, fingers
        self._stops = [None] * len(fingers)
        self._texts = [""] * len(fingers)
        self._felt = [0.0] * len(fingers)
        self._targets = target.tolist()
        self._moving = np.ones(n)
        self._ticks_left = 0
        self._starts = True
        self._goal = GoalHandle(cancel=self._cancel, feedback=self._feedback)
        return self._goal

    @property
    def senses_contact(self) -> bool:
        """While a goal stops fingers by force."""
        return self._goal is not None and self._force is not None

    @property
    def output(self) -> ControllerOutput:
        """What the last update wrote."""
        return self._output

    def deactivate(self, time: float, reason: str = "the controller was deactivated") -> None:
        """Ends its goal as aborted and forgets its state; the next update activates it again."""
        if self._goal is not None:
            self._goal.end("aborted", ErrorCode.INVALID_GOAL, reason, time)
        self._goal = None
        self._activated = False

    def update(
        self,
        time: float,
        period: float,
        measured: JointState,
        *,
        contact_force: Array | None = None,
    ) -> ControllerOutput:
        """One control tick at `time` [s] of the length `period` [s].

        Args:
            measured: (n) of the controller's joints.
            contact_force: (n) [N] on what each joint moves, up to the next joint; None: contact is not sensed.
        """
        self._time = time
        self._measured[:] = measured.position
        if not self._activated:
            self._activated = True
            self._pid.reset()
            self._reference[:] = measured.position
            self._velocity[:] = 0.0
            self._set_effort(self._effort if self._goal is not None else self._default_effort)
        if self._goal is not None:
            if self._starts:
                self._starts = False
                self._began = time
                self._moved = [time] * len(self._fingers)
            self._judge(time, period, measured, contact_force)
            if self._goal is not None:
                self._ramp(period)
        np.subtract(self._reference, measured.position, out=self._error)
        np.subtract(self._velocity, measured.velocity, out=self._error_rate)
        command = self._pid.update(self._error, period, self._error_rate)
        np.maximum(command, self._minus_effort, out=command)
        np.minimum(command, self._effort, out=self._command)
        return self._output

    def _ramp(self, period: float) -> None:
        """Moves the references of the fingers that have not stopped towards their targets."""
        if self._ticks_left <= 0 or period != self._period:
            self._plan_ramp(period)
        self._ticks_left -= 1
        self._reference += self._step

    def _plan_ramp(self, period: float) -> None:
        """The step of every joint's reference, and for how many ticks it stays the same."""
        step, limit = self._step, self._speed * period
        way = (self._target - self._reference) * self._moving
        np.minimum(np.maximum(way, -limit), limit, out=step)
        np.divide(step, period, out=self._velocity)
        self._period = period
        moves = step != 0.0
        ticks = np.floor(way[moves] / step[moves])
        self._ticks_left = int(ticks.min()) if ticks.size else UNTIL_CHANGED

    def _judge(self, time: float, period: float, measured: JointState, contact_force: Array | None) -> None:
        """Stops the fingers that met something or arrived; ends the goal when all have."""
        position: list[float] = measured.position.tolist()
        velocity: list[float] = measured.velocity.tolist()
        wanted = self._force
        force = contact_force.tolist() if contact_force is not None and wanted is not None else None
        share = period / (period + self._contact_time)
        tolerance, slow = self._goal_tolerance, self._stall_velocity
        for f, finger in enumerate(self._fingers):
            if self._stops[f] is not None:
                continue
            if force is not None and wanted is not None:
                pressed = 0.0
                for j in finger:
                    pressed += force[j]
                felt = self._felt[f] = self._felt[f] + share * (pressed - self._felt[f])
                if felt >= wanted:
                    self._stop(f, "contact", f"contact at {felt:.3g} N (asked {wanted:.3g} N)")
                    continue
            far = still = False
            for j in finger:
                if abs(self._targets[j] - position[j]) > tolerance[j]:
                    far = True
                    if -slow[j] <= velocity[j] <= slow[j]:
                        still = True
                    else:
                        still = False
                        break
            if not far:
                if all(abs(self._target[j] - self._reference[j]) <= REACHED for j in finger):
                    self._stop(f, "reached", "reached its target")
            elif not still:
                self._moved[f] = time
            elif time - self._moved[f] >= self._stall_time:
                away = [abs(self._targets[j] - position[j]) for j in finger]
                k = away.index(max(away))
                self._stop(f, "stalled", f"stalled {away[k]:.3g} before the target of '{self.joints[finger[k]]}'")
        if self._goal is not None and None not in self._stops:
            stops = tuple(stop for stop in self._stops if stop is not None)
            names = (self.joints[finger[0]] for finger in self._fingers)
            text = "; ".join(f"finger of '{name}': {why}" for name, why in zip(names, self._texts, strict=True))
            self._goal.end("succeeded", ErrorCode.SUCCESSFUL, f"{text}; at t = {time:.3f} s", time, stops)
            self._end_motion()

    def _stop(self, f: int, why: FingerStop, text: str) -> None:
        self._stops[f], self._texts[f] = why, text
        self._moving[list(self._fingers[f])] = 0.0
        self._ticks_left = 0

    def _end_motion(self) -> None:
        self._goal = None
        self._moving[:] = 0.0
        self._step[:] = 0.0
        self._velocity[:] = 0.0

    def _cancel(self, handle: GoalHandle) -> None:
        handle.end("canceled", ErrorCode.SUCCESSFUL, f"canceled at t = {self._time:.3f} s", self._time)
        if self._goal is handle:
            self._end_motion()

    def _feedback(self) -> Feedback:
        return Feedback(elapsed=self._time - self._began, desired=self._reference.copy(), actual=self._measured.copy())


def build(name: str, spec: GripperSpec, fit: Fit) -> GripperController:
    """The controller of a spec."""
    joints = [fit.robot.joint(joint) for joint in spec.joints]
    own = math.inf if spec.max_effort is None else spec.max_effort
    return GripperController(
        name=name,
        joints=spec.joints,
        gains=spec.gains,
        fingers=fingers(fit.robot, spec.joints),
        speed=spec.speed,
        max_effort=np.array([min(own, math.inf if j.limits.effort is None else j.limits.effort) for j in joints]),
        stall_velocity=_each(joints, spec.stall_velocity, turning=STALL_VELOCITY, sliding=STALL_SPEED),
        stall_time=spec.stall_time,
        goal_tolerance=_each(joints, spec.goal_tolerance, turning=GOAL_ANGLE, sliding=GOAL_DISTANCE),
        feed_forward="gravity" if spec.gravity_compensation else "none",
        compat=fit.compat,
    )


def _each(joints: Sequence[Joint], stated: float | None, *, turning: float, sliding: float) -> Array:
    """(n) what was stated, or the default of each joint's type."""
    defaults = [sliding if joint.type == "prismatic" else turning for joint in joints]
    return np.array(defaults if stated is None else [stated] * len(joints))


def check(spec: GripperSpec, robot: RobotModel) -> Iterator[Problem]:
    """Gains of joints that it does not have, and gains all zero."""
    yield from strangers(spec.joints, spec.gains, ("gains",), "gains", "CTRL102")
    yield from idle_gains(spec.joints, spec.gains, "effort")


MEMBER = ControllerMember(name="gripper", spec=GripperSpec, build=build, check=check)
