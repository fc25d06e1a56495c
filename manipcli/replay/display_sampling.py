"""Sampling of a recording at a display rate, in one pass over its spans."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.model.state import Contact
from manipcli.record.recording import ContactSnapshot, Recording, Span, joined


def sampled(recording: Recording, *, rate: float) -> tuple[Span, tuple[tuple[Contact, ...], ...]] | None:
    """The ticks nearest to multiples of 1 / rate, and the last one; one span in memory at a time.

    Args:
        recording: the recording.
        rate: sampling rate [Hz]; above the rate of the recording, every tick is taken.

    Returns:
        The ticks as one span without contacts, and for each tick the contacts since the previous one with the largest
        force of each pair; None for a recording without ticks.
    """
    chosen: list[Span] = []
    gathered = _Contacts()
    before = -1.0
    for span in recording.spans:
        times = span.states.time
        if not len(times):
            continue
        # Index of the last multiple that a tick is nearest to, or past; a tick is taken if it grows.
        number = np.floor((times + recording.period / 2.0) * rate + 1e-9)
        ticks = np.flatnonzero(np.diff(number, prepend=before))
        before = float(number[-1])
        chosen.append(_picked(span, ticks))
        gathered.add(span.contacts, times[ticks])
        last = _picked(span, np.array([len(times) - 1]))
    if not chosen:
        return None
    if last.states.time[0] not in chosen[-1].states.time:
        chosen.append(last)
        gathered.add((), last.states.time)
    return joined(chosen), tuple(gathered.found)


def _picked(span: Span, ticks: npt.NDArray[np.intp]) -> Span:
    return Span(
        states=span.states.map(lambda a: a[ticks].copy()),
        controllers=tuple(trace.map(lambda a: a[ticks].copy()) for trace in span.controllers),
        contacts=(),
    )


class _Contacts:
    """Contacts since the previous time, for a growing number of times."""

    def __init__(self) -> None:
        self._now: tuple[Contact, ...] = ()
        self._waiting: list[ContactSnapshot] = []
        self.found: list[tuple[Contact, ...]] = []

    def add(self, snapshots: Iterable[ContactSnapshot], times: Array) -> None:
        self._waiting += snapshots
        for time in times.tolist():
            strongest = {(contact.a, contact.b): contact for contact in self._now}
            taken = 0
            for snapshot in self._waiting:
                if snapshot.time > time:
                    break
                taken += 1
                self._now = snapshot.contacts
                for contact in snapshot.contacts:
                    known = strongest.get((contact.a, contact.b))
                    if known is None or contact.force >= known.force:
                        strongest[contact.a, contact.b] = contact
            del self._waiting[:taken]
            self.found.append(tuple(strongest[pair] for pair in sorted(strongest)))
