"""The contract of preflight checks: warnings about a task and its plan, before the run.

A check of a controller uses the `loop` and `hand` of its member of the seam, never its class.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

import numpy as np

from manipcli.control.chain import target_of
from manipcli.control.control_loop import ControlLoop, HandSettings, PidLoop
from manipcli.control.controllers import CONTROLLERS
from manipcli.control.joint_space_load import Configurations, JointSpaceLoad, load_of
from manipcli.core.errors import Diagnostic, Place
from manipcli.core.geometry import Array
from manipcli.model.configuration import named_configurations, with_mimics
from manipcli.model.kinematics import Kinematics
from manipcli.plan.claimed_joints import Claims
from manipcli.spec.controllers import GainsSpec, Interface
from manipcli.task.plan_task import Plan, start_position
from manipcli.task.switches import active_in
from manipcli.task.task import Task

PER_MOTION: Final = 12
"""Number of checked configurations per planned motion."""


@dataclass(frozen=True, slots=True)
class ControlledJoint:
    """A joint that a controller commands.

    Attributes:
        controller: name of the controller.
        name: of the joint.
        interfaces: command interfaces of the controller.
        loop: control law of the joint.
        ticks: control ticks between two updates.
        place: of its gains in the file, or of the joints of the controller.
    """

    controller: str
    name: str
    interfaces: tuple[Interface, ...]
    loop: ControlLoop
    ticks: int
    place: Place

    @property
    def gains(self) -> GainsSpec | None:
        """Gains of its PID loop; None if it has another loop."""
        return self.loop.gains.get(self.name, GainsSpec()) if isinstance(self.loop, PidLoop) else None


@dataclass(frozen=True, slots=True, eq=False)
class Shift:
    """The parts of a task with the same active controllers, and the configurations of the robot in them.

    Attributes:
        joints: commanded joints, in the order of the controllers file.
        configurations: of the planned motions; without a plan, of the named poses.
        load: (joints) -> their joint-space load over the configurations, with all other joints free.
    """

    joints: tuple[ControlledJoint, ...]
    configurations: Configurations
    load: Callable[[tuple[ControlledJoint, ...]], JointSpaceLoad]

    @property
    def pid_efforts(self) -> tuple[ControlledJoint, ...]:
        """The joints with a PID loop on effort."""
        return tuple(joint for joint in self.joints if joint.interfaces == ("effort",) and joint.gains is not None)

    @property
    def servos(self) -> tuple[ControlledJoint, ...]:
        """The joints commanded by position or velocity, which the motors of the engine follow."""
        return tuple(joint for joint in self.joints if "effort" not in joint.interfaces)

    @property
    def other_efforts(self) -> tuple[ControlledJoint, ...]:
        """The joints commanded by effort without a PID loop."""
        return tuple(joint for joint in self.joints if "effort" in joint.interfaces and joint.gains is None)


@dataclass(frozen=True, slots=True)
class HandJoint:
    """A joint of a hand: its controller, the settings of the hand, and its gains (zero without a PID loop)."""

    controller: str
    settings: HandSettings
    gains: GainsSpec


@dataclass(frozen=True)
class Subject:
    """The checked task and its plan; `made` None: it could not be planned."""

    task: Task
    made: Plan | None
    _loads: dict[tuple[int, tuple[str, ...]], JointSpaceLoad] = field(default_factory=dict)

    @property
    def planned(self) -> bool:
        return self.made is not None

    @property
    def plan(self) -> Plan:
        """The plan, for checks with `needs_plan`."""
        assert self.made is not None
        return self.made

    @property
    def kind(self) -> str:
        """`planned configurations` or `named configurations`, those of its shifts."""
        return f"{'planned' if self.planned else 'named'} configurations"

    @cached_property
    def hand_joints(self) -> Mapping[str, HandJoint]:
        """The joints of all hand controllers, by name."""
        found: dict[str, HandJoint] = {}
        for name, spec in self.task.controllers.controllers.items():
            member = CONTROLLERS[spec.type]
            if member.hand is None:
                continue
            loop, settings = member.loop(spec), member.hand(spec)
            gains = loop.gains if isinstance(loop, PidLoop) else {}
            found |= {joint: HandJoint(name, settings, gains.get(joint, GainsSpec())) for joint in spec.joints}
        return found

    @cached_property
    def shifts(self) -> tuple[Shift, ...]:
        """A shift for each set of active controllers."""
        robot = self.task.robot
        in_steps = tuple(active_in(self.task.spec.steps, Claims.of(self.task.controllers), robot))
        kinematics = Kinematics(robot, gravity=self.task.scene.gravity)
        samples = None if self.made is None else _planned(self.task, self.made)
        named = Configurations.at_rest(named_configurations(robot, start_position(self.task)))
        found = []
        for number, active in enumerate(dict.fromkeys(in_steps)):
            configurations = named if samples is None else _while(samples, [there == active for there in in_steps])

            def load(
                joints: tuple[ControlledJoint, ...], number: int = number, there: Configurations = configurations
            ) -> JointSpaceLoad:
                names = tuple(joint.name for joint in joints)
                if (number, names) not in self._loads:
                    self._loads[number, names] = load_of(robot, kinematics, names, there)
                return self._loads[number, names]

            found.append(Shift(tuple(self._controlled(active)), configurations, load))
        return tuple(found)

    def _controlled(self, active: frozenset[str]) -> Iterator[ControlledJoint]:
        period = self.task.spec.simulation.control_period
        for name, spec in self.task.controllers.controllers.items():
            if name not in active or not spec.interfaces or target_of(spec):
                continue
            loop = CONTROLLERS[spec.type].loop(spec)
            for joint in spec.joints:
                key = ("gains", joint) if isinstance(loop, PidLoop) else ("joints",)
                place = self.task.controllers_file.place("controllers", name, *key)
                yield ControlledJoint(name, joint, spec.interfaces, loop, spec.ticks(period), place)


@dataclass(frozen=True, slots=True)
class Check:
    """A member of the seam.

    Attributes:
        name: that of its file.
        codes: of its findings.
        findings: (subject) -> warnings, each at its place in its file.
        needs_plan: skipped for a task that could not be planned.
        needs_physics: skipped for an engine without physics, where tracking is ideal.
        ends: with a finding of it, the checks after it have no meaning.
    """

    name: str
    codes: tuple[str, ...]
    findings: Callable[[Subject], Iterable[Diagnostic]]
    needs_plan: bool = False
    needs_physics: bool = True
    ends: bool = False


def once(findings: Iterable[tuple[str, Diagnostic]]) -> Iterator[Diagnostic]:
    """The first finding of each code, place and joint: a controller can be active in several shifts.

    Args:
        findings: (joint, finding); the joint is "" for a finding about several joints.
    """
    reported = set()
    for joint, finding in findings:
        key = (finding.code, finding.place, joint)
        if key not in reported:
            reported.add(key)
            yield finding


@dataclass(frozen=True, slots=True, eq=False)
class _Sample:
    """All joints (n) in a motion of step number `step`, from 1; 0: before the first step."""

    step: int
    position: Array
    velocity: Array
    acceleration: Array


def _planned(task: Task, plan: Plan) -> tuple[_Sample, ...]:
    """Samples of all motions; joints outside of a motion keep their position."""
    robot = task.robot
    here, still = np.array(plan.start.position), np.zeros(len(robot.joint_names))
    samples = [_Sample(0, here, still, still)]
    for step in plan.every:
        k, here = step.index + 1, np.array(step.start.position)
        for motion in step.plan.motions:
            if motion.trajectory is None:
                continue
            at = robot.indices(motion.trajectory.names)
            times = np.linspace(0.0, float(motion.trajectory.times[-1]), PER_MOTION)
            for q, v, a in zip(*motion.trajectory.sample(times), strict=True):
                position, velocity, acceleration = here.copy(), still.copy(), still.copy()
                position[at], velocity[at], acceleration[at] = q, v, a
                samples.append(_Sample(k, with_mimics(robot, position), velocity, acceleration))
            here = samples[-1].position
        here = np.array(step.plan.end.position)
        samples.append(_Sample(k, here, still, still))
    return tuple(samples)


def _while(samples: tuple[_Sample, ...], there: list[bool]) -> Configurations:
    """The samples of the steps whose entry in `there` is True; entry 0 is the time before the first step."""
    chosen = [sample for sample in samples if there[sample.step]]
    return Configurations(
        np.array([sample.position for sample in chosen]),
        np.array([sample.velocity for sample in chosen]),
        np.array([sample.acceleration for sample in chosen]),
    )
