"""Spec of `inertials:` of a robot file: masses, centres of mass and moments of inertia of links."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from manipcli.core.text import did_you_mean
from manipcli.spec.base import Model, or_short, problem
from manipcli.spec.quantity import Length, Mass

WATER = 1000.0
"""[kg/m3] Default density of estimates: arms have 1000 to 2000 kg/m3 in the volume of their shapes."""
Density = Annotated[float, Field(gt=0)]


class MomentsSpec(Model):
    """Moments and products of inertia about the centre of mass, along the axes of the link."""

    ixx: Annotated[float, Field(gt=0)] = Field(description="Moment about x [kg m^2], above 0.")
    iyy: Annotated[float, Field(gt=0)] = Field(description="Moment about y [kg m^2], above 0.")
    izz: Annotated[float, Field(gt=0)] = Field(description="Moment about z [kg m^2], above 0.")
    ixy: float = Field(0.0, description="Product [kg m^2]. Default 0.")
    ixz: float = Field(0.0, description="Product [kg m^2]. Default 0.")
    iyz: float = Field(0.0, description="Product [kg m^2]. Default 0.")


class EstimateSpec(Model):
    """How links without a usable inertial get one: from the volume of their shapes."""

    density: Density = Field(WATER, description="Density of the shapes [kg/m^3], above 0. Default 1000.")
    total_mass: Annotated[Mass, Field(gt=0)] | None = Field(
        None,
        description="Mass of the whole robot with its base [kg], above 0: the estimated masses are scaled to reach it. "
        "Default: none, the density counts.",
    )


class LinkInertialSpec(Model):
    """The inertial of one link; what is not stated is computed from its shapes."""

    mass: Annotated[Mass, Field(ge=0)] | None = Field(
        None, description="Mass [kg], at least 0; 0: the link has no mass of its own."
    )
    density: Density | None = Field(None, description="Density of its shapes [kg/m^3], above 0, instead of a mass.")
    centre: tuple[Length, Length, Length] | None = Field(
        None, description="Centre of mass in the link [m]. Default: that of its shapes."
    )
    inertia: MomentsSpec | None = Field(
        None, description="Inertia about the centre of mass. Default: that of its shapes, scaled to the mass."
    )

    @model_validator(mode="after")
    def _stated(self) -> LinkInertialSpec:
        if self.mass is not None and self.density is not None:
            raise problem("conflict", "mass and density are both given", at=("density",), key=True)
        if self.mass is None and self.density is None:
            raise problem("conflict", "neither mass nor density is given", hint="add `mass: 1.2 kg`")
        if self.inertia is not None and not self.mass:
            raise problem("conflict", "inertia needs a mass above 0", at=("inertia",), key=True)
        return self


class InertialsSpec(Model):
    """Inertials that replace or complete those of the description; `inertials: estimate` is `{estimate: {}}`."""

    estimate: EstimateSpec | None = Field(
        None,
        description="Estimates the inertial of every link with shapes whose inertial is missing, massless or "
        "impossible. Default: none is estimated.",
    )
    links: dict[str, LinkInertialSpec] = Field({}, description="Inertials by link. Default: those of the description.")

    @model_validator(mode="before")
    @classmethod
    def _word(cls, value: object) -> object:
        if value == "estimate":
            return {"estimate": {}}
        if isinstance(value, str):
            message = "expected `estimate`, or a mapping with the keys estimate and links"
            raise problem("conflict", message, hint=did_you_mean(value, ["estimate"]))
        return value

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler, /) -> JsonSchemaValue:
        return or_short(schema, handler, {"const": "estimate"})
