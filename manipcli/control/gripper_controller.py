"""Controller of a hand; see `controllers/gripper.py` for its control law and its file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt

from manipcli.control.action import ErrorCode, Feedback, FingerStop, GoalHandle, GripperGoal, refuse_inactive
from manipcli.control.controller import ControllerOutput, FeedForward, JointState, distinct, refuse_not_finite
from manipcli.control.gains import build_pid, joint_gains, tune_pid
from manipcli.control.grip_reflex import GripReflex
from manipcli.control.tracking_error import TrackingError
from manipcli.control.tunable_gains import TunableGains
from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array
from manipcli.description.elements import JointType
from manipcli.description.transmission import Compat
from manipcli.spec.controllers import GainsSpec, Interface, Role

REACHED = 1e-9
"""rad or m: a reference this close to its target has arrived."""

_Watched = tuple[int, float, float, float]
"""A joint, the lower and upper bound of its target range, and its stall velocity."""

UNTIL_CHANGED = 1 << 62
"""[ticks] More than any run has."""


class GripperController:
    """Executes one goal at a time, and holds in between.

    A goal ends when every finger has stopped, see `GoalResult.fingers`; it is aborted if a finger stalls that must not.

    A finger has *contact* when the sum of its joints' contact forces meets the goal's force, after a low pass of the
    time constant `contact_time`, so that the impact of the first touch does not count as a grip. It is *stalled* when,
    for `stall_time`, none of its joints outside `goal_tolerance` moved faster than `stall_velocity`, although their
    effort cannot grow: each reference is at its target, or each effort at its maximum. It has *reached* when all its
    joints are within `goal_tolerance` and their references at the targets.

    While it holds what a finger has contact with, the reflex of its goal may add to the efforts.

    A reference that is beyond its joint, seen from the target (it pressed on the object to release), begins at the
    joint.

    Args:
        name: of the controller.
        joints: (n) distinct names.
        interface: effort, or position, which needs no gains and has no maximum effort.
        gains: by joint name.
        types: (n) joint types, for texts; None: revolute.
        fingers: default joint indices of each finger; empty: each joint is a finger.
        speed: [rad/s or m/s] of the references.
        max_effort: (n) or a number, N m or N; None: unlimited.
        stall_velocity, goal_tolerance: see above; (n) or a number, rad/s or m/s and rad or m.
        stall_time: see above [s].
        allow_stalling: whether a goal with stalled fingers succeeds; otherwise it is aborted.
        contact_time: [s] time constant of the low pass on contact forces; 0: no filter.
        feed_forward: added to the effort by the manager.
        compat: order of the PID integration.

    Attributes:
        gains: of its PID, which may change; None without one.
        reflex: does nothing without pads.

    Raises:
        InvalidArgument: duplicate joints, gains of an unknown joint or all zero, fingers that are not a partition of
            the joints, a maximum effort on the position interface.
    """

    role: Role = "hand"
    sensors = ()

    def __init__(
        self,
        *,
        name: str,
        joints: Sequence[str],
        gains: Mapping[str, GainsSpec] | None = None,
        interface: Literal["position", "effort"] = "effort",
        types: Sequence[JointType] | None = None,
        fingers: tuple[tuple[int, ...], ...] = (),
        speed: float = 1.0,
        max_effort: npt.ArrayLike | None = None,
        stall_velocity: npt.ArrayLike = 0.02,
        stall_time: float = 0.2,
        goal_tolerance: npt.ArrayLike = 0.05,
        allow_stalling: bool = True,
        contact_time: float = 0.02,
        feed_forward: FeedForward = "none",
        compat: Compat | None = None,
    ) -> None:
        self.name = name
        self.joints = distinct(name, joints)
        self.accepts_goals = True
        self._units = ["m" if kind == "prismatic" else "rad" for kind in types or ["revolute"] * len(self.joints)]
        self.interfaces: tuple[Interface, ...] = (interface,)
        self.feed_forward: FeedForward = feed_forward
        n = len(self.joints)
        chosen = joint_gains(name, self.joints, gains or {})
        self._pid = None if interface == "position" else build_pid(name, self.joints, chosen, compat)
        self.gains = None if interface == "position" else TunableGains(name, self.joints, chosen, self._tune)
        self._default_fingers = self._parted(fingers)
        self._speed = speed
        self._default_effort = self._efforts(np.inf if max_effort is None else max_effort)
        self._stall_velocity: list[float] = np.broadcast_to(stall_velocity, (n,)).tolist()
        self._goal_tolerance: list[float] = np.broadcast_to(goal_tolerance, (n,)).tolist()
        self._stall_time, self._contact_time = stall_time, contact_time
        self._allow_stalling = allow_stalling

        self.output = output = ControllerOutput.of(n, 1)
        self._reference, self._velocity, self._command = output.position, output.velocity, output.command
        self._effort = self._default_effort.copy()
        self._tracking = TrackingError(output.rows[:2])
        self._control = None
        self.reflex = GripReflex(n)
        if self._pid is not None:
            extra = self.reflex.extra
            self._control = self._pid.loop(self._tracking.errors, self._command, feed=extra, effort=self._effort)
        self._step = np.zeros(n)
        self._measured: Array = np.zeros(n)
        self._activated = False
        self._time = self._began = 0.0
        self._goal: GoalHandle | None = None
        self._starts = False
        self._target = np.zeros(n)
        self._fingers = self._default_fingers
        self._force: float | None = None
        self._stops: list[FingerStop | None] = []
        self._going: list[tuple[int, tuple[_Watched, ...]]] = []
        self._moved: list[float] = []
        self._felt: list[float] = []
        self._texts: list[str] = []
        self._moving = np.zeros(n)
        self._ticks_left = 0
        self._period = math.nan

    def _efforts(self, effort: npt.ArrayLike) -> Array:
        """(n) efforts from one number, or from one per joint."""
        n = len(self.joints)
        given = np.array(effort, dtype=np.float64)
        if given.shape not in ((), (n,)) or not (given > 0.0).all():
            message = f"max_effort is {given.tolist()}; expected values above 0, one number or {n}"
            raise InvalidArgument("CTRL133", message)
        if self._pid is None and np.isfinite(given).any():
            message = f"controller '{self.name}' commands positions, which have no maximum effort"
            raise InvalidArgument(
                "CTRL133", message, hint="limit the effort of its joints, or use the effort interface"
            )
        return np.broadcast_to(given, (n,)).copy()

    def _parted(self, fingers: tuple[tuple[int, ...], ...]) -> tuple[tuple[int, ...], ...]:
        n = len(self.joints)
        if not fingers:
            return tuple((j,) for j in range(n))
        if sorted(j for finger in fingers for j in finger) != list(range(n)) or not all(fingers):
            raise InvalidArgument(
                "CTRL130", f"controller '{self.name}': fingers {fingers} are not a partition of the joints 0 to {n - 1}"
            )
        return fingers

    def send_goal(self, goal: GripperGoal) -> GoalHandle:
        """Accept a goal, which begins at the next update; the previous goal is aborted.

        Raises:
            InvalidArgument: the controller is inactive, a target of another length or not finite, fingers that are
                not a partition of the joints, a force or an effort that is not positive.
        """
        refuse_inactive(self.name, self.accepts_goals)
        n = len(self.joints)
        target = np.array(goal.target, dtype=np.float64)
        if target.shape == ():
            target = np.full(n, float(target))
        if target.shape != (n,) or not np.isfinite(target).all():
            raise InvalidArgument("CTRL131", f"target is {target.tolist()}; expected {n} finite numbers, one per joint")
        if goal.force is not None and not goal.force > 0.0:
            raise InvalidArgument("CTRL132", f"force is {goal.force} N; expected more than 0, or None")
        fingers = self._parted(goal.fingers) if goal.fingers else self._default_fingers
        effort = self._default_effort if goal.max_effort is None else self._efforts(goal.max_effort)
        if self._goal is not None:
            self._goal.end("aborted", ErrorCode.INVALID_GOAL, "preempted by a new goal", self._time)
        self._effort[:] = effort
        self._target, self._force, self._fingers = target, goal.force, fingers
        self._stops = [None] * len(fingers)
        self._texts = [""] * len(fingers)
        self._felt = [0.0] * len(fingers)
        self._moving = np.ones(n)
        self._ticks_left = 0
        self._starts = True
        self.reflex.begin(goal.reflex, goal.force)
        self._watch()
        self._goal = GoalHandle(cancel=self._cancel, feedback=self._feedback)
        return self._goal

    def halt(self, time: float, reason: str) -> None:
        """Abort its goal for this reason; the references stay where they are, and the fingers go on pressing."""
        if self._goal is not None:
            self._goal.end("aborted", ErrorCode.INVALID_GOAL, reason, time)
            self._end_motion()

    @property
    def senses_contact(self) -> bool:
        """True while a goal stops fingers by force."""
        return self._goal is not None and self._force is not None

    def deactivate(self, time: float, reason: str = "the controller was deactivated") -> None:
        """Abort its goal and reset its state; the next update re-activates it."""
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
            contact_force: (n) [N], see `Controller.update`; None: contacts are not sensed.
        """
        self._time = time
        self._measured = measured.position
        if not self._activated:
            self._activate(measured)
        if self._goal is not None:
            if self._starts:
                self._starts = False
                self._began = time
                self._moved = [time] * len(self._fingers)
                self._unwind(measured.position)
                self._freeze()
            self._judge(time, period, measured, contact_force)
            if self._goal is not None:
                self._ramp(period)
        if self._control is None:
            self._command[:] = self._reference
            return self.output
        if not self._tracking.update(measured, math.inf):
            refuse_not_finite(self.name, self.joints, measured, time)
        holds = self._goal is None and "contact" in self._stops
        presses = holds and self.reflex.update(period, measured.position, self._command, self._effort)
        self._control(period, presses)
        return self.output

    def _activate(self, measured: JointState) -> None:
        self._activated = True
        if self._pid is not None:
            self._pid.reset()
            self._pid.freeze(False)
        self._reference[:] = measured.position
        self._velocity[:] = 0.0
        if self._goal is None:
            self._effort[:] = self._default_effort
            self._stops = []

    def _unwind(self, position: Array) -> None:
        """Reset references that push away from their targets to the joint positions."""
        wrong = (self._target - position) * (self._reference - position) < 0.0
        self._reference[wrong] = position[wrong]

    def _tune(self, gains: tuple[GainsSpec, ...]) -> None:
        tune_pid(self._pid, self.name, self.joints, gains)
        if self._stops:
            self._freeze()

    def _freeze(self) -> None:
        """Freeze the integrals of fingers that have reached the requested force."""
        if self._pid is not None:
            presses = np.zeros(len(self.joints), dtype=np.bool_)
            for finger, stop in zip(self._fingers, self._stops, strict=True):
                presses[list(finger)] = stop == "contact"
            self._pid.freeze(presses)

    def _ramp(self, period: float) -> None:
        """Moves the references of the fingers that have not stopped towards their targets."""
        if self._ticks_left <= 0 or period != self._period:
            self._plan_ramp(period)
        self._ticks_left -= 1
        np.add(self._reference, self._step, self._reference)

    def _plan_ramp(self, period: float) -> None:
        """The step of every joint's reference, and the number of ticks for which it is constant."""
        step, limit = self._step, self._speed * period
        remaining = (self._target - self._reference) * self._moving
        np.minimum(np.maximum(remaining, -limit), limit, out=step)
        np.divide(step, period, out=self._velocity)
        self._period = period
        moves = step != 0.0
        ticks = np.floor(remaining[moves] / step[moves])
        self._ticks_left = int(ticks.min()) if ticks.size else UNTIL_CHANGED

    def _judge(self, time: float, period: float, measured: JointState, contact_force: Array | None) -> None:
        """Stop the fingers that met something or arrived; end the goal when all have."""
        position: list[float] = measured.position.tolist()
        velocity: list[float] = measured.velocity.tolist()
        wanted = self._force
        force = contact_force.tolist() if contact_force is not None and wanted is not None else None
        moved = self._moved
        for f, watched in self._going:
            if force is not None and wanted is not None:
                pressed = 0.0
                for j, _, _, _ in watched:
                    pressed += force[j]
                share = period / (period + self._contact_time)
                felt = self._felt[f] = self._felt[f] + share * (pressed - self._felt[f])
                if felt >= wanted:
                    self._stop(f, "contact", f"contact at {felt:.3g} N (requested {wanted:.3g} N)")
                    continue
            far = still = False
            for j, lower, upper, slow in watched:
                if not lower <= position[j] <= upper:
                    far = True
                    still = -slow <= velocity[j] <= slow
                    if not still:
                        break
            if not far:
                if all(abs(self._target[j] - self._reference[j]) <= REACHED for j in self._fingers[f]):
                    self._stop(f, "reached", "reached its target")
            elif not still or self._gains_effort(f):
                moved[f] = time
            elif time - moved[f] >= self._stall_time:
                away = [abs(float(self._target[j]) - position[j]) for j in self._fingers[f]]
                k = away.index(max(away))
                j = self._fingers[f][k]
                text = f"stalled {away[k]:.3g} {self._units[j]} before the target of '{self.joints[j]}'"
                if force is not None:
                    text += f", with {self._felt[f]:.3g} N of the requested {wanted:.3g} N"
                self._stop(f, "stalled", text)
        if self._goal is not None and None not in self._stops:
            self._end_goal(self._goal, time)

    def _end_goal(self, goal: GoalHandle, time: float) -> None:
        stops = tuple(stop for stop in self._stops if stop is not None)
        names = (self.joints[finger[0]] for finger in self._fingers)
        text = "; ".join(f"finger of '{name}': {why}" for name, why in zip(names, self._texts, strict=True))
        text = f"{text}; at t = {time:.3f} s"
        if "stalled" in stops and not self._allow_stalling:
            text = f"controller '{self.name}': {text}; stalling is not allowed"
            goal.end("aborted", ErrorCode.GOAL_TOLERANCE_VIOLATED, text, time, stops)
        else:
            goal.end("succeeded", ErrorCode.SUCCESSFUL, text, time, stops)
        self._end_motion()

    def _gains_effort(self, f: int) -> bool:
        """Whether a finger's effort still grows: a reference is moving, and its effort is below the maximum.

        On the position interface the effort is unknown: a moving reference is enough.
        """
        for j in self._fingers[f]:
            remaining = self._target[j] - self._reference[j]
            if abs(remaining) <= REACHED:
                continue
            if self._pid is None or math.copysign(1.0, remaining) * self._command[j] < self._effort[j]:
                return True
        return False

    def _watch(self) -> None:
        """List the fingers to check at every tick: those that have not stopped."""
        target, tolerance, slow = self._target.tolist(), self._goal_tolerance, self._stall_velocity
        self._going = [
            (f, tuple((j, target[j] - tolerance[j], target[j] + tolerance[j], slow[j]) for j in finger))
            for f, finger in enumerate(self._fingers)
            if self._stops[f] is None
        ]

    def _stop(self, f: int, why: FingerStop, text: str) -> None:
        self._stops[f], self._texts[f] = why, text
        self._moving[list(self._fingers[f])] = 0.0
        self._freeze()
        self._ticks_left = 0
        self._watch()

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
        return Feedback(
            elapsed=self._time - self._began, desired=self._reference.copy(), actual=np.array(self._measured)
        )
