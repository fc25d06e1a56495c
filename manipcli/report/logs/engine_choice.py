"""Settings that an engine chose itself, from the record `engine` of a log's metadata."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

REASON: Final = "_reason"
"""A key `NAME_reason` holds the reason for the value of NAME."""


def engine_choices(metadata: Mapping[str, Mapping[str, str]]) -> tuple[tuple[str, str], ...]:
    """Name and value of each setting, the value with its reason: ("solver iterations", "100 (2 movable bodies)")."""
    chosen = metadata.get("engine", {})
    return tuple(
        (name.replace("_", " "), f"{value} ({chosen[name + REASON]})" if chosen.get(name + REASON) else value)
        for name, value in chosen.items()
        if not (name.endswith(REASON) and name.removesuffix(REASON) in chosen)
    )
