"""The goals of a plan as messages in YAML, one per goal, as `ros2 action send_goal` takes them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel
from manipcli.plan.claimed_joints import Claim, Claims
from manipcli.plan.hand import closing_speed, ramp
from manipcli.plan.motion import GoalTolerances, Grip, JointTolerance, Motion, PlanningState
from manipcli.plan.trajectory import JointTrajectory
from manipcli.report.joint_trajectory_export import duration_text, message_lines, thinned
from manipcli.report.ros2.controllers import GRIP, Exported
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.resolved import number_text, yaml_word
from manipcli.task.switches import foreseen

if TYPE_CHECKING:
    from manipcli.task.plan_task import Plan

LONGEST: Final = 131_071
"""[bytes] Longest argument of a command in Linux."""
PRECISIONS: Final = ((1e-7, 0.01), (1e-6, 0.1), (1e-5, 1.0))
"""[rad or m] Deviation in position of the points that are written, and share of the largest change of acceleration;
the first by which a message is short enough."""
ARRIVED: Final = 1e-9
"""[rad or m] Shorter motions of a hand are none."""


@dataclass(frozen=True, slots=True)
class Goal:
    """One goal: its file, the name and type of its action, and the message."""

    file: str
    action: str
    type: str
    text: str


@dataclass(frozen=True, slots=True)
class Phase:
    """What is sent together: goals, or a switch of controllers; `pause` [s] without either.

    Attributes:
        title: step and phase, for people.
        goals: of one motion.
        activate, deactivate: names of controllers.
        pause: [s].
    """

    title: str
    goals: tuple[Goal, ...] = ()
    activate: tuple[str, ...] = ()
    deactivate: tuple[str, ...] = ()
    pause: float = 0.0


def phases(plan: Plan, spec: ControllersSpec, exported: Sequence[Exported], robot: RobotModel) -> tuple[Phase, ...]:
    """All motions of a plan in order."""
    plan = plan.merged
    claims = Claims.of(spec)
    known = {own.name: own for own in exported}
    sender = _Sender(robot, spec, known)
    spans = iter(plan.spans())
    found = []
    for k, step in enumerate(plan.steps, start=1):
        for j in range(1, len(step.plan.motions) + 1):
            motion, before, _ = next(spans)
            title = f"{k}.{j} {step.verb} '{step.id}'" + (f": {motion.label}" if motion.label != step.verb else "")
            if motion.switch is not None:
                _, after = foreseen(motion.switch, claims, robot)
                on, off = ({own.name for own in each.controllers if own.active} for each in (after, claims))
                found.append(Phase(title, activate=tuple(sorted(on - off)), deactivate=tuple(sorted(off - on))))
                claims = after
                continue
            stem = f"goals/{k:02d}.{j:02d}_{_word(step.id)}_{_word(motion.label)}"
            goals = tuple(sender.goals(motion, before, claims, stem, title))
            pause = 0.0 if goals else motion.duration
            found.append(Phase(title, goals, pause=pause))
    return tuple(found)


class _Sender:
    """Makes the goals of a motion for the controllers that are active then."""

    def __init__(self, robot: RobotModel, spec: ControllersSpec, known: Mapping[str, Exported]) -> None:
        self._robot, self._spec, self._known = robot, spec, known

    def goals(self, motion: Motion, before: PlanningState, claims: Claims, stem: str, title: str) -> Iterator[Goal]:
        """The goals of a motion; the file of the hand ends in `_hand` if the arm moves, too."""
        if motion.trajectory is not None:
            controller = _serving(claims.followers, motion.trajectory.names)
            if controller is not None:
                whole = _completed(motion.trajectory, controller.joints, self._robot, before.position)
                yield self._follow(controller.name, whole, motion.tolerances, stem, title)
        grip = motion.grip
        if grip is not None:
            controller = _serving(claims.grippers, grip.joints)
            if controller is not None:
                yield self._grip(
                    controller.name, grip, before.position, stem if motion.trajectory is None else f"{stem}_hand", title
                )

    def _follow(
        self, name: str, trajectory: JointTrajectory, tolerances: GoalTolerances | None, stem: str, title: str
    ) -> Goal:
        action, kind = self._action(name)
        end = []
        if tolerances is not None:
            end += _tolerances("path_tolerance", tolerances.path) + _tolerances("goal_tolerance", tolerances.goal)
            end.append(f"goal_time_tolerance: {duration_text(tolerances.goal_time)}")
        text = ""
        for tolerance, jerk in PRECISIONS:
            points = message_lines(thinned(trajectory, tolerance=tolerance, jerk=jerk))
            lines = [f"# {title}; {name}", "trajectory:", *(f"  {line}" for line in points), *end]
            text = "\n".join(lines) + "\n"
            if len(text.encode()) <= LONGEST:
                break
        return Goal(f"{stem}.yaml", action, kind, text)

    def _grip(self, name: str, grip: Grip, q: Array, stem: str, title: str) -> Goal:
        action, kind = self._action(name)
        spec, joints = self._spec.controllers[name], self._known[name].joints
        target = grip.target[[grip.joints.index(joint) for joint in joints]]
        if kind != GRIP:
            speed = closing_speed(self._robot, joints, getattr(spec, "speed", None))
            trajectory = _closing(joints, q[self._robot.indices(joints)], target, speed)
            return self._follow(name, trajectory, None, stem, title)
        effort = _effort(self._robot, joints[0], grip.force, getattr(spec, "max_effort", None))
        command = f"{{position: {number_text(float(target[0]))}, max_effort: {number_text(effort)}}}"
        force = "" if grip.force is None else f"; the plan grips with {grip.force:g} N"
        return Goal(f"{stem}.yaml", action, kind, f"# {title}; {name}{force}\ncommand: {command}\n")

    def _action(self, name: str) -> tuple[str, str]:
        action = self._known[name].action
        assert action is not None  # followers and hands have actions
        return action


def _serving(claims: Sequence[Claim], joints: Sequence[str]) -> Claim | None:
    return next((claim for claim in claims if {*joints} <= {*claim.joints}), None)


def _completed(
    trajectory: JointTrajectory, joints: Sequence[str], robot: RobotModel, position: Array
) -> JointTrajectory:
    """The trajectory of all joints of its controller, which ROS wants: the others hold their positions."""
    others = tuple(name for name in joints if name not in trajectory.names)
    if not others:
        return trajectory
    held = np.tile(position[robot.indices(others)], (len(trajectory.times), 1))
    rest = np.zeros_like(held)

    def wider(values: Array | None, more: Array) -> Array | None:
        return None if values is None else np.hstack([values, more])

    return JointTrajectory.of_arrays(
        (*trajectory.names, *others), trajectory.times, np.hstack([trajectory.positions, held]),
        wider(trajectory.velocities, rest), wider(trajectory.accelerations, rest), orders=trajectory.orders,
    )  # fmt: skip


def _closing(joints: tuple[str, ...], here: Array, target: Array, speed: float) -> JointTrajectory:
    """Every joint at one speed towards its target; the nearest arrives first."""
    arrivals = np.unique(np.abs(target - here))
    distance = np.concatenate([[0.0], arrivals[arrivals > ARRIVED]])
    if len(distance) == 1:
        distance = np.array([0.0, speed])  # a second in which nothing moves: a trajectory has a duration
    return JointTrajectory.of_arrays(joints, distance / speed, ramp(here, target, distance), None, None)


def _effort(robot: RobotModel, joint: str, force: float | None, most: float | None) -> float:
    """[N or N m] `max_effort` of a goal: the force of a joint that slides, else the largest effort; 0: unknown."""
    limit = robot.joint(joint).limits.effort
    largest = min((value for value in (most, limit) if value is not None), default=0.0)
    if force is None or robot.joint(joint).type != "prismatic":
        return largest
    return min(force, largest) if largest else force


def _tolerances(key: str, tolerances: Sequence[JointTolerance]) -> list[str]:
    if not tolerances:
        return []
    values = ("position", "velocity", "acceleration")
    return [f"{key}:"] + [
        f"- {{name: {yaml_word(own.name)}, "
        + ", ".join(f"{word}: {number_text(float(getattr(own, word)))}" for word in values)
        + "}"
        for own in tolerances
    ]


def _word(text: str) -> str:
    """A part of a file name."""
    return re.sub(r"[^A-Za-z0-9-]+", "_", text).strip("_") or "step"
