"""`energy`: the mechanical work of the joints."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World, effortless, unknown_group
from manipcli.conditions.robustness import Robustness, robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.core.geometry import Array
from manipcli.core.prose import amount, named
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.spec.base import Model
from manipcli.spec.names import GroupName
from manipcli.spec.quantity import Energy


class EnergySpec(Model):
    """The work of the joints is less than `below`, from the start of the run or of the step of `at` or `during`."""

    below: Annotated[Energy, Field(gt=0)] = Field(description="Largest work [J].")
    group: GroupName | None = Field(default=None, description="Only joints of this group. Default: all moving joints.")


def monitor(spec: EnergySpec, world: World) -> Monitor:
    """`below` minus the work W [J] of the joints.

        W = sum over joints of the integral of max(tau_j qd_j, 0) dt

    by the trapezoidal rule over the control ticks, from measured efforts and velocities. Braking does not reduce W:
    drives are assumed not to recuperate.
    """
    robot = world.robot
    columns = robot.indices(robot.joint_names if spec.group is None else robot.group(spec.group).joints)
    done: list[tuple[float, float, float]] = []
    """Time, power and work at the last tick."""

    def look(window: StateWindow) -> Robustness:
        states = window.states
        power = np.maximum(states.effort[:, columns] * states.velocity[:, columns], 0.0).sum(axis=-1)
        work = _work(states.time, power, *(done[-1] if done else (float(states.time[0]), 0.0, 0.0)))
        done[:] = [(float(states.time[-1]), float(power[-1]), float(work[-1]))]

        def describe(k: int) -> str:
            return f"{readable(float(work[k]), 'J')}; below {readable(spec.below, 'J')}"

        return robustness(spec.below - work, window.times, unit="J", scale=spec.below, describe=describe)

    return look


def _work(times: Array, power: Array, time: float, last_power: float, work: float) -> Array:
    """(T,) the integral of power since the start, continued from the last tick.

    A running sum, so the result does not depend on how the run is split into windows.
    """
    passed = np.diff(times, prepend=time)
    mean = (power + np.concatenate([[last_power], power[:-1]])) / 2.0
    return np.cumsum(np.concatenate([[work], passed * mean]))[1:]


def check(spec: EnergySpec, context: CheckContext) -> tuple[Problem, ...]:
    """An unknown group."""
    return unknown_group(context.robot, spec.group, ("group",))


def clause(spec: EnergySpec, robot: RobotModel) -> str:
    who = "the joints" if spec.group is None else f"the joints of group {named(spec.group)}"
    return f"{who} have done less than {amount(spec.below, 'J')} of work"


ENERGY = Condition(
    name="energy",
    spec=EnergySpec,
    units=("J",),
    open=monitor,
    check=check,
    absent=lambda spec, world: effortless(world),
    clause=clause,
    example="energy: {below: 50 J}",
)
