"""A simulation that obeys commands: whatever ticks it, a step of a task or a robot at rest, is live."""

from __future__ import annotations

from typing import Protocol

from manipcli.model.state import WorldState
from manipcli.simulate.session import Session


class SessionOver(BaseException):
    """The session ends before the next tick. Not an Exception: no step of a task recovers from it."""


class Turn(Protocol):
    """What happens around each tick."""

    def before_tick(self) -> None:
        """Carry out the commands of the tick.

        Raises:
            SessionOver: the session ends.
        """
        ...

    def after_tick(self) -> None:
        """Send feedback and results, and wait until the next tick is due."""
        ...


class LiveSession(Session):
    """A session whose ticks have a turn, from `begin` on."""

    _turn: Turn | None = None

    def begin(self, turn: Turn) -> None:
        """Obey from the next tick on."""
        self._turn = turn

    def tick(self) -> WorldState:
        turn = self._turn
        if turn is None:
            return super().tick()
        turn.before_tick()
        state = super().tick()
        turn.after_tick()
        return state
