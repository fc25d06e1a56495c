"""Spec of `plan:`: how the plan of a task is chosen."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from manipcli.spec.base import Model


class PlanSpec(Model):
    """How the plan of a task is chosen."""

    optimise: Annotated[
        int,
        Field(
            ge=0,
            le=10_000,
            description="Number of further candidates (grasps, approaches, places, configurations of the arm) that are "
            "compared with the first plan, 0 to 10000; the cheapest plan of the whole task is used. Default 0: the "
            "first plan is used.",
        ),
    ] = 0
    effort: Annotated[
        float,
        Field(
            gt=0,
            le=10_000,
            description="Work that the search may take for each step before the task is refused, above 0 to 10000: 1 "
            "is about 4 s on a quiet machine. It counts work, not time: a slow machine makes the same plan. Default 1.",
        ),
    ] = 1.0
