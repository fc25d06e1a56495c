"""`vary:` of a task: which numbers are drawn anew for each sample, and from what.

What a text such as `2 cm` must be is known only once the path is: here amounts stay as they are written.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field, GetJsonSchemaHandler, TypeAdapter, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from manipcli.spec.base import Model, or_short, problem

Amount = float | str
"""A number (SI), or a text with a unit."""
Value = Amount | tuple[Amount, ...]
"""Of a vector: an amount for all its components, or one for each."""
WORDS = ("uniform", "normal", "choice", "grid")


class NormalSpec(Model):
    """A normal distribution; `[mean, sd]` is short for it."""

    mean: Value = Field(description="The middle.")
    sd: Value = Field(description="The standard deviation, above 0.")

    @model_validator(mode="before")
    @classmethod
    def _pair(cls, value: object) -> object:
        return {"mean": value[0], "sd": value[1]} if isinstance(value, list) and len(value) == 2 else value

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler, /) -> JsonSchemaValue:
        return or_short(schema, handler, TypeAdapter(tuple[Value, Value]).json_schema())


class DistributionSpec(Model):
    """Exactly one distribution. Of a vector each component is drawn on its own, unless lists are what is chosen."""

    keys: ClassVar[tuple[str, ...]] = WORDS

    uniform: tuple[Value, Value] | None = Field(
        None, description="[least, most]: every value between them alike; of a whole number each of them alike."
    )
    normal: NormalSpec | None = Field(
        None,
        description="{mean, sd} or [mean, sd], cut off at the field's bounds (a mass at 0); whole numbers rounded.",
    )
    choice: Annotated[tuple[Value, ...], Field(min_length=1)] | None = Field(
        None, description="One of these, each alike."
    )
    grid: Annotated[tuple[Value, ...], Field(min_length=1)] | None = Field(
        None,
        description="One of these after the other. Sample 0 has the first of every grid, the last grid of the file "
        "goes on first, and after all combinations they begin again.",
    )

    @property
    def word(self) -> str:
        """Which of `keys` it is."""
        return next(key for key in self.keys if getattr(self, key) is not None)

    @model_validator(mode="after")
    def _one(self) -> DistributionSpec:
        given = [key for key in self.keys if getattr(self, key) is not None]
        if len(given) != 1:
            found = f"not both '{given[0]}' and '{given[1]}'" if given else "not none"
            message = f"expected exactly one of {', '.join(self.keys)}, {found}"
            raise problem("conflict", message, at=(given[1],) if given else (), key=bool(given))
        return self


class VarySpec(DistributionSpec):
    """From what a number is drawn: the value itself, or what is added to it, or by what it is multiplied."""

    keys: ClassVar[tuple[str, ...]] = (*WORDS, "offset", "scale")

    offset: DistributionSpec | None = Field(None, description="Drawn, and added to the value in the file.")
    scale: DistributionSpec | None = Field(None, description="Drawn, and multiplied with the value in the file.")

    @property
    def distribution(self) -> DistributionSpec:
        """What is drawn, wherever it stands."""
        return self.offset or self.scale or self
