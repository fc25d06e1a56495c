"""Execution of motions: sends controller goals and steps the session until they are done."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from typing import Final, Literal, TypeVar

import numpy as np

from manipcli.control.action import GoalHandle
from manipcli.control.roles import Follower, Hand, is_follower, is_hand
from manipcli.core.errors import InvalidArgument, SimulationFailed
from manipcli.core.geometry import Array, wrapped
from manipcli.model.state import WorldState
from manipcli.plan.motion import OPENING, Motion
from manipcli.plan.trajectory import JointTrajectory
from manipcli.simulate.compliance_switch import ComplianceSwitch
from manipcli.simulate.goals import arm_goal, gripper_goal, switch_text
from manipcli.simulate.session import SLOW, Session

Until = Callable[[WorldState], bool]
"""Whether the condition that a step waits for holds in a state."""
Alarm = Callable[[WorldState], str]
"""Maps the state of a tick to the reason for an immediate stop; empty if there is none."""

T = TypeVar("T")
Lane = Generator[None, WorldState, T]
"""An activity that is sent the state of each tick, and returns how it ended."""

UNTIL_TICKS: Final = SLOW
"""Control ticks between two evaluations of an `until`."""
ARRIVED: Final = {"revolute": 0.05, "continuous": 0.05, "prismatic": 0.005}
"""[rad or m] A joint further than this from the end of its motion has not arrived, whatever its controller says."""
MOVED: Final = 0.5
"""Nor has one that made less than this share of its displacement, if its controller has no tolerance for its end."""
NEGLIGIBLE: Final = {"revolute": 5e-3, "continuous": 5e-3, "prismatic": 5e-4}
"""[rad or m] A joint so near to the end has arrived, however short its motion."""
REST: Final = 0.5
"""[s] Time that the robot holds still after a stop."""
PATIENCE: Final = 30.0
"""[s] A motion without a deadline is aborted this long after its planned end."""


@dataclass(frozen=True, slots=True)
class MotionEnd:
    """How a motion or a wait ended.

    `awaited`: it timed out because the condition under `until` did not hold; `weak`: it is done, but a finger pressed
    with less than the requested force.
    """

    outcome: Literal["done", "failed", "timeout"]
    text: str = ""
    awaited: bool = False
    weak: bool = False


DONE: Final = MotionEnd("done")


class Alarmed(Exception):
    """An alarm was raised in the last tick; the robot still moves."""


class Executor:
    """Executes motions one after the other, and those of several executors of a session together.

    Args:
        session: what is stepped.
        touch: whether the engine has contacts; if not, a hand that closed on nothing is not a failure.
        on_goal: called with every goal: the name of the controller, and the handle.
        alarm: called after every tick; `run`, `wait` and `hold` raise `Alarmed` with its reason.
    """

    def __init__(
        self,
        session: Session,
        *,
        touch: bool = True,
        on_goal: Callable[[str, GoalHandle], None] | None = None,
        alarm: Alarm | None = None,
    ) -> None:
        self._session = session
        self._touch = touch
        self._on_goal = on_goal
        self._alarm = alarm
        self._handles: tuple[GoalHandle, ...] = ()
        self._serving: tuple[Follower | Hand, ...] = ()
        self._beside: Executor | None = None
        self._compliance = ComplianceSwitch(session)

    @property
    def beside(self) -> Executor:
        """Another executor for a motion at the same time; `stop` of this one stops it, too."""
        if self._beside is None:
            self._beside = Executor(self._session, touch=self._touch, on_goal=self._on_goal)
            self._beside._compliance = self._compliance
        return self._beside

    def run(self, motion: Motion, *, until: Until | None, deadline: float | None) -> MotionEnd:
        """See `running`."""
        (end,) = self.together(self.running(motion, until=until, deadline=deadline))
        return end

    def wait(self, until: Until, *, deadline: float) -> MotionEnd:
        """Hold still until the condition holds."""
        (end,) = self.together(self.waiting(until, deadline=deadline))
        return end

    def together(self, *lanes: Lane[T]) -> tuple[T, ...]:
        """Tick until all lanes have ended. An alarm, and a failure of the simulation, is raised in each of them."""
        ends: dict[int, T] = {}

        def advance(k: int, step: Callable[[], None]) -> None:
            try:
                step()
            except StopIteration as end:
                ends[k] = end.value

        for k, lane in enumerate(lanes):
            advance(k, partial(next, lane))
        while len(ends) < len(lanes):
            active = [(k, lane) for k, lane in enumerate(lanes) if k not in ends]
            try:
                state = self._tick()
            except (Alarmed, SimulationFailed) as stop:
                with ExitStack() as every:  # all of them, also after one that raises it again
                    for k, lane in reversed(active):
                        every.callback(advance, k, partial(lane.throw, stop))
                continue
            for k, lane in active:
                advance(k, partial(lane.send, state))
        return tuple(ends[k] for k in range(len(lanes)))

    def running(self, motion: Motion, *, until: Until | None, deadline: float | None) -> Lane[MotionEnd]:
        """Send the motion's goals and tick until all are reached and its duration has passed.

        Args:
            motion: to execute.
            until: also waited for, if the motion awaits it; a guarded motion stops when it holds.
            deadline: simulated time [s] at which the step times out; None: `PATIENCE` after the planned end.

        On a failure or a timeout all goals are canceled: the controllers bring the joints to rest.

        Raises:
            InvalidArgument: no controller takes a goal of the motion.
        """
        session = self._session
        latest = session.time + motion.duration + PATIENCE if deadline is None else deadline
        text = ""
        trajectory = self._compliance.before(motion)
        if motion.switch is not None:
            switched = session.manager.carry_out(motion.switch, time=session.time)
            text = switch_text(switched)
            if not switched.ok:
                return MotionEnd("failed", text)
        start = session.state.position.copy()
        try:
            handles = self._send(motion, trajectory)
        except InvalidArgument:  # no active controller, after a switch
            self._cancel()
            raise
        last_tick = session.ticks + self._ticks(motion.duration)
        awaited = until if motion.awaits else None
        presses = self._compliance.ends_held(motion)
        while True:
            state = yield
            for handle in handles:
                if handle.result is not None and handle.result.status != "succeeded":
                    self._cancel()
                    return MotionEnd("failed", handle.result.text)
            if session.manager.faults:
                self._cancel()
                return _fault(session)
            busy = session.ticks < last_tick or any(handle.active for handle in handles)
            if presses:
                if wrong := self._compliance.failure:
                    self._cancel()
                    return MotionEnd("failed", wrong)
                busy = self._compliance.presses_yet
            if self._compliance.passed(motion) or (presses and not busy and trajectory is not None):
                felt, wrong = self._compliance.result(motion)
                yield from self.come_to_rest()
                if session.manager.faults:
                    return _fault(session)
                return MotionEnd("failed", wrong) if wrong else replace(DONE, text=felt)
            over = session.time >= latest
            looks = over or session.ticks % UNTIL_TICKS == 0
            holds = awaited is not None and looks and (motion.guarded or not busy) and awaited(state)
            if holds and busy:
                left = max(0, last_tick - session.ticks) * session.period
                hold = self._compliance.holding(motion)
                yield from self.come_to_rest()
                if session.manager.faults:
                    return _fault(session)
                when = f"{left:.2f} s before its end" if left else "after its planned end"
                return replace(DONE, text=f"stopped {when}: `until` held{hold()}")
            if not busy and (awaited is None or holds):
                far = self._far(motion, start, state)
                felt, wrong = self._compliance.result(motion)
                if far or wrong:
                    return MotionEnd("failed", far or wrong)
                if felt:
                    return replace(DONE, text=felt)
                return replace(DONE, text=text) if text else _held(motion, handles, self._touch)
            if over and deadline is not None:
                late = "this motion ended" if busy else "the condition under `until` held"
                late = f"limit reached at t = {session.time:.3f} s, before {late}"
                if busy and session.ticks >= last_tick:  # it should be over by now
                    late += f"; {self._furthest()}"
                self._cancel()
                return MotionEnd("timeout", late, awaited=not busy)
            if over:
                late = f"the motion has not ended {PATIENCE:g} s after its planned end; {self._furthest()}"
                self._cancel()
                return MotionEnd("timeout", late)

    def waiting(self, until: Until, *, deadline: float) -> Lane[MotionEnd]:
        """Hold still until the condition holds."""
        while self._session.time < deadline:
            state = yield
            if self._session.manager.faults:
                return _fault(self._session)
            looks = self._session.ticks % UNTIL_TICKS == 0 or self._session.time >= deadline
            if looks and until(state):
                return DONE
        return MotionEnd("timeout", f"`until` did not hold by t = {self._session.time:.3f} s", awaited=True)

    def hold(self, duration: float) -> None:
        """Command nothing new for `duration` [s]."""
        for _ in range(self._ticks(duration)):
            self._tick()

    def stop(self) -> None:
        """Cancel goals, let the joints stop within their limits, and hold still until they rest; alarms are ignored.

        A force with which the arm presses is given up.
        """
        self._cancel()
        self._compliance.relax()
        if self._beside is not None:
            self._beside._cancel()
        for _ in range(self._ticks(REST)):
            self._session.tick()
        while self._moving and not self._session.manager.faults:  # a stop with a low limit takes longer
            self._session.tick()

    def come_to_rest(self) -> Lane[None]:
        """Cancel active goals, and tick until all references rest, or a controller fails."""
        self._cancel()
        yield
        faults = self._session.manager.faults
        while not faults and self._moving:
            yield
            faults = self._session.manager.faults

    @property
    def _moving(self) -> bool:
        """Whether a reference of the last motion moves."""
        serving = self._serving if self._beside is None else (*self._serving, *self._beside._serving)
        return any(controller.output.velocity.any() for controller in serving)

    def _ticks(self, duration: float) -> int:
        """The number of ticks in `duration` [s]."""
        return math.ceil(duration / self._session.period - 1e-6)

    def _tick(self) -> WorldState:
        """
        Raises:
            Alarmed: the alarm has a reason to stop.
        """
        state = self._session.tick()
        wrong = "" if self._alarm is None else self._alarm(state)
        if wrong:
            raise Alarmed(wrong)
        return state

    def _send(self, motion: Motion, trajectory: JointTrajectory | None) -> tuple[GoalHandle, ...]:
        manager = self._session.manager
        self._handles, self._serving = (), ()
        if trajectory is not None:
            follower = manager.serving(trajectory.names)
            if not is_follower(follower):
                raise InvalidArgument("CTRL152", f"controller '{follower.name}' does not follow trajectories")
            whole = self._completed(trajectory, follower)
            own = motion.tolerances
            self._accept(follower.name, follower.send_goal(whole if own is None else arm_goal(whole, own)))
            self._serving += (follower,)
        if motion.grip is not None:
            gripper = manager.serving(motion.grip.joints)
            if not is_hand(gripper):
                raise InvalidArgument("CTRL151", f"controller '{gripper.name}' is not a gripper")
            self._accept(gripper.name, gripper.send_goal(gripper_goal(gripper, motion.grip)))
            self._serving += (gripper,)
        return self._handles

    def _accept(self, controller: str, handle: GoalHandle) -> None:
        self._handles = (*self._handles, handle)
        if self._on_goal is not None:
            self._on_goal(controller, handle)

    def _completed(self, trajectory: JointTrajectory, follower: Follower) -> JointTrajectory:
        """The trajectory with the other joints of its controller, which keep their present references."""
        others = tuple(name for name in follower.joints if name not in trajectory.names)
        if not others:
            return trajectory
        manager = self._session.manager
        if manager.started:
            wanted = dict(zip(follower.joints, follower.output.position, strict=True))
        else:  # nothing has been commanded yet
            wanted = dict(zip(self._session.robot.joint_names, self._session.engine.read().position, strict=True))
        stay = np.tile([wanted[name] for name in others], (len(trajectory.times), 1))

        def widened(values: Array | None, more: Array) -> Array | None:
            return None if values is None else np.hstack([values, more])

        rest = np.zeros_like(stay)
        return JointTrajectory.of_arrays(
            (*trajectory.names, *others), trajectory.times, np.hstack([trajectory.positions, stay]),
            widened(trajectory.velocities, rest), widened(trajectory.accelerations, rest),
        )  # fmt: skip

    def _far(self, motion: Motion, start: Array, state: WorldState) -> str:
        """Which joint did not arrive, although its controller has no goal tolerance that says so; "" if all did.

        `start`: (n) measured when the motion began. A robot that may touch something in this motion may press on it.
        """
        trajectory, robot = motion.trajectory, self._session.robot
        if trajectory is None or motion.guarded or motion.allowed or motion.compliance is not None:
            return ""
        columns = robot.indices(trajectory.names)
        joints = [robot.joint(name) for name in trajectory.names]
        turning = np.array([joint.type == "continuous" for joint in joints])

        def difference(a: Array, b: Array) -> Array:
            return np.where(turning, wrapped(a - b), a - b)

        end = trajectory.positions[-1]
        missed = np.abs(difference(end, state.position[columns]))
        bound = np.array([ARRIVED[joint.type] for joint in joints])
        k = int(np.argmax(missed / bound))
        text = f"joint '{joints[k].name}' is {missed[k]:.3g} {joints[k].unit} from the end of this motion"
        if missed[k] > bound[k]:
            return f"{text}, limit {bound[k]:g} {joints[k].unit}; its controller has no closer goal tolerance"
        bounded = frozenset[str]().union(*(handle.bounded for handle in self._handles))
        first = trajectory.positions[0] if trajectory.times[0] == 0.0 else start[columns]
        planned, made = difference(end, first), difference(state.position[columns], start[columns])
        for joint, far, asked, moved in zip(joints, missed, planned, made, strict=True):
            short = moved * np.sign(asked) < MOVED * abs(asked)
            if short and far > NEGLIGIBLE[joint.type] and joint.name not in bounded:
                moved_text = f"joint '{joint.name}' moved {moved * np.sign(asked):.3g} of {abs(asked):.3g} {joint.unit}"
                return f"{moved_text} of this motion; its controller has no goal tolerance"
        return ""

    def _furthest(self) -> str:
        """Text on the joint with an active goal that is furthest from its reference."""
        active = [
            (abs(error), name)
            for controller, handle in zip(self._serving, self._handles, strict=True)
            if handle.active
            for name, error in zip(controller.joints, handle.feedback().error.tolist(), strict=True)
        ]
        if not active:
            return self._compliance.felt
        far, name = max(active)
        unit = self._session.robot.joint(name).unit
        return f"joint '{name}' is {far:.3g} {unit} from its reference, the largest error"

    def _cancel(self) -> None:
        for handle in self._handles:
            handle.cancel()


def _fault(session: Session) -> MotionEnd:
    """A controller failed, even if no step uses it: the robot is no longer the one that the task was planned for."""
    return MotionEnd("failed", session.manager.faults[-1].message)


def _held(motion: Motion, handles: tuple[GoalHandle, ...], touch: bool) -> MotionEnd:
    """Done, unless the hand must hold something and no finger met anything, or must open and a finger was stopped."""
    text = "; ".join(handle.result.text for handle in handles if handle.result is not None and handle.result.fingers)
    weak = False
    if motion.grip is not None:
        stops = [stop for handle in handles if handle.result is not None for stop in handle.result.fingers]
        if motion.grip.must_hold and touch and "contact" not in stops and "stalled" not in stops:
            return MotionEnd("failed", f"the hand closed on nothing: {text}")
        if motion.grip.must_arrive and "stalled" in stops:
            what = "open" if motion.label == OPENING else "reach its target"
            return MotionEnd("failed", f"the hand did not {what}: {text}")
        weak = motion.grip.force is not None and "stalled" in stops
    return MotionEnd("done", text, weak=weak)
