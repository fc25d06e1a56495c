"""Spec of `baseline:`: allowed changes of a run relative to its blessed baseline."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from manipcli.spec.base import Model
from manipcli.spec.quantity import Share

Allowance = Annotated[Share, Field(ge=0)]


class ToleranceSpec(Model):
    """Allowed changes as shares of the blessed value; changes below 0.05 s, 1 J, 1 mm, 0.5 deg or 0.5 N are ignored."""

    duration: Allowance = Field(
        0.05, description="How much longer the task and each step may take, 0 or more. Default 5 %."
    )
    energy: Allowance = Field(0.1, description="How much more energy the joints may deliver, 0 or more. Default 10 %.")
    margin: Allowance = Field(0.25, description="How much of a margin may be lost, 0 or more. Default 25 %.")


class BaselineSpec(Model):
    """How `manipcli test` compares a run with the baseline that `manipcli bless` wrote."""

    tolerance: ToleranceSpec = Field(ToleranceSpec(), description="Allowed changes for the worse.")
