"""Arrays of a page in one compressed text."""

from __future__ import annotations

import base64
import zlib
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

Json = dict[str, object]
Reference = tuple[str, int, int]
"""Number type, offset [byte] and count of an array in the pack."""

LEVEL = 9
LARGEST = float(np.finfo(np.float32).max)


@dataclass(slots=True)
class Pack:
    """Concatenated arrays, each aligned to four bytes."""

    parts: list[bytes] = field(default_factory=list)
    length: int = 0

    def add(self, values: npt.ArrayLike, kind: str) -> Reference:
        """`kind`: f float32, H uint16, I uint32, b int8."""
        if kind == "f":
            # Values beyond float32 are clipped.
            values = np.clip(values, -LARGEST, LARGEST)
        array = np.ascontiguousarray(values, dtype={"f": "<f4", "H": "<u2", "I": "<u4", "b": "i1"}[kind])
        data = array.tobytes()
        reference = (kind, self.length, array.size)
        data += bytes(-len(data) % 4)
        self.parts.append(data)
        self.length += len(data)
        return reference

    def text(self) -> str:
        """The arrays, as zlib in base64."""
        return base64.b64encode(zlib.compress(b"".join(self.parts), LEVEL)).decode()
