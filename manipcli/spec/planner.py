"""Block `planner` of a task file: the common settings of path planners. Each member adds its own."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from manipcli.spec.base import Model


class PlannerSpec(Model):
    """How paths around obstacles are searched, where the straight joint-space path is not free."""

    type: str = Field("rrt_connect", description="The path planner. Default rrt_connect.")
    samples: Annotated[
        int, Field(ge=0, le=10_000_000, description="Most samples of one search; 0: none is made. Default 5000.")
    ] = 5_000
    shortcuts: Annotated[
        int, Field(ge=0, le=1_000_000, description="Attempts to shorten a path that was found. Default 200.")
    ] = 200
    deviation: Annotated[
        float,
        Field(
            gt=0, le=1, description="How far the corners of a path are rounded [rad or m], over 0 to 1. Default 0.1."
        ),
    ] = 0.1
