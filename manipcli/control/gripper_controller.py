"""The hand's controller; see `controllers/gripper.py` for its laws and its file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt

from manipcli.control.action import ErrorCode, Feedback, FingerStop, GoalHandle, GripperGoal
from manipcli.control.controller import ControllerOutput, FeedForward, JointState, distinct, refuse_not_finite
from manipcli.control.gains import build_pid, joint_gains
from manipcli.core.errors import InvalidArgument
from manipcli.core.geometry import Array
from manipcli.description.elements import JointType
from manipcli.description.transmission import Compat
from manipcli.spec.controllers import GainsSpec, Interface, Role

REACHED = 1e-9
"""rad or m: a reference this close to its target has arrived."""

_Watched = tuple[int, float, float, float]
"""A joint, from where to where it counts as arrived, and how slow it counts as stalled."""

UNTIL_CHANGED = 1 << 62
"""Ticks: more than any run has."""


class GripperController:
    """One goal at a time; holds in between. It ends when every finger has stopped, see `GoalResult.fingers`; it is
    aborted where one has stalled that must not.

    A finger has *contact* when the sum of its joints' contact forces meets the goal's force, after a low pass of the
    time constant `contact_time`, so that the knock of the first touch does not count as a grip; it is *stalled* when
    none of its joints that are further than `goal_tolerance` from their targets moved faster than `stall_velocity`
    for `stall_time` although none will be pushed harder: each one's reference is at its target, or its effort at its
    maximum; it has *reached* when all its joints are within `goal_tolerance` and their references are there.

    A reference that stands beyond its joint, seen from the target, as one does that pressed on what the hand lets go,
    begins where the joint is.

    Args:
        name: of the controller.
        joints: (n) distinct names.
        interface: effort, or position, which needs no gains and knows no maximum effort.
        gains: by joint name.
        types: (n) joint types, for texts; None: they turn.
        fingers: joint indices of each finger, where a goal does not say; empty: each joint is a finger.
        speed: [rad/s or m/s] of the references.
        max_effort: (n) or a number, N m or N; None: unlimited here.
        stall_velocity, goal_tolerance: see above; (n) or a number, rad/s or m/s and rad or m.
        stall_time: see above [s].
        allow_stalling: whether a goal succeeds whose fingers stalled; else it is aborted.
        contact_time: [s] of the low pass on contact forces; 0 takes them as they are.
        feed_forward: what the manager shall add to the effort.
        compat: order of the PID integration.

    Raises:
        InvalidArgument: joints repeated, gains of an unknown joint or all zero, fingers that do not part the joints, a
            maximum effort of positions.
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
        self._units = ["m" if kind == "prismatic" else "rad" for kind in types or ["revolute"] * len(self.joints)]
        self.interfaces: tuple[Interface, ...] = (interface,)
        self.feed_forward: FeedForward = feed_forward
        n = len(self.joints)
        chosen = joint_gains(name, self.joints, gains or {})
        self._pid = None if interface == "position" else build_pid(name, self.joints, chosen, compat)
        self._default_fingers = self._parted(fingers)
        self._speed = speed
        self._default_effort = self._efforts(np.inf if max_effort is None else max_effort)
        self._stall_velocity: list[float] = np.broadcast_to(stall_velocity, (n,)).tolist()
        self._goal_tolerance: list[float] = np.broadcast_to(goal_tolerance, (n,)).tolist()
        self._stall_time, self._contact_time = stall_time, contact_time
        self._allow_stalling = allow_stalling

        self.output = output = ControllerOutput.of(n, 1)
        self._reference, self._velocity, self._command = output.position, output.velocity, output.command
        self._errors = np.zeros((2, n))
        self._error, self._error_rate = self._errors
        self._all_errors = self._errors.reshape(-1)
        self._step = np.zeros(n)
        self._measured: Array = np.zeros(n)
        self._activated = False
        self._time = self._began = 0.0
        self._goal: GoalHandle | None = None
        self._starts = False
        self._set_effort(self._default_effort)
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
        """(n) of a number or of one for each joint."""
        n = len(self.joints)
        given = np.array(effort, dtype=np.float64)
        if given.shape not in ((), (n,)) or not (given > 0.0).all():
            raise InvalidArgument("CTRL133", f"max_effort {given.tolist()}: expected more than 0, one number or {n}")
        if self._pid is None and np.isfinite(given).any():
            message = f"controller '{self.name}' commands positions, which know no maximum effort"
            raise InvalidArgument("CTRL133", message, hint="give its joints effort limits, or use the effort interface")
        return np.broadcast_to(given, (n,)).copy()

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
        if target.shape == ():
            target = np.full(n, float(target))
        if target.shape != (n,) or not np.isfinite(target).all():
            raise InvalidArgument("CTRL131", f"target {target.tolist()}: expected {n} finite numbers, one a joint")
        if goal.force is not None and not goal.force > 0.0:
            raise InvalidArgument("CTRL132", f"force is {goal.force} N; expected more than 0, or None")
        fingers = self._parted(goal.fingers) if goal.fingers else self._default_fingers
        effort = self._default_effort if goal.max_effort is None else self._efforts(goal.max_effort)
        if self._goal is not None:
            self._goal.end("aborted", ErrorCode.INVALID_GOAL, "preempted by a new goal", self._time)
        self._set_effort(effort)
        self._target, self._force, self._fingers = target, goal.force, fingers
        self._stops = [None] * len(fingers)
        self._texts = [""] * len(fingers)
        self._felt = [0.0] * len(fingers)
        self._moving = np.ones(n)
        self._ticks_left = 0
        self._starts = True
        self._watch()
        self._goal = GoalHandle(cancel=self._cancel, feedback=self._feedback)
        return self._goal

    @property
    def senses_contact(self) -> bool:
        """While a goal stops fingers by force."""
        return self._goal is not None and self._force is not None

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
            contact_force: (n) [N], see `Controller.update`; None: contact is not sensed.
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
        if self._pid is None:
            self._command[:] = self._reference
            return self.output
        np.subtract(self._reference, measured.position, self._error)
        np.subtract(self._velocity, measured.velocity, self._error_rate)
        if not math.hypot(*self._all_errors.tolist()) < math.inf:
            refuse_not_finite(self.name, self.joints, measured, time)
        command = self._command
        self._pid.apply(self._errors, period, command)
        np.maximum(command, self._minus_effort, out=command)
        np.minimum(command, self._effort, out=command)
        return self.output

    def _activate(self, measured: JointState) -> None:
        self._activated = True
        if self._pid is not None:
            self._pid.reset()
            self._pid.freeze(False)
        self._reference[:] = measured.position
        self._velocity[:] = 0.0
        self._set_effort(self._effort if self._goal is not None else self._default_effort)

    def _unwind(self, position: Array) -> None:
        """Takes back references that push away from their targets."""
        wrong = (self._target - position) * (self._reference - position) < 0.0
        self._reference[wrong] = position[wrong]

    def _freeze(self) -> None:
        """Fingers that press as hard as asked press no harder: their integrals stay."""
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
        moved = self._moved
        for f, watched in self._going:
            if force is not None and wanted is not None:
                pressed = 0.0
                for j, _, _, _ in watched:
                    pressed += force[j]
                share = period / (period + self._contact_time)
                felt = self._felt[f] = self._felt[f] + share * (pressed - self._felt[f])
                if felt >= wanted:
                    self._stop(f, "contact", f"contact at {felt:.3g} N (asked {wanted:.3g} N)")
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
            elif not still or self._winds_up(f):
                moved[f] = time
            elif time - moved[f] >= self._stall_time:
                away = [abs(float(self._target[j]) - position[j]) for j in self._fingers[f]]
                k = away.index(max(away))
                j = self._fingers[f][k]
                text = f"stalled {away[k]:.3g} {self._units[j]} before the target of '{self.joints[j]}'"
                if force is not None:
                    text += f", where it felt {self._felt[f]:.3g} N of the {wanted:.3g} N asked"
                self._stop(f, "stalled", text)
        if self._goal is not None and None not in self._stops:
            self._end_goal(self._goal, time)

    def _end_goal(self, goal: GoalHandle, time: float) -> None:
        """With what stopped each finger."""
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

    def _winds_up(self, f: int) -> bool:
        """Whether a finger will be pushed harder: a reference is on its way, and its effort not at its maximum.

        Where positions are commanded nobody here knows the effort: a reference on its way is enough.
        """
        for j in self._fingers[f]:
            way = self._target[j] - self._reference[j]
            if abs(way) <= REACHED:
                continue
            if self._pid is None or math.copysign(1.0, way) * self._command[j] < self._effort[j]:
                return True
        return False

    def _watch(self) -> None:
        """What is looked at every tick: the fingers that have not stopped."""
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
