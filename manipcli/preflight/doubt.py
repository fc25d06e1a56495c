"""A doubt about one joint of a task, that is told once however often it is found."""

from __future__ import annotations

from dataclasses import dataclass

from manipcli.core.errors import Finding, Place


@dataclass(frozen=True, slots=True)
class Doubt:
    """A warning, and the joint that it is about; "" where it is about several at once."""

    joint: str
    finding: Finding

    @property
    def what(self) -> tuple[str, Place | None, str]:
        """Equal where the same is doubted of the same, whatever the numbers are."""
        return self.finding.code, self.finding.place, self.joint
