"""`wait`: hold still.

- wait: 1 s
- wait: {duration: 1 s}
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, GetJsonSchemaHandler, TypeAdapter, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from manipcli.core.prose import amount
from manipcli.model.robot import RobotModel
from manipcli.plan.motion import PlanningState, StepPlan
from manipcli.plan.motion_builder import MotionBuilder
from manipcli.plan.planner import Planner
from manipcli.plan.step import StepMember, single
from manipcli.spec.base import Model, or_short
from manipcli.spec.quantity import Pause, Time


class WaitSpec(Model):
    """Hold still for a time; with `until` on the step, at least that long and until the condition holds."""

    duration: Annotated[Pause, Field(ge=0, description="Duration [s], at most 1 h.")] = 0.0

    @model_validator(mode="before")
    @classmethod
    def _scalar(cls, value: Any) -> Any:
        """`wait: 1 s` is short for `wait: {duration: 1 s}`."""
        return {"duration": value} if isinstance(value, str | int | float) else value

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler, /) -> JsonSchemaValue:
        return or_short(schema, handler, TypeAdapter(Time).json_schema() | {"minimum": 0, "maximum": 3600})


def plan(spec: WaitSpec, planner: Planner, state: PlanningState) -> StepPlan:
    """One motion without commands."""
    builder = MotionBuilder(planner, state)
    builder.dwell("wait", spec.duration)
    return builder.plan()


def clause(spec: WaitSpec, robot: RobotModel) -> str:
    return f"hold still for {amount(spec.duration, 's')}" if spec.duration else "hold still"


MEMBER = StepMember(
    name="wait",
    spec=WaitSpec,
    candidates=single(plan),
    check=lambda *_: (),
    uncommanded=lambda *_: (),
    clause=clause,
    moves=False,
    part=lambda *_: "nothing",
)
