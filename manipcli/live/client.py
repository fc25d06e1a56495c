"""One client of the rosbridge protocol 2: its operations, its rights and its limits."""

from __future__ import annotations

import json
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from manipcli.core.text import did_you_mean
from manipcli.live import command as words
from manipcli.live.budget import RATE, Budget
from manipcli.live.command import Answer, Command
from manipcli.live.fields import MAX_NAME, Refused, check_type, near, number_of, text_of, topic_of
from manipcli.live.frames import BadFrame, read_frame
from manipcli.live.offer import Offer, goal_type, request_type
from manipcli.live.outbox import MAX_QUEUE, Outbox, Subscription
from manipcli.live.rosapi import Rosapi
from manipcli.record.json_message import BadMessage, definition, from_json

MAX_SUBSCRIPTIONS: Final = 100
MAX_GOALS: Final = 100
"""Goals and services of one client that wait for an answer."""
LEVELS: Final = ("none", "error", "warning", "info")
QUEUE: Final = 10
"""Default of `queue_length`."""


@dataclass(frozen=True, slots=True)
class Services:
    """What all clients share.

    Attributes:
        offer: names and types.
        latched: the last text of a latched topic; None before its first message.
        rosapi: answers its services.
        put: hands a command to the control loop; False if too many wait.
        in_network: calls in the thread of the network.
        subscribed: to be called when subscriptions have changed.
    """

    offer: Offer
    latched: Callable[[str], str | None]
    rosapi: Rosapi
    put: Callable[[Command], bool]
    in_network: Callable[[Callable[[], None]], None]
    subscribed: Callable[[], None]


class Client:
    """A connection.

    Args:
        number: of the connection in the session.
        commands: whether it may command.
        services: see there.
    """

    def __init__(self, number: int, *, commands: bool, services: Services) -> None:
        self.outbox = Outbox()
        self._number = number
        self._commands = commands
        self._services = services
        self._offer = services.offer
        self._goals: dict[str, str] = {}
        self._calls = 0
        self._sent = 0
        self._level = "warning"
        self._budget = Budget()
        self._warned = 0.0
        self._operations: dict[str, Callable[[dict[str, Any]], None]] = {
            "advertise": self._advertise,
            "unadvertise": lambda frame: None,
            "publish": self._publish,
            "subscribe": self._subscribe,
            "unsubscribe": self._unsubscribe,
            "call_service": self._call_service,
            "send_action_goal": self._send_goal,
            "cancel_action_goal": self._cancel_goal,
            "set_level": self._set_level,
        }

    def receive(self, text: str | bytes) -> None:
        """Carry out one frame; whatever is wrong with it is a status message."""
        if not self._within_rate():
            return
        frame: dict[str, Any] = {}
        try:
            frame = read_frame(text)
            op = text_of(frame, "op")
            if op not in self._operations:
                raise Refused(f"unknown op '{op[:60]}'; {did_you_mean(op[:60], self._operations, kind='ops')}")
            self._operations[op](frame)
        except (BadFrame, BadMessage, Refused) as error:
            self._failed(frame, str(error))

    def _failed(self, frame: Mapping[str, Any], text: str) -> None:
        """An operation that waits for a response gets one; others get a status."""
        op, name = frame.get("op"), frame.get("service")
        if op == "call_service" and isinstance(name, str):
            self._respond(frame, Answer(False, {}, text=text))
        elif op == "send_action_goal" and isinstance(frame.get("action"), str):
            self._result(frame, Answer(False, {}, text=text, status=6))
        else:
            self.status("error", text, frame.get("id"))

    def status(self, level: str, text: str, id_: object = None) -> None:
        """Send a status message, if the client wants this level."""
        if LEVELS.index(level) <= LEVELS.index(self._level):
            found = {"op": "status", "level": level, "msg": text}
            self._answer(found if not isinstance(id_, str) else {**found, "id": id_})

    def _answer(self, message: Mapping[str, object]) -> None:
        self.outbox.answer(json.dumps(message, separators=(",", ":")))

    def _within_rate(self) -> bool:
        now = time.monotonic()
        if self._budget.spend(now):
            return True
        if now - self._warned > 1.0:
            self._warned = now
            self.status("error", f"more than {RATE:g} operations per second; the others are dropped")
        return False

    def _set_level(self, frame: dict[str, Any]) -> None:
        level = text_of(frame, "level")
        if level not in LEVELS:
            raise Refused(f"unknown level '{level[:60]}'; expected {', '.join(LEVELS)}")
        self._level = level

    def _advertise(self, frame: dict[str, Any]) -> None:
        topic = topic_of(frame)
        check_type(topic, self._input(topic), frame)

    def _input(self, topic: str) -> str:
        kind = self._offer.received.get(topic)
        if kind is None:
            raise Refused(f"topic '{topic}' takes no messages; {near(topic, self._offer.received)}")
        return kind

    def _publish(self, frame: dict[str, Any]) -> None:
        topic = topic_of(frame)
        message = from_json(definition(self._input(topic)), frame.get("msg", {}))

        def refused(answer: Answer) -> None:
            if not answer.ok:
                self.status("error", f"{topic}: {answer.text}", frame.get("id"))

        self._put(words.PUBLISH, topic, "", message, refused)

    def _put(self, op: str, name: str, id_: str, message: object, answer: Callable[[Answer], None]) -> None:
        """Hand a command to the control loop, whose thread calls back; `answer` is called in this thread."""
        if not self._commands and name not in self._offer.readers:
            raise Refused("this connection may only read: connect with the token that `manipcli serve` printed")

        def back(found: Answer) -> None:
            self._services.in_network(lambda: answer(found))

        text = json.dumps(message, separators=(",", ":"), allow_nan=False)
        if not self._services.put(Command(op, name, id_, text, back)):
            raise Refused("too many commands wait for the next tick")

    def _subscribe(self, frame: dict[str, Any]) -> None:
        topic = topic_of(frame)
        kind = self._offer.published.get(topic)
        if kind is None:
            raise Refused(f"topic '{topic}' is not published; {near(topic, self._offer.published)}")
        check_type(topic, kind, frame)
        if topic not in self.outbox.subscriptions and len(self.outbox.subscriptions) >= MAX_SUBSCRIPTIONS:
            raise Refused(f"more than {MAX_SUBSCRIPTIONS} subscriptions")
        throttle = number_of(frame, "throttle_rate", 0.0) / 1000.0
        length = int(min(number_of(frame, "queue_length", 0.0), MAX_QUEUE)) or QUEUE
        self.outbox.subscriptions[topic] = Subscription(topic, throttle, deque(maxlen=length))
        last = self._services.latched(topic)
        if last is not None:
            self.outbox.publish(topic, last, time.monotonic())
        self._services.subscribed()

    def _unsubscribe(self, frame: dict[str, Any]) -> None:
        self.outbox.subscriptions.pop(topic_of(frame), None)
        self._services.subscribed()

    def _call_service(self, frame: dict[str, Any]) -> None:
        name = "/" + text_of(frame, "service").lstrip("/")
        request = frame.get("args", {})
        if name.startswith("/rosapi/"):
            self._respond(frame, Answer(True, self._services.rosapi.call(name, request)))
            return
        kind = self._offer.services.get(name)
        if kind is None:
            raise Refused(f"unknown service '{name[:80]}'; {near(name, [*self._offer.services, *self._rosapi_names])}")
        if self._calls >= MAX_GOALS:
            raise Refused(f"more than {MAX_GOALS} services wait for a response")
        message = from_json(definition(request_type(kind)), request if request != [] else {})

        def answered(answer: Answer) -> None:
            self._calls -= 1
            self._respond(frame, answer)

        self._put(words.CALL_SERVICE, name, "", message, answered)
        self._calls += 1

    @property
    def _rosapi_names(self) -> list[str]:
        return [*self._services.rosapi.names]

    def _respond(self, frame: Mapping[str, Any], answer: Answer) -> None:
        values: object = answer.values if answer.ok else answer.text
        found = {"op": "service_response", "service": frame["service"], "values": values, "result": answer.ok}
        self._answer({**found, "id": frame["id"]} if isinstance(frame.get("id"), str) else found)

    def _send_goal(self, frame: dict[str, Any]) -> None:
        name = "/" + text_of(frame, "action").lstrip("/")
        kind = self._offer.actions.get(name)
        if kind is None:
            raise Refused(f"unknown action '{name[:80]}'; {near(name, self._offer.actions)}")
        check_type(name, kind, {"type": frame.get("action_type")})
        asked = frame.get("id")
        if not isinstance(asked, str) or not asked or len(asked) > MAX_NAME:
            raise Refused("send_action_goal needs an id, a text")
        if asked in self._goals:
            raise Refused(f"goal '{asked[:60]}' is still active; each goal needs its own id")
        if len(self._goals) >= MAX_GOALS:
            raise Refused(f"more than {MAX_GOALS} goals are active")
        message = from_json(definition(goal_type(kind)), frame.get("args", {}))
        self._sent += 1
        own = f"{self._number}.{self._sent}"

        def answered(answer: Answer) -> None:
            if answer.status is None:
                if frame.get("feedback") is True:
                    found = {"op": "action_feedback", "action": frame["action"], "values": answer.values, "id": asked}
                    self._answer(found)
                return
            self._goals.pop(asked, None)
            self._result(frame, answer)

        self._put(words.SEND_GOAL, name, own, message, answered)
        self._goals[asked] = own

    def _result(self, frame: Mapping[str, Any], answer: Answer) -> None:
        values: object = answer.values or answer.text
        found = {"op": "action_result", "action": frame["action"], "values": values, "status": answer.status}
        found["result"] = answer.ok
        self._answer({**found, "id": frame["id"]} if isinstance(frame.get("id"), str) else found)

    def _cancel_goal(self, frame: dict[str, Any]) -> None:
        own = self._goals.get(text_of(frame, "id"))
        if own is None:
            raise Refused(f"goal '{text_of(frame, 'id')[:60]}' is not active")
        self._put(words.CANCEL_GOAL, "/" + text_of(frame, "action").lstrip("/"), own, {}, words.nobody)
