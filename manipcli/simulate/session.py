"""Simulation session: steps engine, sensors, controllers and actuators, one control tick at a time.

Order: read engine -> sensors -> controllers -> joint limits -> actuators -> write -> observe -> physics. The recorder
and the progress line are observers; the loop does nothing else.

No call in a tick releases the interpreter lock, as `np.dot`, `take` and `norm` do for vectors of any size: that wakes
the recorder's thread and costs more than ten microseconds. `np.vdot`, `np.matmul` and indexing keep the lock.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from manipcli.control.actuation import Actuation
from manipcli.control.command import JointCommand
from manipcli.control.controller import ControllerOutput
from manipcli.control.grip_reflex import Pad
from manipcli.control.limiter import JointLimiter, NotFinite
from manipcli.control.manager import ControllerManager, JointVectors
from manipcli.control.roles import has_reflex, is_hand, reads_sensors
from manipcli.control.saturation import EFFORT, MotorLimits
from manipcli.core.errors import SimulationFailed
from manipcli.core.geometry import Array
from manipcli.model.grasp import LINK
from manipcli.model.robot import RobotModel
from manipcli.model.state import Contact, WorldState
from manipcli.scene.scene import Scene
from manipcli.simulate.engine import Engine
from manipcli.simulate.hand_pads import hand_pads
from manipcli.simulate.holder import Holder
from manipcli.simulate.sensor_bank import NO_SENSORS, SensorBank
from manipcli.spec.sensors import SensorSpec

SLOW: Final = 10
"""Control ticks between two updates of slow quantities: body velocities (at the last tick before a multiple of it), all
contacts, and the plausibility of the state."""
RUNAWAY_FACTOR: Final = 3.0
"""A joint that exceeds its velocity limit by this factor is unstable."""
RUNAWAY_SPEED: Final = 90.0
"""[rad/s or m/s] The same for a joint without a limit; Bullet clamps joints at 100."""
BODY_SPEED: Final = 50.0
"""[m/s] A faster body means that the simulation diverged."""
FALLEN: Final = -10.0
"""[m] A body below this height has fallen out of the scene."""


class Observer(Protocol):
    """Observes every tick before the physics step. The arrays are only valid during the call."""

    def tick(self, tick: int, state: WorldState, outputs: Sequence[ControllerOutput | None]) -> None:
        """The state at the start of control tick `tick`, and the output of each loaded controller; None: not active."""
        ...

    def contacts(self, tick: int, contacts: tuple[Contact, ...]) -> None:
        """All contacts at control tick `tick`."""
        ...


@dataclass(frozen=True, slots=True)
class Silent:
    """Observes nothing, before the start of the recording."""

    def tick(self, tick: int, state: WorldState, outputs: Sequence[ControllerOutput | None]) -> None: ...

    def contacts(self, tick: int, contacts: tuple[Contact, ...]) -> None: ...


class Session:
    """Owns the clock of a run: control tick k begins at k * period.

    `sensors`: of the robot and the task; `seed`: of their noise. The attribute `sensors` is their bank; `holder`: of
    attached objects; None where contact and friction hold them.
    """

    def __init__(
        self,
        *,
        robot: RobotModel,
        scene: Scene,
        engine: Engine,
        manager: ControllerManager,
        period: float,
        sensors: Mapping[str, SensorSpec] = NO_SENSORS,
        seed: int = 0,
    ) -> None:
        self.robot = robot
        self.scene = scene
        self.engine = engine
        self.manager = manager
        self.period = period
        self.observer: Observer = Silent()
        self.ticks = 0
        self.state = engine.read()
        self._limiter = JointLimiter([joint.limits for joint in robot.moving_joints], robot.joint_names)
        self.actuation = Actuation(robot, period)
        hands = {name for controller in manager.controllers if is_hand(controller) for name in controller.joints}
        self._motors = MotorLimits(robot, pressing=hands)
        self._counted = np.array([not engine.ideal and name not in hands for name in robot.joint_names])
        self._obeyed = -1
        if engine.ideal:
            manager.keep_references()
        self.sensors = bank = SensorBank(sensors, robot, scene, engine, period=period, seed=seed, state=self.state)
        self._measured: JointVectors | None = bank.joints
        self._sensing = bool(bank)
        for controller in manager.controllers:
            if reads_sensors(controller):
                asked = controller.sensors
                controller.attach([bank.reading(r.sensor) if r.sensor else engine.sense_wrench(r.joint) for r in asked])
            if has_reflex(controller) and (pads := hand_pads(sensors, robot, controller.joints)):
                felt = [Pad(link, spec.at.transform.R, bank.reading(name)) for name, spec, link in pads]
                controller.reflex.attach(robot, controller.joints, felt)
        n = len(robot.joint_names)
        self._contact_force = np.zeros(n)
        self._joint_of_part, self._followers = _joint_of_part(robot)
        limits = [joint.limits.velocity for joint in robot.moving_joints]
        self._runaway = np.array([RUNAWAY_SPEED if v is None else max(RUNAWAY_FACTOR * v, 1.0) for v in limits])
        self._touching: tuple[Contact, ...] = ()
        holding = None if engine.ideal else robot.holding
        self.holder = None if holding is None else Holder(robot, scene, holding, engine, period)
        self._watchful = 0  # the tick up to which contacts are read at every tick

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.ticks * self.period

    @property
    def saturations(self) -> Array:
        """(n) number of ticks in which each joint's command, or the engine's motor at the joint, was saturated.

        0 for joints of hands, which press on objects or on their stops by intent, and for all joints in an engine with
        ideal tracking.
        """
        return np.where(self._counted, self._limiter.saturations, 0.0)

    @property
    def saturations_by_kind(self) -> Array:
        """(k, n) number of these ticks by each of the `KINDS` of limits."""
        return np.where(self._counted, self._limiter.by_kind, 0.0)

    @property
    def touching(self) -> tuple[Contact, ...]:
        """The contacts of the last reading, at most ten ticks ago."""
        return self._touching

    def restart_clock(self, observer: Observer) -> None:
        """Make the next tick number 0, and the first for `observer`; the world is unchanged."""
        self.ticks = 0
        self.observer = observer
        self.sensors.reset()
        self._limiter.reset()
        self._watchful = 0
        self.actuation.reset()

    def tick(self) -> WorldState:
        """One control period.

        Raises:
            SimulationFailed: the state is not finite, or a joint or a body is implausibly fast or low.
        """
        bank = self.sensors
        state = self.state = self.engine.read(velocities=bank.body_velocities or self.ticks % SLOW == SLOW - 1)
        time = self.ticks * self.period
        state.time[...] = time
        if self._sensing:
            bank.sense(self.ticks, state)
        seen = self._measured or state
        self._touch(state)
        if self.holder is not None and self.holder.attached:
            self.holder.look(state, self.engine.contacts())
        if self._motors.watches:
            limiter = self._limiter
            self._motors.count(state.effort, limiter.saturated, limiter.saturations, limiter.by_kind[EFFORT])
        manager = self.manager
        command = manager.update(time, seen, self._contact_force)
        if manager.faults:
            self._refuse_runaway(state)  # an implausible state is the cause, not the controller
        try:
            self._limiter.apply(command, seen.position, seen.velocity, self.period)
        except NotFinite as bad:
            self._refuse_runaway(state)
            if not np.isfinite(state.position).all():
                raise SimulationFailed(str(bad), time=time) from bad
            manager.stop_non_finite(time)
            self._limiter.apply(command, seen.position, seen.velocity, self.period)
        if command.version != self._obeyed:
            self._obeyed = command.version
            self.actuation.select(command.modes)
            if not self.engine.ideal:
                self._motors.select(command.modes)
        if self.actuation.ideal or self.engine.ideal:
            self.engine.write(command)
        else:
            self._drive(command, state)
        self.observer.tick(self.ticks, state, manager.outputs)
        self.engine.advance()
        self.ticks += 1
        return state

    def _drive(self, command: JointCommand, state: WorldState) -> None:
        """Apply the actuator model and write the command; the manager overwrites all of it at the next tick."""
        effort = command.effort
        applied = self.actuation.apply(effort, state.position, state.velocity)
        if applied is not effort:
            effort[:] = applied
        self.engine.write(command)

    def _touch(self, state: WorldState) -> None:
        """Read the contacts, and the contact force on the links that each joint moves.

        This happens at every tenth tick, at every tick while a controller needs forces, and for ten ticks after the
        set of touching parts changes or a force on the robot grows a lot, so that no short contact is lost.
        """
        ticks = self.ticks
        slow = ticks % SLOW == 0
        if slow:
            self._refuse_runaway(state)
        if (slow or ticks >= self._watchful) and self.engine.touches_changed():
            self._watchful = ticks + SLOW
        elif not slow and ticks >= self._watchful and not self.manager.senses_contact:
            return
        before, self._touching = self._touching, self.engine.contacts()
        if not (slow or before or self._touching):
            return
        forces = [0.0] * len(self._contact_force)
        for a, b, force, _, _ in self._touching:
            if a.startswith(LINK) and b.startswith(LINK):
                continue  # a hand that presses on its own robot holds nothing
            joint_a, joint_b = self._joint_of_part.get(a), self._joint_of_part.get(b)
            if joint_a is None:
                if joint_b is not None:
                    forces[joint_b] += force
            elif joint_b is None:
                forces[joint_a] += force
        for driver, follower in self._followers:
            if forces[follower] > forces[driver]:
                forces[driver] = forces[follower]
        self._contact_force[:] = forces
        self.observer.contacts(ticks, self._touching)

    def _refuse_runaway(self, state: WorldState) -> None:
        speeds = np.abs(state.velocity)
        if np.count_nonzero(speeds < self._runaway) < len(speeds):
            k = int(np.argmax(np.where(np.isfinite(speeds), speeds / self._runaway, np.inf)))
            name = self.robot.joint_names[k]
            unit = self.robot.joint(name).unit
            raise SimulationFailed(
                f"joint '{name}' diverges at {state.velocity[k]:.3g} {unit}/s, limit {self._runaway[k]:.3g} {unit}/s; "
                "its controller may be unstable (gains too high for the control period), or too weak to hold its "
                "weight (gains, clamps or effort too low, no gravity compensation)",
                time=self.time,
            )
        slow = np.abs(state.body_linear) < 0.5 * BODY_SPEED  # along each axis
        high = state.body_position[:, 2] > FALLEN
        if np.count_nonzero(slow) == slow.size and np.count_nonzero(high) == high.size:
            return
        for k, body in enumerate(self.scene.movable):
            speed = float(np.linalg.norm(state.body_linear[k]))
            if not speed < BODY_SPEED:
                raise SimulationFailed(
                    f"'{body.name}' flies off at {speed:.3g} m/s; the limit is {BODY_SPEED:g} m/s", time=self.time
                )
            if not state.body_position[k, 2] > FALLEN:
                raise SimulationFailed(f"'{body.name}' has fallen out of the scene, below {FALLEN:g} m", time=self.time)


def _joint_of_part(robot: RobotModel) -> tuple[dict[str, int], tuple[tuple[int, int], ...]]:
    """The joints that sense the contacts of a part.

    Links below a joint that mimics a joint above it belong to that joint, as the tip of a linkage. If the mimic joint
    is elsewhere, as at the other jaw of a gripper with one motor, its driver senses the larger of the two forces.

    Returns:
        For every part `robot/<link>`, the joint vector index of the last joint that moves it; base parts are absent.
        And (driver, mimic): pairs of indices of joints; the first also senses the force of the second.
    """
    names = robot.joint_names
    index: dict[str, int] = {}
    followers: list[tuple[int, int]] = []
    for joint in robot.joints:
        k = index.get(joint.parent)
        if joint.independent:
            k = names.index(joint.name)
        elif joint.mimic is not None:
            driver = names.index(joint.mimic.joint)
            if k is None or (k != driver and (driver, k) not in followers):
                k = names.index(joint.name)
                followers.append((driver, k))
        if k is not None:
            index[joint.child] = k
    return {f"robot/{link}": k for link, k in index.items()}, tuple(followers)
