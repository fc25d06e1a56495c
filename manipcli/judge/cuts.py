"""In how many control ticks joints and actuators were asked for more than they can give: counted by the run, kept in
the metadata of its log, told in one line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from manipcli.core.text import escape

JOINTS, ACTUATORS = "saturated joints", "saturated actuators"
"""Metadata of the log: count by name, of those that were cut."""
EFFORTS: Final = "saturated efforts"
"""Of the same joints, in how many of these ticks it was at the limit of effort."""
MOST_CUT: Final = 3
"""Joints and actuators that are named."""


@dataclass(frozen=True, slots=True)
class Cuts:
    """Ticks, of `ticks` in all, in which joints' commands were cut at their limits, and actuators had no more to give.

    Names of which the count is 0 count as absent. `efforts`: of those of a joint, in how many its limit of effort was
    one, where that is known; in the others it was that of position, velocity or acceleration.
    """

    joints: Mapping[str, int] = field(default_factory=dict)
    actuators: Mapping[str, int] = field(default_factory=dict)
    ticks: int = 0
    efforts: Mapping[str, int] = field(default_factory=dict)

    @classmethod
    def from_metadata(cls, metadata: Mapping[str, Mapping[str, str]], *, end: float, period: float) -> Cuts:
        """What a log says whose last tick is at `end` [s]; what is no number in it is left out."""
        ticks = round(end / period) + 1 if period > 0.0 else 0
        joints, actuators, efforts = (
            {name: int(text) for name, text in metadata.get(kind, {}).items() if text.isdecimal()}
            for kind in (JOINTS, ACTUATORS, EFFORTS)
        )
        return cls(joints, actuators, ticks, efforts)

    def to_metadata(self) -> Mapping[str, Mapping[str, str]]:
        """The same; nothing of what was never cut."""
        kinds = ((JOINTS, self.joints), (ACTUATORS, self.actuators))
        found = {kind: {name: str(count) for name, count in counts.items() if count} for kind, counts in kinds}
        found[EFFORTS] = {name: str(self.efforts[name]) for name in found[JOINTS] if name in self.efforts}
        return {kind: counts for kind, counts in found.items() if counts}

    def since(self, before: Cuts) -> Cuts:
        """What was added since then."""
        return Cuts(
            {name: count - before.joints.get(name, 0) for name, count in self.joints.items()},
            {name: count - before.actuators.get(name, 0) for name, count in self.actuators.items()},
            self.ticks - before.ticks,
            {name: count - before.efforts.get(name, 0) for name, count in self.efforts.items()},
        )

    def __str__(self) -> str:
        """`cut at its limits: joint 'a' (effort) in 463 of 2000 ticks`, the worst first; nothing where nothing was."""
        counts = {f"joint '{escape(name)}'{self._of(name)}": count for name, count in self.joints.items()}
        counts |= {f"actuator '{escape(name)}'": count for name, count in self.actuators.items()}
        worst = sorted((name for name, count in counts.items() if count), key=lambda name: -counts[name])
        if not worst:
            return ""
        told = ", ".join(f"{name} in {counts[name]}" for name in worst[:MOST_CUT])
        more = f"; {len(worst) - MOST_CUT} more less often" if len(worst) > MOST_CUT else ""
        all_ticks = f" of {self.ticks}" if self.ticks else ""
        return f"cut at {'its' if len(worst) == 1 else 'their'} limits: {told}{all_ticks} ticks{more}"

    def _of(self, name: str) -> str:
        """At which limit of a joint."""
        count = self.efforts.get(name)
        if count is None:
            return ""
        if not count:
            return " (position, velocity or acceleration)"
        return " (effort)" if count >= self.joints[name] else f" (effort in {count})"
