"""Fields of the operations of a client."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final

from manipcli.core.text import did_you_mean

MAX_NAME: Final = 256
"""Longest name or id [characters]."""


class Refused(ValueError):
    """An operation that is not carried out."""


def text_of(frame: Mapping[str, Any], key: str) -> str:
    """A printable text that is not empty."""
    value = frame.get(key)
    if not isinstance(value, str) or not value or len(value) > MAX_NAME or "\0" in value or not value.isprintable():
        raise Refused(f"'{key}' must be a text of 1 to {MAX_NAME} characters")
    return value


def topic_of(frame: Mapping[str, Any]) -> str:
    """The topic, with a leading slash."""
    return "/" + text_of(frame, "topic").lstrip("/")


def number_of(frame: Mapping[str, Any], key: str, default: float) -> float:
    """A number from 0 to 1e9."""
    value = frame.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= 1e9:
        raise Refused(f"'{key}' must be a number from 0 to 1e9")
    return float(value)


def check_type(name: str, kind: str, frame: Mapping[str, Any]) -> None:
    """
    Raises:
        Refused: the frame names another type; `std_msgs/String` is `std_msgs/msg/String`.
    """
    given = frame.get("type")
    short = kind.replace("/msg/", "/").replace("/action/", "/")
    if given is not None and given not in (kind, short, ""):
        raise Refused(f"'{name}' is of type {kind}, not {str(given)[:80]}")


def near(name: str, known: Iterable[str]) -> str:
    """A hint for an unknown name."""
    return did_you_mean(name[:80], known) or "there is none"
