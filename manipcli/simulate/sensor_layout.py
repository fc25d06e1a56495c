"""Where the numbers of each sensor are among those of all sensors, and when it measures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from manipcli.conditions.sensed import Sensed
from manipcli.core.geometry import Transform
from manipcli.model.robot import RobotModel
from manipcli.scene.scene import Scene
from manipcli.simulate.mount import BASE, WORLD
from manipcli.simulate.sensor import Quantity, Topic
from manipcli.simulate.sensors import SENSORS
from manipcli.simulate.signal_chain import Sampling
from manipcli.spec.mounted_sensor import FilteredSpec, MountedSpec
from manipcli.spec.sensors import SensorSpec


@dataclass(frozen=True, slots=True)
class Place:
    """A sensor among others.

    Attributes:
        quantities: its numbers.
        topics: its messages.
        sampling: when it measures.
        first: column that is 1 when a measurement arrives; the measurement follows.
        width: numbers in a measurement; 0: it takes pictures.
        joints: indices of the joints that it measures, in joint vectors: positions, velocities, then efforts; None: it
            measures something else.
    """

    quantities: tuple[Quantity, ...]
    topics: tuple[Topic, ...]
    sampling: Sampling
    first: int
    width: int
    joints: tuple[int, ...] | None


def ticks_per_measurement(spec: SensorSpec, period: float) -> float:
    """Control ticks of `period` [s] between two measurements; not whole for a rate that `check` refuses."""
    return 1.0 if spec.rate is None else 1.0 / (spec.rate * period)


def layout(sensors: Mapping[str, SensorSpec], robot: RobotModel, period: float) -> dict[str, Place]:
    """The places of the sensors of a checked task, by name; `period` [s] of a control tick."""
    places: dict[str, Place] = {}
    first = 0
    for name, spec in sensors.items():
        member = SENSORS[spec.type]
        quantities = member.quantities(spec, robot)
        width = sum(quantity.width for quantity in quantities)
        sampling = Sampling(
            period,
            max(1, round(ticks_per_measurement(spec, period))),
            round(spec.delay / period),
            spec.filter if isinstance(spec, FilteredSpec) else None,
            spec.noise.dropout,
        )
        joints = None if member.joints is None else tuple(robot.indices(member.joints(spec, robot)))
        places[name] = Place(quantities, member.topics(spec, robot), sampling, first, width, joints)
        first += 1 + width if width else 0
    return places


def sensed_by_name(sensors: Mapping[str, SensorSpec], robot: RobotModel, scene: Scene) -> dict[str, Sensed]:
    """The sensors as conditions see them, also of a task with errors."""
    found = {}
    for name, spec in sensors.items():
        member = SENSORS[spec.type]
        found[name] = Sensed(spec.type)
        if member.sensed is not None:
            sensed = member.sensed(spec, robot, scene)
            messages = {topic.suffix: topic.type for topic in member.topics(spec, robot)}
            found[name] = replace(sensed, messages=messages)
    return found


def sensor_frames(sensors: Mapping[str, SensorSpec], robot: RobotModel) -> tuple[tuple[str, str, Transform], ...]:
    """(parent, child, X_PC) of the frames of sensors, for `/tf_static`."""
    found: list[tuple[str, str, Transform]] = []
    for name, spec in sensors.items():
        if not isinstance(spec, MountedSpec):
            continue
        parent = spec.link or spec.frame or WORLD
        found.append((robot.root if parent == BASE else parent, name, spec.at.transform))
        found += [(name, name + suffix, X_SF) for suffix, X_SF in SENSORS[spec.type].frames(spec).items()]
    return tuple(found)
