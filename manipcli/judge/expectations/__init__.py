"""The expectations: every condition, held at the end, and those that look at the whole recording (one file each)."""

from __future__ import annotations

from typing import Any

from manipcli.core.registry import Seam
from manipcli.judge.expectation import Expectation, at_end
from manipcli.judge.expectations.duration import DURATION
from manipcli.judge.expectations.no_collision import NO_COLLISION
from manipcli.judge.expectations.step_done import STEP_DONE
from manipcli.judge.expectations.tracking import TRACKING
from manipcli.model.condition import Condition
from manipcli.model.conditions import CONDITIONS


# Any: a seam holds members of different specs; each is only ever called with its own.
def expectations(conditions: Seam[Condition[Any]]) -> Seam[Expectation[Any]]:
    """The seam of expectations that these conditions make."""
    ends = tuple(at_end(condition) for condition in conditions)
    return Seam(kind="expectation", members=(*ends, TRACKING, NO_COLLISION, DURATION, STEP_DONE))


EXPECTATIONS: Seam[Expectation[Any]] = expectations(CONDITIONS)
