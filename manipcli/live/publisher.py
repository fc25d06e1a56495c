"""Messages for subscribers, made in the thread of the network by the encoders of the log."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from manipcli.live.feed import Sample
from manipcli.live.interface import CLOCK, Offer
from manipcli.model.robot import RobotModel
from manipcli.model.state import WorldState
from manipcli.record import channels as topics
from manipcli.record import messages
from manipcli.record.cdr import NS_PER_S, CdrWriter
from manipcli.record.channels import ControllerChannel, Recorded, channel_table
from manipcli.record.definition import read_definition
from manipcli.record.json_message import definition, to_json
from manipcli.record.records import MESSAGE_HEAD, PAYLOAD
from manipcli.record.selection import Selection, word
from manipcli.record.write.block import Block
from manipcli.scene.scene import Scene


class Publisher:
    """Makes the text of `publish` operations.

    Args:
        offer: the topics.
        robot, scene: of the session.
        recorded: channels of its controllers.
        period: [s] of its control loop.
    """

    def __init__(
        self, offer: Offer, robot: RobotModel, scene: Scene, recorded: Sequence[Recorded], period: float
    ) -> None:
        self.offer = offer
        self._robot, self._scene, self._recorded, self._period = robot, scene, recorded, period
        self._table = {channel.topic: channel for channel in channel_table(recorded)}
        self._topics: frozenset[str] = frozenset()
        self._block: Block | None = None
        self._state = WorldState.room(len(robot.moving_joints), len(scene.movable))
        self._last: dict[str, str] = {}
        for topic, data in begin_messages(robot, scene, recorded):
            self.event(topic, data)

    def event(self, topic: str, data: bytes) -> str:
        """The text of a message in CDR; kept for later subscribers if its topic is latched."""
        text = self._text(topic, data)
        if topic in self.offer.latched:
            self._last[topic] = text
        return text

    def latched(self, topic: str) -> str | None:
        """The last text of a latched topic; None before its first message."""
        return self._last.get(topic)

    def clock(self, tick: int) -> dict[str, int]:
        """The simulated time of a tick, builtin_interfaces/Time."""
        sec, nanosec = divmod(round(tick * self._period * 1e9), NS_PER_S)
        return {"sec": sec, "nanosec": nanosec}

    def sample(self, sample: Sample, wanted: Iterable[str]) -> dict[str, str]:
        """The texts of the wanted topics that have a message at this tick."""
        found: dict[str, str] = {}
        wanted = frozenset(wanted)
        if CLOCK in wanted:
            message = {"clock": self.clock(sample.tick)}
            found[CLOCK] = json.dumps({"op": "publish", "topic": CLOCK, "msg": message}, separators=(",", ":"))
        own = wanted & self._table.keys()
        if not own:
            return found
        content = self._encoder(own, sample)
        names = {channel.id: topic for topic, channel in self._table.items()}
        offset = 0
        while offset < len(content):
            _, length, channel, *_ = MESSAGE_HEAD.unpack_from(content, offset)
            end = offset + 9 + length
            topic = names[channel]
            found[topic] = self._text(topic, content[offset + PAYLOAD : end])
            offset = end
        return found

    def _encoder(self, wanted: frozenset[str], sample: Sample) -> bytes:
        """The message records of one tick, by the encoder of the log."""
        if self._block is None or wanted != self._topics:
            self._topics = wanted
            table = [self._table[topic] for topic in sorted(wanted)]
            every = Selection({word(topic): 1 for topic in wanted})
            self._block = Block(self._robot, self._scene, self._recorded, table, every, self._period, 1)
        np.copyto(self._state.numbers, sample.numbers)
        outputs: Any = [None if own is None else SimpleNamespace(rows=own[0], speed=own[1]) for own in sample.outputs]
        self._block.add(sample.tick, self._state, outputs)
        content = self._block.encode([])
        return b"" if content is None else content.data

    def _text(self, topic: str, data: bytes) -> str:
        channel = self._table[topic]
        kind = definition(channel.type) if not channel.definition else read_definition(channel.type, channel.definition)
        message = to_json(kind, data)
        return json.dumps({"op": "publish", "topic": topic, "msg": message}, separators=(",", ":"), allow_nan=False)


def begin_messages(robot: RobotModel, scene: Scene, recorded: Sequence[Recorded]) -> tuple[tuple[str, bytes], ...]:
    """The latched topics at the begin of a session, with their messages: there are no goals yet."""
    no_goals = CdrWriter()
    no_goals.u32(0)
    actions = [each for each in recorded if isinstance(each, ControllerChannel) and each.action]
    return (
        (topics.ROBOT_DESCRIPTION, messages.string_message(robot.urdf)),
        (topics.TF_STATIC, messages.tf_message(messages.static_transforms(robot, scene), 0)),
        (topics.MARKERS, messages.marker_message(scene, 0)),
        *((each.status_topic, no_goals.data) for each in actions),
    )


def is_sampled(topic: str, offer: Offer) -> bool:
    """Whether a topic can have messages at ticks, not only once."""
    return topic in offer.published and topic not in offer.latched
