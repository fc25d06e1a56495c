"""`duration`: a run or a step takes less than a limit."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from manipcli.conditions.condition import Condition, Monitor, World
from manipcli.conditions.robustness import Robustness, robustness
from manipcli.conditions.state_window import ROUNDING, StateWindow
from manipcli.core.prose import amount
from manipcli.model.robot import RobotModel
from manipcli.spec.base import Model
from manipcli.spec.quantity import Time


class TimeTakenSpec(Model):
    """The simulated time of the run, or of the step of `at` or `during`, is less than `below`."""

    below: Annotated[Time, Field(gt=0)] = Field(description="Longest simulated time [s].")


def monitor(spec: TimeTakenSpec, world: World) -> Monitor:
    """`below` minus the time [s] since the first tick.

    A tick of a step lasts until the next tick or the end of the step: with `at: STEP` and `during: STEP` this is the
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

        def describe(k: int) -> str:
            return f"{passed[k]:.3f} s; below {spec.below:g} s"

        return robustness(spec.below - passed, window.times, unit="s", scale=spec.below, describe=describe)

    return look


def clause(spec: TimeTakenSpec, robot: RobotModel) -> str:
    return f"less than {amount(spec.below, 's')} of simulated time have passed"


DURATION = Condition(
    name="duration",
    spec=TimeTakenSpec,
    units=("s",),
    open=monitor,
    check=lambda spec, context: (),
    absent=lambda spec, world: None,
    clause=clause,
    example="duration: {below: 60 s}",
)
