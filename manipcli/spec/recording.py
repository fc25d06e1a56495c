"""Specs of what a run records, and how often."""

from __future__ import annotations

from typing import Annotated, Final, Literal, get_args

from pydantic import Field, model_validator

from manipcli.spec.base import Model, problem
from manipcli.spec.quantity import Frequency

Rate = Annotated[Frequency, Field(gt=0)]
SLOWEST: Final = 20.0
"""Lowest rate [Hz] at which the end of a run can be judged."""


class RatesSpec(Model):
    """Recording rates of topics [Hz]: the control rate divided by a whole number."""

    joint_states: Rate | None = Field(None, description="Measured joints [Hz], 20 or more. Default: the control rate.")
    tf: Rate | None = Field(None, description="Links and bodies [Hz], 20 or more. Default: the control rate.")
    controller_state: Rate | None = Field(
        None, description="State of every controller [Hz], 20 or more. Default: the control rate."
    )
    reference: Rate | None = Field(None, description="Reference of every controller, for plots [Hz]. Default 100 Hz.")
    error: Rate | None = Field(None, description="Error of every controller, for plots [Hz]. Default 100 Hz.")
    actuator_states: Rate | None = Field(
        None, description="Actuators, behind the transmissions [Hz]; efforts at the gears. Default 100 Hz."
    )
    wrench: Rate | None = Field(None, description="Wrench of every force sensor [Hz]. Default: the control rate.")

    @property
    def given(self) -> dict[str, float]:
        """Rates that are set, by topic."""
        rates = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: rate for name, rate in rates.items() if rate is not None}


ChosenTopic = Literal[
    "joint_states",
    "tf",
    "controller_state",
    "reference",
    "error",
    "actuator_states",
    "wrench",
    "contacts",
    "goals",
    "sensors",
]
"""Optional topics; `goals` are the action topics of the controllers, `sensors` those below `/sensors`."""
JUDGED: Final = ("joint_states", "tf", "controller_state")
"""Topics that the judge reads together, at the ticks at which all of them are recorded."""


class RecordSpec(Model):
    """Recorded topics and their rates. Small topics, one-time messages and joint states are always recorded."""

    rates: RatesSpec = Field(RatesSpec(), description="How often topics are recorded.")
    topics: tuple[ChosenTopic, ...] | None = Field(
        None, description="The optional topics to record; `joint_states` is always recorded. Default: all."
    )

    @model_validator(mode="after")
    def _consistent(self) -> RecordSpec:
        for name, rate in self.rates.given.items():
            if name in self.left_out:
                raise problem("conflict", f"'{name}' has a rate, but is not among `topics`", at=("rates", name))
            if name in JUDGED and rate < SLOWEST:
                message = f"'{name}' is recorded at {rate:g} Hz; judging needs at least {SLOWEST:g} Hz"
                raise problem("conflict", message, at=("rates", name), hint=f"record it at {SLOWEST:g} Hz or more")
        return self

    def strides(self, period: float) -> dict[str, int]:
        """Control ticks of `period` [s] between two messages of each topic with a rate."""
        return {name: max(1, round(1.0 / (rate * period))) for name, rate in self.rates.given.items()}

    @property
    def left_out(self) -> frozenset[str]:
        """Topics that are not recorded."""
        return frozenset() if self.topics is None else frozenset(get_args(ChosenTopic)) - {*self.topics, "joint_states"}
