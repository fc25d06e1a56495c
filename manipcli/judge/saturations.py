"""Saturation of joints and actuators: number of control ticks at a limit, stored in the log of the run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from manipcli.core.text import escape

JOINTS, ACTUATORS = "saturated joints", "saturated actuators"
"""Metadata of the log: ticks by name; names without saturation are left out."""
LIMITS: Final = "saturated limits"
"""Metadata of the log: ticks by `KIND, JOINT`, KIND the limit; several limits can act in one tick."""
MOST_CUT: Final = 3
"""Number of joints and actuators named in a line."""


@dataclass(frozen=True, slots=True)
class Saturations:
    """Number of control ticks in saturation.

    Attributes:
        joints: ticks by joint in which its command was limited; 0 is the same as absent.
        actuators: ticks by actuator in which it was at its limit.
        ticks: of the run; 0: unknown.
        kinds: ticks by kind of limit (position, velocity, ...) and joint.
    """

    joints: Mapping[str, int] = field(default_factory=dict)
    actuators: Mapping[str, int] = field(default_factory=dict)
    ticks: int = 0
    kinds: Mapping[str, Mapping[str, int]] = field(default_factory=dict)

    @classmethod
    def from_metadata(cls, metadata: Mapping[str, Mapping[str, str]], *, end: float, period: float) -> Saturations:
        """The saturations in a log whose last tick is at `end` [s]; entries that are not numbers are left out."""
        ticks = round(end / period) + 1 if period > 0.0 else 0
        joints, actuators, limits = (
            {name: int(text) for name, text in metadata.get(what, {}).items() if text.isdecimal()}
            for what in (JOINTS, ACTUATORS, LIMITS)
        )
        kinds: dict[str, dict[str, int]] = {}
        for key, count in limits.items():
            kind, _, name = key.partition(", ")
            kinds.setdefault(kind, {})[name] = count
        return cls(joints, actuators, ticks, kinds)

    def to_metadata(self) -> Mapping[str, Mapping[str, str]]:
        """The metadata that `from_metadata` reads, without counts of 0."""
        limits = {f"{kind}, {name}": count for kind, of in self.kinds.items() for name, count in of.items()}
        every = {JOINTS: self.joints, ACTUATORS: self.actuators, LIMITS: limits}
        found = {what: {name: str(count) for name, count in counts.items() if count} for what, counts in every.items()}
        return {what: counts for what, counts in found.items() if counts}

    def since(self, before: Saturations) -> Saturations:
        """The difference to an earlier count of the same run."""
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
        """`saturated: joint 'a' (velocity) in 463 of 2000 ticks`, the most ticks first; "" without saturation."""
        counts = {f"joint '{escape(name)}'{self._of(name)}": count for name, count in self.joints.items()}
        counts |= {f"actuator '{escape(name)}'": count for name, count in self.actuators.items()}
        worst = sorted((name for name, count in counts.items() if count), key=lambda name: -counts[name])
        if not worst:
            return ""
        first = ", ".join(f"{name} in {counts[name]}" for name in worst[:MOST_CUT])
        more = f"; {len(worst) - MOST_CUT} more in fewer ticks" if len(worst) > MOST_CUT else ""
        all_ticks = f" of {self.ticks}" if self.ticks else ""
        return f"saturated: {first}{all_ticks} ticks{more}"

    def _of(self, name: str) -> str:
        """The kinds of limit at which a joint saturated, as ` (velocity)`."""
        counts = {kind.replace("_", " "): of[name] for kind, of in self.kinds.items() if of.get(name)}
        if list(counts.values()) == [self.joints[name]]:
            return f" ({next(iter(counts))})"
        worst = sorted(counts, key=lambda kind: -counts[kind])
        return f" ({', '.join(f'{kind} in {counts[kind]}' for kind in worst)})" if worst else ""
