"""Candidates of a plan that were refused, grouped by the stage and the reason of their refusal."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RefusedCandidates:
    """Candidates of one step with the same reason.

    Attributes:
        step: id of the step.
        stage: the motion that was refused: `reach`, `approach`, `close`, ...; `-` where none is named.
        count: number of candidates.
        cause: of the first of them; the others differ in numbers only.
        names: of the candidates that have a name, at most a few.
    """

    step: str
    stage: str
    count: int
    cause: str
    names: tuple[str, ...] = ()
