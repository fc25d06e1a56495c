"""How well a held body is held: in a vice, by mass, force and settings; and the cup of the pour."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from benchmarks.engines.worlds import NAMES, STEP, body, opened, robot
from benchmarks.processes import POUR
from manipcli.core.geometry import Array
from manipcli.model.kinematics import Kinematics
from manipcli.pipeline import load_task, run_task
from manipcli.record.read.reading import read_recording
from manipcli.replay.curves import Interval
from manipcli.shapes.primitives import Box

EDGE: Final = 0.04
"""[m] Of the cube in the vice."""


class Variant(NamedTuple):
    """An engine with settings of its own, and what the page calls it."""

    label: str
    engine: str
    own: dict[str, Any]


PYBULLET: Final = tuple(
    Variant(f"PyBullet, {count} iterations", "pybullet", {"solver_iterations": count}) for count in (100, 200, 1000)
)
MUJOCO: Final = Variant("MuJoCo", "mujoco", {})
HARD_CUP: Final = ("scene.cup.mass=300 g", "scene.cup.friction=0.5")
"""The heaviest and smoothest cup of the pour's `vary:`."""


def vice(variant: Variant, mass: float, press: float, seconds: float) -> tuple[Array, Array]:
    """A cube between a fixed jaw and one of 0.2 kg that presses, friction 1: (T) its height [m], and the force of the
    moving jaw [N], after each step."""
    jaw = Box((0.02, EDGE, EDGE))
    model = robot([(0.2, (0.0, 0.0, 0.0), jaw)], "prismatic", (-1.0, 0.0, 0.0), [(EDGE + 0.02, 0.0, 0.0)], base=jaw)
    cube = body("cube", Box((EDGE,) * 3), (EDGE / 2.0 + 0.01, 0.0, 0.0), mass=mass)
    height, force = np.empty((2, round(seconds / STEP)))
    with opened(variant.engine, [cube], model, modes=("effort",), own=variant.own) as bench:
        bench.command.effort[0] = press
        for k in range(len(height)):
            bench.engine.write(bench.command)
            bench.engine.advance()
            height[k] = bench.places[0, 2]
            force[k] = sum(c.force for c in bench.engine.contacts() if "robot/link0" in (c.a, c.b))
    return height, force


def vice_rows() -> list[tuple[str, ...]]:
    """Creep and force for light and heavy cubes; one column per variant."""
    rows = []
    for mass, press in ((0.0015, 40.0), (0.01, 40.0), (0.15, 12.0), (1.0, 15.0)):
        cells = []
        for variant in (*PYBULLET, MUJOCO):
            height, force = vice(variant, mass, press, 1.5)
            creep = 1e3 * (height[500] - height[-1])
            held = force[500:]
            cells.append(
                f"{creep:.2g} mm/s, {held.mean():.2f} N +- {held.std():.2f}" if creep < EDGE * 1e3 else "falls"
            )
        rows.append((f"{1e3 * mass:g} g, pressed with {press:g} N", *cells))
    return rows


def cup_slip(folder: Path) -> tuple[dict[str, tuple[Array, Array]], tuple[Interval, ...]]:
    """How far the cup moves in the hand while it is carried, in the pour with `HARD_CUP`.

    Returns:
        For each engine: times [s], and the distance [m] of the cup from its place in the palm 0.1 s after the pick.
        And the steps of the last run.
    """
    found: dict[str, tuple[Array, Array]] = {}
    steps: tuple[Interval, ...] = ()
    for engine in NAMES:
        log = folder / f"{engine}.mcap"
        overrides = (*HARD_CUP, f"simulation.engine={engine}")
        report = run_task(POUR, log=log, force=True, overrides=overrides)
        steps = tuple(Interval(s.id, s.started or 0.0, s.ended or 0.0) for s in report.verdict.steps)
        recording = read_recording(log)
        states, robot = recording.states, load_task(POUR, overrides=overrides).robot
        first = steps[0].end + 0.1
        last = next(step for step in steps if step.name.startswith("place")).start
        ticks = np.arange(round(first / recording.period), round(last / recording.period), 20)
        kinematics, cup = Kinematics(robot), recording.body_names.index("cup")
        held = []
        for k in ticks:
            X_WP = kinematics.forward(states.position[k], "palm")
            held.append(X_WP.R.T @ (states.body_position[k, cup] - X_WP.p))
        found[engine] = states.time[ticks], np.linalg.norm(np.array(held) - held[0], axis=1)
    return found, steps


def slip_text(found: dict[str, tuple[Array, Array]], engines: Sequence[str]) -> tuple[str, ...]:
    """The largest distance of each."""
    return tuple(f"{1e3 * found[engine][1].max():.2g} mm" for engine in engines)
