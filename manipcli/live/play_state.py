"""Whether a live session plays, is paused or ends: states of simulation_interfaces, changed by commands alone.

While it does not play there is no tick, so no simulated number depends on how long it waits. A session that is
simulated again from its log gets the same commands at the same ticks, and is paused and stepped as it was.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from manipcli.live.command import CALL_SERVICE, Command

STOPPED: Final = 0
PLAYING: Final = 1
PAUSED: Final = 2
QUITTING: Final = 3
STATES: Final = {STOPPED: "stopped", PLAYING: "playing", PAUSED: "paused", QUITTING: "quitting"}
"""simulation_interfaces/SimulationState."""
SET_STATE: Final = "/set_simulation_state"
FIRST: Final = "first"
"""Id of the command with which a session begins that does not play: no client can send it."""


@dataclass(frozen=True, slots=True)
class Reset:
    """The next session, which begins when this one has ended, and its first state; `begun`: called when it begins."""

    state: int
    begun: Callable[[], None]

    def command(self) -> Command | None:
        """The command that brings the next session, which would play, into its first state."""
        if self.state == PLAYING:
            return None
        return Command(CALL_SERVICE, SET_STATE, FIRST, f'{{"state": {{"state": {self.state}}}}}')


@dataclass(slots=True)
class PlayState:
    """The state of one session.

    Attributes:
        state: one of `STATES`.
        steps: ticks that are still simulated before it is paused again.
        over: whether it ends, after its first tick at the earliest.
        reset: what comes after it; None: nothing.
    """

    state: int = PLAYING
    steps: int = 0
    over: bool = False
    reset: Reset | None = None

    @property
    def moves(self) -> bool:
        """Whether the next tick is due."""
        return self.state == PLAYING or self.steps > 0

    def ticked(self) -> None:
        """A tick was simulated."""
        if self.steps:
            self.steps -= 1

    def end(self, reset: Reset | None = None) -> None:
        """End the session before the next tick."""
        self.over, self.reset = True, reset
