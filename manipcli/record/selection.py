"""What of a run is recorded, and how often: by the last word of each topic, for every controller alike."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from manipcli.record.channels import Channel

PLOTTED = ("reference", "error", "actuator_states")
"""What only serves viewers."""
PLOT_PERIOD = 0.01
"""[s] between two messages of those, unless somebody asks for another."""
GOALS = ("feedback", "status", "result")


@dataclass(frozen=True, slots=True)
class Selection:
    """`strides`: ticks between two messages, where it is not the usual; `left_out`: what is not recorded at all.

    Both by words: `tf`, `controller_state`, `goals` (the action topics), ...
    """

    strides: Mapping[str, int] = field(default_factory=dict)
    left_out: frozenset[str] = frozenset()

    def holds(self, channel: Channel) -> bool:
        """Whether a channel is recorded."""
        return word(channel.topic) not in self.left_out

    def stride(self, topic: str, period: float) -> int:
        """Ticks of `period` [s] between two messages of a topic that is recorded by the clock."""
        name = word(topic)
        usual = max(1, round(PLOT_PERIOD / period)) if name in PLOTTED else 1
        return self.strides.get(name, usual)


EVERYTHING = Selection()


def word(topic: str) -> str:
    """By which a topic is chosen: `/arm/controller_state` is `controller_state`."""
    last = topic.rpartition("/")[2]
    return "goals" if last in GOALS and topic.count("/") > 2 else last


def common_stride(strides: Mapping[str, int]) -> int:
    """Ticks between two moments at which every one of these is recorded: all have tick 0."""
    return math.lcm(1, *strides.values())
