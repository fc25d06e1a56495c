"""The steps of a task that a run does, and the state in which it begins."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from manipcli.judge.part import RunPart
from manipcli.record.start_state import StartState


@dataclass(frozen=True, slots=True)
class Part:
    """`steps[first:last]` of a task.

    Attributes:
        first: index of the first step.
        last: index behind the last step; None: of all.
        until: id of the step after which the run was asked to stop; "": none.
        state: at the start; None: the start of the task.
        live: a live session.
    """

    first: int = 0
    last: int | None = None
    until: str = ""
    state: StartState | None = None
    live: bool = False

    @property
    def described(self) -> RunPart | None:
        """For log and verdict; None for a whole run."""
        state = self.state
        if self.live:
            return RunPart(live=True, runs=self.last is None)
        if state is None:
            return RunPart(last=self.until) if self.until else None
        return RunPart(state.step, self.until, state.log, state.sha256, state.time)


WHOLE: Final = Part()
"""All steps, from the start of the task."""
LIVE: Final = Part(last=0, live=True)
"""No step, for a live session that holds."""
LIVE_RUN: Final = Part(live=True)
"""All steps, in a live session."""
