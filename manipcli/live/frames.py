"""Frames of a client: JSON objects within limits of size and depth."""

from __future__ import annotations

import json
from typing import Any, Final

MAX_FRAME: Final = 1 << 20
"""Largest frame [byte]; a larger one closes the connection."""
MAX_DEPTH: Final = 32
"""Deepest nesting of a frame."""


class BadFrame(ValueError):
    """A frame that is not a JSON object within the limits."""


def read_frame(frame: str | bytes) -> dict[str, Any]:
    """The JSON object of a text frame.

    Raises:
        BadFrame: a binary frame, invalid or too deep JSON, NaN or infinity, or something else than an object.
    """
    if not isinstance(frame, str):
        raise BadFrame("binary frames are not supported; send JSON as text")
    if _depth(frame) > MAX_DEPTH:
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


def _depth(text: str) -> int:
    """An upper bound of the nesting: the brackets opened more than closed, also those in texts."""
    if text.count("[") + text.count("{") <= MAX_DEPTH:
        return 0
    deepest = depth = 0
    quoted = escaped = False
    for letter in text:
        if quoted:
            quoted, escaped = escaped or letter != '"', letter == "\\" and not escaped
        elif letter == '"':
            quoted = True
        elif letter in "[{":
            depth += 1
            deepest = max(deepest, depth)
        elif letter in "]}":
            depth -= 1
    return deepest
