"""Contacts between two links of the robot, from the recorded contacts: pair, first time and largest force."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from manipcli.core.text import escape, number_of
from manipcli.core.units import readable
from manipcli.model.grasp import LINK
from manipcli.record.recording import ContactSnapshot

MOST_NAMED: Final = 3
"""Number of pairs named in a line."""


@dataclass(frozen=True, slots=True)
class SelfContact:
    """Two links of the robot that pressed on each other.

    Attributes:
        a, b: their names, in alphabetical order.
        time: [s] when they first did.
        force: [N] the largest sum of their normal forces.
        at: [s] its time.
    """

    a: str
    b: str
    time: float
    force: float
    at: float

    def __str__(self) -> str:
        """`'forearm' and 'palm' from 1.203 s, up to 12.3 N at 1.410 s`."""
        names = f"'{escape(self.a)}' and '{escape(self.b)}'"
        return f"{names} from {self.time:.3f} s, up to {readable(self.force, 'N')} at {self.at:.3f} s"


class SelfContacts:
    """Collects them from successive contacts of a recording."""

    def __init__(self) -> None:
        self._found: dict[tuple[str, str], SelfContact] = {}

    def add(self, snapshots: Iterable[ContactSnapshot]) -> None:
        """The next contacts, in order of time."""
        for time, contacts in ((snapshot.time, snapshot.contacts) for snapshot in snapshots):
            for a, b, force, _, _ in contacts:
                if force > 0.0 and a.startswith(LINK) and b.startswith(LINK):
                    known = self._found.get((a, b))
                    if known is None or force > known.force:
                        first = time if known is None else known.time
                        names = a.removeprefix(LINK), b.removeprefix(LINK)
                        self._found[a, b] = SelfContact(*names, first, force, time)

    def found(self) -> tuple[SelfContact, ...]:
        """One per pair, in order of time and name."""
        return tuple(sorted(self._found.values(), key=lambda each: (each.time, each.a, each.b)))


def self_contact_line(found: Sequence[SelfContact]) -> str:
    """One line that names the pairs with the largest forces; "" without any."""
    if not found:
        return ""
    hardest = sorted(found, key=lambda each: -each.force)
    more = len(hardest) - MOST_NAMED
    rest = f"; {number_of(more, 'pair')} more with less force" if more > 0 else ""
    return f"the robot touches itself: {'; '.join(map(str, hardest[:MOST_NAMED]))}{rest}"
