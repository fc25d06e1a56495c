"""`saturation`: no motor is at its effort limit for more than a share of a step."""

from __future__ import annotations

from typing import Annotated, Final

import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator

from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World, effortless, unknown_group
from manipcli.conditions.robustness import Robustness, robustness
from manipcli.conditions.state_window import ROUNDING, StateWindow, StepTime
from manipcli.core.geometry import Array
from manipcli.core.prose import listing, named, share
from manipcli.core.text import did_you_mean
from manipcli.model.motor_limits import EffortLimits
from manipcli.model.robot import RobotModel
from manipcli.spec.base import Model, problem
from manipcli.spec.quantity import Share

MOST: Final = 0.2
"""Default of `below`, and of `saturation:` of a task."""


class SaturationSpec(Model):
    """Each motor is at its effort limit in at most the share `below` of the ticks of a step."""

    group: str | None = Field(default=None, description="Only joints of this group.")
    joints: Annotated[tuple[str, ...], Field(min_length=1)] | None = Field(
        default=None, description="Only these joints. Default, without `group`: all joints with an effort limit."
    )
    below: Annotated[Share, Field(gt=0, le=1)] = Field(
        default=MOST, description="Largest share of the ticks of a step. Default 20 %."
    )

    @model_validator(mode="after")
    def _either(self) -> SaturationSpec:
        if self.group is not None and self.joints is not None:
            raise problem("conflict", "both `group` and `joints` are given", at=("joints",), key=True)
        return self


def monitor(spec: SaturationSpec, world: World) -> Monitor:
    """`below` minus the share of the ticks of a step in which a joint was at its effort limit, for the worst joint.

    It is at its limit where its effort is, or that of an actuator that drives it: less losses and friction while it
    drives. The share is known at the last tick of each step, and evaluated
    there; ticks outside of steps do not count. With several ends of steps the least margin decides.
    """
    joints = _joints(spec, world.robot)
    columns = world.robot.indices(joints)
    limits = EffortLimits.of(world.robot)
    least = limits.least[columns]
    units = [world.robot.joint(name).effort_unit for name in joints]
    full: dict[str, npt.NDArray[np.int64]] = {}
    ticks: dict[str, int] = {}

    def count(step: StepTime, times: Array, at_limit: npt.NDArray[np.bool_]) -> int | None:
        """Adds the ticks of a step; its last tick, if the window has it."""
        if step.started is None:
            return None
        end = np.inf if step.ended is None else step.ended
        first, last = (int(k) for k in np.searchsorted(times, (step.started - ROUNDING, end - ROUNDING)))
        if first >= last:
            return None
        full[step.id] = full.get(step.id, np.zeros(len(joints), dtype=np.int64)) + at_limit[first:last].sum(axis=0)
        ticks[step.id] = ticks.get(step.id, 0) + last - first
        return last - 1 if times[last - 1] + 1.5 * world.period > end else None

    def look(window: StateWindow) -> Robustness:
        times = window.times
        margins, applies = np.full(len(times), spec.below), np.zeros(len(times), dtype=bool)
        texts: dict[int, str] = {}
        at_limit = limits.reached(window.states.effort, window.states.velocity)[:, columns]
        finite = bool(np.isfinite(window.states.effort[:, columns]).all())
        for step in window.steps:
            last = count(step, times, at_limit)
            if last is None:
                continue
            worst = int(np.argmax(full[step.id]))
            share = full[step.id][worst] / ticks[step.id]
            margin = spec.below - share if finite else np.nan
            if not applies[last] or margin < margins[last]:
                limit = f"its effort limit ({least[worst]:.4g} {units[worst]}) in {100.0 * share:.3g} % of"
                text = f"joint '{joints[worst]}' is at {limit}" if share else "no joint is at its effort limit in"
                texts[last] = f"{text} step '{step.id}'; below {100.0 * spec.below:.4g} %"
                margins[last], applies[last] = margin, True
        idle = "no step ended"
        return robustness(
            margins, times, unit="", scale=spec.below, describe=lambda k: texts.get(k, ""), applies=applies, idle=idle
        )

    return look


def _joints(spec: SaturationSpec, robot: RobotModel) -> tuple[str, ...]:
    """The joints of the spec that have an effort limit above 0."""
    limited = limited_joints(robot)
    asked = spec.joints or (robot.joint_names if spec.group is None else robot.group(spec.group).joints)
    return tuple(name for name in asked if name in limited)


def limited_joints(robot: RobotModel) -> frozenset[str]:
    """The joints with an effort limit above 0, their own or of their motors."""
    least = EffortLimits.of(robot).least
    return frozenset(name for name, limit in zip(robot.joint_names, least, strict=True) if 0.0 < limit < np.inf)


def check(spec: SaturationSpec, context: CheckContext) -> tuple[Problem, ...]:
    """An unknown group or joint, or joints without effort limits."""
    robot = context.robot
    found = unknown_group(robot, spec.group, ("group",))
    for k, name in enumerate(spec.joints or ()):
        if name not in robot.joint_names:
            message = f"'{name}' is not a moving joint of robot '{robot.name}'"
            found += (Problem(("joints", k), message, did_you_mean(name, robot.joint_names)),)
    if not found and not _joints(spec, robot):
        hint = "add it to the robot file: `limits: {JOINT: {effort: 20 N m}}`"
        return (Problem((), "no joint has an effort limit", hint),)
    return found


def clause(spec: SaturationSpec, robot: RobotModel) -> str:
    who = "each joint with an effort limit" if spec.group is None else f"each joint of group {named(spec.group)}"
    if spec.joints is not None:
        who = f"each of the joints {listing([named(name) for name in spec.joints])}"
    return f"{who} is at its effort limit for less than {share(spec.below)} of a step"


SATURATION = Condition(
    name="saturation",
    spec=SaturationSpec,
    units=("",),
    open=monitor,
    check=check,
    absent=lambda spec, world: effortless(world),
    scope="always",
    clause=clause,
    example="saturation: {group: arm, below: 20 %}",
    live=False,
)
