"""`tool_speed`: the tool, or another link, moves slower than a limit."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import CheckContext, Condition, Monitor, Problem, World
from manipcli.conditions.robustness import Robustness, robustness
from manipcli.conditions.state_window import StateWindow
from manipcli.core.geometry import Transform
from manipcli.core.prose import amount, named
from manipcli.core.text import did_you_mean
from manipcli.core.units import readable
from manipcli.model.robot import RobotModel
from manipcli.spec.base import Model
from manipcli.spec.names import LinkName
from manipcli.spec.quantity import Speed


class ToolSpeedSpec(Model):
    """The origin of the tool frame (or of `link`) moves slower than `below`."""

    below: Annotated[Speed, Field(gt=0)] = Field(description="Largest speed in the world [m/s].")
    link: LinkName | None = Field(default=None, description="A link instead of the tool frame; its origin counts.")


def monitor(spec: ToolSpeedSpec, world: World) -> Monitor:
    """`below` minus the speed [m/s] of the point in the world, from measured positions and velocities of the joints."""
    link, X_LT = _frame(spec, world.robot)
    name = "the tool" if spec.link is None else f"link '{link}'"

    def look(window: StateWindow) -> Robustness:
        q, v = window.states.position, window.states.velocity
        velocity = world.kinematics.point_velocity
        speed = np.linalg.norm([velocity(q[k], v[k], link, X_LT) for k in range(len(q))], axis=-1)

        def describe(k: int) -> str:
            return f"{name} moves at {readable(float(speed[k]), 'm/s')}; below {readable(spec.below, 'm/s')}"

        return robustness(spec.below - speed, window.times, unit="m/s", scale=spec.below, describe=describe)

    return look


def _frame(spec: ToolSpeedSpec, robot: RobotModel) -> tuple[str, Transform | None]:
    """The link, and the pose of the measured point in it; None: its origin."""
    if spec.link is not None:
        return spec.link, None
    return (robot.root, None) if robot.tool is None else (robot.tool.link, robot.tool.X_LT)


def check(spec: ToolSpeedSpec, context: CheckContext) -> tuple[Problem, ...]:
    """An unknown link, or a robot without a tool."""
    robot = context.robot
    links = [link.name for link in robot.links]
    if spec.link is not None and spec.link not in links:
        message = f"'{spec.link}' is not a link of robot '{robot.name}'"
        return (Problem(("link",), message, did_you_mean(spec.link, links)),)
    if spec.link is None and robot.tool is None:
        message = f"robot '{robot.name}' has no tool"
        return (Problem((), message, "name a `link` here, or add a `tool` to the robot file"),)
    return ()


def clause(spec: ToolSpeedSpec, robot: RobotModel) -> str:
    who = "the tool" if spec.link is None else f"link {named(spec.link)}"
    return f"{who} moves slower than {amount(spec.below, 'm/s')}"


TOOL_SPEED = Condition(
    name="tool_speed",
    spec=ToolSpeedSpec,
    units=("m/s",),
    open=monitor,
    check=check,
    absent=lambda spec, world: None,
    scope="always",
    clause=clause,
    example="tool_speed: {below: 1.5 m/s}",
)
