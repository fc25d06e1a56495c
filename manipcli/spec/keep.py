"""Block `keep` of a step: constraints on the path and on its timing."""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator, Field, model_validator

from manipcli.spec.base import Model, problem
from manipcli.spec.names import BodyName, FrameName
from manipcli.spec.quantity import Acceleration, Angle, Length, Speed
from manipcli.spec.robot import Vector3

Side = Annotated[Length, Field(gt=0, le=100.0)]


class VolumeSpec(Model):
    """A box along the axes of `frame`."""

    centre: Vector3 = Field(description="Its centre [x, y, z] in `frame`.")
    size: tuple[Side, Side, Side] = Field(description="Its sides [m].")


class InsideSpec(Model):
    """A volume that the tool, or the held object, stays in."""

    box: VolumeSpec = Field(description="A box.")
    frame: FrameName | None = Field(
        None,
        description="`base`, a body, a part of one or a named frame, as it is before the step. Default: `world`.",
    )


class KeepSpec(Model):
    """What must hold while the robot moves; several constraints in one mapping, or a list of mappings."""

    upright: Annotated[Angle, Field(gt=0, le=3.1416)] | None = Field(
        None,
        description="Largest angle between the held object's z axis and the vertical [rad]; except while `pour` tilts. "
        "Default: 20 deg where the object has contents and the motion ends upright, else unlimited.",
    )
    above: BodyName | None = Field(
        None,
        description="A body that the held object, or the tool where nothing is held, stays above; except where a step "
        "approaches, lowers and withdraws.",
    )
    by: Annotated[Length, Field(ge=0, le=100.0)] | None = Field(
        None, description="Height above the top of that body [m]. Default: 0."
    )
    inside: InsideSpec | None = Field(
        None, description="Where the corners of the held object, or the tool where nothing is held, stay."
    )
    tool_speed: Annotated[Speed, Field(gt=0)] | None = Field(
        None, description="Largest speed of the tool's origin [m/s]."
    )
    tool_acceleration: Annotated[Acceleration, Field(gt=0)] | None = Field(
        None, description="Largest acceleration of the tool's origin [m/s2]."
    )
    slosh: Annotated[Angle, Field(gt=0, le=1.5)] | None = Field(
        None,
        description="Largest angle between the axis of the held container and the apparent gravity at its contents "
        "[rad], so that nothing is spilt by acceleration; except while `pour` tilts.",
    )

    @model_validator(mode="after")
    def _consistent(self) -> KeepSpec:
        if self.by is not None and self.above is None:
            raise problem("conflict", "`by` needs `above: BODY`", at=("by",), key=True, hint="add `above: BODY`")
        if all(getattr(self, word) is None for word in type(self).model_fields):
            raise problem("conflict", "`keep` has no constraint", hint="for example `keep: {upright: 10 deg}`")
        return self


def _listed(value: object) -> object:
    return [value] if isinstance(value, dict | KeepSpec) else value


Keeps = Annotated[
    tuple[KeepSpec, ...], BeforeValidator(_listed, json_schema_input_type=KeepSpec | tuple[KeepSpec, ...])
]
"""A mapping, or a list of them."""
