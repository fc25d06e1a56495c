"""`tool_speed` and `tool_acceleration`: of the tool's origin."""

from __future__ import annotations

from manipcli.core.geometry import Transform
from manipcli.core.prose import amount
from manipcli.plan.keep import KeepMember, Kept
from manipcli.plan.motion import PlanningState
from manipcli.plan.planner import Planner
from manipcli.plan.timing_bounds.tool_motion import ToolAcceleration, ToolSpeed
from manipcli.spec.keep import KeepSpec


def _speed(spec: KeepSpec, planner: Planner, state: PlanningState) -> Kept | None:
    limit = spec.tool_speed
    if limit is None:
        return None
    return Kept("tool_speed", bound=lambda dynamics: ToolSpeed(dynamics, *_tool(planner), limit))


def _acceleration(spec: KeepSpec, planner: Planner, state: PlanningState) -> Kept | None:
    limit = spec.tool_acceleration
    if limit is None:
        return None
    return Kept("tool_acceleration", bound=lambda dynamics: ToolAcceleration(dynamics, *_tool(planner), limit))


def _tool(planner: Planner) -> tuple[str, Transform]:
    link, tool = planner.tool_link, planner.robot.tool  # refuses a robot without a tool frame
    return link, Transform.identity() if tool is None else tool.X_LT


def _speed_clause(spec: KeepSpec) -> str:
    return f"the tool moves at {amount(spec.tool_speed or 0.0, 'm/s')} or slower"


def _acceleration_clause(spec: KeepSpec) -> str:
    return f"the tool accelerates with {amount(spec.tool_acceleration or 0.0, 'm/s^2')} or less"


SPEED = KeepMember("tool_speed", _speed, _speed_clause)
ACCELERATION = KeepMember("tool_acceleration", _acceleration, _acceleration_clause)
