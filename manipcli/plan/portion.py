"""How much of what a container holds is poured: bodies, a share, or a mass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator

from manipcli.core.errors import NotPlannable
from manipcli.core.units import MASS, NUMBER, UnitError, readable, to_si
from manipcli.scene.scene import Body
from manipcli.spec.base import problem
from manipcli.spec.expression import quantity_of

EXPECTED = "a number of bodies (10), a share ('50 %') or a mass ('20 g')"


@dataclass(frozen=True, slots=True)
class Portion:
    """What is to leave a container: `value` of `unit`; a share is one of the mass, from 0 to 1, a mass in kg."""

    value: float
    unit: Literal["bodies", "share", "mass"]

    @property
    def text(self) -> str:
        """`10 bodies`."""
        if self.unit == "bodies":
            return f"{self.value:.0f} {'body' if self.value == 1.0 else 'bodies'}"
        return f"{100.0 * self.value:.4g} %" if self.unit == "share" else readable(self.value, "kg")

    def number(self, contents: Sequence[Body]) -> int:
        """The least number of bodies, in this order, that are as much.

        Raises:
            NotPlannable: the contents are less.
        """
        for number in range(1, len(contents) + 1):
            if self.reached(contents, contents[:number]):
                return number
        whole = Portion(float(len(contents)), "bodies") if self.unit == "bodies" else Portion(_mass(contents), "mass")
        hint = f"write an `amount` of at most {whole.text}, or none to pour all"
        raise NotPlannable(f"cannot pour {self.text}: the container holds {whole.text}", hint=hint)

    def reached(self, contents: Sequence[Body], left: Sequence[Body]) -> bool:
        """Whether the bodies that left are at least as much, of these contents."""
        if self.unit == "bodies":
            return len(left) >= self.value
        wanted = self.value * (_mass(contents) if self.unit == "share" else 1.0)
        return _mass(left) >= wanted * (1.0 - 1e-9)


def _mass(bodies: Sequence[Body]) -> float:
    return sum(body.mass for body in bodies)


def portion_of(amount: float | str) -> Portion:
    """The portion that a task file writes as `10`, `'50 %'` or `'20 g'`.

    Raises:
        UnitError: the text is none of these.
    """
    if not isinstance(amount, str):
        return Portion(float(amount), "bodies")
    try:
        number = to_si(amount, NUMBER, read=quantity_of)
    except UnitError:
        return Portion(to_si(amount, MASS, read=quantity_of), "mass")
    return Portion(number, "share" if "%" in amount else "bodies")


def _typed(amount: object) -> object:
    if isinstance(amount, bool) or not isinstance(amount, int | float | str):
        raise problem("type", f"expected {EXPECTED}", hint="write `amount: 50 %`")
    return amount


def _sound(amount: float | str) -> float | str:
    try:
        portion = portion_of(amount)
    except UnitError as error:
        raise problem(
            "unit", f"{error.cause.partition('; expected')[0]}; expected {EXPECTED}", hint="write `amount: 50 %`"
        ) from None
    if portion.value <= 0.0:
        raise problem("range", f"must be above 0, not {portion.text}", hint="remove the step to pour nothing")
    if portion.unit == "share" and portion.value > 1.0:
        raise problem("range", f"must be at most 100 %, not {portion.text}", hint="remove `amount` to pour all")
    if portion.unit == "bodies" and portion.value != int(portion.value):
        more = f"write `'{100.0 * portion.value:.4g} %'` for a share" if portion.value < 1.0 else "write a whole number"
        raise problem("range", f"{portion.value:g} bodies cannot be poured", hint=more)
    return amount


Amount = Annotated[int | float | str, BeforeValidator(_typed, json_schema_input_type=int | str), AfterValidator(_sound)]
"""See `portion_of`."""
