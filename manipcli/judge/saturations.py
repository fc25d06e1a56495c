"""In how many control ticks joints and actuators were asked for more than they can give: counted by the run, kept in
the metadata of its log, told in one line."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from manipcli.core.text import escape

JOINTS, ACTUATORS = "saturated joints", "saturated actuators"
"""Metadata of the log: count by name, of those that were cut."""
LIMITS: Final = "saturated limits"
"""Of the same joints, `KIND, JOINT`: in how many of these ticks it was that kind of limit, or that one, too."""
MOST_CUT: Final = 3
"""Joints and actuators that are named."""


@dataclass(frozen=True, slots=True)
class Saturations:
    """Ticks, of `ticks` in all, in which joints' commands were cut at their limits, and actuators had no more to give.

    Names of which the count is 0 count as absent. `kinds`: by kind of limit (position, velocity, ...) and joint, in how
    many of the joint's ticks it was that one.
    """

    joints: Mapping[str, int] = field(default_factory=dict)
    actuators: Mapping[str, int] = field(default_factory=dict)
    ticks: int = 0
    kinds: Mapping[str, Mapping[str, int]] = field(default_factory=dict)

    @classmethod
    def from_metadata(cls, metadata: Mapping[str, Mapping[str, str]], *, end: float, period: float) -> Saturations:
        """What a log says whose last tick is at `end` [s]; what is no number in it is left out."""
        ticks = round(end / period) + 1 if period > 0.0 else 0
        joints, actuators, limits = (
            {name: int(text) for name, text in metadata.get(what, {}).items() if text.isdecimal()}
            for what in (JOINTS, ACTUATORS, LIMITS)
        )
        kinds: dict[str, dict[str, int]] = {}
        for told, count in limits.items():
            kind, _, name = told.partition(", ")
            kinds.setdefault(kind, {})[name] = count
        return cls(joints, actuators, ticks, kinds)

    def to_metadata(self) -> Mapping[str, Mapping[str, str]]:
        """The same; nothing of what was never cut."""
        limits = {f"{kind}, {name}": count for kind, of in self.kinds.items() for name, count in of.items()}
        told = {JOINTS: self.joints, ACTUATORS: self.actuators, LIMITS: limits}
        found = {what: {name: str(count) for name, count in counts.items() if count} for what, counts in told.items()}
        return {what: counts for what, counts in found.items() if counts}

    def since(self, before: Saturations) -> Saturations:
        """What was added since then."""
        return Saturations(
            {name: count - before.joints.get(name, 0) for name, count in self.joints.items()},
            {name: count - before.actuators.get(name, 0) for name, count in self.actuators.items()},
            self.ticks - before.ticks,
            {
                kind: {name: count - before.kinds.get(kind, {}).get(name, 0) for name, count in counts.items()}
                for kind, counts in self.kinds.items()
            },
        )

    def __str__(self) -> str:
        """`cut at its limits: joint 'a' (velocity) in 463 of 2000 ticks`, the worst first; "" where none was."""
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
        """At which limits of a joint."""
        counts = {kind.replace("_", " "): of[name] for kind, of in self.kinds.items() if of.get(name)}
        if list(counts.values()) == [self.joints[name]]:
            return f" ({next(iter(counts))})"
        worst = sorted(counts, key=lambda kind: -counts[kind])
        return f" ({', '.join(f'{kind} in {counts[kind]}' for kind in worst)})" if worst else ""
