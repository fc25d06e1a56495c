"""Frames of a client: JSON objects within limits of size and depth."""

from __future__ import annotations

import json
from typing import Any, Final

MAX_FRAME: Final = 1 << 20
"""Largest frame [byte]; a larger one closes the connection."""
MAX_DEPTH: Final = 32
"""Deepest nesting of a frame."""
_SQUARE = bytes.maketrans(b"{}", b"[]")
_OTHERS = bytes(set(range(256)) - set(b"[]{}"))


class BadFrame(ValueError):
    """A frame that is not a JSON object within the limits."""


def read_frame(frame: str | bytes) -> dict[str, Any]:
    """The JSON object of a text frame.

    Raises:
        BadFrame: a binary frame, invalid or too deep JSON, NaN or infinity, or something else than an object.
    """
    if not isinstance(frame, str):
        raise BadFrame("binary frames are not supported; send JSON as text")
    if _too_deep(frame):
        raise BadFrame(f"the JSON is nested deeper than {MAX_DEPTH}")
    try:
        found = json.loads(frame, parse_constant=_refuse)
    except BadFrame:
        raise
    except ValueError as error:  # also for numbers of too many digits
        raise BadFrame(f"invalid JSON: {str(error)[:120]}") from None
    if not isinstance(found, dict):
        raise BadFrame(f"the frame is a {type(found).__name__}; expected an object with an op")
    return found


def _refuse(word: str) -> None:
    raise BadFrame(f"{word} is not JSON")


def _too_deep(text: str) -> bool:
    """Whether brackets outside of texts are nested deeper than the limit."""
    if text.count("[") + text.count("{") <= MAX_DEPTH:
        return False
    outside = "".join(text.replace("\\\\", "").replace('\\"', "").split('"')[::2])
    left = outside.encode("ascii", "ignore").translate(_SQUARE, _OTHERS)
    for _ in range(MAX_DEPTH):  # each removes the innermost level
        left = left.replace(b"[]", b"")
    return b"[]" in left or left.count(b"[") > MAX_DEPTH
