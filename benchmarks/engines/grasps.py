"""How well a held body is held: in a vice, by mass, force and settings; and the cup of the pour."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple
from unittest.mock import patch

import numpy as np

from benchmarks.engines.worlds import STEP, body, opened, robot
from benchmarks.processes import POUR
from manipcli.core.geometry import Array
from manipcli.model.kinematics import Kinematics
from manipcli.model.state import Contact
from manipcli.pipeline import load_task, run_task
from manipcli.record.read.reading import read_recording
from manipcli.record.write.recorder import Recorder
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
            speed = f"{creep:.2g}" if abs(creep) >= 1e-3 else "below 0.001"
            cells.append(f"{speed} mm/s, {held.mean():.2f} N +- {held.std():.2f}" if creep < 1e3 * EDGE else "falls")
        rows.append((f"{1e3 * mass:g} g, pressed with {press:g} N", *cells))
    return rows


class Carried(NamedTuple):
    """A pour: the cup in the hand, from 0.1 s after the pick to the start of the `place`.

    Attributes:
        times: (T) [s].
        slip: (T) [m] distance of the cup from its first place in the palm.
        force: (F) [N] sum of the normal forces of the hand on the cup, whenever the run reads them, from the lift on.
        steps: of the run.
    """

    times: Array
    slip: Array
    force: Array
    steps: tuple[Interval, ...]


def carried(folder: Path, variant: Variant, overrides: Sequence[str] = ()) -> Carried:
    """Run the pour."""
    own = (f"simulation.{variant.engine}.{key}={value}" for key, value in variant.own.items())
    overrides = (*overrides, f"simulation.engine={variant.engine}", *own)
    forces: list[tuple[int, float]] = []
    contacts = Recorder.contacts

    def noted(self: Recorder, k: int, touching: Sequence[Contact]) -> None:
        contacts(self, k, touching)
        pairs = [c for c in touching if "cup" in (c.a, c.b) and (c.a + c.b).count("robot/")]
        forces.append((k, sum(c.force for c in pairs)))

    log = folder / "pour.mcap"
    with patch.object(Recorder, "contacts", noted):
        report = run_task(POUR, log=log, force=True, overrides=overrides)
    steps = tuple(Interval(s.id, s.started or 0.0, s.ended or 0.0) for s in report.verdict.steps)
    recording = read_recording(log)
    states, robot = recording.states, load_task(POUR, overrides=overrides).robot
    last = round(next(step for step in steps if step.name.startswith("place")).start / recording.period)
    ticks = np.arange(round((steps[0].end + 0.1) / recording.period), last, 20)
    kinematics, cup = Kinematics(robot), recording.body_names.index("cup")
    held = []
    for k in ticks:
        X_WP = kinematics.forward(states.position[k], "palm")
        held.append(X_WP.R.T @ (states.body_position[k, cup] - X_WP.p))
    slip = np.linalg.norm(np.array(held) - held[0], axis=1)
    force = np.array([force for k, force in forces if round(steps[1].end / recording.period) < k < last])
    return Carried(states.time[ticks], slip, force, steps)


def cup_rows(folder: Path) -> tuple[list[tuple[str, ...]], dict[str, Carried]]:
    """Rows of the table: variant, force and slip in the pour, slip with `HARD_CUP`; and the runs with `HARD_CUP`."""
    few = Variant("PyBullet, 50 iterations", "pybullet", {"solver_iterations": 50})
    rows: list[tuple[str, ...]] = []
    hard: dict[str, Carried] = {}
    for variant in (few, *PYBULLET, MUJOCO):
        run = carried(folder, variant)
        force = f"{run.force.mean():.2f} N +- {run.force.std():.2f}"
        slip = "not measured"
        if variant in (PYBULLET[0], MUJOCO):
            hard[variant.label] = carried(folder, variant, HARD_CUP)
            slip = _largest(hard[variant.label])
        rows.append((variant.label, force, _largest(run), slip))
    return rows, hard


def _largest(run: Carried) -> str:
    return f"{1e3 * run.slip.max():.2g} mm"
