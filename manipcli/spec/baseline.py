"""`baseline:` of a task: how much worse than what was blessed a run may be."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from manipcli.spec.base import Model
from manipcli.spec.quantity import Share

Allowance = Annotated[Share, Field(ge=0)]


class ToleranceSpec(Model):
    """Shares of the blessed value; differences of less than 0.05 s, 1 J, 1 mm, 0.5 deg or 0.5 N never count."""

    duration: Allowance = Field(
        0.05, description="How much longer the task and each step may take, 0 or more. Default 5 %."
    )
    energy: Allowance = Field(0.1, description="How much more the joints may give, 0 or more. Default 10 %.")
    margin: Allowance = Field(0.25, description="How much of a margin may be lost, 0 or more. Default 25 %.")


class BaselineSpec(Model):
    """What `manipcli test` compares with the baseline that `manipcli bless` wrote."""

    tolerance: ToleranceSpec = Field(ToleranceSpec(), description="How much worse is no failure.")
