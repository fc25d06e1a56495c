"""`duration`: it is over in time."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import Condition, Gauge, World
from manipcli.conditions.robustness import Reading, reading
from manipcli.conditions.state_window import ROUNDING, Moments
from manipcli.spec.base import Model
from manipcli.spec.quantity import Time


class TimeTakenSpec(Model):
    """The simulated time of the whole run, or of the step that is looked at, is `below` this."""

    below: Annotated[Time, Field(gt=0)] = Field(description="Longest simulated time [s].")


def gauge(spec: TimeTakenSpec, world: World) -> Gauge:
    """`below` minus the time [s] since the first tick.

    A tick of a step lasts until the next one, or until the step ended: with `at: STEP` and `during: STEP` it is the
    time from the start of the step to its end.
    """
    started: list[float] = []

    def look(moments: Moments) -> Reading:
        if not started:
            started.append(float(moments.times[0]))
        until = moments.times.copy()
        for step in moments.steps:
            if step.started is not None:
                ended = np.inf if step.ended is None else step.ended
                inside = (moments.times >= step.started - ROUNDING) & (moments.times < ended - ROUNDING)
                until[inside] = np.minimum(moments.times[inside] + world.period, ended)
        passed = np.round(until - started[0], 9)

        def say(k: int) -> str:
            return f"{passed[k]:.3f} s of {spec.below:g} s"

        return reading(spec.below - passed, moments.times, unit="s", scale=spec.below, say=say)

    return look


DURATION = Condition(
    name="duration",
    spec=TimeTakenSpec,
    units=("s",),
    open=gauge,
    check=lambda spec, setting: (),
    absent=lambda spec, world: None,
    example="duration: {below: 60 s}",
)
