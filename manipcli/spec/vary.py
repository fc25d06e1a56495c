"""Spec of `vary:`: the numbers that are drawn for each sample, and their distributions.

The dimension of an amount such as `2 cm` depends on the path, so amounts stay as written here.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field, GetJsonSchemaHandler, TypeAdapter, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from manipcli.spec.base import Model, or_short, problem

Amount = float | str
"""A number (SI), or a string with a unit."""
Value = Amount | tuple[Amount, ...]
"""An amount; for a vector, one amount for all components or one per component."""
WORDS = ("uniform", "normal", "choice", "grid")


class NormalSpec(Model):
    """A normal distribution; short form `[mean, sd]`."""

    mean: Value = Field(description="Mean.")
    sd: Value = Field(description="Standard deviation, above 0.")

    @model_validator(mode="before")
    @classmethod
    def _pair(cls, value: object) -> object:
        return {"mean": value[0], "sd": value[1]} if isinstance(value, list) and len(value) == 2 else value

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler, /) -> JsonSchemaValue:
        return or_short(schema, handler, TypeAdapter(tuple[Value, Value]).json_schema())


class DistributionSpec(Model):
    """Exactly one distribution. Components of a vector are drawn independently, unless the items are lists."""

    keys: ClassVar[tuple[str, ...]] = WORDS

    uniform: tuple[Value, Value] | None = Field(
        None, description="[least, most]: uniform over this interval; for whole numbers, over its integers."
    )
    normal: NormalSpec | None = Field(
        None,
        description="{mean, sd} or [mean, sd], truncated at the field's bounds (a mass at 0); whole numbers rounded.",
    )
    choice: Annotated[tuple[Value, ...], Field(min_length=1)] | None = Field(
        None, description="One of these values, with equal probability."
    )
    grid: Annotated[tuple[Value, ...], Field(min_length=1)] | None = Field(
        None,
        description="These values in turn. Sample 0 takes the first value of every grid, the last grid of the file "
        "advances fastest, and after all combinations they start over.",
    )

    @property
    def word(self) -> str:
        """The key that is set."""
        return next(key for key in self.keys if getattr(self, key) is not None)

    @model_validator(mode="after")
    def _one(self) -> DistributionSpec:
        given = [key for key in self.keys if getattr(self, key) is not None]
        if len(given) != 1:
            found = f"not both '{given[0]}' and '{given[1]}'" if given else "got none"
            message = f"expected exactly one of {', '.join(self.keys)}, {found}"
            raise problem("conflict", message, at=(given[1],) if given else (), key=bool(given))
        return self


class VarySpec(DistributionSpec):
    """Distribution of a number: of its value, or of an offset or a factor applied to the value in the file."""

    keys: ClassVar[tuple[str, ...]] = (*WORDS, "offset", "scale")

    offset: DistributionSpec | None = Field(
        None, description="Distribution of an amount that is added to the value in the file."
    )
    scale: DistributionSpec | None = Field(None, description="Distribution of a factor on the value in the file.")

    @property
    def distribution(self) -> DistributionSpec:
        """The distribution, whether of the value, an offset or a factor."""
        return self.offset or self.scale or self
