"""What waits to be sent to one client: bounded for each topic, the oldest message is dropped."""

from __future__ import annotations

import asyncio
import json
from collections import deque
from dataclasses import dataclass, field
from typing import Final

MAX_QUEUE: Final = 100
"""Longest queue of a topic that a client can ask for."""
MAX_ANSWERS: Final = 2000
"""Answers that wait; a client that does not read them is disconnected."""


@dataclass(slots=True)
class Subscription:
    """One topic of one client.

    Attributes:
        topic: its name.
        throttle: [s] least wall time between two messages.
        waiting: texts, at most as many as the client asked for.
        dropped: texts that were replaced by later ones.
        names: of the topic as the client wrote them, with or without a slash: roslibjs waits for its own word.
    """

    topic: str
    throttle: float
    waiting: deque[str]
    dropped: int = 0
    next: float = 0.0
    names: frozenset[str] = frozenset()

    def addressed(self, text: str) -> list[str]:
        """A text of this topic, under each of the names."""
        if self.names <= {self.topic}:
            return [text]
        own = f'"topic":{json.dumps(self.topic)}'
        return [text.replace(own, f'"topic":{json.dumps(name)}', 1) for name in sorted(self.names)]

    def offer(self, text: str, now: float) -> bool:
        """Queue a text unless it comes too early after the last one; `now`: wall time [s]."""
        if now < self.next:
            return False
        self.next = max(self.next + self.throttle, now - self.throttle) if self.throttle else 0.0
        if len(self.waiting) == self.waiting.maxlen:
            self.dropped += 1
        self.waiting.append(text)
        return True


@dataclass(slots=True)
class Outbox:
    """Answers, then messages of topics in turn.

    Attributes:
        subscriptions: by topic.
        full: whether the client has not read its answers.
    """

    subscriptions: dict[str, Subscription] = field(default_factory=dict)
    full: bool = False
    ready: asyncio.Event = field(default_factory=asyncio.Event)
    _answers: deque[str] = field(default_factory=deque)

    def answer(self, text: str) -> None:
        """Queue an answer; answers are never dropped."""
        if len(self._answers) >= MAX_ANSWERS:
            self.full = True
        else:
            self._answers.append(text)
        self.ready.set()

    def publish(self, topic: str, text: str, now: float) -> bool:
        """Queue a message for a subscriber; False if there is none, or it comes too early."""
        subscription = self.subscriptions.get(topic)
        taken = subscription is not None and subscription.offer(text, now)
        if taken:
            self.ready.set()
        return taken

    def take(self) -> list[str]:
        """All answers, and the next message of each topic."""
        self.ready.clear()
        found = [*self._answers]
        self._answers.clear()
        for subscription in [*self.subscriptions.values()]:
            if subscription.waiting:
                found += subscription.addressed(subscription.waiting.popleft())
                if subscription.waiting:
                    self.ready.set()
        return found
