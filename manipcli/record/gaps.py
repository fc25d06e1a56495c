"""Gaps of a log: times without a message on a topic that otherwise has them regularly."""

from __future__ import annotations

import heapq
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from manipcli.record.decode import Int

LEAST = 100_000_000
"""Shortest gap [ns]."""
FACTOR = 5.0
"""A gap is longer than this many usual intervals."""
USUAL = 0.9
"""Share of the intervals that are not longer than the usual one."""
FEWEST = 20
"""Intervals of a topic that are needed to know the usual one."""
MOST = 64
"""Most gaps of a topic."""
_PER_OCTAVE = 8

Gaps = tuple[tuple[float, float], ...]
"""Start and end [s] of each gap."""
_NAMED = 3


def gaps_text(gaps: Gaps) -> str:
    """`2.00 to 3.10 s, 7.00 to 7.50 s`; of many the first ones, and the number of the others."""
    more = f" and {len(gaps) - _NAMED} more" if len(gaps) > _NAMED else ""
    return ", ".join(f"{start:.2f} to {end:.2f} s" for start, end in gaps[:_NAMED]) + more


def common(first: Gaps, *others: Gaps) -> Gaps:
    """Where each of these has a gap."""
    found = first
    for other in others:
        both = [(max(a, c), min(b, d)) for a, b in found for c, d in other]
        found = tuple((start, end) for start, end in both if start < end)
    return found


def _no_counts() -> npt.NDArray[np.int64]:
    return np.zeros(64 * _PER_OCTAVE, dtype=np.int64)


@dataclass(slots=True)
class Intervals:
    """The intervals between the messages of a topic, added in any number of parts, in memory that does not grow."""

    _last: int | None = None
    _counts: npt.NDArray[np.int64] = field(default_factory=_no_counts)
    _long: list[tuple[int, int]] = field(default_factory=list)

    def add(self, times: Int) -> None:
        """Add log times [ns], not empty."""
        times = np.sort(times)
        if self._last is not None:
            times = np.concatenate(([self._last], times[times > self._last]))
        lengths = np.diff(times)
        place = (np.log2(np.maximum(lengths, 1)) * _PER_OCTAVE).astype(np.int64)
        self._counts += np.bincount(place, minlength=len(self._counts))
        for k in np.flatnonzero(lengths >= LEAST).tolist():
            entry = int(lengths[k]), int(times[k])
            if len(self._long) < MOST:
                heapq.heappush(self._long, entry)
            else:
                heapq.heappushpop(self._long, entry)
        self._last = int(times[-1])

    def gaps(self) -> tuple[tuple[int, int], ...]:
        """Start and end [ns] of each gap, of the `MOST` longest ones; none if too few intervals are known."""
        total = self._counts.sum()
        if total < FEWEST:
            return ()
        usual = 2.0 ** ((np.searchsorted(self._counts.cumsum(), USUAL * total) + 1) / _PER_OCTAVE)
        long = [(start, start + length) for length, start in self._long if length > FACTOR * usual]
        return tuple(sorted(long))
