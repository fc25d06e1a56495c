"""Contract of sensors: the true state in, what the sensor measures out, at its own rate.

    truth -> low pass -> sampling -> + bias + white noise -> quantisation -> limits -> dropout -> delay -> reading

A member declares its spec, its quantities and its messages, and opens a probe that reads the truth. All between truth
and reading is done for every member by `signal_chain.py`, and the messages are written by the recorder. A sensor of
pictures (`Exposure`) has no numbers for the chain: it applies its own noise, and its messages arrive after `delay`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from manipcli.conditions.condition import Problem
from manipcli.conditions.sensed import Sensed
from manipcli.core.geometry import Array, Transform
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.scene.scene import Scene
from manipcli.simulate.engine import Engine
from manipcli.simulate.mount import LastTick, Mount
from manipcli.spec.sensors import Noise, SensorSpec

S = TypeVar("S", bound=SensorSpec)


@dataclass(frozen=True, slots=True)
class Quantity:
    """Numbers of a reading that have a unit in common.

    Attributes:
        name: in `noise` and `limits`.
        width: how many numbers.
        noise: theirs.
        least, most: readings are clipped to these.
    """

    name: str
    width: int
    noise: Noise[float] = field(default_factory=Noise[float])
    least: float = -np.inf
    most: float = np.inf


def limited(name: str, width: int, noise: Noise[float], limit: float | None) -> Quantity:
    """A quantity whose readings are between -limit and limit; None: unlimited."""
    most = np.inf if limit is None else limit
    return Quantity(name, width, noise, -most, most)


@dataclass(frozen=True, slots=True)
class Topic:
    """Messages of a sensor: all numbers of its reading in one message of constant size, or a picture.

    Attributes:
        type: ROS type, `sensor_msgs/msg/Imu`, which `record/schemas.py` has.
        filled: paths of the fields that take the numbers of a reading, in their order: numbers, arrays of numbers or
            messages of numbers (`wrench`, `linear_acceleration`, `ranges`). Empty for the messages of an `Exposure`.
        constant: path -> value of fields that never change, and of arrays in `filled` (which sets their lengths).
        suffix: of the topic `/sensors/NAME`: `/image_raw`.
        frame: suffix of the frame in the header, one of `frames` of the member: `_optical`.
        derive: (T, width) readings -> (T, k) numbers of `filled`, if they are not the readings themselves; picklable.
    """

    type: str
    filled: tuple[str, ...] = ()
    constant: Mapping[str, object] = field(default_factory=dict)
    suffix: str = ""
    frame: str = ""
    derive: Callable[[Array], Array] | None = None


@dataclass(frozen=True, slots=True)
class Picture:
    """A message of an `Exposure`: `suffix` of its topic, and path -> value of its fields; the others are zero.

    Values are numbers, text, numpy arrays or bytes (arrays of numbers) and sequences of mappings (arrays of messages).
    The header is filled in: the stamp is the time of the exposure.
    """

    suffix: str
    fields: Mapping[str, object]


class Probe(Protocol):
    """Reads the truth of a sensor of numbers."""

    def read(self, state: WorldState) -> Array:
        """The true numbers (width), those of all quantities in their order, now; always the same array.

        It is called at every control tick if the sensor has a filter, else at its own rate.
        """
        ...


class Exposure(Protocol):
    """Takes pictures."""

    def expose(self, state: WorldState, rng: np.random.Generator) -> Callable[[], Sequence[Picture]]:
        """Take the picture of this state; the result is called when it arrives, so that a thread may render until then.

        The arrays of `state` are overwritten at the next tick: copy them. Noise comes from `rng`, drawn here.
        """
        ...


@dataclass(frozen=True, slots=True)
class SensorContext:
    """What a sensor is opened with.

    Attributes:
        engine, robot, scene: the true ones; joint vectors follow `robot.moving_joints`; `scene.gravity` (3,) [m/s2].
        period: [s] of a control tick.
        before: velocities one tick ago, for members that `remember`.
        mount: where it is; None for a sensor without a place of its own.
    """

    engine: Engine
    robot: RobotModel
    scene: Scene
    period: float
    before: LastTick
    mount: Mount | None

    @property
    def place(self) -> Mount:
        """`mount` of a member whose spec is a `MountedSpec`."""
        assert self.mount is not None
        return self.mount


@dataclass(frozen=True, slots=True)
class SensorMember(Generic[S]):
    """A member of the seam.

    Attributes:
        name: the word under `type`.
        spec: what the user writes: a subclass of `MountedFilteredSpec` (or, without a place of its own, of
            `FilteredSpec`; of pictures, of `MountedSpec`).
        quantities: (spec, robot) -> the numbers of a reading; empty for pictures.
        topics: (spec, robot) -> its messages, all with the same numbers.
        open: (spec, context) -> a probe, or an exposure.
        check: (spec, robot, scene) -> problems, other than those of link, frame, rate and delay.
        frames: (spec) -> suffix -> pose in S of further frames, `NAME` + suffix in the log.
        joints: (spec, robot) -> the joints that it measures for the controllers; its quantities are then `position`,
            `velocity` and `effort` of these.
        remembers: the probe reads `SensorContext.before`, and on a body its velocities at every tick.
        needs_link: it must be on a link, not on a frame of the scene.
        sensed: (spec, robot, scene) -> what conditions get of it, without `messages`; None: no condition asks for it.
    """

    name: str
    spec: type[S]
    quantities: Callable[[S, RobotModel], tuple[Quantity, ...]]
    topics: Callable[[S, RobotModel], tuple[Topic, ...]]
    open: Callable[[S, SensorContext], Probe | Exposure]
    check: Callable[[S, RobotModel, Scene], Iterable[Problem]] = lambda spec, robot, scene: ()
    frames: Callable[[S], Mapping[str, Transform]] = lambda spec: {}
    joints: Callable[[S, RobotModel], tuple[str, ...]] | None = None
    remembers: bool = False
    needs_link: bool = False
    sensed: Callable[[S, RobotModel, Scene], Sensed] | None = None


AnySensor = SensorMember[Any]
