"""Sampling of a recording at a display rate, in one pass over its spans."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from manipcli.core.geometry import Array
from manipcli.model.state import Contact
from manipcli.record.gaps import LEAST, Gaps, Intervals
from manipcli.record.recording import ContactSnapshot, Recording, Span, joined

MAX_TIMES = 200_000
"""Most states of a playback, more than an hour at the usual rate."""


def sampled(recording: Recording, *, rate: float) -> tuple[Span, SampledContacts, Gaps] | None:
    """The ticks nearest to multiples of 1 / rate, the last one and those beside a gap; one span in memory at a time.

    Args:
        recording: the recording.
        rate: sampling rate [Hz]; above the rate of the recording, every tick is taken.

    Returns:
        The ticks as one span without contacts, the contacts of each tick, and the gaps of the recording; None for a
        recording without ticks.
    """
    chosen: list[Span] = []
    gathered = SampledContacts()
    intervals = Intervals()
    before = -1.0
    last: Span | None = None
    for span in recording.spans:
        times = span.states.time
        if not len(times):
            continue
        # Index of the last multiple that a tick is nearest to, or past; a tick is taken if it grows.
        number = np.floor((times + recording.period / 2.0) * rate + 1e-9)
        picked = np.diff(number, prepend=before) != 0.0
        before = float(number[-1])
        intervals.add(np.rint(times * 1e9).astype(np.int64))
        holes = np.flatnonzero(np.diff(times) * 1e9 >= LEAST)
        picked[holes] = picked[holes + 1] = True
        if last is not None and (times[0] - last.states.time[0]) * 1e9 >= LEAST:
            picked[0] = True
            _append(chosen, gathered, last)
        ticks = np.flatnonzero(picked)
        chosen.append(_picked(span, ticks))
        gathered.add(span.contacts, times[ticks])
        last = _picked(span, np.array([len(times) - 1]))
    if last is None:
        return None
    _append(chosen, gathered, last)
    return joined(chosen), gathered, tuple((start / 1e9, end / 1e9) for start, end in intervals.gaps())


def _append(chosen: list[Span], gathered: SampledContacts, last: Span) -> None:
    """Take a tick after all taken ones, unless it is the last of these."""
    if not len(chosen[-1].states.time) or last.states.time[0] > chosen[-1].states.time[-1]:
        chosen.append(last)
        gathered.add((), last.states.time)


def regular_times(start: float, end: float, rate: float, gaps: Gaps) -> Array:
    """(T,) [s] of the states of a playback, from the first to the last, with the ends of gaps and none inside."""
    count = max(1, min(int(np.ceil((end - start) * rate)), MAX_TIMES))
    times = np.linspace(start, end, count + 1) if end > start else np.array([start])
    for begin, until in gaps:
        times = np.union1d(times[(times <= begin) | (times >= until)], [begin, until])
    return times


def _picked(span: Span, ticks: npt.NDArray[np.intp]) -> Span:
    return Span(
        states=span.states.map(lambda a: a[ticks].copy()),
        controllers=tuple(trace.map(lambda a: a[ticks].copy()) for trace in span.controllers),
        contacts=(),
    )


class SampledContacts:
    """Contacts since the previous time, with the largest force of each pair, for a growing number of times.

    Attributes:
        found: the contacts of each time.
        times: when they were recorded [s].
    """

    def __init__(self) -> None:
        self._now: tuple[tuple[float, Contact], ...] = ()
        self._waiting: list[ContactSnapshot] = []
        self.found: list[tuple[Contact, ...]] = []
        self.times: list[tuple[float, ...]] = []

    def add(self, snapshots: Iterable[ContactSnapshot], times: Array) -> None:
        self._waiting += snapshots
        for time in times.tolist():
            strongest = {contact[:2]: (since, contact) for since, contact in self._now}
            taken = 0
            for snapshot in self._waiting:
                if snapshot.time > time:
                    break
                taken += 1
                self._now = tuple((snapshot.time, contact) for contact in snapshot.contacts)
                for since, contact in self._now:
                    known = strongest.get(contact[:2])
                    if known is None or contact.force >= known[1].force:
                        strongest[contact[:2]] = since, contact
            del self._waiting[:taken]
            chosen = [strongest[pair] for pair in sorted(strongest)]
            self.found.append(tuple(contact for _, contact in chosen))
            self.times.append(tuple(since for since, _ in chosen))
