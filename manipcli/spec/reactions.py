"""What a task says about the time while it runs: what is planned again, and what a failed step leads to."""

from __future__ import annotations

from math import radians
from typing import Annotated, Literal

from pydantic import Field

from manipcli.spec.base import Model
from manipcli.spec.quantity import AngleTolerance, JointTolerance, Length

Then = Literal["stop", "continue"]


class ReplanSpec(Model):
    """How far things may be from where a step was planned to begin; where one is further, it is planned again."""

    position: Annotated[Length, Field(gt=0, description="Of a body [m], above 0. Default 5 mm.")] = 0.005
    rotation: AngleTolerance = Field(radians(2), description="Of a body [rad], above 0 to pi. Default 2 deg.")
    slip: Annotated[Length, Field(gt=0, description="Of what is held, in the hand [m], above 0. Default 1 mm.")] = 0.001
    joints: Annotated[
        JointTolerance, Field(description="Of a joint that is commanded [rad or m], above 0 to pi. Default 0.05.")
    ] = 0.05


class RetrySpec(Model):
    """A step that failed is planned from what is measured then, and tried again."""

    retry: Annotated[int, Field(ge=1, le=20, description="How many more attempts, 1 to 20.")]
    with_: dict[str, bool | int | float | str] = Field(
        {}, alias="with", description="Parameters of the task that have other values in these attempts, for this step."
    )
    then: Then = Field("stop", description="What follows when all attempts have failed. Default `stop`.")


OnFail = Then | RetrySpec
