"""Spec of `holding:` of a tool: what holds an object in the hand."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from manipcli.spec.base import Model, or_short, problem
from manipcli.spec.quantity import Force, Length, Torque


class SuctionSpec(Model):
    """A suction cup at the tool frame, which presses along +z."""

    force: Annotated[Force, Field(gt=0)] = Field(description="Pull along the axis at which it breaks [N], above 0.")
    torque: Annotated[Torque, Field(gt=0)] | None = Field(
        None,
        description="Torque about the tool frame at which it breaks [N m], above 0. Default: `force` times 10 mm, as "
        "of a cup with a diameter of 20 mm.",
    )
    reach: Annotated[Length, Field(gt=0, le=0.05)] = Field(
        0.002, description="Largest gap between the tool frame and the surface when it grips [m]. Default 2 mm."
    )


class WeldSpec(Model):
    """A rigid attachment, for a hand whose grip is not modelled."""

    force: Annotated[Force, Field(gt=0)] | None = Field(
        None, description="Force at which it breaks [N], above 0. Default: unlimited."
    )
    torque: Annotated[Torque, Field(gt=0)] | None = Field(
        None, description="Torque about the tool frame at which it breaks [N m], above 0. Default: unlimited."
    )


class HoldingSpec(Model):
    """What holds a grasped object: `friction`, `weld`, `{weld: ...}` or `{suction: ...}`."""

    suction: SuctionSpec | None = Field(None, description="An attachment by a suction cup; needs no fingers.")
    weld: WeldSpec | None = Field(None, description="A rigid attachment, made when the hand touches the object.")

    @model_validator(mode="before")
    @classmethod
    def _word(cls, value: Any) -> Any:
        """`friction` is short for no attachment, `weld` for one without limits."""
        if value == "suction":
            raise problem("conflict", "suction needs its force", hint="write `holding: {suction: {force: 60 N}}`")
        if isinstance(value, str) and value not in ("friction", "weld"):
            message = f"unknown holding '{value}': expected friction, weld or {{suction: {{force: ...}}}}"
            raise problem("name", message)
        return {"friction": {}, "weld": {"weld": {}}}.get(value, value) if isinstance(value, str) else value

    @model_validator(mode="after")
    def _one(self) -> HoldingSpec:
        if self.suction is not None and self.weld is not None:
            raise problem("conflict", "an object is held by suction or by a weld, not by both", at=("weld",), key=True)
        return self

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler, /) -> JsonSchemaValue:
        return or_short(schema, handler, {"type": "string", "enum": ["friction", "weld"]})
