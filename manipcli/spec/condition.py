"""Specs of conditions, expectations and watches; `unions` builds one model per condition from them.

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

from manipcli.core.errors import Loc
from manipcli.spec.base import Model, problem
from manipcli.spec.names import StepName
from manipcli.spec.quantity import Time

ID = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")
STEP_ID = re.compile(rf"(?:{ID.pattern}(?:\[\d+\])?/)*{ID.pattern}")
"""Id of a step with the blocks around it: `stack[2]/pick_1`."""
ID_HINT = "use letters, digits, '_' and '-'; begin with a letter or '_'"
COMBINATIONS = {
    "all": "All of these conditions hold.",
    "any": "At least one of these conditions holds.",
    "not": "This condition does not hold.",
    "believed": "This condition holds for the poses that the robot believes, not for the true ones.",
    "all_of": "This condition holds for each body of the selection `of`, such as `ball[*]`.",
    "any_of": "This condition holds for at least one body of the selection `of`, such as `ball[*]`.",
    "at_least": "This condition holds for at least `n` bodies of the selection `of`, such as `ball[*]`.",
}
SINGLE = ("not", "believed", "all_of", "any_of", "at_least")
"""Combinations of one condition."""
SELECTING = ("all_of", "any_of", "at_least")
"""Combinations of one condition over the bodies of a selection."""
QUANTIFIERS = {
    "always": "This condition holds all the time.",
    "never": "This condition never holds.",
    "eventually": "This condition holds at some time.",
}
END = "end"
"""Value of `at` for the end of the run."""
WATCHED = ("never", "always")
"""Quantifiers of a watch."""


class KeyedSpec(Model):
    """A block that is identified by its single key `word`."""

    word: ClassVar[str] = ""

    @property
    def body(self) -> Model:
        """The validated block under the key."""
        body = getattr(self, self.word)
        assert isinstance(body, Model)
        return body


class ConditionSpec(KeyedSpec):
    """A condition: its name with its parameters; or `all`, `any`, `not`, `believed` with other conditions."""

    @property
    def name(self) -> str:
        """Name of the condition."""
        return self.word

    @property
    def combines(self) -> bool:
        """Whether this combines other conditions: its `members`."""
        return self.word in COMBINATIONS

    @property
    def members(self) -> tuple[ConditionSpec, ...]:
        """The conditions that this one combines."""
        if not self.combines:
            return ()
        found = getattr(self, self.word)
        return (found,) if self.word in SINGLE else found

    @property
    def where(self) -> tuple[Loc, ...]:
        """Where each of the members is written in this condition."""
        return ((self.word,),) if self.word in SINGLE else tuple((self.word, k) for k in range(len(self.members)))


class SelectedSpec(ConditionSpec):
    """A condition over a selection: under `all_of`, `any_of` or `at_least`."""

    n: Annotated[int, Field(ge=1)] | None = Field(
        None, description="Only with `at_least`: least number of bodies, up to that of the selection."
    )
    of: str | None = Field(
        None,
        description="Selection, such as `ball[*]`: the `object` of the condition. Default: the selection that the "
        "condition itself names.",
    )


class ExpectationSpec(ConditionSpec):
    """A condition and when it must hold: `at`, `during`, or under `always`, `never`, `eventually`."""

    id: str | None = Field(
        None, description="Name in reports. Default: the name of the condition, numbered from the second one on."
    )
    at: StepName | None = Field(
        None, description="When: `end` (the last 0.5 s of the run), or the id of a step (the end of that step)."
    )
    during: StepName | Annotated[tuple[StepName, ...], Field(min_length=1)] | None = Field(
        None, description="When: throughout a step, by its id, or throughout several steps."
    )
    within: Annotated[Time, Field(gt=0)] | None = Field(
        None, description="Only with `eventually`: time limit [s]. Default: the end of the run."
    )

    @property
    def quantifier(self) -> str | None:
        """`always`, `never` or `eventually`; None without a quantifier."""
        return self.word if self.word in QUANTIFIERS else None

    @property
    def condition(self) -> ConditionSpec:
        """The condition under the quantifier, or this one."""
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
        """The id; else the name of the condition, with the prefix `never_` under `never`, `believed_` in `believed`."""
        if self.id is not None:
            return self.id
        inner = self.condition
        name = f"believed_{inner.members[0].name}" if inner.name == "believed" else inner.name
        return f"never_{name}" if self.quantifier == "never" else name

    @model_validator(mode="after")
    def _once(self) -> ExpectationSpec:
        if self.id is not None and not ID.fullmatch(self.id):
            raise problem("conflict", f"'{self.id}' is not a valid id", at=("id",), hint=ID_HINT)
        if self.at is not None and self.during is not None:
            hint = "give `at` for one moment, or `during` for an interval"
            raise problem("conflict", "both `at` and `during` are given", at=("during",), key=True, hint=hint)
        if self.at is not None and self.quantifier is not None:
            message = f"`at` cannot be combined with `{self.quantifier}`"
            raise problem(
                "conflict", message, at=("at",), key=True, hint="use `during` for an interval, or leave `at` out"
            )
        if self.within is not None and self.quantifier != "eventually":
            message = "`within` is only allowed with `eventually`"
            raise problem("conflict", message, at=("within",), key=True, hint="write `eventually: {...}`")
        return self


class WatchSpec(ExpectationSpec):
    """A condition that ends the run when violated: `always` or `never`, over the whole run or `during` steps."""

    at: None = Field(None, description="Not allowed: a watch checks at all times.")
    within: None = Field(None, description="Not allowed: a watch checks at all times.")

    @property
    def label(self) -> str:
        """The id; else `watch_` and the label of an expectation."""
        return super().label if self.id is not None else f"watch_{super().label}"
