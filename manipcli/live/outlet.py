"""Outlets: what shows a live session besides the WebSocket server, in the same process of the network."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Protocol

from manipcli.live.command import Command
from manipcli.live.publisher import Publisher
from manipcli.model.state import WorldState


@dataclass(frozen=True, slots=True)
class Network:
    """What an outlet gets.

    Attributes:
        publisher: its `offer`, `robot`, `scene`, `recorded`, `period`, and the `latched` messages.
        put: hands a command to the control loop, from any thread; False if too many wait. `Command.answer` is called
            in the thread of the network.
        changed: to be called, from any thread, when what the outlet wants has changed.
        title: of the session, for windows.
    """

    publisher: Publisher
    put: Callable[[Command], bool]
    changed: Callable[[], None]
    title: str = ""


class Outlet(Protocol):
    """An open outlet. Its methods are called in the thread of the network and must not block.

    Attributes:
        notice: for the user at the begin of the session, such as its address; "": nothing.
    """

    notice: str

    def wanted(self) -> Collection[str]:
        """The topics whose messages it takes now."""
        ...

    def message(self, topic: str, ns: int, data: bytes) -> None:
        """A message of a wanted or latched topic; `ns`: simulated time [ns]; `data`: CDR."""
        ...

    def watches(self) -> bool:
        """Whether it takes states now."""
        ...

    def state(self, tick: int, state: WorldState) -> None:
        """The state at a tick, at most 100 times per simulated second; the arrays are only valid during the call."""
        ...

    def close(self) -> None:
        """The session ends."""
        ...


class OutletOptions(Protocol):
    """Plain data that crosses to the process of the network, and opens an outlet there."""

    def open(self, network: Network) -> Outlet:
        """
        Raises:
            InvalidInput: a port that cannot be used, or a library that is not installed.
        """
        ...
