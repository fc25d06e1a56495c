"""Figure of a plan: position, velocity, acceleration and torque of each joint with their limits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel
from manipcli.plan.planned_states import planned_states
from manipcli.replay.figure import BANDS, COLOURS, FAINT, GRID, Kind, drawn
from manipcli.task.plan_task import Plan

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PERIOD: Final = 0.01  # s
LIMIT: Final = "#c8403f"
QUANTITIES: Final = ("position", "velocity", "acceleration", "torque")


def plan_figure(plan: Plan, title: str, kind: Kind) -> bytes:
    """The bytes of the figure file: one row per joint that moves, one column per quantity."""
    return drawn(lambda: _figure(plan, title), kind)


def joint_limits(robot: RobotModel, name: str) -> dict[str, tuple[float, float]]:
    """Lower and upper limit of each quantity that has one."""
    limits = robot.joint(name).limits
    found: dict[str, tuple[float, float]] = {}
    if limits.lower is not None and limits.upper is not None:
        found["position"] = limits.lower, limits.upper
    for quantity, limit in (
        ("velocity", limits.velocity),
        ("acceleration", limits.acceleration),
        ("torque", limits.effort),
    ):
        if limit:
            found[quantity] = -limit, limit
    return {quantity: pair for quantity, pair in found.items() if np.isfinite(pair).all()}


def _figure(plan: Plan, title: str) -> Figure:
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    robot = plan.planner.robot
    times, values, starts = _values(plan)
    moving = [k for k, name in enumerate(robot.joint_names) if np.ptp(values["position"][:, k]) > 0.0] or [0]
    figure = Figure(figsize=(14.0, 1.5 * len(moving) + 1.0), layout=ConstrainedLayoutEngine(h_pad=0.04, w_pad=0.06))
    figure.suptitle(title, x=0.01, ha="left", fontsize=12.0, fontweight="bold")
    axes = figure.subplots(len(moving), len(QUANTITIES), sharex=True, squeeze=False)
    for row, k in zip(axes, moving, strict=True):
        name = robot.joint_names[k]
        limits = joint_limits(robot, name)
        unit = robot.joint(name).unit
        units = dict(zip(QUANTITIES, (unit, f"{unit}/s", f"{unit}/s2", "N" if unit == "m" else "N m"), strict=True))
        for place, quantity in zip(row, QUANTITIES, strict=True):
            _panel(place, times, values[quantity][:, k], limits.get(quantity), starts)
            place.set_title(f"{name} {quantity} [{units[quantity]}]", loc="left", fontsize=8.0, color=FAINT, pad=2.0)
    for place in axes[-1]:
        place.set_xlim(0.0, max(float(times[-1]), 1e-9))
        place.set_xlabel("time [s]")
    return figure


def _panel(place: Axes, times: Array, values: Array, limits: tuple[float, float] | None, starts: list[float]) -> None:
    for k, (begin, end) in enumerate(zip(starts, [*starts[1:], float(times[-1])], strict=True)):
        place.axvspan(begin, end, facecolor=BANDS[k % 2], edgecolor="none", zorder=0.5)
    place.grid(visible=True, color=GRID, linewidth=0.6)
    place.plot(times, values, color=COLOURS[0], linewidth=1.0)
    for limit in limits or ():
        place.axhline(limit, color=LIMIT, linewidth=0.9, linestyle="--")


def _values(plan: Plan) -> tuple[Array, dict[str, Array], list[float]]:
    """Times (T,), each quantity (T, n), and the start of each step."""
    plan = plan.merged
    clock, times, starts = 0.0, [], []
    found: dict[str, list[Array]] = {quantity: [] for quantity in QUANTITIES}
    spans = iter(plan.spans())
    for step in plan.steps:
        starts.append(clock)
        for _ in step.plan.motions:
            motion, before, end = next(spans)
            states = planned_states(plan.planner, motion, end, begins=before, period=PERIOD)
            times.append(clock + states.times)
            for quantity in QUANTITIES:
                found[quantity].append(getattr(states, quantity))
            clock += motion.duration
    return np.concatenate(times), {quantity: np.concatenate(rows) for quantity, rows in found.items()}, starts
