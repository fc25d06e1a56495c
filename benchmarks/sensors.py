"""What sensors cost: `python -m benchmarks.sensors [--rounds N]`, in units of bare stepping of the pour.

The pour is simulated with and without sensors, in turn; the difference of the two simulate phases (CPU time, recording
included) is divided by the time that PyBullet alone takes for the same steps.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Final

from benchmarks.inside import POUR, simulate_phase, watched_run
from benchmarks.table import Row, markdown
from benchmarks.twin import clock
from manipcli.run.execute import build_manager, open_session
from manipcli.simulate.session import Session
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import plan_task

NOISE: Final = "white: 1e-6, bias: 1e-6, walk: 1e-6, quantisation: 1e-7"
"""Small, so that the robot moves as without sensors."""
JOINT: Final = f"joints_: {{type: joint, delay: 1 ms, noise: {{position: {{{NOISE}}}, velocity: {{{NOISE}}}}}}}"
WRENCH: Final = f"wrist_: {{type: force_torque, link: palm, filter: 200 Hz, noise: {{force: {{{NOISE}}}}}}}"
IMU: Final = f"imu_: {{type: imu, link: palm, filter: 200 Hz, noise: {{angular_velocity: {{{NOISE}}}}}}}"
PAD: Final = "pad_: {type: tactile, link: finger_1_distal_link, size: [2 cm, 4 cm], rows: 8, columns: 4, rate: 100 Hz}"
SCAN: Final = "scan_: {type: range, frame: world, at: {xyz: [0.3, -0.6, 0.5]}, rays: 683, angle: 240 deg, rate: 100 Hz}"
SETS: Final = {
    "joint, wrench and IMU at 1 kHz": (f"sensors={{{JOINT}, {WRENCH}, {IMU}}}", 0.15),
    "joint at 1 kHz": (f"sensors={{{JOINT}}}", None),
    "wrench at 1 kHz": (f"sensors={{{WRENCH}}}", None),
    "IMU at 1 kHz": (f"sensors={{{IMU}}}", None),
    "8 x 4 taxels and 683 rays at 100 Hz": (f"sensors={{{PAD}, {SCAN}}}", 0.1),
}


def sensor_rows(rounds: int) -> list[Row]:
    """The difference that sensors make to the simulate phase, and the reading alone, over bare stepping."""
    phases: dict[str, list[float]] = {name: [] for name in SETS}
    with tempfile.TemporaryDirectory(prefix="manipcli-benchmark-") as name:
        folder = Path(name)
        simulate_phase(folder)  # imports, caches: does not count
        for _ in range(rounds):
            _, cost = watched_run(folder)
            for what, (override, _) in SETS.items():
                without = simulate_phase(folder)
                phases[what].append((simulate_phase(folder, (override,)) - without) / cost.bare)
        bare = cost.bare / cost.ticks
    rows = [
        Row(f"{what}, recorded / bare stepping", tuple(values), "x", SETS[what][1], "difference of whole phases")
        for what, values in phases.items()
    ]
    rows += [
        Row(f"{what}: reading and noise", tuple(sensed(override) / bare for _ in range(rounds)), "x", None)
        for what, (override, _) in SETS.items()
    ]
    return [*rows, Row("bare stepSimulation", (1e6 * bare,), "us", None, "for orientation")]


def sensed(override: str, ticks: int = 4000) -> float:
    """Seconds of CPU time that the sensors take at a tick, at rest, without engine and recording."""
    task = load_task(POUR, overrides=(override,))
    with open_session(task, plan_task(task), build_manager(task), Session) as session:
        state = session.engine.read()
        began = clock()
        for tick in range(ticks):
            session.sensors.sense(tick, state)
        return (clock() - began) / ticks


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m benchmarks.sensors", description=__doc__)
    parser.add_argument("--rounds", type=int, default=5, help="of every measurement; the median is printed (default 5)")
    print(markdown(sensor_rows(parser.parse_args().rounds)))
