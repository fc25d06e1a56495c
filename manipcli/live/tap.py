"""Another server of the same messages: it gets them in CDR, as the log has them, from the thread of the network."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol


class Tap(Protocol):
    """Takes encoded messages beside the clients of rosbridge."""

    @property
    def wanted(self) -> frozenset[str]:
        """Topics that somebody subscribes to."""
        ...

    def listen(self, changed: Callable[[], object]) -> None:
        """Call `changed`, in any thread, when `wanted` has changed."""
        ...

    def publish(self, topic: str, ns: int, data: bytes) -> None:
        """Take a message of an event; it must not block.

        Args:
            topic: its topic.
            ns: its simulated time [ns].
            data: the message in CDR.
        """
        ...

    def sample(self, ns: int, found: Mapping[str, bytes]) -> None:
        """Take the messages of one tick by topic, at least those of `wanted`."""
        ...
