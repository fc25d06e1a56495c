"""Motors that share joints, simulated: what the log says of both sides, read without manipcli."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import manipcli

pytestmark = pytest.mark.slow

Array = npt.NDArray[np.float64]
ROOT = Path(__file__).parents[2]
EXAMPLES = {"differential_wrist": "07_differential_wrist", "four_bar_finger": "08_four_bar_finger"}


def both_sides(log: Path) -> dict[str, dict[str, Array]]:
    """Per topic: position, velocity and effort (T, 2), at the times of /actuator_states."""
    reader = McapReader(log)
    reader.open()
    store = get_typestore(Stores.EMPTY)
    wanted = [c for c in reader.connections if c.topic in ("/joint_states", "/actuator_states")]
    types: dict[str, Any] = {}
    for connection in wanted:
        types.update(get_types_from_msg(connection.msgdef.data, connection.msgtype))
    store.register(types)
    rows: dict[str, dict[int, Any]] = {"/joint_states": {}, "/actuator_states": {}}
    for connection, ns, raw in reader.messages(wanted):
        rows[connection.topic][ns] = store.deserialize_cdr(raw, connection.msgtype)
    times = sorted(rows["/actuator_states"])
    return {
        topic: {
            field: np.array([getattr(messages[ns], field) for ns in times])
            for field in ("position", "velocity", "effort")
        }
        for topic, messages in rows.items()
    }


def simulated(folder: Path, robot: str, actuators: str | None = None) -> tuple[dict[str, dict[str, Array]], str]:
    """The example's log and verdict; with other actuators in the robot file, if said."""
    for part in ("robots", "controllers"):
        shutil.copytree(ROOT / part, folder / part)
    example = folder / "examples" / EXAMPLES[robot]
    shutil.copytree(ROOT / "examples" / EXAMPLES[robot], example)
    file = folder / "robots" / robot / "robot.yaml"
    if actuators is not None:
        head = file.read_text(encoding="utf-8").partition("actuators:\n")[0]
        file.write_text(head + "actuators:\n" + actuators, encoding="utf-8")
    report = manipcli.run_task(example / "task.yaml", log=folder / "log.mcap")
    return both_sides(folder / "log.mcap"), report.verdict.verdict


def test_the_motors_of_the_wrist_share_both_joints(tmp_path: Path) -> None:
    """effort_a = (pitch +- roll) / (2 40), velocity_a = 40 (pitch +- roll)."""
    log, status = simulated(tmp_path, "differential_wrist")
    assert status == "passed"
    joints, motors = log["/joint_states"], log["/actuator_states"]
    mix = np.array([[1.0, 1.0], [1.0, -1.0]])
    np.testing.assert_allclose(motors["effort"], joints["effort"] @ mix / 80.0, atol=1e-12)
    np.testing.assert_allclose(motors["velocity"], joints["velocity"] @ mix * 40.0, atol=1e-9)
    np.testing.assert_allclose(motors["position"], joints["position"] @ mix * 40.0, atol=1e-9)
    assert np.abs(joints["velocity"]).max(axis=0).min() > 1.0  # both joints moved


def test_the_linkage_motor_of_the_finger_turns_with_both_joints(tmp_path: Path) -> None:
    """effort_a = ((j1 - j2) / 20, j2 / 20), velocity_a = (20 j1, 20 (j1 + j2)); power is that of the joints."""
    log, status = simulated(tmp_path, "four_bar_finger")
    assert status == "passed"
    joints, motors = log["/joint_states"], log["/actuator_states"]
    j1, j2 = joints["effort"].T
    np.testing.assert_allclose(motors["effort"], np.stack([j1 - j2, j2], axis=1) / 20.0, atol=1e-12)
    v1, v2 = joints["velocity"].T
    np.testing.assert_allclose(motors["velocity"], np.stack([v1, v1 + v2], axis=1) * 20.0, atol=1e-9)
    power = [np.sum(side["effort"] * side["velocity"], axis=1) for side in (joints, motors)]
    np.testing.assert_allclose(power[0], power[1], atol=1e-10)


WRIST_MOTORS = ("left_motor", "right_motor")
FINGER_MOTORS = ("knuckle_motor", "linkage_motor")


@pytest.mark.parametrize(
    ("robot", "names", "limit", "joint_limit"),
    [("differential_wrist", WRIST_MOTORS, 0.015, 20.0), ("four_bar_finger", FINGER_MOTORS, 0.003, 2.0)],
)
def test_the_limit_of_a_motor_saturates_and_not_that_of_a_joint(
    tmp_path: Path, robot: str, names: tuple[str, str], limit: float, joint_limit: float
) -> None:
    log, _ = simulated(tmp_path, robot, "".join(f"  {name}: {{effort: {limit}}}\n" for name in names))
    used = np.abs(log["/actuator_states"]["effort"])
    assert used.max() == pytest.approx(limit, rel=1e-9)
    assert np.count_nonzero(used > limit * (1 - 1e-9)) >= 3
    assert np.abs(log["/joint_states"]["effort"]).max() < 0.5 * joint_limit


def test_by_position_the_engines_motors_stay_within_the_actuators(tmp_path: Path) -> None:
    """Both joints of the wrist by position: no motor gives more than it has, whatever the other does."""
    limit = 0.02
    for part in ("robots", "controllers", "examples"):
        shutil.copytree(ROOT / part, tmp_path / part)
    robot = tmp_path / "robots" / "differential_wrist" / "robot.yaml"
    head = robot.read_text(encoding="utf-8").partition("actuators:\n")[0]
    actuators = "".join(f"  {name}: {{effort: {limit}}}\n" for name in WRIST_MOTORS)
    robot.write_text(head + "actuators:\n" + actuators, encoding="utf-8")
    controllers = tmp_path / "controllers" / "differential_wrist.yaml"
    controllers.write_text(
        "controllers:\n  wrist_controller:\n    type: joint_trajectory\n    joints: [pitch, roll]\n"
        "    command_interface: position\n",
        encoding="utf-8",
    )
    manipcli.run_task(tmp_path / "examples" / EXAMPLES["differential_wrist"] / "task.yaml", log=tmp_path / "log.mcap")
    used = np.abs(both_sides(tmp_path / "log.mcap")["/actuator_states"]["effort"])
    assert 0.2 * limit < used.max() <= limit * (1 + 1e-9)
