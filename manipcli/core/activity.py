"""Announcement of work that takes seconds, from any layer to whoever shows progress."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_listener: ContextVar[Callable[[str], None] | None] = ContextVar("activity", default=None)


def announce(text: str) -> None:
    """Reports what takes a while, before it begins; without a listener nothing happens."""
    listener = _listener.get()
    if listener is not None:
        listener(text)


@contextmanager
def announced_to(listener: Callable[[str], None]) -> Iterator[None]:
    """Passes announcements within the block to `listener`."""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)
