"""What every sensor promises, over the registry and on every engine."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from manipcli.control.controller import SensorRequest
from manipcli.model.build_robot import build_robot
from manipcli.model.robot import RobotModel
from manipcli.record.schemas import schema_text
from manipcli.record.write.rows import sensor_template
from manipcli.scene.scene import Scene
from manipcli.simulate.engine import EngineMember, EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.simulate.sensor import SensorMember
from manipcli.simulate.sensors import SENSORS
from manipcli.spec.load import load_robot

ROBOT = Path(__file__).parents[2] / "robots" / "arm7_hand3" / "robot.yaml"
every_sensor = pytest.mark.parametrize("member", SENSORS.members, ids=SENSORS.names)


@cache
def robot() -> RobotModel:
    file = load_robot(ROBOT)
    return build_robot(file.spec, file=ROBOT, source=file.source)[0]


def request_of(member: SensorMember, model: RobotModel) -> SensorRequest:
    """At the last joint of the arm."""
    joint = next(joint for joint in model.joints if joint.name == "joint_7")
    return SensorRequest(member.name, joint.name, joint.child)


@every_sensor
@pytest.mark.parametrize("engine", ENGINES.members, ids=ENGINES.names)
def test_it_writes_one_array_and_its_randomness_is_that_of_the_generator(
    member: SensorMember, engine: EngineMember
) -> None:
    scene = Scene(bodies=(), frames=(), gravity=np.array([0.0, 0.0, -9.81]))
    start = np.zeros(len(robot().joint_names))
    world = engine.open(robot(), scene, EngineSettings(step=1e-3, substeps=1, start=start))
    try:
        sensors = [member.open(world, request_of(member, robot())) for _ in range(2)]
        generators = [np.random.default_rng(3) for _ in sensors]
        assert [sensor.reading.tolist() for sensor in sensors] == [[0.0] * member.width] * 2
        arrays = [sensor.reading for sensor in sensors]
        for _ in range(5):
            world.advance()
            state = world.read()
            one, other = (sensor.sense(state, rng) for sensor, rng in zip(sensors, generators, strict=True))
            assert (one is arrays[0], other is arrays[1]) == (True, True)
            np.testing.assert_array_equal(one, other)
            assert np.isfinite(one).all()
        assert (engine.physics == "full") == bool(np.abs(arrays[0]).max() > 0.0)
    finally:
        world.close()


@every_sensor
def test_its_message_is_a_header_and_one_number_for_each_of_its_reading(member: SensorMember) -> None:
    """As another library decodes it: ones in, as many ones out, and nothing left."""
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(member.definition or schema_text(member.message), member.message))
    template = sensor_template(1, "link", member.width)
    data = bytearray(template.data)
    ((offset, count),) = template.runs
    assert count == member.width
    data[offset : offset + 8 * count] = np.ones(count).tobytes()
    message = store.deserialize_cdr(bytes(data), member.message)
    assert message.header.frame_id == "link"
    assert _numbers(message) == [1.0] * member.width


def _numbers(message: object) -> list[float]:
    """Every float of a message, depth first."""
    if isinstance(message, float):
        return [message]
    fields = vars(message).values() if hasattr(message, "__dict__") else ()
    return [number for field in fields for number in _numbers(field)]
