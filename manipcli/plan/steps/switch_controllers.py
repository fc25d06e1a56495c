"""`switch_controllers`: switch controllers between two control ticks; nothing moves.

- switch_controllers: soft_arm                     # active afterwards, alone on its joints
- switch_controllers: {to: [soft_arm, hand]}
- switch_controllers: {activate: [soft_arm], deactivate: [arm]}
- switch_controllers: {deactivate: [hand], strictness: best_effort}
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, GetJsonSchemaHandler, TypeAdapter, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from manipcli.conditions.condition import Problem
from manipcli.core.prose import listing, named
from manipcli.model.robot import RobotModel
from manipcli.plan.claimed_joints import Claims, unknown_controller
from manipcli.plan.motion import Motion, PlanningState, StepPlan, Strictness, Switch
from manipcli.plan.planner import Planner
from manipcli.plan.step import StepMember, single
from manipcli.scene.scene import Scene
from manipcli.spec.base import Model, or_short
from manipcli.spec.names import ControllerName

Names = str | tuple[str, ...]


def _names(value: object) -> object:
    """`{to: arm}` is short for `{to: [arm]}`."""
    return [value] if isinstance(value, str) else value


class SwitchControllersSpec(Model):
    """Switch controllers between two control ticks; nothing moves.

    Give either `to`, the controllers that are active afterwards, or `activate` and `deactivate`, as in ROS's service.
    An activated controller holds the measured position. Uncommanded joints are held by a brake. With `strict` a switch
    is done as a whole or refused; with `best_effort` names that cannot be switched are left out, also those that claim
    joints of controllers that stay active.
    """

    to: Annotated[tuple[str, ...], BeforeValidator(_names, json_schema_input_type=Names)] = Field(
        (), description="Controllers that are active afterwards; others on their joints are deactivated."
    )
    activate: tuple[ControllerName, ...] = Field((), description="Controllers to activate.")
    deactivate: tuple[ControllerName, ...] = Field((), description="Controllers to deactivate.")
    strictness: Strictness = Field(
        "strict",
        description="`strict`: all or nothing. `best_effort`: all that can be switched. Default `strict`.",
    )

    @model_validator(mode="before")
    @classmethod
    def _short(cls, value: Any) -> Any:
        """`switch_controllers: arm` is short for `{to: arm}`."""
        return {"to": value} if isinstance(value, str | list) else value

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler, /) -> JsonSchemaValue:
        return or_short(schema, handler, TypeAdapter(Names).json_schema())

    @model_validator(mode="after")
    def _one_way(self) -> SwitchControllersSpec:
        lists = bool(self.activate or self.deactivate)
        if bool(self.to) == lists:
            raise ValueError("needs either `to`, or `activate` and `deactivate`")
        return self


def request(spec: SwitchControllersSpec) -> Switch:
    """The requested switch."""
    return Switch(to=spec.to, activate=spec.activate, deactivate=spec.deactivate, strictness=spec.strictness)


def plan(spec: SwitchControllersSpec, planner: Planner, state: PlanningState) -> StepPlan:
    """One motion that takes no time."""
    motion = Motion("switch", trajectory=None, grip=None, duration=0.0, switch=request(spec))
    return StepPlan((motion,), state)


def check(spec: SwitchControllersSpec, robot: RobotModel, scene: Scene) -> tuple[Problem, ...]:
    """Nothing: controllers are checked by `uncommanded`."""
    return ()


def uncommanded(spec: SwitchControllersSpec, robot: RobotModel, claims: Claims) -> tuple[Problem, ...]:
    """Names that are not in the controllers file; whether the others can be switched is checked with `request`."""
    lists = (("to", spec.to), ("activate", spec.activate), ("deactivate", spec.deactivate))
    return tuple(
        problem
        for key, names in lists
        for k, name in enumerate(names)
        for problem in unknown_controller(claims, name, (key, k))
    )


def clause(spec: SwitchControllersSpec, robot: RobotModel) -> str:
    lists = (("activate", spec.activate or spec.to), ("deactivate", spec.deactivate))
    doing = [f"{word} {listing([named(name) for name in names])}" for word, names in lists if names]
    others = ", and deactivate the others on their joints" if spec.to else ""
    best = ", as far as possible" if spec.strictness == "best_effort" else ""
    return f"between two control ticks, {listing(doing)}{others}{best}"


MEMBER = StepMember(
    name="switch_controllers",
    spec=SwitchControllersSpec,
    candidates=single(plan),
    moves=False,
    part=lambda *_: "nothing",
    check=check,
    uncommanded=uncommanded,
    clause=clause,
    request=request,
)
