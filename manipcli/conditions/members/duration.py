"""`duration`: it is over in time."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import Condition, Gauge, World
from manipcli.conditions.robustness import Robustness, robustness
from manipcli.conditions.state_window import ROUNDING, StateWindow
from manipcli.spec.base import Model
from manipcli.spec.quantity import Time


class TimeTakenSpec(Model):
    """The simulated time of the whole run, or of the step that is looked at, is `below` this."""

    below: Annotated[Time, Field(gt=0)] = Field(description="Longest simulated time [s].")


def monitor(spec: TimeTakenSpec, world: World) -> Gauge:
    """`below` minus the time [s] since the first tick.

    A tick of a step lasts until the next one, or until the step ended: with `at: STEP` and `during: STEP` it is the
    time from the start of the step to its end.
    """
    started: list[float] = []

    def look(window: StateWindow) -> Robustness:
        if not started:
            started.append(float(window.times[0]))
        until = window.times.copy()
        for step in window.steps:
            if step.started is not None:
                ended = np.inf if step.ended is None else step.ended
                inside = (window.times >= step.started - ROUNDING) & (window.times < ended - ROUNDING)
                until[inside] = np.minimum(window.times[inside] + world.period, ended)
        passed = np.round(until - started[0], 9)

        def say(k: int) -> str:
            return f"{passed[k]:.3f} s of {spec.below:g} s"

        return robustness(spec.below - passed, window.times, unit="s", scale=spec.below, say=say)

    return look


DURATION = Condition(
    name="duration",
    spec=TimeTakenSpec,
    units=("s",),
    open=monitor,
    check=lambda spec, context: (),
    absent=lambda spec, world: None,
    example="duration: {below: 60 s}",
)
