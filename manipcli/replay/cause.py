"""Why a run did not pass, and where that is written."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Written:
    """Where a step or an expectation is written.

    Attributes:
        place: file and line of the user, such as `pour.yaml:13`; "" if unknown.
        file: name of the `Source` that contains it.
        line: its line in that source, from 1; 0 if no source contains it.
    """

    place: str
    file: str = ""
    line: int = 0


@dataclass(frozen=True, slots=True)
class Cause:
    """Why a run did not pass.

    Attributes:
        title, text, hint: what is wrong, the measurement, and what helps.
        at: [s] time of the worst value; None if it has no time.
        written: where the step or the expectation is written.
        step, expectation: which one it is about; "" for neither.
    """

    title: str
    text: str
    at: float | None = None
    written: Written | None = None
    hint: str = ""
    step: str = ""
    expectation: str = ""
