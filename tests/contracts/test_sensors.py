"""What every sensor promises, over the registry and on every engine."""

from __future__ import annotations

import pickle
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from manipcli.core.geometry import Array
from manipcli.model.build_robot import build_robot
from manipcli.model.robot import RobotModel
from manipcli.record.schemas import schema_text
from manipcli.record.write.rows import measured_template
from manipcli.scene.scene import Scene
from manipcli.simulate.engine import EngineMember, EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.simulate.sensor import AnySensor
from manipcli.simulate.sensor_bank import SensorBank
from manipcli.simulate.sensor_layout import sensed_by_name
from manipcli.simulate.sensors import SENSORS
from manipcli.spec.load import load_robot
from manipcli.spec.sensors import SensorSpec

ROBOT = Path(__file__).parents[2] / "robots" / "arm7_hand3" / "robot.yaml"
NEEDED: dict[str, dict[str, Any]] = {
    "contact": {"threshold": 1.0},
    "tactile": {"size": (0.1, 0.1), "rows": 2, "columns": 3, "shear": True},
}
"""Keys without a default."""
every_sensor = pytest.mark.parametrize("member", SENSORS.members, ids=SENSORS.names)


@cache
def robot() -> RobotModel:
    file = load_robot(ROBOT)
    return build_robot(file.spec, file=ROBOT, source=file.source)[0]


def spec_of(member: AnySensor) -> SensorSpec:
    """On the palm, if it has a place."""
    keys = {"type": member.name, **NEEDED.get(member.name, {})}
    if "link" in member.spec.model_fields:
        keys["link"] = "palm"
    spec: SensorSpec = member.spec.model_validate(keys)
    return spec


@every_sensor
@pytest.mark.parametrize("engine", ENGINES.members, ids=ENGINES.names)
def test_its_numbers_are_finite_in_one_array_and_the_same_for_the_same_seed(
    member: AnySensor, engine: EngineMember
) -> None:
    scene = Scene(bodies=(), frames=(), gravity=np.array([0.0, 0.0, -9.81]))
    start = np.zeros(len(robot().joint_names))
    world = engine.open(robot(), scene, EngineSettings(step=1e-3, substeps=1, start=start))
    try:
        sensors = {"it": spec_of(member)}
        banks = [SensorBank(sensors, robot(), scene, world, period=1e-3, seed=3, state=world.read()) for _ in range(2)]
        readings = [bank.reading("it") for bank in banks]
        for tick in range(5):
            world.advance()
            state = world.read()
            for bank in banks:
                bank.sense(tick, state)
            assert all(bank.reading("it") is not None for bank in banks)
            np.testing.assert_array_equal(*readings)
            assert np.isfinite(readings[0]).all()
        assert readings[0].size == sum(q.width for q in member.quantities(sensors["it"], robot()))
    finally:
        world.close()


@every_sensor
def test_its_message_takes_the_numbers_of_a_reading(member: AnySensor) -> None:
    """As another library decodes it: the numbers that are filled in are there, in their order."""
    spec = spec_of(member)
    width = sum(q.width for q in member.quantities(spec, robot()))
    reading = np.arange(1.0, width + 1.0)
    for topic in member.topics(spec, robot()):
        store = get_typestore(Stores.EMPTY)
        store.register(get_types_from_msg(schema_text(topic.type), topic.type))
        template = measured_template(1, topic.type, topic.filled, topic.constant, "place")
        derive = pickle.loads(pickle.dumps(topic.derive))  # a live session sends it to another process
        wanted = reading if derive is None else derive(reading[None])[0]
        data, first = bytearray(template.data), 0
        for (offset, count), code in zip(template.runs, template.codes, strict=True):
            raw = wanted[first : first + count].astype(code).tobytes()
            data[offset : offset + len(raw)] = raw
            first += count
        assert first == (len(wanted) if topic.filled else 0)
        message = store.deserialize_cdr(bytes(data), topic.type)
        assert message.header.frame_id == "place"
        found = [number for path in topic.filled for number in _numbers(getattr(message, path))]
        np.testing.assert_allclose(found, wanted[:first])


@every_sensor
def test_conditions_get_all_numbers_of_a_reading(member: AnySensor) -> None:
    spec, nothing = spec_of(member), Scene(bodies=(), frames=(), gravity=np.zeros(3))
    sensed = sensed_by_name({"it": spec}, robot(), nothing)["it"]
    assert sensed.type == member.name
    if member.sensed is not None:
        assert sensed.width == sum(q.width for q in member.quantities(spec, robot()))
        assert {*sensed.suffixes} <= {*sensed.messages}


def _numbers(value: Any) -> list[float]:
    """Every number of a field, depth first."""
    if isinstance(value, bool | int | float):
        return [float(value)]
    if isinstance(value, np.ndarray):
        numbers: Array = value.astype(float)
        return list(numbers.ravel())
    fields = [each for name, each in vars(value).items() if not name.startswith("__")]
    return [number for field in fields for number in _numbers(field)]
