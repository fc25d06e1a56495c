"""Which contacts are worth a message: a set of pairs that changed, a knock and its end at once, other forces at most
100 times a simulated second, small changes at most ten times, so that a force that stays is known closely soon."""

from __future__ import annotations

from collections.abc import Sequence

from manipcli.model.state import Contact

FORCE_PERIOD = 0.01
"""[s] Forces alone are written no more often than this."""

FORCE_SHARE, FORCE_LEAST = 0.1, 0.05
"""A force has changed when it differs by more than a tenth of what was recorded and by more than 0.05 N."""

STEADY_PERIOD = 0.1
"""[s] After so long smaller changes count, too:"""

STEADY_SHARE, STEADY_LEAST = 0.01, 0.005
"""more than a hundredth of what was recorded and more than 0.005 N."""

KNOCK_SHARE, KNOCK_LEAST = 0.5, 1.0
"""Of two forces, recorded and now, the larger is a knock if it is more than the lesser by half of that and 1 N besides:
that it began, or ended, is written at once."""

DEPTH_LEAST = 2e-4
"""[m] A pair that is deeper by more than this than what was recorded is written at once."""


class ContactFilter:
    """Remembers what was recorded last. The first contacts are always recorded, were there none: a log without any
    message of them lost its messages."""

    def __init__(self) -> None:
        self._pairs: list[tuple[str, str]] | None = None
        self._last: Sequence[Contact] = ()
        self._time = 0.0

    def changed(self, time: float, contacts: Sequence[Contact]) -> Sequence[Contact] | None:
        """What to record of `contacts`, which are sorted by their names, at `time` [s]: all; None when the last message
        still holds."""
        pairs = [contact[:2] for contact in contacts]
        if pairs == self._pairs and not self._differs(time, contacts):
            return None
        self._pairs, self._last, self._time = pairs, contacts, time
        return contacts

    def _differs(self, time: float, found: Sequence[Contact]) -> bool:
        due = time - self._time >= FORCE_PERIOD - 1e-9
        steady = time - self._time >= STEADY_PERIOD - 1e-9
        share, least = (STEADY_SHARE, STEADY_LEAST) if steady else (FORCE_SHARE, FORCE_LEAST)
        for old, new in zip(self._last, found, strict=True):
            if new.distance < old.distance - DEPTH_LEAST:
                return True
            if abs(new.force - old.force) > KNOCK_LEAST + KNOCK_SHARE * min(old.force, new.force):
                return True
            if due and abs(new.force - old.force) > least + share * old.force:
                return True
        return False
