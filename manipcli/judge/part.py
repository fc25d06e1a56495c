"""The part of a task that a run did: from a step on, up to a step; stated in its log and its verdict."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

PART: Final = "part"
"""Metadata of the log of a run that did a part of its task."""


@dataclass(frozen=True, slots=True)
class RunPart:
    """Which steps a run did, and where its start state is from.

    Attributes:
        first, last: ids of its first and its last step; "" for those of the task.
        log, sha256, time: name and checksum of the log of the start state, and its time [s] there; "" and 0 for the
            start of the task.
        live: whether it was a live session.
        runs: whether a live session ran the steps, and not only held.
    """

    first: str = ""
    last: str = ""
    log: str = ""
    sha256: str = ""
    time: float = 0.0
    live: bool = False
    runs: bool = False

    @property
    def partial(self) -> bool:
        """Whether steps of the task were left out."""
        return not self.runs

    def __str__(self) -> str:
        """`part of the task: from 'place_1', in the state of pick.mcap at 5.20 s; not the uninterrupted run`."""
        if self.live:
            return f"live session, {'with' if self.runs else 'without'} the steps of the task"
        words = []
        if self.first:
            words.append(
                f"from '{self.first}', in the state of {self.log} (SHA-256 {self.sha256[:12]}) at {self.time:.3f} s; "
                "not the uninterrupted run"
            )
        if self.last:
            words.append(f"stopped after '{self.last}' as asked")
        return f"part of the task: {'; '.join(words)}"

    def to_metadata(self) -> dict[str, str]:
        """The metadata that `from_metadata` reads."""
        origin = {"origin": self.log, "origin_sha256": self.sha256, "origin_time": repr(self.time)}
        return {
            **({"from": self.first, **origin} if self.first else {}),
            **({"until": self.last} if self.last else {}),
            **({"live": "true"} if self.live else {}),
            **({"runs": "true"} if self.runs else {}),
            "text": str(self),
        }

    @staticmethod
    def from_metadata(values: Mapping[str, str]) -> RunPart:
        """The part in the metadata of a log; an unreadable time is 0."""
        try:
            time = float(values.get("origin_time", "0"))
        except ValueError:
            time = 0.0
        return RunPart(
            values.get("from", ""), values.get("until", ""), values.get("origin", ""), values.get("origin_sha256", ""),
            time, "live" in values, "runs" in values,
        )  # fmt: skip
