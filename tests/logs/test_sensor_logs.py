"""Sensors in logs: stamps and arrivals, simulated again to the byte, and nothing of it without sensors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

from manipcli.core.errors import InvalidInput
from manipcli.pipeline import run_task, verify_log
from manipcli.task.load_task import load_task

ROOT = Path(__file__).parents[2]
TASK = f"""\
task: sensed
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
simulation: {{engine: kinematic, settle: 0.05 s}}
start: home
steps: [{{move: {{to: zero}}}}, {{wait: 0.3 s}}]
sensors:
"""
IMU = (
    "  imu: {type: imu, link: palm, rate: 250 Hz, delay: 3 ms, noise: {angular_velocity: {white: 1}, dropout: 10 %}}\n"
)
ENCODERS = "  encoders: {type: joint, delay: 2 ms, noise: {position: {white: 0.001}, dropout: 1 %}}\n"


def written(folder: Path, sensors: str) -> Path:
    path = folder / "task.yaml"
    path.write_text(TASK + sensors if sensors else TASK.removesuffix("sensors:\n"))
    return path


def messages(log: Path) -> dict[str, list[tuple[int, bytes]]]:
    """Log time and bytes of the messages of each topic."""
    found: dict[str, list[tuple[int, bytes]]] = {}
    with log.open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages():
            found.setdefault(channel.topic, []).append((message.log_time, message.data))
    return found


def test_a_log_with_sensors(tmp_path: Path) -> None:
    log, fewer = tmp_path / "one.mcap", tmp_path / "fewer.mcap"
    run_task(written(tmp_path, IMU + ENCODERS), log=log)
    assert verify_log(log).identical
    with AnyReader([log]) as reader:
        stamps: dict[str, list[int]] = {}
        noise: list[float] = []
        truth: dict[int, Any] = {}
        for connection, _, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype) if connection.topic != "/rosout" else None
            if connection.topic == "/joint_states":
                truth[message.header.stamp.nanosec + 10**9 * message.header.stamp.sec] = message.position
            if connection.topic.startswith("/sensors/"):
                stamps.setdefault(connection.topic, []).append(
                    message.header.stamp.nanosec + 10**9 * message.header.stamp.sec
                )
            if connection.topic == "/sensors/encoders":
                noise += (message.position - truth[stamps[connection.topic][-1]]).tolist()
            if connection.topic == "/tf_static":
                assert "imu" in [each.child_frame_id for each in message.transforms]
    whole = messages(log)
    for topic, delay, every in (("/sensors/imu", 3, 4), ("/sensors/encoders", 2, 1)):
        times = np.array([time for time, _ in whole[topic]])
        np.testing.assert_array_equal(times - np.array(stamps[topic]), delay * 1_000_000)
        assert (np.array(stamps[topic]) % (every * 1_000_000) == 0).all()
        assert len(set(stamps[topic])) == len(times)
    assert np.std(noise) == pytest.approx(0.001, rel=0.1)

    run_task(written(tmp_path, ENCODERS), log=fewer)
    assert {topic: whole[topic] for topic in whole if topic not in ("/sensors/imu", "/tf_static")} == {
        topic: found for topic, found in messages(fewer).items() if topic != "/tf_static"
    }


WRONG = [
    ("a: {type: imu, link: plam}", "SENS101", "'palm'"),
    ("a: {type: imu, link: palm, rate: 300 Hz}", "SENS106", "250 Hz"),
    ("a: {type: imu, link: palm, rate: 2 kHz}", "SENS106", "1000 Hz"),
    ("a: {type: imu, link: palm, delay: 1.5 ms}", "SENS107", "'1 ms' or '2 ms'"),
    ("a: {type: force_torque}", "SENS100", "palm"),
    ("palm: {type: imu, link: palm}", "SENS108", "rename"),
    ("a: {type: contact, threshold: 1 N}", "SENS104", "link: LINK"),
    ("a: {type: joint, joints: [joint_11]}", "SENS105", "joint_1"),
    ("a: {type: imu, link: palm, noise: {angular_velocity: {white: -1}}}", "TASK204", "white"),
    ("a: {type: imu, link: palm, noise: {angular_velocty: {white: 1}}}", "TASK201", "'angular_velocity'"),
    ("a: {type: imo, link: palm}", "TASK203", "'imu'"),
    ("a: {type: camera, resolution: [1920, 1080], rate: 1 kHz}", "SENS113", "Hz or less"),
    ("a: {type: camera, rate: 100 Hz, delay: 10 s, cloud: true}", "SENS113", "`delay`"),
    ("a: {type: camera, resolution: [2048, 2048], cloud: true, rate: 1 Hz}", "SENS131", "resolution"),
]


@pytest.mark.parametrize(("line", "code", "hint"), WRONG, ids=[code for _, code, _ in WRONG])
def test_what_is_wrong_is_reported_where_it_is(line: str, code: str, hint: str, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput) as refused:
        load_task(written(tmp_path, f"  {line}\n"))
    (finding,) = refused.value.findings
    assert finding.code == code
    assert finding.place is not None
    assert finding.place.line == len(TASK.splitlines()) + 1
    assert finding.place.column > 1
    assert hint in (finding.hint or "")
