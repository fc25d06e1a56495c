"""Spec of the common keys of a step; `unions` adds the verbs."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, field_validator

from manipcli.spec.base import problem
from manipcli.spec.clearance import PartPair
from manipcli.spec.condition import ID_HINT, STEP_ID, ConditionSpec, KeyedSpec
from manipcli.spec.keep import Keeps
from manipcli.spec.quantity import Pause
from manipcli.spec.reactions import OnFail, RetrySpec


class StepSpec(KeyedSpec):
    """Common keys of every step. `body` is the validated block under the verb."""

    id: str | None = Field(None, description="Names the step in logs and reports. Default: the verb and a number.")
    until: ConditionSpec | None = Field(
        None,
        description="Condition that the step waits for after its motion (`pour`: in its dwell; a `guarded` `move`: "
        "also during the motion), for 30 s or until its `timeout`.",
    )
    timeout: Annotated[Pause, Field(gt=0)] | None = Field(
        None, description="Time after which the step fails [s], above 0 to 1 h."
    )
    keep: Keeps = Field(
        (),
        description="Constraints on the step's motions, one mapping or a list: `keep: {upright: 10 deg, tool_speed: "
        "0.25}`. A path that keeps them is searched; checked at every tick of the plan, not of the run.",
    )
    allow: tuple[PartPair, ...] = Field(
        (),
        description="Pairs of parts that may touch in this step: `[[robot/palm, shelf], [cup, tray]]`; a part is a "
        "body, `robot/LINK`, or `robot` for each of its links.",
    )
    on_fail: OnFail = Field(
        "stop",
        description="After a failure: `stop` ends the run, `continue` goes on (the failure has no effect on the "
        "verdict), `{retry: n, with: {param: value}}` re-plans and retries the step. Default `stop`.",
    )

    @property
    def retry(self) -> RetrySpec | None:
        """How the step is retried; None if it is not."""
        return self.on_fail if isinstance(self.on_fail, RetrySpec) else None

    @property
    def may_fail(self) -> bool:
        """Whether the run goes on after the last attempt failed."""
        return (self.on_fail if self.retry is None else self.retry.then) == "continue"

    @property
    def verb(self) -> str:
        """Verb of the step."""
        return self.word

    @field_validator("id", mode="after")
    @classmethod
    def _id(cls, own: str | None) -> str | None:
        if own is not None and not STEP_ID.fullmatch(own):
            raise problem("conflict", f"'{own}' is not a valid id", hint=ID_HINT)
        return own
