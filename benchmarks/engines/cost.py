"""Processor time of the physics alone: the pour's scene with the cup at rest, and balls in a tray."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from benchmarks.engines.worlds import NAMES, body, opened
from benchmarks.processes import POUR
from manipcli.control.command import Mode
from manipcli.pipeline import load_task
from manipcli.scene.scene import Body
from manipcli.shapes.primitives import Box, Sphere

BLOCK: Final = 100
"""Calls between two readings of the clock; the best of `BLOCKS` counts."""
BLOCKS: Final = 8
RADIUS: Final = 0.014
"""[m] Of the balls."""


def per_call(work: Callable[[], object]) -> float:
    """[us] of this thread."""
    best = float("inf")
    for _ in range(BLOCKS):
        began = time.thread_time()
        for _ in range(BLOCK):
            work()
        best = min(best, time.thread_time() - began)
    return 1e6 * best / BLOCK


def cost_rows() -> list[tuple[str, ...]]:
    """(what, then the cost in each engine)."""
    columns = [_costs(name) for name in NAMES]
    return [(what, *(column[what] for column in columns)) for what in columns[0]]


def _costs(name: str) -> dict[str, str]:
    task = load_task(POUR, overrides=(f"simulation.engine={name}",))
    brake: Mode = "brake"
    modes = (brake,) * len(task.robot.joint_names)
    found: dict[str, str] = {}
    with opened(name, [], task.robot, modes=modes):
        pass  # loads the library
    began = time.thread_time()
    with opened(name, task.scene.bodies, task.robot, modes=modes) as bench:
        found["open the world of the pour"] = f"{1e3 * (time.thread_time() - began):.0f} ms"
        engine = bench.run(0.3).engine
        found["cup with ball at rest, arm braked: physics step"] = f"{per_call(engine.advance):.0f} us"
        found["the same: read the state"] = f"{per_call(engine.read):.1f} us"
        found["the same: read all contacts"] = f"{per_call(engine.contacts):.0f} us"
    for count in (20, 60):
        with opened(name, _balls(count)) as bench:
            step = per_call(bench.run(0.7).engine.advance)
            found[f"{count} balls of 10 g at rest in a tray: physics step"] = f"{step:.0f} us"
    return found


def _balls(count: int) -> list[Body]:
    """On a floor with four walls, in layers of 25."""
    tray = [body("floor", Box((0.4, 0.4, 0.02)), (2.0, 0.0, -0.01))]
    for k, (x, y) in enumerate(((0.11, 0.0), (-0.11, 0.0), (0.0, 0.11), (0.0, -0.11))):
        size = (0.02, 0.24, 0.1) if x else (0.24, 0.02, 0.1)
        tray.append(body(f"wall{k}", Box(size), (2.0 + x, y, 0.05)))
    for k in range(count):
        place = (2.0 + 0.03 * (k % 5 - 2), 0.03 * (k // 5 % 5 - 2), 0.03 + 0.04 * (k // 25))
        tray.append(body(f"ball{k}", Sphere(RADIUS), place, mass=0.01, friction=0.5))
    return tray
