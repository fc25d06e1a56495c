"""Contacts and joints against laws with closed forms: friction, rest, stacks, a drop, a pendulum, a sensor."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from benchmarks.engines.worlds import G, body, opened, robot
from manipcli.core.geometry import Array, Transform
from manipcli.model.kinematics import Kinematics
from manipcli.scene.scene import Body
from manipcli.shapes.primitives import Box, Sphere

Cells = dict[str, str]
"""The text of each row of a table, for one engine."""
CUBE = 0.05
"""[m] Edge of the cubes on the table."""


def laws(name: str) -> Cells:
    """Every row of the table of laws."""
    return {
        "angle at which a block starts to slide, friction 0.5 (law: 26.57 deg)": f"{friction_angle(name):.2f} deg",
        "block that slides down 35 deg, friction 0.4: acceleration (law: 2.4125 m/s2)": f"{sliding(name):.4f} m/s2",
        "block at rest, 10 g: sink-in, force / weight": _rest(name, 0.01),
        "block at rest, 10 kg": _rest(name, 10.0),
        "ten cubes of 100 g, stacked: top sinks, drift in 8 s": _stack(name),
        "10 kg on 100 g: upper cube sinks, forces (law: 98.10, 99.08 N)": _unequal(name),
        "ball dropped by 100 mm, restitution 0: rebound, deepest, peak force": _drop(name),
        **{
            f"passive double pendulum, 10 s, step {1e3 * step:g} ms: change of energy at the end, largest": _pendulum(
                name, step
            )
            for step in (5e-4, 1e-3, 2e-3)
        },
        "weight of 2.7 kg on a wrench sensor: error": _wrench(name),
    }


def _table() -> Body:
    return body("table", Box((1.0, 1.0, 0.2)), (2.0, 0.0, 0.4))


def _cube(k: int, mass: float) -> Body:
    return body(f"cube{k}", Box((CUBE,) * 3), (2.0, 0.0, 0.5 + (k + 0.5) * CUBE), mass=mass, friction=0.8)


def _slope(angle: float, friction: float) -> list[Body]:
    """A block on a long plane, which descends along +x."""
    normal = np.array([math.sin(angle), 0.0, math.cos(angle)])
    plane = body("plane", Box((6.0, 1.0, 0.2)), (-0.1 * normal).tolist(), pitch=angle)
    place = (0.025 * normal).tolist()
    return [plane, body("block", Box((0.1, 0.1, 0.05)), place, mass=0.5, friction=friction, pitch=angle)]


def friction_angle(name: str) -> float:
    """[deg] By bisection to 0.02 deg; a block slides if it moves at more than 10 mm/s after 0.6 s."""
    low, high = 20.0, 32.0
    while high - low > 0.02:
        middle = (low + high) / 2.0
        with opened(name, _slope(math.radians(middle), 0.5)) as bench:
            speed = float(np.linalg.norm(bench.run(0.6).velocities[0]))
        low, high = (low, middle) if speed > 0.01 else (middle, high)
    return low


def sliding(name: str) -> float:
    """[m/s2] The mean between 0.2 and 0.7 s."""
    with opened(name, _slope(math.radians(35.0), 0.4)) as bench:
        first = np.linalg.norm(bench.run(0.2).velocities[0])
        return float(np.linalg.norm(bench.run(0.5).velocities[0]) - first) / 0.5


def _rest(name: str, mass: float) -> str:
    with opened(name, [_table(), _cube(0, mass)]) as bench:
        sunk = 0.525 - bench.run(1.5).places[0, 2]
        return f"{_mm(sunk)}, {bench.force() / (mass * G):.5f}"


def _stack(name: str) -> str:
    with opened(name, [_table(), *(_cube(k, 0.1) for k in range(10))]) as bench:
        before = bench.run(2.0).places
        after = bench.run(8.0).places
    return f"{_mm(0.525 + 9 * CUBE - before[9, 2])}, {_mm(float(np.abs(after - before).max()))}"


def _unequal(name: str) -> str:
    with opened(name, [_table(), _cube(0, 0.1), _cube(1, 10.0)]) as bench:
        sunk = 0.575 - bench.run(2.0).places[1, 2]
        forces = sorted(contact.force for contact in bench.engine.contacts())
    return f"{_mm(sunk)}, {', '.join(f'{force:.2f}' for force in forces)} N"


def drop(name: str) -> tuple[Array, Array]:
    """A ball of 50 g and 40 mm, dropped by 100 mm: (600) its height [m] and the force on it [N] after each step."""
    ball = body("ball", Sphere(0.02), (2.0, 0.0, 0.62), mass=0.05, friction=0.5)
    height, force = np.empty(600), np.empty(600)
    with opened(name, [_table(), ball]) as bench:
        for k in range(600):
            bench.engine.advance()
            height[k], force[k] = bench.places[0, 2] - 0.52, bench.force()
    return height, force


def _drop(name: str) -> str:
    height, force = drop(name)
    lowest = int(np.argmin(height[: int(np.argmax(force > 0.0)) + 12]))
    return f"{_mm(max(0.0, float(height[lowest:].max())))}, {_mm(-float(height.min()))}, {force.max():.0f} N"


def pendulum(name: str, step: float, seconds: float = 10.0) -> tuple[Array, Array]:
    """Two rods of 1 kg and 0.5 m, released from the horizontal; times [s] and the change of their energy, as a share
    of that between the start and hanging at rest."""
    links = [(1.0, (0.25, 0.0, 0.0), None)] * 2
    model = robot(links, "continuous", (0.0, 1.0, 0.0), [(0.0, 0.0, 2.0), (0.5, 0.0, 0.0)])
    kinematics = Kinematics(model)

    def energy(q: Array, v: Array) -> float:
        height = sum(float((kinematics.forward(q, f"link{k}") @ Transform.of(xyz=(0.25, 0, 0))).p[2]) for k in range(2))
        return float(0.5 * v @ kinematics.mass_matrix(q) @ v) + G * height

    every, found = round(0.02 / step), []
    with opened(name, [], model, modes=("effort", "effort"), step=step) as bench:
        for k in range(round(seconds / step) + 1):
            if k % every == 0:
                state = bench.engine.read()
                found.append(energy(np.array(state.position), np.array(state.velocity)))
            bench.engine.advance()
    times = np.linspace(0.0, seconds, len(found))
    return times, (np.array(found) - found[0]) / (2.0 * G * (0.25 + 0.75))


def _pendulum(name: str, step: float) -> str:
    _, change = pendulum(name, step)
    return f"{100.0 * change[-50:].mean():+.1f} %, {100.0 * np.abs(change).max():.1f} %"


def _wrench(name: str) -> str:
    """A slide that carries 2.7 kg is held by its brake; the sensor is at its joint."""
    model = robot([(2.7, (0.0, 0.0, 0.0), None)], "prismatic", (0.0, 0.0, 1.0), [(0.0, 0.0, 1.0)])
    with opened(name, [], model) as bench:
        wrench = bench.engine.sense_wrench("joint0")
        bench.run(1.0).engine.read()
        error = float(np.linalg.norm(wrench[:3] - np.array([0.0, 0.0, -2.7 * G])))
    return f"{'below 0.000001' if error < 1e-6 else f'{error:.2g}'} N of {2.7 * G:.1f} N"


def _mm(value: float) -> str:
    return f"{1e3 * value:.2g} mm" if abs(value) < 0.01 else f"{1e3 * value:.0f} mm"


def law_rows(cells: Sequence[Cells]) -> list[tuple[str, ...]]:
    """(what, then one text per engine) of tables with equal rows."""
    return [(what, *(column[what] for column in cells)) for what in cells[0]]
