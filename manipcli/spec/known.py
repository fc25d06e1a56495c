"""How well the robot knows where a body is at the start."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from manipcli.spec.base import Model, problem
from manipcli.spec.quantity import Angle, Length

Spread = Annotated[Length, Field(ge=0.0, le=10.0)]


class RegionSpec(Model):
    """Positions about the true one, `radius`, `circle` or `box`; the believed position is drawn uniformly from them."""

    radius: Annotated[Length, Field(gt=0.0, le=10.0)] | None = Field(
        None, description="Radius of a level disc [m], above 0 to 10 m."
    )
    circle: Annotated[Length, Field(gt=0.0, le=10.0)] | None = Field(
        None,
        description="Radius of a level circle [m], on which the position is: always off by that, in any direction.",
    )
    box: tuple[Spread, Spread, Spread] | None = Field(
        None, description="Full lengths along the axes of the world [m], 0 to 10 m."
    )

    @model_validator(mode="after")
    def _one(self) -> RegionSpec:
        given = [key for key in ("radius", "circle", "box") if getattr(self, key) is not None]
        if len(given) != 1:
            found, at = " and ".join(given) or "none", tuple(given[-1:])
            raise problem("conflict", f"expected exactly one of radius, circle, box, got {found}", at=at, key=bool(at))
        return self


class KnownSpec(Model):
    """The robot knows the body to be within this of where it believes it; without it, it knows the pose exactly."""

    region: RegionSpec | None = Field(None, description="Error of the position. Default: none.")
    rotation: Annotated[Angle, Field(ge=0.0, le=3.1416)] = Field(
        0.0, description="Largest error of the rotation about the vertical, either way [rad], 0 to 180 deg. Default 0."
    )

    @model_validator(mode="after")
    def _uncertain(self) -> KnownSpec:
        region = self.region
        box = () if region is None else region.box or (region.radius or region.circle or 0.0,)
        if self.rotation == 0.0 and not any(box):
            hint = "write `region: {radius: 3 cm}` or `rotation: 10 deg`, or remove `known`"
            raise problem("conflict", "`known` has neither a region nor a rotation", hint=hint)
        return self
