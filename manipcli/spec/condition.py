"""Conditions and expectations as they are written; the loader makes one model a word of these.

until: {inside: {object: ball, of: tray}}
expect:
  - upright: {object: cup, within: 30 deg}
    during: lift_1
  - eventually: {all: [{at_rest: {object: ball}}, {not: {inside: {object: ball, of: cup}}}]}
    within: 8 s
watch:
  - never: {collision: [robot, desk]}
"""

from __future__ import annotations

import re
from typing import Annotated, ClassVar

from pydantic import Field, model_validator

from manipcli.spec.base import Model, problem
from manipcli.spec.quantity import Time

ID = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")
ID_HINT = "an id is letters, digits, '_' and '-', and begins with a letter"
COMBINATIONS = {
    "all": "Every one of these conditions holds.",
    "any": "One of these conditions holds, at least.",
    "not": "This condition does not hold.",
}
QUANTIFIERS = {
    "always": "This condition holds all the time.",
    "never": "This condition never holds.",
    "eventually": "This condition holds at some time.",
}
END = "end"
"""The word of `at` for the end of the run."""
WATCHED = ("never", "always")
"""The words under which a condition can be watched while the run goes on."""


class KeyedSpec(Model):
    """A block that is known by its one key `word`."""

    word: ClassVar[str] = ""

    @property
    def body(self) -> Model:
        """The validated block under the key."""
        body = getattr(self, self.word)
        assert isinstance(body, Model)
        return body


class ConditionSpec(KeyedSpec):
    """A condition: its name, and under it what it asks; or `all`, `any`, `not`, and under it other conditions."""

    @property
    def name(self) -> str:
        """Which condition this is."""
        return self.word

    @property
    def combines(self) -> bool:
        """Whether this is made of other conditions: its `members`."""
        return self.word in COMBINATIONS

    @property
    def members(self) -> tuple[ConditionSpec, ...]:
        """The conditions that this one combines."""
        if not self.combines:
            return ()
        found = getattr(self, self.word)
        return (found,) if self.word == "not" else found


class ExpectationSpec(ConditionSpec):
    """A condition and when it must hold: `at`, `during`, or under `always`, `never`, `eventually`."""

    id: str | None = Field(None, description="Names it in reports. Default: its word, numbered from the second on.")
    at: str | None = Field(
        None, description="When: `end` (the last 0.5 s of the run), or the id of a step (the moment at which it ends)."
    )
    during: str | Annotated[tuple[str, ...], Field(min_length=1)] | None = Field(
        None, description="When: all the time of a step, by its id, or of several."
    )
    within: Annotated[Time, Field(gt=0)] | None = Field(
        None, description="Only with `eventually`: how long there is time for it [s]. Default: to the end."
    )

    @property
    def quantifier(self) -> str | None:
        """`always`, `never`, `eventually`; None where the condition stands alone."""
        return self.word if self.word in QUANTIFIERS else None

    @property
    def condition(self) -> ConditionSpec:
        """What must hold, or must not."""
        if self.quantifier is None:
            return self
        found = getattr(self, self.word)
        assert isinstance(found, ConditionSpec)
        return found

    @property
    def steps(self) -> tuple[str, ...]:
        """Ids of the steps of `during`."""
        return (self.during,) if isinstance(self.during, str) else self.during or ()

    @property
    def label(self) -> str:
        """Its id; else the word of its condition, after `never_` where it must never hold."""
        if self.id is not None:
            return self.id
        return f"never_{self.condition.name}" if self.quantifier == "never" else self.condition.name

    @model_validator(mode="after")
    def _once(self) -> ExpectationSpec:
        if self.id is not None and not ID.fullmatch(self.id):
            raise problem("conflict", f"'{self.id}' cannot be an id", at=("id",), hint=ID_HINT)
        if self.at is not None and self.during is not None:
            hint = "`at` is one moment, `during` a time"
            raise problem("conflict", "say either `at` or `during`", at=("during",), key=True, hint=hint)
        if self.at is not None and self.quantifier is not None:
            message = f"`at` is one moment, `{self.quantifier}` speaks of a time"
            raise problem("conflict", message, at=("at",), key=True, hint="say `during`, or leave it out")
        if self.within is not None and self.quantifier != "eventually":
            message = "`within` beside a condition goes with `eventually` alone"
            raise problem("conflict", message, at=("within",), key=True, hint="write `eventually: {...}`")
        return self


class WatchSpec(ExpectationSpec):
    """What ends the run where it is broken: `always` or `never`, over the whole run or `during` steps."""

    at: None = Field(None, description="Nothing: a watch looks at all times.")
    within: None = Field(None, description="Nothing: a watch looks at all times.")

    @property
    def label(self) -> str:
        """Its id; else `watch_` and what an expectation would be called."""
        return super().label if self.id is not None else f"watch_{super().label}"
