"""Fields of the operations of a client."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final

from manipcli.core.text import did_you_mean
from manipcli.record.definition import Message
from manipcli.record.json_message import from_json

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


def rooted(name: str) -> str:
    """The name with one leading slash."""
    return "/" + name.lstrip("/")


def topic_of(frame: Mapping[str, Any]) -> str:
    """The topic, with a leading slash."""
    return rooted(text_of(frame, "topic"))


def arguments(kind: Message, args: object) -> dict[str, object]:
    """The complete request or goal: `args` is an object, or a list of the values of its fields in order.

    Raises:
        BadMessage: it is not valid for this type.
    """
    if not isinstance(args, list):
        return from_json(kind, args)
    names = [field.name for field in kind.fields]
    if len(args) > len(names):
        raise Refused(f"{len(args)} args; {kind.name} has {len(names)} fields")
    return from_json(kind, dict(zip(names, args, strict=False)))


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
