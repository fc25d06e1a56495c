"""Quantity types of specs, converted to SI: a bare number is SI, a string has a unit (`"45 deg"`).

Booleans, NaN, infinity and strings without a unit are refused.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from manipcli.core import units
from manipcli.core.units import NUMBER_PATTERN, Dimension, UnitError, fitting_units, names_of, symbols_of, to_si
from manipcli.spec.base import problem
from manipcli.spec.expression import quantity_of

SIGNED = r"^[-+(\s]*"
"""Begins the pattern of a quantity: signs and brackets."""
_LETTER, _OTHER = r"[A-Za-z°µμ%]", r"[^A-Za-z°µμ%\s]"


@dataclass(frozen=True, slots=True)
class Unit:
    """Metadata of an annotated float: the dimensions that a string may have."""

    dimensions: tuple[Dimension, ...]

    @property
    def name(self) -> str:
        """`an angle or a length`."""
        return names_of(self.dimensions)

    @property
    def expected(self) -> str:
        """What to write, for messages."""
        symbols = " or ".join(dimension.symbol or "1" for dimension in self.dimensions)
        last = fitting_units(self.dimensions[0])[1 if len(fitting_units(self.dimensions[0])) > 1 else 0]
        example = f"5 {last}" if self.dimensions[0].symbol else last
        number = f": a number in {symbols}" if symbols != "1" else ""
        return f"{self.name}{number}, or a string such as '{example}'"

    @property
    def pattern(self) -> str:
        """JSON Schema pattern of a string: a number, then an operator, a compound unit, or one fitting symbol."""
        fitting = [symbol for dimension in self.dimensions for symbol in symbols_of(dimension)]
        alone = "|".join(symbol.replace("u", "[uµμ]") for symbol in fitting)
        if units.NUMBER in self.dimensions:
            alone += "|"
        several = rf"{_LETTER}+(?:{_OTHER}|\s+\S)"
        after = rf"[-+*/)]|{several}" + (rf"|(?:{alone})\s*$" if alone else "")
        return rf"{SIGNED}{NUMBER_PATTERN}(?![\d.]|[eE][-+]?\d)\s*(?:{after})|\$"

    def read(self, value: object) -> object:
        """The SI value of a string; a number passes on to pydantic unchanged."""
        if isinstance(value, str):
            try:
                return to_si(value, *self.dimensions, read=quantity_of)
            except UnitError as error:
                raise problem("unit", error.cause, hint=error.hint) from None
        if value is None or isinstance(value, bool | list | tuple | dict):
            raise PydanticCustomError("quantity_type", "{expected}", {"expected": self.expected})
        return value

    def __get_pydantic_core_schema__(self, source: type[float], handler: GetCoreSchemaHandler, /) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self.read, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler, /) -> JsonSchemaValue:
        json_schema = handler(schema)
        json_schema["type"] = ["number", "string"]
        json_schema["pattern"] = self.pattern
        json_schema["description"] = self.expected
        return json_schema


Length = Annotated[float, Unit((units.LENGTH,))]
Angle = Annotated[float, Unit((units.ANGLE,))]
Mass = Annotated[float, Unit((units.MASS,))]
Time = Annotated[float, Unit((units.TIME,))]
Pause = Annotated[Time, Field(le=3600.0)]
"""A waiting time, at most 1 h."""
Frequency = Annotated[float, Unit((units.FREQUENCY,))]
Force = Annotated[float, Unit((units.FORCE,))]
Torque = Annotated[float, Unit((units.TORQUE,))]
Speed = Annotated[float, Unit((units.SPEED,))]
Acceleration = Annotated[float, Unit((units.ACCELERATION,))]
Energy = Annotated[float, Unit((units.ENERGY,))]
"""In J = N m: a torque has the same dimension."""
Share = Annotated[float, Unit((units.NUMBER,))]
"""`0.1` or `"10 %"`."""
JointValue = Annotated[float, Unit((units.ANGLE, units.LENGTH))]
"""Position of a joint, revolute or prismatic."""
Turn = Annotated[Angle, Field(ge=-6.2832, le=6.2832)]
"""An angle of at most one revolution in either direction, rounded up."""
AngleTolerance = Annotated[Angle, Field(gt=0, le=3.1416)]
"""Tolerance on an orientation, at most pi: degrees without a unit are refused."""
JointTolerance = Annotated[JointValue, Field(gt=0, le=3.1416)]
"""Tolerance on a joint position, at most pi likewise."""
JointVelocity = Annotated[float, Unit((units.ANGULAR_VELOCITY, units.SPEED))]
JointAcceleration = Annotated[float, Unit((units.ANGULAR_ACCELERATION, units.ACCELERATION))]
JointJerk = Annotated[float, Unit((units.ANGULAR_JERK, units.JERK))]
JointEffort = Annotated[float, Unit((units.TORQUE, units.FORCE))]
JointStiffness = Annotated[float, Unit((units.ANGULAR_STIFFNESS, units.STIFFNESS))]
JointDamping = Annotated[float, Unit((units.ANGULAR_DAMPING, units.DAMPING))]
