"""Filter of contact messages: a changed set of pairs and impacts are recorded at once, other changes of force at most
100 times per simulated second, and small changes at most ten times."""

from __future__ import annotations

from collections.abc import Sequence

from manipcli.model.state import Contact

FORCE_PERIOD = 0.01
"""Shortest time between messages with changes of force only [s]."""

FORCE_SHARE, FORCE_LEAST = 0.1, 0.05
"""A force change is recorded if it exceeds a tenth of the recorded force and 0.05 N."""

STEADY_PERIOD = 0.1
"""Time after which smaller changes are recorded, too [s]."""

STEADY_SHARE, STEADY_LEAST = 0.01, 0.005
"""A small change exceeds a hundredth of the recorded force and 0.005 N."""

KNOCK_SHARE, KNOCK_LEAST = 0.5, 1.0
"""An impact: the larger of the recorded and the current force exceeds 1.5 times the smaller one plus 1 N.
Its start and end are recorded at once."""

DEPTH_LEAST = 2e-4
"""Increase of penetration that is recorded at once [m]."""


class ContactFilter:
    """Compares contacts with the last recorded ones. The first message is always recorded, even without contacts, so
    that a log without contact messages is known to be incomplete."""

    def __init__(self) -> None:
        self._pairs: list[tuple[str, str]] | None = None
        self._last: Sequence[Contact] = ()
        self._time = 0.0

    def changed(self, time: float, contacts: Sequence[Contact]) -> Sequence[Contact] | None:
        """The contacts to record at `time` [s]: all of `contacts`, sorted by name; None if the last message is still
        valid."""
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
