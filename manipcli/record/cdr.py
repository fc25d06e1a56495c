"""CDR little-endian (OMG DDS-XTypes 1.3, encoding version 1), as ROS 2 serialises: primitives, strings, sequences.

Every value is aligned to its own size, counted from the end of the four bytes of encapsulation `00 01 00 00`.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

from manipcli.core.geometry import Array

ENCAPSULATION = b"\x00\x01\x00\x00"

_I32, _U32, _F32, _F64 = (struct.Struct(code) for code in ("<i", "<I", "<f", "<d"))
NS_PER_S = 1_000_000_000


def text_bytes(text: str) -> bytes:
    """UTF-8 bytes; undecodable bytes of a file name are written as escapes."""
    return text.encode("utf-8", errors="backslashreplace")


class CdrWriter:
    """Appends values to one message. Each method returns the offset of its value, so that the message can be used as a
    template whose numbers are filled in later."""

    def __init__(self) -> None:
        self._data = bytearray(ENCAPSULATION)

    @property
    def data(self) -> bytes:
        return bytes(self._data)

    def _put(self, packer: struct.Struct, value: float) -> int:
        self._data += b"\x00" * (-(len(self._data) - 4) % packer.size)
        offset = len(self._data)
        self._data += packer.pack(value)
        return offset

    def u8(self, value: int) -> int:
        self._data.append(value)
        return len(self._data) - 1

    def i32(self, value: int) -> int:
        return self._put(_I32, value)

    def u32(self, value: int) -> int:
        return self._put(_U32, value)

    def f32(self, value: float) -> int:
        return self._put(_F32, value)

    def f64(self, value: float) -> int:
        return self._put(_F64, value)

    def f64s(self, values: Sequence[float]) -> int:
        """Consecutive doubles without a length; at least one."""
        offsets = [self.f64(float(value)) for value in values]
        return offsets[0]

    def float64s(self, values: Array) -> None:
        """A float64[] of the numbers in `values` (n)."""
        self.u32(len(values))
        if len(values):
            self._data += b"\x00" * (-(len(self._data) - 4) % 8)
            self._data += values.astype("<f8").tobytes()

    def numbers(self, data: bytes, size: int) -> int:
        """Consecutive numbers of `size` bytes each, without a length; at least one."""
        self._data += b"\x00" * (-(len(self._data) - 4) % size)
        offset = len(self._data)
        self._data += data
        return offset

    def octets(self, data: bytes) -> None:
        """A uint8[N] of fixed length."""
        self._data += data

    def time(self, ns: int) -> int:
        """builtin_interfaces/Time: whole seconds, nanoseconds."""
        offset = self.i32(ns // NS_PER_S)
        self.u32(ns % NS_PER_S)
        return offset

    def text(self, value: str) -> int:
        """Length with the closing NUL, bytes, NUL."""
        raw = text_bytes(value)
        offset = self.u32(len(raw) + 1)
        self._data += raw + b"\x00"
        return offset

    def texts(self, values: Sequence[str]) -> int:
        offset = self.u32(len(values))
        for value in values:
            self.text(value)
        return offset

    def doubles(self, count: int) -> int:
        """A float64[] of `count` zeros; returns the offset of its first element (its end if empty)."""
        self.u32(count)
        return self.f64s([0.0] * count) if count else len(self._data)

    def header(self, ns: int, frame: str) -> int:
        """std_msgs/Header; returns the offset of its stamp."""
        offset = self.time(ns)
        self.text(frame)
        return offset


class CdrError(ValueError):
    """A message that is shorter than what it declares."""


class CdrReader:
    """Reads one message sequentially; every length is checked against the remaining bytes before reading."""

    def __init__(self, data: bytes | memoryview) -> None:
        self._data = memoryview(data)
        # The last two bytes are options of the writer without effect on the data.
        if bytes(self._data[:2]) != ENCAPSULATION[:2] or len(self._data) < 4:
            raise CdrError("is not little-endian CDR")
        self.offset = 4

    def skip(self, size: int, align: int) -> int:
        """Skip `size` bytes aligned to `align`; returns their offset."""
        start = self.offset + (-(self.offset - 4) % align)
        if size < 0 or start + size > len(self._data):
            raise CdrError("ends too early")
        self.offset = start + size
        return start

    def take(self, size: int, align: int) -> memoryview:
        """The next `size` bytes, aligned to `align`."""
        start = self.skip(size, align)
        return self._data[start : start + size]

    def u32(self) -> int:
        return int(_U32.unpack_from(self._data, self.skip(4, 4))[0])

    def f64(self) -> float:
        return float(_F64.unpack_from(self._data, self.skip(8, 8))[0])

    def text(self) -> str:
        size = self.u32()
        if size == 0:
            return ""
        start = self.skip(size, 1)
        return bytes(self._data[start : start + size - 1]).decode("utf-8", errors="replace")

    def count(self, smallest: int) -> int:
        """Length of a sequence whose elements take at least `smallest` bytes each."""
        count = self.u32()
        if count * smallest > len(self._data) - self.offset:
            raise CdrError("ends too early")
        return count

    def texts(self) -> tuple[str, ...]:
        return tuple(self.text() for _ in range(self.count(4)))

    def expect(self, size: int) -> None:
        """Raise CdrError if fewer than `size` bytes are left."""
        if size > len(self._data) - self.offset:
            raise CdrError("ends too early")

    def header(self) -> str:
        """Skip the stamp of a header; returns its frame."""
        self.skip(8, 4)
        return self.text()
