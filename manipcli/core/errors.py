"""Everything that can go wrong, as data: a place, a message, a hint, and the exit code it leads to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import ClassVar, Final, Literal

Severity = Literal["error", "warning", "note"]
EXPANDED: Final = "expanded from"
"""How the hint of a finding begins to say which call of a macro made what it is about."""


class ExitCode(IntEnum):
    """What the command line returns. The numbers are public and do not change."""

    PASSED = 0
    FAILED = 1
    INTERRUPTED = 2
    INTERNAL = 3
    USAGE = 4
    NOTHING_TO_RUN = 5


Loc = tuple[str | int, ...]
"""Where something stands in what a file holds: keys and numbers of items, from the top."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where in a file the user wrote something. Lines and columns count from 1.

    Line 0: not in a file but in an argument, which `file` quotes (`--set scene.cup.mass=80`).

    Attributes:
        calls: where macros were called that made it, the outermost first; places are equal whoever called.
    """

    file: str
    line: int
    column: int
    calls: tuple[Place, ...] = field(default=(), compare=False, repr=False)

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}" if self.line > 0 else self.file

    @property
    def expanded(self) -> str:
        """`expanded from OUTERMOST, in it from INNERMOST`; "" for what no macro made."""
        inner = f", in it from {self.calls[-1]}" if len(self.calls) > 1 else ""
        return f"{EXPANDED} {self.calls[0]}{inner}" if self.calls else ""


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One thing to tell about an input file."""

    code: str
    message: str
    place: Place | None = None
    hint: str | None = None
    severity: Severity = "error"

    def __post_init__(self) -> None:
        told = self.place.expanded if self.place is not None else ""
        if told and EXPANDED not in (self.hint or ""):
            object.__setattr__(self, "hint", f"{self.hint}; {told}" if self.hint else told)

    def __str__(self) -> str:
        where = f"{self.place}: " if self.place is not None else ""
        return f"{where}{self.severity}[{self.code}]: {self.message}"


class ManipcliError(Exception):
    """Base of the family; caught once, in `cli/app.py`."""

    exit_code: ClassVar[ExitCode] = ExitCode.INTERNAL
    code: ClassVar[str] = "INT000"

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        """The error as findings, for every renderer alike."""
        return (Diagnostic(code=self.code, message=str(self)),)


class InvalidInput(ManipcliError):
    """A file or an argument cannot be used; carries every finding of the file at once."""

    exit_code = ExitCode.USAGE
    code = "USE000"

    def __init__(self, findings: Sequence[Diagnostic]) -> None:
        self._findings = tuple(findings)
        super().__init__("\n".join(str(finding) for finding in self._findings))

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        return self._findings


class InvalidArgument(InvalidInput, ValueError):
    """An argument of the Python API cannot be used; also a `ValueError`, as callers in Python expect."""

    def __init__(self, code: str, message: str, *, hint: str | None = None) -> None:
        super().__init__((Diagnostic(code=code, message=message, hint=hint),))


RefusalReason = Literal["orientation", "touches", "in_the_way", "line"]
"""The arm cannot turn its tool so; it reaches a pose only so that something touches; something is in a motion's way;
the arm cannot take its tool along a straight line."""


class NotPlannable(ManipcliError):
    """A step has no plan: unreachable, outside limits, in collision, or too slow for its limits.

    `loc`: which value below the step's verb is the cause, where it is one; `place`: where that or the step is written.
    `reason`: by which a step decides what to try next, or to tell; hints are for people alone.
    """

    exit_code = ExitCode.FAILED
    code = "PLAN100"

    def __init__(
        self,
        cause: str,
        *,
        step: str | None = None,
        hint: str | None = None,
        place: Place | None = None,
        loc: Loc = (),
        reason: RefusalReason | None = None,
    ) -> None:
        self.cause = cause
        self.step = step
        self.hint = hint
        self.place = place
        self.loc = loc
        self.reason = reason
        super().__init__(f"step '{step}': {cause}" if step is not None else cause)

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        return (Diagnostic(code=self.code, message=str(self), place=self.place, hint=self.hint),)


class SimulationFailed(ManipcliError):
    """The physics left the plausible: NaN, an explosion, a body in free fall, a bad start."""

    exit_code = ExitCode.FAILED
    code = "SIM100"

    def __init__(self, cause: str, *, time: float) -> None:
        self.cause = cause
        self.time = time
        super().__init__(f"{cause} at t = {time:.3f} s")
