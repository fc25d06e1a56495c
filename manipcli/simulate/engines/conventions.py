"""What engines with physics have in common: servo motors of joints, and which forces are impacts."""

from __future__ import annotations

from operator import attrgetter
from typing import Final

UNLIMITED_EFFORT: Final = 1e6
"""Represents "no effort limit" of a motor [N m or N]."""
POSITION_TIME: Final = 0.01
"""[s] Time constant with which a position command is approached, for any physics step; close to ros_gz's default gain
of 0.1 at 1 kHz."""
KNOCK: Final = 1.5
"""A contact point with more than this factor of the largest force, plus `KNOCK_LEAST`, is an impact."""
KNOCK_LEAST: Final = 1.0
"""[N]"""
sides = attrgetter("a", "b")
"""Key by which contacts are sorted."""


def knock(greatest: float) -> float:
    """[N] The force at a contact point above which it is an impact, after a largest force of `greatest` [N]."""
    return KNOCK * greatest + KNOCK_LEAST
