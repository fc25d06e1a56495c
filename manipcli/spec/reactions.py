"""Specs of `replan` and `on_fail`: when a step is re-planned, and what follows a failure."""

from __future__ import annotations

from math import radians
from typing import Annotated, Literal

from pydantic import Field

from manipcli.spec.base import Model
from manipcli.spec.quantity import AngleTolerance, JointTolerance, Length

Then = Literal["stop", "continue"]


class ReplanSpec(Model):
    """Tolerances between the planned and the measured start of a step; beyond them the step is re-planned."""

    position: Annotated[Length, Field(gt=0, description="Position of a body [m], above 0. Default 5 mm.")] = 0.005
    rotation: AngleTolerance = Field(radians(2), description="Rotation of a body [rad], above 0 to pi. Default 2 deg.")
    slip: Annotated[
        Length, Field(gt=0, description="Slip of a held object in the hand [m], above 0. Default 1 mm.")
    ] = 0.001
    joints: Annotated[
        JointTolerance, Field(description="Position of a commanded joint [rad or m], above 0 to pi. Default 0.05.")
    ] = 0.05


class RetrySpec(Model):
    """Retries of a failed step, each re-planned from the measured state."""

    retry: Annotated[int, Field(ge=1, le=20, description="Number of retries, 1 to 20.")]
    with_: dict[str, bool | int | float | str] = Field(
        {}, alias="with", description="Task parameters with other values for this step in the retries."
    )
    then: Then = Field("stop", description="What to do when all retries fail. Default `stop`.")


OnFail = Then | RetrySpec
