"""Figures of docs/explanation/engines.md: a light cube in a vice, the cup of the pour, a dropped ball."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from benchmarks.engines.grasps import MUJOCO, PYBULLET, Carried, vice
from benchmarks.engines.laws import drop
from benchmarks.engines.worlds import NAMES, STEP
from manipcli.core.geometry import Array
from manipcli.replay import figure
from manipcli.replay.curves import Chart, Curve, Panel

DOCS: Final = Path(__file__).resolve().parents[2] / "docs"


def vice_picture() -> None:
    """docs/pictures/engines_vice.svg."""
    creeps, forces = [], []
    for variant in (*PYBULLET, MUJOCO):
        height, force = vice(variant, 0.01, 40.0, 2.0)
        creeps.append(_curve(variant.label, 1e3 * (height[100] - height)[100::4], 0.1, 4 * STEP))
        forces.append(_curve(variant.label, force[100::4], 0.1, 4 * STEP))
    panels = (
        Panel("creep", "creep", "mm", tuple(creeps)),
        Panel("force of the moving jaw", "force", "N", tuple(forces)),
    )
    _draw("engines_vice.svg", Chart("A cube of 10 g, pressed with 40 N", panels, (), 0.1, 2.0))


def slip_picture(runs: dict[str, Carried]) -> None:
    """docs/pictures/engines_slip.svg, of pours by what they are called."""
    curves = tuple(Curve(label, label, "", run.times, 1e3 * run.slip) for label, run in runs.items())
    first = next(iter(runs.values()))
    title = "Pour with a cup of 300 g, friction 0.5: motion of the cup in the hand"
    panels = (Panel("slip", "slip", "mm", curves),)
    steps = tuple(step for step in first.steps if step.end > first.times[0] and step.start < first.times[-1])
    _draw("engines_slip.svg", Chart(title, panels, steps, float(first.times[0]), float(first.times[-1])))


def drop_picture() -> None:
    """docs/pictures/engines_drop.svg: from 10 ms before the impact, 90 ms."""
    heights, forces = [], []
    for name, label in NAMES.items():
        height, force = drop(name)
        heights.append(_curve(label, 1e3 * height[132:232], 0.133, STEP))
        forces.append(_curve(label, force[132:232], 0.133, STEP))
    panels = (Panel("height", "height", "mm", tuple(heights)), Panel("contact force", "force", "N", tuple(forces)))
    _draw("engines_drop.svg", Chart("A ball of 50 g, dropped by 100 mm", panels, (), 0.133, 0.232))


def _curve(label: str, values: Array, start: float, period: float) -> Curve:
    return Curve(label, label, "", np.array(start + period * np.arange(len(values)), dtype=np.float64), values)


def _draw(name: str, chart: Chart) -> None:
    (DOCS / "pictures" / name).write_bytes(figure.render(chart, figure.kind_of(Path(name))))
