"""How two messages of one type differ: the first field, and whether all of it stays within a tolerance."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from manipcli.record.cdr import CdrError
from manipcli.record.decode import Run, runs
from manipcli.record.definition import Message

REMEMBERED = 16
"""Layouts of one topic that are tried before a message is taken apart."""

Value = float | int | str
Bytes = npt.NDArray[np.uint8]


def first_difference(
    message: Message, a: bytes, b: bytes, tolerance: float = 0.0, besides: Collection[str] = ()
) -> tuple[str, Value, Value] | None:
    """The first value that differs by more than `tolerance`: its field, and what each message has; else None.

    Fields `besides` are not looked at.

    Raises:
        CdrError: a message is shorter than its lengths say.
    """
    left, right = runs(message, a), runs(message, b)
    for x, y in zip(left, right, strict=False):
        assert x.path == y.path  # a length that differs is met before what it is the length of
        if x.label in besides:
            continue
        if not x.code or x.code == "#":
            u, v = x.value(a, 0), y.value(b, 0)
            if u != v:
                return x.label, u, v
            continue
        k = _first_number(x, y, a, b, tolerance)
        if k is not None:
            return x.name(k), x.value(a, k), y.value(b, k)
    return None


def _first_number(x: Run, y: Run, a: bytes, b: bytes, tolerance: float) -> int | None:
    u, v = (np.frombuffer(data, run.code, run.count, run.offset) for data, run in ((a, x), (b, y)))
    size = u.dtype.itemsize
    unlike = (u.view(np.uint8).reshape(-1, size) != v.view(np.uint8).reshape(-1, size)).any(axis=1)
    if tolerance and u.dtype.kind == "f":
        unlike &= ~_near(u, v, tolerance)
    return int(np.argmax(unlike)) if unlike.any() else None


def _near(a: npt.NDArray[np.floating], b: npt.NDArray[np.floating], tolerance: float) -> npt.NDArray[np.bool_]:
    """Nothing is near to what is not there but the same."""
    with np.errstate(invalid="ignore"):
        return np.asarray((np.abs(a - b) <= tolerance) | (np.isnan(a) & np.isnan(b)) | (a == b))


@dataclass(frozen=True, slots=True)
class _Layout:
    """Of messages of one length: the bytes that decide where things stand, what those are, and where numbers are."""

    length: int
    guards: npt.NDArray[np.int64]
    letters: Bytes
    floats: tuple[tuple[str, npt.NDArray[np.int64]], ...]
    others: npt.NDArray[np.int64]


class Near:
    """Whether messages of one type are the same within a tolerance, many at once."""

    def __init__(self, message: Message, tolerance: float) -> None:
        self._message = message
        self._tolerance = tolerance
        self._known: deque[_Layout] = deque(maxlen=REMEMBERED)

    def within(self, a: Bytes, b: Bytes) -> npt.NDArray[np.bool_]:
        """(n,) whether the messages (n, length) differ in floating-point numbers alone, and by no more."""
        near = np.zeros(len(a), dtype=bool)
        rest = np.arange(len(a))
        while len(rest):
            layout = self._layout(a[rest[0]])
            if layout is None:
                rest = rest[1:]
                continue
            fits = (a[rest][:, layout.guards] == layout.letters).all(axis=1)
            some = rest[fits]
            near[some] = self._alike(layout, a[some], b[some])
            rest = rest[~fits]
        return near

    def _alike(self, layout: _Layout, a: Bytes, b: Bytes) -> npt.NDArray[np.bool_]:
        alike = (a[:, layout.others] == b[:, layout.others]).all(axis=1)
        for code, at in layout.floats:
            u, v = (np.ascontiguousarray(rows[:, at]).view(code) for rows in (a, b))
            alike &= _near(u, v, self._tolerance).all(axis=1)
        return np.asarray(alike)

    def _layout(self, row: Bytes) -> _Layout | None:
        for one in self._known:
            if one.length == len(row) and np.array_equal(row[one.guards], one.letters):
                return one
        try:
            found = runs(self._message, row.tobytes())
        except CdrError:
            return None
        guards = [np.arange(0)]
        floats: dict[str, list[npt.NDArray[np.int64]]] = {}
        for run in found:
            place = np.arange(run.offset, run.offset + run.size)
            if run.code in ("<f8", "<f4"):
                floats.setdefault(run.code, []).append(place)
            elif not run.code:
                guards.append(np.arange(_length_of_text(run), run.offset + run.size))
            elif run.code == "#":
                guards.append(place)
        numbers = tuple((code, np.concatenate(places)) for code, places in floats.items())
        every = np.concatenate([np.arange(0), *(places for _, places in numbers)])
        at = np.concatenate(guards)
        others = np.setdiff1d(np.arange(len(row)), every)
        made = _Layout(len(row), at, row[at], numbers, others)
        self._known.appendleft(made)
        return made


def _length_of_text(run: Run) -> int:
    """Its four bytes stand right before the text."""
    return run.offset - 4
