"""Selection of recorded topics and their rates, by the last word of each topic, for all controllers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from manipcli.record.channels import BELIEF, SCENE_JOINTS, SENSORS, Channel

PLOTTED = ("reference", "error", "actuator_states")
"""Topics that are only for viewers."""
PLOT_PERIOD = 0.01
"""Default period of these topics [s]."""
GOALS = ("feedback", "status", "result")


@dataclass(frozen=True, slots=True)
class Selection:
    """`strides`: ticks between two messages, if not the default; `left_out`: topics that are not recorded.

    Both by the last word of the topic: `tf`, `controller_state`, `goals` (the action topics), ...
    """

    strides: Mapping[str, int] = field(default_factory=dict)
    left_out: frozenset[str] = frozenset()

    def holds(self, channel: Channel) -> bool:
        """Whether a channel is recorded."""
        return word(channel.topic) not in self.left_out

    def stride(self, topic: str, period: float) -> int:
        """Ticks of `period` [s] between two messages of a periodic topic."""
        name = word(topic)
        usual = max(1, round(PLOT_PERIOD / period)) if name in PLOTTED else 1
        return self.strides.get(name, usual)


EVERYTHING = Selection()


def word(topic: str) -> str:
    """The word that selects a topic: `controller_state` for `/arm/controller_state`."""
    if topic.startswith(f"{SENSORS}/"):
        return "sensors"
    if topic == SCENE_JOINTS or topic.startswith(f"{BELIEF}/"):
        return "tf"
    last = topic.rpartition("/")[2]
    return "goals" if last in GOALS and topic.count("/") > 2 else last


def common_stride(strides: Mapping[str, int]) -> int:
    """Ticks between two times at which all of these are recorded, starting at tick 0."""
    return math.lcm(1, *strides.values())
