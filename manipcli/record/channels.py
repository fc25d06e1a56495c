"""Table of the recorded channels: topic, message type and quality of service."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from manipcli.core.geometry import Array
from manipcli.record import schemas
from manipcli.spec.controllers import Interface

ROBOT_DESCRIPTION = "/robot_description"
TF_STATIC = "/tf_static"
TF = "/tf"
JOINT_STATES = "/joint_states"
ACTUATOR_STATES = "/actuator_states"
CONTACTS = "/contacts"
EVENTS = "/task/events"
ROSOUT = "/rosout"
MARKERS = "/markers"
LIVE_COMMANDS = "/live/commands"
SENSORS = "/sensors"
"""Above the topics of sensors."""
BELIEF = "/belief"
"""Above the topics of believed poses: those of `uncertain` bodies, each with its covariance, and `BELIEF_TF`."""
SCENE_JOINTS = "/scene/joints"
"""Positions of the joints of the scene, from the poses of `/tf` and at its ticks."""
BELIEF_TF = f"{BELIEF}/tf"
"""The poses that the robot believes, in frames of their own; at the ticks of `/tf`."""

# A quality of service profile as rosbag2 stores it: the last message is kept for late subscribers.
_INFINITE = "{sec: 9223372036, nsec: 854775807}"
TRANSIENT_LOCAL = (
    "- history: keep_last\n  depth: 1\n  reliability: reliable\n  durability: transient_local\n"
    f"  deadline: {_INFINITE}\n  lifespan: {_INFINITE}\n"
    f"  liveliness: automatic\n  liveliness_lease_duration: {_INFINITE}\n"
    "  avoid_ros_namespace_conventions: false\n"
)


@dataclass(frozen=True, slots=True)
class ControllerChannel:
    """A controller whose reference, feedback, error and output are recorded.

    Attributes:
        name: name of the controller.
        joints: its joints in the order of its outputs.
        interfaces: command interfaces of its output.
        action: name of its action; "" without an action.
    """

    name: str
    joints: tuple[str, ...]
    interfaces: tuple[Interface, ...] = ("effort",)
    action: Literal["", "follow_joint_trajectory", "gripper_cmd"] = ""

    @property
    def state_topic(self) -> str:
        return f"/{self.name}/controller_state"

    @property
    def reference_topic(self) -> str:
        return f"/{self.name}/reference"

    @property
    def error_topic(self) -> str:
        return f"/{self.name}/error"

    @property
    def feedback_topic(self) -> str:
        return f"/{self.name}/{self.action}/feedback"

    @property
    def status_topic(self) -> str:
        return f"/{self.name}/{self.action}/status"

    @property
    def result_topic(self) -> str:
        return f"/{self.name}/{self.action}/result"


@dataclass(frozen=True, slots=True)
class SensorChannel:
    """A broadcaster of a sensor.

    Attributes:
        name: name of the controller.
        sensor: name of the sensor, the last word of the topic.
        message: ROS type of the messages: a header and `width` float64 fields.
        frame: link frame of the measurements.
        width: numbers in a measurement.
        definition: ros2msg text of the type; "" for a type of `record/schemas.py`.
    """

    name: str
    sensor: str
    message: str
    frame: str
    width: int
    definition: str = ""

    @property
    def topic(self) -> str:
        return f"/{self.name}/{self.sensor}"


@dataclass(frozen=True, slots=True)
class MeasuredChannel:
    """A topic of a sensor.

    Attributes:
        topic: its name.
        message: ROS type, of `record/schemas.py`.
        frame: in the header.
        filled: fields that take the numbers of each measurement; empty for messages that are recorded one by one.
        fixed: values of the other fields.
        arrived: column, among the numbers of all sensors at a tick, that is 1 when a measurement arrives.
        first, width: columns of the measurement.
        every, delay: control ticks between measurements, and from a measurement to its arrival.
        complete: whether every measurement arrives.
        derive: (T, width) measurements -> (T, k) numbers of `filled`; None: the measurements themselves.
    """

    topic: str
    message: str
    frame: str
    filled: tuple[str, ...] = ()
    fixed: Mapping[str, object] = field(default_factory=dict)
    arrived: int = 0
    first: int = 0
    width: int = 0
    every: int = 1
    delay: int = 0
    complete: bool = True
    derive: Callable[[Array], Array] | None = None


@dataclass(frozen=True, slots=True)
class BeliefChannels:
    """Topics of what the robot believes.

    Attributes:
        bodies: those of `BELIEF_TF`, in the order of the scene.
        uncertain: those with a topic of their own.
    """

    bodies: tuple[str, ...] = ()
    uncertain: tuple[str, ...] = ()


NO_BELIEF = BeliefChannels()


def believed_frame(body: str) -> str:
    """The frame of the believed pose of a body."""
    return f"believed/{body}"


Recorded = ControllerChannel | SensorChannel | None
"""Recorded channels of a loaded controller; None: not recorded."""


@dataclass(frozen=True, slots=True)
class Channel:
    """One row of the table; `id` counts from 1.

    `definition`: ros2msg text of a type that `schemas.py` does not have.
    """

    id: int
    topic: str
    type: str
    latched: bool = False
    definition: str = ""


def channel_table(
    controllers: Sequence[Recorded],
    *,
    live: bool = False,
    sensors: Sequence[MeasuredChannel] = (),
    belief: BeliefChannels = NO_BELIEF,
    scene_joints: bool = False,
) -> tuple[Channel, ...]:
    """All channels of a recording, in the order of their ids; `live`: also that of the commands of a live session;
    `scene_joints`: that of the joints of a scene that has some."""
    rows: list[tuple[str, str, bool]] = [
        (ROBOT_DESCRIPTION, schemas.STRING, True),
        (TF_STATIC, schemas.TF_MESSAGE, True),
        (MARKERS, schemas.MARKER_ARRAY, True),
        (JOINT_STATES, schemas.JOINT_STATE, False),
        (TF, schemas.TF_MESSAGE, False),
        (CONTACTS, schemas.CONTACTS, False),
        (EVENTS, schemas.TASK_EVENT, False),
        (ROSOUT, schemas.LOG, False),
        (ACTUATOR_STATES, schemas.JOINT_STATE, False),
    ]
    for controller in controllers:
        if isinstance(controller, SensorChannel):
            rows.append((controller.topic, controller.message, False))
        if not isinstance(controller, ControllerChannel):
            continue
        rows += [
            (controller.state_topic, schemas.CONTROLLER_STATE, False),
            (controller.reference_topic, schemas.JOINT_STATE, False),
            (controller.error_topic, schemas.JOINT_STATE, False),
        ]
        if controller.action:
            feedback, result = schemas.ACTIONS[controller.action]
            rows += [
                (controller.feedback_topic, feedback, False),
                (controller.status_topic, schemas.GOAL_STATUS_ARRAY, True),
                (controller.result_topic, result, False),
            ]
    rows += [(sensor.topic, sensor.message, False) for sensor in sensors]
    if belief.bodies:
        rows.append((BELIEF_TF, schemas.TF_MESSAGE, False))
        rows += [(f"{BELIEF}/{name}", schemas.POSE_WITH_COVARIANCE, True) for name in belief.uncertain]
    if scene_joints:
        rows.append((SCENE_JOINTS, schemas.JOINT_STATE, False))
    if live:
        rows.append((LIVE_COMMANDS, schemas.LIVE_COMMAND, False))
    own = {sensor.topic: sensor.definition for sensor in controllers if isinstance(sensor, SensorChannel)}
    return tuple(
        Channel(k, topic, kind, latched, own.get(topic, "")) for k, (topic, kind, latched) in enumerate(rows, start=1)
    )
