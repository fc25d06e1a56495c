"""Joints that the engine's own motors move, on position and velocity interfaces: can their gains and motors work?

Their loop is another one than that of efforts: no inertia is in it, and of an actuator only what limits its effort.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.control.joint_space_load import Configurations, load_of
from manipcli.control.stability import largest_velocity_gain, velocity_loop_poles
from manipcli.core.errors import Finding, Place
from manipcli.core.geometry import Array
from manipcli.core.text import digits, listed, told_apart
from manipcli.flow.doubt import Doubt
from manipcli.flow.load import Task
from manipcli.model.drivetrain import Drivetrain
from manipcli.model.kinematics import Kinematics
from manipcli.model.robot import Actuator, RobotModel
from manipcli.spec.controllers import GainsSpec, Interface, JointTrajectorySpec

RINGING: Final = 0.5
"""A pole that changes its sign every tick may be no larger."""
FASTER: Final = 1.0 + 1e-6
"""From this share of an actuator's velocity limit on a plan is beyond it."""


@dataclass(frozen=True, slots=True)
class Driven:
    """One joint that is commanded by position or velocity: by whom, and by which gains, where there are any."""

    controller: str
    joint: str
    interface: Interface
    gains: GainsSpec | None
    ticks: int
    place: Place


def driven_joints(task: Task, active: Collection[str]) -> tuple[Driven, ...]:
    """Those of these controllers to which no effort is added."""
    period = task.spec.simulation.control_period
    found = []
    for name, spec in task.controllers.controllers.items():
        interface = next((one for one in spec.interfaces if one in ("position", "velocity")), None)
        if name not in active or interface is None or "effort" in spec.interfaces:
            continue
        ticks = spec.ticks(period)
        for joint in spec.joints:
            gains: GainsSpec | None = None
            key: tuple[str, ...] = ("joints",)
            if isinstance(spec, JointTrajectorySpec) and spec.interfaces == ("velocity",):
                gains, key = spec.gains.get(joint, GainsSpec()), ("gains", joint)
            place = task.controllers_file.place("controllers", name, *key)
            found.append(Driven(name, joint, interface, gains, ticks, place))
    return tuple(found)


def drive_doubts(
    task: Task, drives: tuple[Driven, ...], kinematics: Kinematics, postures: Configurations, *, planned: bool
) -> Iterator[Doubt]:
    """Warnings about joints that are commanded by position or velocity, over the postures in which they will be."""
    period = task.spec.simulation.control_period
    load = load_of(task.robot, kinematics, [one.joint for one in drives], postures)
    for k, one in enumerate(drives):
        if one.gains is not None:
            yield from _rings(one, one.gains, one.ticks * period)
        weight, needed = (float(np.abs(part[:, k]).max()) for part in (load.gravity, load.needed))
        finding = too_weak(
            task.robot, one.joint, one.place, weight=weight, needed=needed if planned else 0.0,
            limit=float(load.effort[k]),
        )  # fmt: skip
        if finding is not None:
            yield Doubt(one.joint, finding)
    yield from _left_out(task, drives, postures.velocity)


def too_weak(
    robot: RobotModel, joint: str, place: Place, *, weight: float, needed: float, limit: float
) -> Finding | None:
    """Too little effort for gravity or for the plan, all three in N m or N; None where there is enough."""
    unit = robot.joint(joint).effort_unit
    if weight > limit:
        takes, most = told_apart(weight, limit, form=".3g")
        message = f"{joint}: holding against gravity takes up to {takes} {unit}, its limit is {most} {unit}"
        return Finding("CTRL155", message, place, "it will sink; check the effort limit and the masses", "warning")
    if needed > limit:
        takes, most = told_apart(needed, limit, form=".3g")
        message = f"{joint}: the planned motions need up to {takes} {unit}, its limit is {most} {unit}"
        hint = f"it will lag behind; lower its acceleration limit (robot file, limits.{joint}.acceleration)"
        return Finding("CTRL155", message, place, hint, "warning")
    return None


def _rings(one: Driven, gains: GainsSpec, period: float) -> Iterator[Doubt]:
    """A velocity loop that diverges, or turns round every tick."""
    if gains.p == 0.0:
        return
    p, d, i = gains.p, gains.d, gains.i
    poles = velocity_loop_poles(p=p, i=i, d=d, period=period)
    most = largest_velocity_gain(i=i, d=d, period=period)
    at = f"at {1e3 * period:.3g} ms"
    if abs(poles[0]) >= 1.0:
        if p >= most > 0.0:
            message = f"{one.joint}: p {digits(p)} on the velocity interface is unstable above {digits(most)} {at}"
            hint = f"stay below half of that: p {digits(0.5 * most)}"
        else:
            message = f"{one.joint}: p {digits(p)}, i {digits(i)} and d {digits(d)} on the velocity interface are "
            message += f"unstable {at}"
            hint = "lower d, which is to stay well below 1, and i"
    elif any(pole.real < -RINGING and abs(pole.imag) < 1e-9 for pole in poles):
        message = (
            f"{one.joint}: p {digits(p)}{f' with d {digits(d)}' if d else ''} on the velocity interface rings {at}: "
        )
        message += "it turns round every tick"
        hint = f"p is unstable above {digits(most)}; stay below half of that"
    else:
        return
    yield Doubt(one.joint, Finding("CTRL157", message, one.place, hint, "warning"))


def _left_out(task: Task, drives: tuple[Driven, ...], velocity: Array) -> Iterator[Doubt]:
    """What is said of actuators and does not act, as their joints are not commanded by effort; one a controller.

    Args:
        task, drives: the joints, of a robot of a joint vector (n).
        velocity: (T, n) planned.
    """
    train = Drivetrain.of(task.robot)
    speeds = np.abs(velocity[:, list(train.joints)] @ train.transmission.maps.actuator_motion.T).max(
        axis=0, initial=0.0
    )
    owners = {one.joint: one for one in drives}
    groups: dict[tuple[str, Interface], list[int]] = {}
    for row, k in enumerate(train.joints):
        owner = owners.get(task.robot.joint_names[k])
        if owner is not None and _inert(train.actuators[row]):
            groups.setdefault((owner.controller, owner.interface), []).append(row)
    for (controller, interface), rows in groups.items():
        own = [train.actuators[row] for row in rows]
        *most, last = (word for word in _WORDS if any(word in _inert(one) for one in own))
        words = f"{', '.join(most)} and {last}" if most else last
        names = listed([f"'{one.name}'" for one in own])
        message = f"{'actuator' if len(own) == 1 else 'actuators'} {names}: {words} {'act' if most else 'acts'} on "
        message += f"effort commands alone, and '{controller}' commands by {interface}"
        fast = [
            f"'{one.name}' at {speeds[row]:.3g} (limit {one.velocity:.3g})"
            for one, row in zip(own, rows, strict=True)
            if one.velocity is not None and speeds[row] > FASTER * one.velocity
        ]
        hint = "command by effort to have them act"
        if fast:
            message += f"; the plan turns {listed(fast, most=3)} per second"
            hint += ", or narrow the velocities of the joints (robot file, limits)"
        place = task.robot_file.place("actuators", own[0].name)
        yield Doubt("", Finding("CTRL158", message, place, hint, "warning"))


_WORDS: Final = ("velocity limit", "friction", "latency")


def _inert(actuator: Actuator) -> tuple[str, ...]:
    """What of an actuator does not act on joints that are commanded by position or velocity."""
    said = (
        actuator.velocity is not None,
        actuator.viscous_friction > 0.0 or actuator.coulomb_friction > 0.0,
        actuator.latency > 0,
    )
    return tuple(word for word, there in zip(_WORDS, said, strict=True) if there)
