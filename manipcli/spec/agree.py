"""Spec of `agree:`: allowed differences between the runs of one task in several engines."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from manipcli.core.units import NUMBER, Quantity, UnitError
from manipcli.spec.base import Model, problem
from manipcli.spec.baseline import Allowance
from manipcli.spec.expression import quantity_of
from manipcli.spec.quantity import Length


def amount_of(text: str) -> Quantity:
    """The quantity in an amount such as `1 cm` or `20 %`.

    Raises:
        UnitError: it is not a quantity.
    """
    return quantity_of(text)


def _amount(value: float | str) -> float | str:
    try:
        size = amount_of(value).value if isinstance(value, str) else value
    except UnitError as error:
        raise problem("unit", f"{error.cause}; expected an amount or a share", hint="write '1 cm' or '20 %'") from None
    if isinstance(value, str) and amount_of(value).dimension == NUMBER and "%" not in value:
        raise problem("unit", f"'{value}' has no unit", hint=f"write '{value} mm', or '{value} %' of the margin")
    if size < 0:
        raise problem("range", f"{value} is negative; expected 0 or more")
    return value


Amount = Annotated[float | str, AfterValidator(_amount)]
"""A share (`20 %`), an amount with its unit (`1 cm`), or a number in the SI unit of the margin."""


class AgreeSpec(Model):
    """How far runs of this task in several engines may differ. What is left out may differ by any amount.

    A share is of the largest value of the runs; differences below 0.05 s, 1 mm, 0.5 deg or 0.5 N are then ignored.
    """

    margin: Allowance | None = Field(None, description="How much every margin may differ, as a share. Default: any.")
    margins: dict[str, Amount] = Field(
        {}, description="How much single margins may differ, by the name of the expectation: `1 cm` or `20 %`."
    )
    duration: Allowance | None = Field(
        None, description="How much the durations of task and steps may differ, as a share. Default: any."
    )
    slip: Annotated[Length, Field(ge=0)] | None = Field(
        None, description="How much the slip of each grasp may differ [m]. Default: any."
    )
    force: Allowance | None = Field(
        None, description="How much the peak force of each grasp may differ, as a share. Default: any."
    )
    contact_force: Allowance | None = Field(
        None, description="How much the peak contact force of each step may differ, as a share. Default: any."
    )
