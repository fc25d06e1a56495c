"""Difference of two messages of one type: the first differing field, and equality within a tolerance."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from manipcli.record.cdr import CdrError
from manipcli.record.decode import Bytes, Int, Layouts, Run, runs
from manipcli.record.definition import Message

Value = float | int | str


def first_difference(
    message: Message, a: bytes, b: bytes, tolerance: float = 0.0, besides: Collection[str] = ()
) -> tuple[str, Value, Value] | None:
    """The first value that differs by more than `tolerance`: its field and both values; None without a difference.

    Fields `besides` are not compared.

    Raises:
        CdrError: a message is shorter than its lengths declare.
    """
    left, right = runs(message, a), runs(message, b)
    for x, y in zip(left, right, strict=False):
        assert x.path == y.path  # different lengths are found before their arrays
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
    """Equal within `tolerance`; nan and inf equal only themselves."""
    with np.errstate(invalid="ignore"):
        return np.asarray((np.abs(a - b) <= tolerance) | (np.isnan(a) & np.isnan(b)) | (a == b))


@dataclass(frozen=True, slots=True)
class _Places:
    """Offsets of the floating-point numbers of a layout by type code, and all other bytes."""

    floats: tuple[tuple[str, Int], ...]
    others: Int


class Near:
    """Vectorised comparison of messages of one type within a tolerance."""

    def __init__(self, message: Message, tolerance: float) -> None:
        self._message = message
        self._tolerance = tolerance
        self._layouts = Layouts(self._places)

    def within(self, a: Bytes, b: Bytes) -> npt.NDArray[np.bool_]:
        """(n,) whether messages (n, length) differ only in floating-point numbers, by at most the tolerance."""
        near = np.zeros(len(a), dtype=bool)
        n, length = a.shape
        for found, some in self._layouts.groups(a.tobytes(), np.arange(n) * length, np.full(n, length)):
            near[some] = self._alike(found, a[some], b[some])
        return near

    def _alike(self, found: _Places, a: Bytes, b: Bytes) -> npt.NDArray[np.bool_]:
        alike = (a[:, found.others] == b[:, found.others]).all(axis=1)
        for code, at in found.floats:
            u, v = (np.ascontiguousarray(rows[:, at]).view(code) for rows in (a, b))
            alike &= _near(u, v, self._tolerance).all(axis=1)
        return np.asarray(alike)

    def _places(self, data: memoryview) -> tuple[_Places, list[tuple[int, int]]]:
        every = np.arange(len(data))
        try:
            found = runs(self._message, data)
        except CdrError:  # not a message of this type: compare all bytes
            return _Places((), every), [(0, len(data))] if len(data) else []
        numbers = []
        for code in ("<f8", "<f4"):
            places = [np.arange(run.offset, run.end) for run in found if run.code == code]
            numbers.append((code, np.concatenate([np.zeros(0, dtype=np.int64), *places])))
        guards = [(run.begin, run.end) for run in found if run.code in ("", "#")]
        return _Places(tuple(numbers), np.setdiff1d(every, np.concatenate([at for _, at in numbers]))), guards
