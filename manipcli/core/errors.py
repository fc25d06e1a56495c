"""Errors and diagnostics as data: place, message, hint and exit code."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import ClassVar, Final, Literal

from manipcli.core.refused_candidates import RefusedCandidates

Severity = Literal["error", "warning", "note"]
EXPANDED: Final = "expanded from"
"""Start of the hint that names the macro calls behind a finding."""


class ExitCode(IntEnum):
    """Exit codes of the command line. The numbers are public and do not change."""

    PASSED = 0
    FAILED = 1
    INTERRUPTED = 2
    INTERNAL = 3
    USAGE = 4
    NOTHING_TO_RUN = 5


Loc = tuple[str | int, ...]
"""Path to a value in a file: keys and indices, from the top."""


@dataclass(frozen=True, slots=True)
class Place:
    """A place in a file. Lines and columns count from 1.

    Line 0 means an argument instead of a file; `file` quotes it (`--set scene.cup.mass=80`).

    Attributes:
        calls: places of the macro calls that produced the value, or of the uses of its file, outermost first.
        how: how messages name them: `expanded from`, `used at`. Both are ignored in comparisons.
    """

    file: str
    line: int
    column: int
    calls: tuple[Place, ...] = field(default=(), compare=False, repr=False)
    how: str = field(default=EXPANDED, compare=False, repr=False)

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}" if self.line > 0 else self.file

    @property
    def expanded(self) -> str:
        """`expanded from OUTERMOST, then from INNERMOST`, or `used at ...`; "" without calls."""
        inner = f", then {self.how.rpartition(' ')[2]} {self.calls[-1]}" if len(self.calls) > 1 else ""
        return f"{self.how} {self.calls[0]}{inner}" if self.calls else ""


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """An error, a warning or a note about an input file. As text: its place, severity, code and message.

    Attributes:
        code: `TASK203`; `manipcli explain` explains it.
        message: what is wrong.
        place: file, line and column; None for a finding about no file.
        hint: what to do; None without a hint.
        severity: `error`, `warning` or `note`.
    """

    code: str
    message: str
    place: Place | None = None
    hint: str | None = None
    severity: Severity = "error"

    def __post_init__(self) -> None:
        calls = self.place.expanded if self.place is not None else ""
        if self.place is not None and calls and self.place.how not in (self.hint or ""):
            object.__setattr__(self, "hint", f"{self.hint}; {calls}" if self.hint else calls)

    def __str__(self) -> str:
        where = f"{self.place}: " if self.place is not None else ""
        return f"{where}{self.severity}[{self.code}]: {self.message}"


class ManipcliError(Exception):
    """Base class of all errors of manipcli; caught once, in `cli/app.py`."""

    exit_code: ClassVar[ExitCode] = ExitCode.INTERNAL
    code: ClassVar[str] = "INT000"

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        """The error as findings, for renderers."""
        return (Diagnostic(code=self.code, message=str(self)),)


class InvalidInput(ManipcliError):
    """A file or an argument is invalid; carries all findings of the file."""

    exit_code = ExitCode.USAGE
    code = "USE000"

    def __init__(self, findings: Sequence[Diagnostic]) -> None:
        self._findings = tuple(findings)
        super().__init__("\n".join(str(finding) for finding in self._findings))

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        return self._findings


class InvalidArgument(InvalidInput, ValueError):
    """An argument of the Python API is invalid; also a `ValueError`, as Python callers expect."""

    def __init__(self, code: str, message: str, *, hint: str | None = None) -> None:
        super().__init__((Diagnostic(code=code, message=message, hint=hint),))


RefusalReason = Literal["reach", "orientation", "touches", "in_the_way", "line", "constraint"]
"""`reach`: no joint positions reach the pose; `orientation`: the arm cannot reach the tool orientation; `touches`:
every solution is in collision; `in_the_way`: an obstacle blocks the motion; `line`: the tool cannot follow a straight
line; `constraint`: a `keep` is violated."""


class NotPlannable(ManipcliError):
    """A step has no plan: unreachable, outside limits, in collision, or too slow for its limits.

    Attributes:
        cause: what is wrong, without the step.
        step: id of the step.
        hint: what to do, for users only.
        place: of the value that is the cause, or of the step.
        loc: path of that value below the step's verb; empty if no single value is the cause.
        reason: for code that decides what to try next.
        parts: bodies and links (`robot/<link>`) that are in the way, and the object that cannot be picked where it is.
        remedy: searches for a change with which it could be planned; as a hint. Slow, so only called for the refusal
            that is reported.
        candidates: of the whole task, if it has no plan.
        motions: that were planned before the refused one, for pictures (`plan.motion.Motion`).
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
        parts: frozenset[str] = frozenset(),
        remedy: Callable[[], str] | None = None,
        candidates: tuple[RefusedCandidates, ...] = (),
        motions: tuple[object, ...] = (),
    ) -> None:
        self.cause = cause
        self.step = step
        self.hint = hint
        self.place = place
        self.loc = loc
        self.reason = reason
        self.parts = parts
        self.remedy = remedy
        self.candidates = candidates
        self.motions = motions
        super().__init__(f"step '{step}': {cause}" if step is not None else cause)

    def but(
        self,
        *,
        cause: str | None = None,
        hint: str | None = None,
        step: str | None = None,
        place: Place | None = None,
        parts: frozenset[str] | None = None,
        candidates: tuple[RefusedCandidates, ...] | None = None,
        motions: tuple[object, ...] | None = None,
    ) -> NotPlannable:
        """The same refusal with these attributes, where they are given."""
        return NotPlannable(
            self.cause if cause is None else cause,
            step=self.step if step is None else step,
            hint=self.hint if hint is None else hint,
            place=self.place if place is None else place,
            loc=self.loc,
            reason=self.reason,
            parts=self.parts if parts is None else parts,
            remedy=self.remedy,
            candidates=self.candidates if candidates is None else candidates,
            motions=self.motions if motions is None else motions,
        )

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        return (Diagnostic(code=self.code, message=str(self), place=self.place, hint=self.hint),)


class SimulationFailed(ManipcliError):
    """The simulation diverged: NaN, excessive speed, a body in free fall, an invalid start."""

    exit_code = ExitCode.FAILED
    code = "SIM100"

    def __init__(self, cause: str, *, time: float) -> None:
        self.cause = cause
        self.time = time
        what, _, advice = cause.partition("; ")
        super().__init__(f"{what} at t = {time:.3f} s{f'; {advice}' if advice else ''}")
