"""Law: a kernel gives the bits of the law in Python, for random settings and inputs, zeros of both signs included."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from manipcli.control.action import GripperGoal
from manipcli.control.active_trajectory import ActiveTrajectory, Part, Reference
from manipcli.control.actuation import Actuation
from manipcli.control.command import JointCommand, Mode
from manipcli.control.controller import ControllerOutput, JointState
from manipcli.control.feed_forward import ModelFeedForward
from manipcli.control.gripper_controller import GripperController
from manipcli.control.limiter import JointLimiter
from manipcli.control.pid import Pid
from manipcli.control.tracking_error import TrackingError
from manipcli.control.trajectory_controller import JointTrajectoryController
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.description.elements import Inertial, Joint, JointLimits, Link, Mimic, SoftLimits, TransmissionTag
from manipcli.model.robot import Actuator, RobotModel
from manipcli.plan.trajectory import JointTrajectory
from manipcli.simulate.sensor import Quantity
from manipcli.simulate.signal_chain import Sampling, SignalChain
from manipcli.spec.controllers import GainsSpec
from manipcli.spec.sensors import Noise

PERIOD = 1e-3
Rng = np.random.Generator


def numbers(rng: Rng, *shape: int, scale: float = 1.0) -> Array:
    """Random, a quarter of them zeros of both signs."""
    found = rng.normal(scale=scale, size=shape)
    found[rng.random(shape) < 0.125] = 0.0
    found[rng.random(shape) < 0.125] = -0.0
    return found


def bound(rng: Rng, n: int) -> Array:
    """Random bounds, some 0 and some infinite."""
    return np.where(rng.random(n) < 0.3, np.inf, np.abs(numbers(rng, n)))


def pid_loop(rng: Rng) -> list[Any]:
    n = int(rng.integers(1, 9))
    ros1 = rng.random() < 0.4
    words = ["none", "conditional_integration"] + ([] if ros1 else ["back_calculation"])

    def gains() -> dict[str, Array]:
        some = rng.random(3) < 0.7
        u, i = bound(rng, n), bound(rng, n)
        return {
            "p": numbers(rng, n) * some[0], "i": numbers(rng, n) * some[1], "d": numbers(rng, n) * some[2],
            "u_min": -u - 0.1, "u_max": bound(rng, n) + 0.1 * rng.integers(0, 2), "i_min": -i, "i_max": bound(rng, n),
            "tracking_time": np.abs(numbers(rng, n)), "error_deadband": np.abs(numbers(rng, n)) * rng.integers(0, 2),
        }  # fmt: skip

    pid = Pid(**gains(), antiwindup=list(rng.choice(words, n)), compat="ros1" if ros1 else "ros2")
    errors, command, feed = np.zeros((2, n)), np.zeros(n), np.zeros(n)
    effort = np.abs(numbers(rng, n)) + 0.01
    run = pid.loop(errors, command, feed=feed, effort=effort if rng.random() < 0.5 else None)
    seen: list[Any] = []
    for tick in range(60):
        if tick == 20:
            pid.freeze(rng.random(n) < 0.5)
        if tick == 40:
            pid.set_gains(**gains())
        if tick == 50:
            pid.reset()
        errors[:], feed[:] = numbers(rng, 2, n), numbers(rng, n)
        run(PERIOD, bool(rng.random() < 0.5))
        seen += [command.copy(), pid.i_term]
    return seen


def test_pid(equal_bits: Any) -> None:
    equal_bits(pid_loop, "pid", seeds=150)


def test_errors_and_the_quick_test_of_a_bound(equal_bits: Any) -> None:
    """The kernel compares each error, the law in Python their norm: it may be more cautious, never less."""

    def errors(rng: Rng) -> list[Any]:
        n = int(rng.integers(1, 9))
        reference, position, velocity = numbers(rng, 2, n), np.zeros(n), np.zeros(n)
        tracking = TrackingError(reference)
        measured = JointState(position, velocity, np.zeros(n))
        seen: list[Any] = []
        for _ in range(20):
            position[:], velocity[:] = numbers(rng, n), numbers(rng, n)
            below = tracking.update(measured, 2.0)
            assert not below or (np.abs(tracking.errors) < 2.0).all()
            seen += [tracking.errors.copy()]
        position[0] = rng.choice([np.nan, np.inf])
        return [*seen, tracking.update(measured, np.inf), tracking.update(measured, 0.0)]

    equal_bits(errors, "errors")


@pytest.mark.parametrize("interfaces", [("effort",), ("position", "velocity"), ("position",)])
def test_samples_of_a_reference(equal_bits: Any, interfaces: Any) -> None:
    """At full speed and scaled, on ticks and between them, with another period, beyond the end."""

    def follow(rng: Rng) -> list[Any]:
        n = int(rng.integers(1, 6))
        output = ControllerOutput.of(n, len(interfaces))
        scale = numbers(rng, n) if interfaces == ("effort",) else None
        reference = Reference(output.rows[:3], interfaces, velocity_scale=scale)
        zero = np.zeros((2, n))
        move = JointTrajectory.of_arrays([str(k) for k in range(n)], [0.0, 0.05], numbers(rng, 2, n), zero, zero)
        active = ActiveTrajectory.hold(np.zeros(n)).with_part(Part(slice(0, n), move, 0.0))
        reference.follow(active, active.ticks(PERIOD), time=1.0, period=PERIOD, speed=1.0)
        seen: list[Any] = []
        time, off_tick, half = 1.0, rng.random() < 0.3, rng.random() < 0.3
        for tick in range(80):
            if tick == 30:
                reference.rescale(float(rng.choice([1.0, 0.5, 0.0])), time=time)
            period = 0.5 * PERIOD if half and tick > 20 else PERIOD
            if reference.moving:
                reference.advance(time, period)
            feed = reference.feed_room.copy() if reference.feeds else np.zeros(0)
            seen += [output.rows.copy(), feed, reference.ended, reference.moving, reference.feeds]
            time += period * (1.3 if off_tick and tick == 10 else 1.0)
        return seen

    equal_bits(follow, "sample")


def limits(rng: Rng) -> JointLimits:
    soft = None
    if rng.random() < 0.5:
        soft = SoftLimits(-0.5, 0.5, float(rng.choice([0.0, 5.0])), float(rng.choice([0.0, 2.0])))
    lower = float(rng.choice([-1.0, 0.0, -np.inf]))
    return JointLimits(
        lower if np.isfinite(lower) else None, 1.0, float(rng.choice([0.5, 2.0])), float(rng.choice([0.0, 1.0])),
        None, None, soft,
    )  # fmt: skip


def test_limits(equal_bits: Any) -> None:
    """Commands, saturated joints and their counts by kind, in a mixture of modes that changes."""

    def limit(rng: Rng) -> list[Any]:
        n = int(rng.integers(1, 9))
        limiter = JointLimiter([limits(rng) for _ in range(n)])
        command = JointCommand(n)
        modes: tuple[Mode, ...] = ("effort", "velocity", "position", "brake", "free")
        position, velocity = np.zeros((2, n))
        small = rng.random() < 0.5
        seen: list[Any] = []
        for tick in range(40):
            if tick % 20 == 0:
                command.obey([modes[int(k)] for k in rng.choice([0, 0, 0, 1, 2, 3, 4], n)])
            scale = 0.05 if small and tick < 30 else 1.0
            for row in (command.effort, command.velocity, command.position, position, velocity):
                row[:] = numbers(rng, n, scale=scale)
            limiter.apply(command, position, velocity, 0.01)
            seen += [command.effort.copy(), command.velocity.copy(), command.position.copy()]
            seen += [limiter.saturated.copy(), limiter.saturations.copy(), limiter.by_kind.copy()]
        return seen

    equal_bits(limit, "window")


def robot(*actuators: Actuator, mimic: bool = False) -> RobotModel:
    """A chain of four joints with gears of 10, one of them negative; with `mimic` j2 follows j0."""
    inertial = Inertial(1.0, Transform.of(xyz=(0.0, 0.0, 0.1)), frozen(np.eye(3) * 0.02))
    chain = tuple(
        Joint(
            f"j{k}", "revolute", f"l{k}", f"l{k + 1}", Transform.of(xyz=(0.0, 0.0, 0.2)), frozen((0.0, 1.0, 0.0)),
            JointLimits(effort=100.0), damping=0.3 * k,
        )
        for k in range(4)
    )  # fmt: skip
    if mimic:
        chain = (*chain[:2], dataclasses.replace(chain[2], mimic=Mimic("j0", -1.5)), chain[3])
    tags = tuple(
        TransmissionTag(f"t{k}", "SimpleTransmission", (f"j{k}",), (1.0,), (0.0,), (f"m{k}",), (10.0 - 13.0 * k,))
        for k in range(3)
    )
    links = tuple(Link(f"l{k}", inertial, (), ()) for k in range(5))
    return RobotModel("r", "l0", links, chain, (), (), tags, Transform.identity(), "", actuators=actuators)


def test_actuators(equal_bits: Any) -> None:
    """With limits of effort and velocity, friction and losses, and joints that effort does not command."""

    def actuate(rng: Rng) -> list[Any]:
        rubs, fast = rng.random() < 0.5, rng.random() < 0.5
        motors = [
            Actuator(
                f"m{k}", effort=float(rng.choice([0.05, 10.0])),
                velocity=float(rng.choice([1.0, 20.0])) if fast else None,
                efficiency=0.9 if rubs else 1.0, coulomb_friction=float(rng.choice([0.0, 0.01])) if rubs else 0.0,
                viscous_friction=0.01 if rubs else 0.0,
            )
            for k in range(3)
        ]  # fmt: skip
        actuation = Actuation(robot(*motors), PERIOD)
        command, position, velocity = np.zeros((3, 4))
        seen: list[Any] = []
        for tick in range(40):
            if tick == 20:
                actuation.select([str(rng.choice(["effort", "position"])) for _ in range(4)])
            command[:], position[:], velocity[:] = numbers(rng, 4), numbers(rng, 4), numbers(rng, 4)
            applied = actuation.apply(command, position, velocity)
            seen += [applied.copy(), applied is command, actuation.saturated.copy(), actuation.saturations.copy()]
        return seen

    equal_bits(actuate, "actuation")


class Dynamics:
    """Efforts that depend on all of their inputs."""

    def inverse_dynamics(self, q: Array, v: Array, a: Array) -> Array:
        return np.sin(q) + v * a

    def gravity(self, q: Array) -> Array:
        return np.cos(q)


class Commands:
    """Output and demand of a controller of efforts."""

    def __init__(self, joints: int, feed_forward: str) -> None:
        self.output = ControllerOutput.of(joints, 1)
        self.interfaces, self.feed_forward = ("effort",), feed_forward


@pytest.mark.parametrize("demands", [("inverse_dynamics", "gravity"), ("gravity", "gravity")])
def test_model_based_efforts(equal_bits: Any, demands: tuple[str, str]) -> None:
    """For joints in a row and scattered ones, with a joint that follows another."""

    def add(rng: Rng) -> list[Any]:
        dynamics: Any = Dynamics()
        law = ModelFeedForward(robot(mimic=True), dynamics)
        first: Any = Commands(2, demands[0])
        second: Any = Commands(1, demands[1])
        law.serve([(first, slice(0, 2), 1, 0), (second, np.array([3]), 1, 0)])
        seen: list[Any] = []
        for tick in range(20):
            for own in (first, second):
                own.output.rows[:] = numbers(rng, *own.output.rows.shape)
            law.add(tick, numbers(rng, 4), numbers(rng, 4))
            seen += [first.output.rows.copy(), second.output.rows.copy()]
        return seen

    equal_bits(add, "model_efforts", "copies")


def test_a_trajectory_controller(equal_bits: Any) -> None:
    """A goal, an error beyond its tolerance or a cancel, another goal; measurements are overwritten in place."""

    def control(rng: Rng) -> list[Any]:
        joints = ("a", "b", "c")
        gains = {name: GainsSpec(p=40.0, i=5.0 * rng.integers(0, 2), d=1.0, i_clamp=0.5) for name in joints}
        controller = JointTrajectoryController(name="arm", joints=joints, gains=gains)
        q, v = np.zeros(3), np.zeros(3)
        measured = JointState(q, v, np.zeros(3))
        zero = np.zeros((2, 3))
        seen: list[Any] = []
        handle = None
        for tick in range(150):
            if tick in (5, 90):
                path = np.array([q, q + numbers(rng, 3)])
                handle = controller.send_goal(JointTrajectory.of_arrays(joints, [0.0, 0.06], path, zero, zero))
            if tick == 40 and handle is not None and rng.random() < 0.5:
                handle.cancel()
            output = controller.update(tick * PERIOD, PERIOD, measured)
            v += 0.01 * output.command
            q += PERIOD * v
            seen += [output.rows.copy(), q.copy(), handle is not None and handle.result is not None]
        return seen

    equal_bits(control, "errors", "pid", "sample", seeds=10)


def test_a_hand(equal_bits: Any) -> None:
    """A goal with contact forces that stop one finger after the other."""

    def grip(rng: Rng) -> list[Any]:
        joints = ("a", "b", "c")
        gains = {name: GainsSpec(p=3.0, i=float(rng.integers(0, 2)), d=0.1) for name in joints}
        controller = GripperController(name="hand", joints=joints, gains=gains, speed=2.0, max_effort=1.0)
        q, v = np.zeros(3), np.zeros(3)
        measured = JointState(q, v, np.zeros(3))
        force = np.zeros(3)
        seen: list[Any] = []
        for tick in range(150):
            if tick == 5:
                controller.send_goal(GripperGoal(target=np.full(3, 0.4), force=1.0))
            if tick == 100:
                controller.send_goal(GripperGoal(target=np.zeros(3), max_effort=0.2))
            force[:] = np.where(tick > np.array([20, 40, 60]), 5.0, 0.0)
            output = controller.update(tick * PERIOD, PERIOD, measured, contact_force=force)
            v += 0.1 * output.command
            q += PERIOD * v
            seen += [output.rows.copy(), q.copy()]
        return seen

    equal_bits(grip, "errors", "pid", seeds=10)


def test_a_sensor(equal_bits: Any) -> None:
    """Filtered or not, at any rate and delay, with losses."""

    def sense(rng: Rng) -> list[Any]:
        n = int(rng.integers(1, 5))
        noise = Noise[float](white=0.1, bias=1.0, walk=0.5 * rng.integers(0, 2), quantisation=0.01 * rng.integers(0, 2))
        most = float(bound(rng, 1)[0])
        sampling = Sampling(
            PERIOD,
            every=int(rng.integers(1, 4)),
            delay=int(rng.integers(0, 9)),
            cutoff=None if rng.random() < 0.5 else 30.0,
            dropout=0.2 * rng.integers(0, 2),
        )
        truth = np.zeros(n)
        chain = SignalChain([Quantity("force", n, noise, -most, most)], sampling, seed=1, name="a", truth=truth)
        seen: list[Any] = []
        for tick in range(600):
            truth[:] = numbers(rng, n)
            seen += [chain.step(tick), chain.reading.copy()]
        return seen

    equal_bits(sense, "sensor", seeds=10)
