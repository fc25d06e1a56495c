"""What a control tick costs beside the physics: controllers, limits and actuators, timed inside runs of the pour."""

from __future__ import annotations

import statistics
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import ParamSpec, TypeVar
from unittest.mock import patch

from benchmarks.inside import POUR
from benchmarks.table import Row
from benchmarks.twin import clock
from manipcli.control.actuation import Actuation
from manipcli.control.compiled import library
from manipcli.control.limiter import JointLimiter
from manipcli.control.manager import ControllerManager
from manipcli.pipeline import run_task

ARM = tuple(f"joint_{k}" for k in range(1, 8))
HAND = tuple(f"finger_{k}_{part}" for k in (1, 2, 3) for part in ("proximal", "distal"))


def actuators(features: str) -> str:
    """Every joint's motor with these."""
    return "robot.actuators={" + ", ".join(f"{joint}_motor: {{{features}}}" for joint in (*ARM, *HAND)) + "}"


LIMITED = (actuators("effort: 1000"),)
FRICTION = "viscous_friction: 1e-6, coulomb_friction: 1e-6, efficiency: 0.99"
EVERYTHING = (
    actuators(f"effort: 1000, velocity: 10000, {FRICTION}"),
    *(f"controllers.arm_controller.gains.{joint}.i=1" for joint in ARM),
    *(f"controllers.arm_controller.gains.{joint}.i_clamp=5" for joint in ARM),
    *(f"controllers.arm_controller.gains.{joint}.u_clamp_max=500" for joint in ARM),
    *(f"controllers.arm_controller.gains.{joint}.u_clamp_min=-500" for joint in ARM),
    *(f"controllers.arm_controller.gains.{joint}.antiwindup_strategy=back_calculation" for joint in ARM),
)

P = ParamSpec("P")
R = TypeVar("R")


class Ticks:
    """Seconds that some functions took together, tick by tick; a tick begins where the first of them is called."""

    def __init__(self) -> None:
        self.spent: list[float] = []

    def timed(self, work: Callable[P, R], *, first: bool = False) -> Callable[P, R]:
        """The same function, watched."""
        spent = self.spent

        def watched(*args: P.args, **kwargs: P.kwargs) -> R:
            began = clock()
            try:
                return work(*args, **kwargs)
            finally:
                took = clock() - began
                if first:
                    spent.append(took)
                else:
                    spent[-1] += took

        return watched


def tick_cost(overrides: Sequence[str]) -> float:
    """Median [us] of a control tick over a run: dynamics, controllers, limits, actuators."""
    ticks = Ticks()
    with (
        tempfile.TemporaryDirectory(prefix="manipcli-benchmark-") as folder,
        patch.object(ControllerManager, "update", ticks.timed(ControllerManager.update, first=True)),
        patch.object(JointLimiter, "apply", ticks.timed(JointLimiter.apply)),
        patch.object(Actuation, "apply", ticks.timed(Actuation.apply)),
    ):
        report = run_task(POUR, overrides=overrides, log=Path(folder) / "pour.mcap")
    if report.verdict.verdict != "passed":
        raise RuntimeError(f"the pour that is measured failed: {report.verdict.text}")
    return 1e6 * statistics.median(ticks.spent)


def control_rows(rounds: int) -> list[Row]:
    """With PID, inverse dynamics, limits and simple transmissions; with every feature on; without compiled kernels."""
    kernels = library.use(None)
    python = tuple(tick_cost(LIMITED) for _ in range(rounds))
    library.use(kernels)
    plain = tuple(tick_cost(LIMITED) for _ in range(rounds))
    full = tuple(tick_cost(EVERYTHING) for _ in range(rounds))
    how = "in Python" if kernels is None else "compiled"
    return [
        Row("control tick of the pour, 13 joints", plain, "us", 25.0, f"{how}; PID, inverse dynamics, limits, gears"),
        Row("the same with every feature on", full, "us", 40.0, "and integrals, clamps, friction, efficiency"),
        Row("the first without compiled kernels", python, "us", None, "the laws in Python"),
    ]
