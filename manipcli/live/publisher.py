"""Messages for clients, made in the process of the network by the encoders of the log."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import cached_property
from types import SimpleNamespace
from typing import Any

from manipcli.core.geometry import Array, Transform
from manipcli.live.offer import CLOCK, Offer
from manipcli.live.sample import Sample
from manipcli.live.sensed import SensedMessages
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.record import channels as topics
from manipcli.record import messages
from manipcli.record.cdr import NS_PER_S, CdrWriter
from manipcli.record.channels import ControllerChannel, MeasuredChannel, Recorded, channel_table
from manipcli.record.definition import read_definition
from manipcli.record.json_message import compact, definition, to_json
from manipcli.record.records import MESSAGE_HEAD, PAYLOAD
from manipcli.record.selection import Selection, word
from manipcli.record.write.block import Block
from manipcli.scene.scene import Scene


class Publisher:
    """Makes messages in CDR, and their text in `publish` operations.

    Args:
        offer: the topics.
        robot, scene: of the session.
        recorded: channels of its controllers.
        period: [s] of its control loop.
        sensors: channels of its sensors.
        frames: (parent, child, X_PC) of their frames.

    Attributes:
        state: of the last sample.
        outputs: of the controllers in the last sample.
        latched: the last message of each latched topic, in CDR.
        sensed: messages of sensors of numbers.
    """

    def __init__(
        self,
        offer: Offer,
        robot: RobotModel,
        scene: Scene,
        recorded: Sequence[Recorded],
        period: float,
        sensors: Sequence[MeasuredChannel] = (),
        frames: Sequence[tuple[str, str, Transform]] = (),
    ) -> None:
        self.offer = offer
        self.robot, self.scene, self.recorded, self.period = robot, scene, recorded, period
        self.state = WorldState.room(len(robot.moving_joints), len(scene.movable))
        self.outputs: Sequence[tuple[Array, Array] | None] = ()
        self.latched = dict(begin_messages(robot, scene, recorded, frames))
        self._table = {channel.topic: channel for channel in channel_table(recorded, sensors=sensors)}
        self._names = {channel.id: topic for topic, channel in self._table.items()}
        self._kinds = {
            topic: read_definition(kind, self._table[topic].definition)
            if topic in self._table and self._table[topic].definition
            else definition(kind)
            for topic, kind in offer.published.items()
        }
        self.sensed = SensedMessages(sensors, period)
        self._topics: frozenset[str] = frozenset()
        self._block: Block | None = None

    @cached_property
    def sampled(self) -> frozenset[str]:
        """Topics with messages at ticks; others only have them at events."""
        return self._states | {CLOCK} | self.sensed.topics

    @cached_property
    def _states(self) -> frozenset[str]:
        """Topics of the state and of controllers."""
        return self._made([topic for topic in self._table if topic not in self.sensed.topics]).topics

    def ns(self, tick: int) -> int:
        """The simulated time [ns] of a tick."""
        return round(tick * self.period * 1e9)

    def clock(self, tick: int) -> dict[str, int]:
        """The simulated time of a tick, builtin_interfaces/Time."""
        sec, nanosec = divmod(self.ns(tick), NS_PER_S)
        return {"sec": sec, "nanosec": nanosec}

    def sample(self, sample: Sample, wanted: Collection[str]) -> dict[str, bytes]:
        """The messages in CDR of the wanted topics that have one at this tick; sets `state`."""
        found: dict[str, bytes] = {}
        self.state.numbers[...] = sample.numbers
        self.state.time[...] = sample.tick * self.period
        self.outputs = sample.outputs
        if CLOCK in wanted:
            found[CLOCK] = clock_message(self.ns(sample.tick))
        if sample.sensed is not None:
            found |= self.sensed.new(sample.sensed, wanted)
        own = {*wanted} & self._states
        if not own:
            return found
        content = self._encoded(own, sample)
        offset = 0
        while offset < len(content):
            _, length, channel, *_ = MESSAGE_HEAD.unpack_from(content, offset)
            end = offset + 9 + length
            found[self._names[channel]] = content[offset + PAYLOAD : end]
            offset = end
        return found

    def _encoded(self, wanted: set[str], sample: Sample) -> bytes:
        """The message records of one tick, by the encoder of the log."""
        if self._block is None or wanted != self._topics:
            self._topics = frozenset(wanted)
            self._block = self._made(wanted)
        outputs: Any = [None if own is None else SimpleNamespace(rows=own[0], speed=own[1]) for own in sample.outputs]
        self._block.add(sample.tick, self.state, outputs)
        content = self._block.encode([])
        return b"" if content is None else content.data

    def _made(self, wanted: Collection[str]) -> Block:
        table = [self._table[topic] for topic in sorted(wanted)]
        every = Selection({word(topic): 1 for topic in wanted})
        return Block(self.robot, self.scene, self.recorded, table, every, self.period, 1)

    def text(self, topic: str, data: bytes) -> str:
        """The `publish` operation of a message in CDR."""
        message = to_json(self._kinds[topic], data)
        return compact({"op": "publish", "topic": topic, "msg": message})


def begin_messages(
    robot: RobotModel, scene: Scene, recorded: Sequence[Recorded], frames: Sequence[tuple[str, str, Transform]] = ()
) -> tuple[tuple[str, bytes], ...]:
    """The latched topics at the begin of a session, with their messages: there are no goals yet.

    Args:
        robot, scene, recorded, frames: as of a `Publisher`.
    """
    no_goals = CdrWriter()
    no_goals.u32(0)
    actions = [each for each in recorded if isinstance(each, ControllerChannel) and each.action]
    return (
        (topics.ROBOT_DESCRIPTION, messages.string_message(robot.urdf)),
        (topics.TF_STATIC, messages.tf_message((*messages.static_transforms(robot, scene), *frames), 0)),
        (topics.MARKERS, messages.marker_message(scene, 0)),
        *((each.status_topic, no_goals.data) for each in actions),
    )


def clock_message(ns: int) -> bytes:
    """A rosgraph_msgs/Clock."""
    writer = CdrWriter()
    writer.time(ns)
    return writer.data
