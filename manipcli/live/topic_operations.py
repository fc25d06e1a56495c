"""Operations of a client on topics: advertise, publish, subscribe, unsubscribe."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from manipcli.live import command as words
from manipcli.live.command import Answer
from manipcli.live.connection import Connection
from manipcli.live.fields import MAX_NAME, Refused, check_type, near, number_of, text_of, topic_of
from manipcli.live.outbox import MAX_QUEUE, Subscription
from manipcli.record.json_message import definition, from_json

MAX_SUBSCRIPTIONS: Final = 100
QUEUE: Final = 10
"""Default of `queue_length`."""


@dataclass(frozen=True, slots=True)
class _Asked:
    """What one `subscribe` asked for: least time between two messages [s], messages that wait, name of the topic."""

    throttle: float
    length: int
    name: str


class TopicOperations:
    """Those of one client.

    A client can subscribe a topic several times, with an id each: it gets every message once, as often as the fastest
    asked for, until the last is unsubscribed.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._asked: dict[str, dict[str, _Asked]] = {}

    def advertise(self, frame: Mapping[str, Any]) -> None:
        """Check the topic and its type; publishing needs no `advertise`."""
        topic = topic_of(frame)
        check_type(topic, self._input(topic), frame)

    def unadvertise(self, frame: Mapping[str, Any]) -> None:
        """Has no effect."""

    def _input(self, topic: str) -> str:
        received = self._connection.offer.received
        if topic not in received:
            raise Refused(f"topic '{topic}' takes no messages; {near(topic, received)}")
        return received[topic]

    def publish(self, frame: Mapping[str, Any]) -> None:
        """Check a message and hand it to the control loop."""
        topic = topic_of(frame)
        kind = self._input(topic)
        self._connection.check_right(topic)  # before the long check of the message
        message = from_json(definition(kind), frame.get("msg", {}))

        def refused(answer: Answer) -> None:
            if not answer.ok:
                self._connection.status("error", f"{topic}: {answer.text}", frame.get("id"))

        self._connection.command(words.PUBLISH, topic, "", message, refused)

    def subscribe(self, frame: Mapping[str, Any]) -> None:
        """Subscribe, and send the last message of a latched topic."""
        topic, id_ = topic_of(frame), _id_of(frame)
        published = self._connection.offer.published
        if topic not in published:
            raise Refused(f"topic '{topic}' is not published; {near(topic, published)}")
        check_type(topic, published[topic], frame)
        asked = self._asked.setdefault(topic, {})
        if id_ not in asked and sum(map(len, self._asked.values())) >= MAX_SUBSCRIPTIONS:
            raise Refused(f"more than {MAX_SUBSCRIPTIONS} subscriptions")
        throttle = number_of(frame, "throttle_rate", 0.0) / 1000.0
        length = int(min(number_of(frame, "queue_length", 0.0), MAX_QUEUE)) or QUEUE
        asked[id_] = _Asked(throttle, length, text_of(frame, "topic"))
        self._warn_of_ignored(frame)
        self._apply(topic)
        last = self._connection.services.latched(topic)
        if last is not None:
            self._connection.outbox.publish(topic, last, time.monotonic())

    def unsubscribe(self, frame: Mapping[str, Any]) -> None:
        """End the subscription with the id of the frame, or all of the topic without an id."""
        topic, id_ = topic_of(frame), _id_of(frame)
        asked = self._asked.get(topic)
        if asked is None:
            return
        if id_:
            asked.pop(id_, None)
        else:
            asked.clear()
        self._apply(topic)

    def _apply(self, topic: str) -> None:
        """Make the subscription of a topic that serves all that were asked for."""
        subscriptions, asked = self._connection.outbox.subscriptions, self._asked[topic].values()
        if not asked:
            subscriptions.pop(topic, None)
            del self._asked[topic]
        else:
            pictures = self._connection.offer.pictures
            length = 1 if topic in pictures else max(each.length for each in asked)
            before = subscriptions.get(topic)
            kept = () if before is None else before.waiting
            dropped = 0 if before is None else before.dropped + max(0, len(kept) - length)
            waiting = deque(kept, maxlen=length)
            throttle, names = min(each.throttle for each in asked), frozenset(each.name for each in asked)
            subscriptions[topic] = Subscription(topic, throttle, waiting, dropped, names=names)
        self._connection.services.subscribed()

    def _warn_of_ignored(self, frame: Mapping[str, Any]) -> None:
        compression = frame.get("compression")
        if compression not in (None, "", "none"):
            text = f"compression '{str(compression)[:20]}' is not supported; messages are sent as JSON text"
            self._connection.status("warning", text, frame.get("id"))
        if frame.get("fragment_size") is not None:
            self._connection.status("warning", "fragment_size has no effect; messages are sent whole", frame.get("id"))


def _id_of(frame: Mapping[str, Any]) -> str:
    """The id of a subscription; "" if it has none."""
    found = frame.get("id")
    if found is None:
        return ""
    if not isinstance(found, str) or len(found) > MAX_NAME:
        raise Refused(f"'id' must be a text of at most {MAX_NAME} characters")
    return found
