"""`vary:` and `--set` on sensors: what they lose is the world's alone, where they are is known to the planner."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from manipcli.core.errors import InvalidInput
from manipcli.pipeline import run_task, verify_log
from manipcli.run.prepared import prepare, same_for_planner
from manipcli.task.load_task import load_task
from manipcli.task.task import Task

ROOT = Path(__file__).parents[2]
TASK = f"""\
task: sensed
robot: robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
simulation: {{engine: kinematic, settle: 0.05 s}}
start: home
steps: [{{wait: 0.4 s}}]
scene: {{box: {{box: {{size: [0.1, 0.1, 0.1]}}, pose: {{xyz: [2, 0, 0.05]}}, fixed: true}}}}
sensors:
  range: {{type: range, at: {{xyz: [1, 0, 0.05]}}, rate: 500 Hz, noise: {{distance: {{white: 1e-9 m}}}}}}
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A task with a range finder 0.95 m from a box, whose robot has an IMU."""
    robot = (ROOT / "robots/arm7_hand3/robot.yaml").read_text()
    robot = robot.replace("description: ", f"description: {ROOT}/robots/arm7_hand3/", 1)
    own = "sensors:\n  imu: {type: imu, link: palm, noise: {angular_velocity: {white: 0.1}}}\n"
    (tmp_path / "robot.yaml").write_text(f"{robot.rstrip()}\n{own}")
    (tmp_path / "task.yaml").write_text(TASK)
    return tmp_path / "task.yaml"


def sample(path: Path, vary: str, *more: str, number: int = 0) -> Task:
    return load_task(path, overrides=(f"vary={vary}", *more), sample=number, allow_outside=True)


@pytest.mark.parametrize(
    ("vary", "known", "drawn"),
    [
        ("sensors.range.noise.distance.white: {choice: [3 mm]}", 1e-9, 3e-3),
        ("sensors.*.noise.distance.white: {scale: {choice: [4]}}", 1e-9, 4e-9),
        ("sensors.range.delay: {choice: [10 ms]}", 0.0, 0.01),
        ("sensors.range.rate: {scale: {choice: [0.5]}}", 500.0, 250.0),
        ("sensors.range.limits.most: {offset: {choice: [-90 m]}}", 100.0, 10.0),
        ("robot.sensors.imu.noise.angular_velocity.white: {choice: [3]}", 0.1, 3.0),
        ("sensors.range.at.xyz: {offset: {choice: [[0.5 m, 0, 0]]}}", (1.0, 0.0, 0.05), (1.5, 0.0, 0.05)),
        ("sensors.range.angle: {choice: [90 deg]}", np.pi, np.pi / 2.0),
    ],
)
def test_plans_are_shared_unless_the_planner_knows_the_number(
    path: Path, vary: str, known: object, drawn: object
) -> None:
    def value(sensors: Any) -> object:
        *_, at = vary.partition(":")[0].removeprefix("robot.").split(".", 2)
        found = sensors["imu" if "imu" in vary else "range"]
        for part in at.split("."):
            found = getattr(found, part)
        return found

    options: dict[str, Any] = {"overrides": (f"vary={{{vary}}}",), "package_path": (), "allow_outside": True}
    written = prepare(path, **options)
    task = written.written.sample(0)
    geometry = ".at." in vary or ".angle" in vary
    assert value(task.true.sensors) == drawn
    assert value(task.sensors) == (drawn if geometry else known)
    assert same_for_planner(task, written.written.task) is not geometry
    assert (written.plan is None) is geometry
    if not geometry:
        assert task.true.scene is task.scene
        assert task.true.robot is task.robot


def test_the_log_has_the_drawn_sensor_and_simulates_the_same(path: Path, tmp_path: Path) -> None:
    log = tmp_path / "log.mcap"
    vary = "{sensors.range.noise.distance.white: {choice: [3 mm]}, sensors.range.rate: {choice: [1 kHz]}, \
        sensors.range.at.xyz.0: {offset: {choice: [0.25 m]}}}"
    run_task(path, log=log, overrides=(f"vary={vary}",), sample=0, allow_outside=True)
    with AnyReader([log]) as reader:
        topics = [c for c in reader.connections if c.topic == "/sensors/range"]
        read: list[Any] = [reader.deserialize(data, c.msgtype) for c, _, data in reader.messages(topics)]
        static: Any = next(
            reader.deserialize(data, c.msgtype) for c, _, data in reader.messages() if c.topic == "/tf_static"
        )
    distances = np.array([message.range for message in read])
    stamps = [message.header.stamp.nanosec for message in read[:900]]
    assert {*np.diff(stamps).tolist()} == {10**6}
    assert np.std(distances) == pytest.approx(3e-3, rel=0.15)
    assert np.mean(distances) == pytest.approx(0.7, abs=1e-3)
    assert {t.child_frame_id: t.transform.translation.x for t in static.transforms}["range"] == 1.25
    assert verify_log(log, allow_outside=True).identical


def test_what_is_set_is_not_drawn(path: Path) -> None:
    vary = "{sensors.range.delay: {choice: [10 ms]}, sensors.range.rate: {choice: [100 Hz]}}"
    task = sample(path, vary, "sensors.range.delay=4 ms", "robot.sensors.imu.delay=2 ms")
    spec, imu = task.true.sensors["range"], task.true.sensors["imu"]
    assert (spec.delay, spec.rate, imu.delay) == (0.004, 100.0, 0.002)


@pytest.mark.parametrize(
    ("vary", "message"),
    [
        ("sensors.range.rate: {grid: [100 Hz, 300 Hz]}", "300 Hz"),
        ("sensors.rnge.rate: {grid: [100 Hz, 250 Hz]}", "did you mean 'range'"),
        ("sensors.range.noise.distance.white: {uniform: [-1 mm, 1 mm]}", "-0.001"),
        ("robot.sensors.imu.rate: {choice: [100 Hz]}", "no value at 'robot.sensors.imu.rate'"),
    ],
)
def test_numbers_that_cannot_be_are_refused(path: Path, vary: str, message: str) -> None:
    with pytest.raises(InvalidInput) as refused:
        sample(path, f"{{{vary}}}", number=1)
    assert message in "\n".join(f"{each.message} {each.hint}" for each in refused.value.findings)
