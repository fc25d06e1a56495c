"""The sensors of a running simulation: read, filtered, delayed and delivered at every control tick."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from manipcli.core.geometry import Array
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.scene.scene import Scene
from manipcli.simulate.engine import Engine
from manipcli.simulate.measured_joints import MeasuredJoints
from manipcli.simulate.mount import LastTick, mount_of
from manipcli.simulate.sensor import Exposure, Picture, Probe, SensorContext
from manipcli.simulate.sensor_layout import Place, layout
from manipcli.simulate.sensors import SENSORS
from manipcli.simulate.signal_chain import SignalChain, generators
from manipcli.spec.mounted_sensor import MountedSpec
from manipcli.spec.sensors import SensorSpec

Deliver = Callable[[int, int, str, Picture], None]
"""(tick of arrival, tick of measuring, name of the sensor, message)."""
NO_SENSORS: Final[Mapping[str, SensorSpec]] = {}


def _nobody(tick: int, taken: int, name: str, picture: Picture) -> None:
    """Receives nothing."""


@dataclass(slots=True)
class _Numbers:
    """A sensor of numbers.

    `row`: its columns of `SensorBank.numbers`, of which the first is 1 when a measurement arrives; `heard`: whether one
    has arrived since `reset`.
    """

    probe: Probe
    chain: SignalChain
    truth: Array
    row: Array
    every: int
    heard: bool = False


@dataclass(slots=True)
class _Pictures:
    """A sensor of pictures, and those on their way: tick of arrival, tick of exposure, the messages."""

    name: str
    exposure: Exposure
    rng: np.random.Generator
    every: int
    delay: int
    coming: deque[tuple[int, int, Callable[[], Sequence[Picture]]]]


class SensorBank:
    """All sensors of a session, by name; without any it costs nothing.

    Args:
        sensors: of a checked task.
        robot, scene, engine: the true ones.
        period: [s] of a control tick.
        seed: of the simulation.
        state: at the start.

    Attributes:
        numbers: (width) for each sensor of numbers, in the order of `layout`: 1 at a tick at which a measurement
            arrives, else 0, then its last reading.
        joints: what the sensors of joints measure, and the truth of the other joints; None without such sensors.
        body_velocities: whether velocities of bodies must be up to date at every tick.
        deliver: called with each message of a sensor of pictures when it arrives.
    """

    def __init__(
        self,
        sensors: Mapping[str, SensorSpec],
        robot: RobotModel,
        scene: Scene,
        engine: Engine,
        *,
        period: float,
        seed: int,
        state: WorldState,
    ) -> None:
        self.deliver: Deliver = _nobody
        self.joints: MeasuredJoints | None = None
        self.body_velocities = False
        self._sensors, self._robot, self._seed = sensors, robot, seed
        self._places = layout(sensors, robot, period)
        self.numbers = np.zeros(sum(1 + place.width for place in self._places.values() if place.width))
        self._before = LastTick(state)
        self._remembers = False
        self._each: dict[str, _Numbers] = {}
        self._pictures: list[_Pictures] = []
        for name, spec in sensors.items():
            member = SENSORS[spec.type]
            mount = mount_of(spec, robot, scene) if isinstance(spec, MountedSpec) else None
            context = SensorContext(engine, robot, scene, period, self._before, mount)
            self._remembers |= member.remembers
            self.body_velocities |= member.remembers and mount is not None and mount.movable >= 0
            self._add(name, self._places[name], member.open(spec, context))

    def _add(self, name: str, place: Place, opened: Probe | Exposure) -> None:
        if not place.width:
            assert not hasattr(opened, "read")
            rng = generators(self._seed, name, 1)[0]
            self._pictures.append(_Pictures(name, opened, rng, place.sampling.every, place.sampling.delay, deque()))
            return
        assert not hasattr(opened, "expose")
        row = self.numbers[place.first : place.first + 1 + place.width]
        truth = np.zeros(place.width)
        chain = SignalChain(place.quantities, place.sampling, seed=self._seed, name=name, truth=truth, reading=row[1:])
        every = place.sampling.every if place.sampling.cutoff is None else 1
        self._each[name] = _Numbers(opened, chain, truth, row, every)
        if place.joints is not None:
            if self.joints is None:
                self.joints = MeasuredJoints(len(self._robot.joint_names))
            self.joints.add(place.joints, row[1:])

    def __bool__(self) -> bool:
        return bool(self._places)

    def reading(self, name: str) -> Array:
        """(width) the last reading of a sensor of numbers; always the same array."""
        place = self._places[name]
        return self.numbers[place.first + 1 : place.first + 1 + place.width]

    def arriving(self, name: str) -> Array:
        """(1 + width) 1 at a tick at which a measurement arrives, else 0; the last reading. Always the same array."""
        return self._each[name].row

    def heard(self, name: str) -> bool:
        """Whether a measurement of a sensor of numbers has arrived since `reset`."""
        return self._each[name].heard

    def positions(self, state: WorldState) -> Array:
        """(n) the joint positions as the robot knows them: as they are measured, and true for joints without a sensor.

        Args:
            state: the true one.
        """
        return self.joints.position if self.joints is not None and self.joints.known else state.position

    def reset(self) -> None:
        """The next tick is tick 0: noise begins again, and what is on its way is dropped."""
        for each in self._each.values():
            each.chain.reset()
            each.heard = False
        for pictures in self._pictures:
            pictures.coming.clear()
            pictures.rng = generators(self._seed, pictures.name, 1)[0]

    def sense(self, tick: int, state: WorldState) -> None:
        """One control tick, counted from `reset`."""
        for each in self._each.values():
            if tick % each.every == 0:
                each.truth[:] = each.probe.read(state)
            each.row[0] = arrived = each.chain.step(tick)
            each.heard = arrived or each.heard
        for pictures in self._pictures:
            self._expose(pictures, tick, state)
        if self._remembers:
            self._before.keep(state)
        if self.joints is not None:
            self.joints.update(state)

    def _expose(self, pictures: _Pictures, tick: int, state: WorldState) -> None:
        if tick % pictures.every == 0:
            pictures.coming.append((tick + pictures.delay, tick, pictures.exposure.expose(state, pictures.rng)))
        while pictures.coming and pictures.coming[0][0] <= tick:
            _, taken, messages = pictures.coming.popleft()
            for picture in messages():
                self.deliver(tick, taken, pictures.name, picture)
