"""What the control loop sends to the process of the network: the state of some ticks, and the messages of events."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from manipcli.core.geometry import Array


@dataclass(frozen=True, slots=True)
class Sample:
    """The state of one tick.

    Attributes:
        tick: of the control loop.
        numbers: those of a `WorldState`.
        outputs: rows and speed of each controller's output; None while it is inactive.
        sensed: see `Sensed`; None while nobody wants it.
    """

    tick: int
    numbers: Array
    outputs: Sequence[tuple[Array, Array] | None]
    sensed: Array | None = None


@dataclass(frozen=True, slots=True)
class Event:
    """A message of the log; `ns`: simulated time [ns]; `data`: CDR."""

    topic: str
    ns: int
    data: bytes
