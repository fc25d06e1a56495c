"""Collector of findings about a robot file."""

from __future__ import annotations

from manipcli.core.errors import Diagnostic, InvalidInput, Loc, Place
from manipcli.spec.located import Source


class Reporter:
    """Collects findings about a robot file, each with the place of the value it refers to."""

    def __init__(self, source: Source | None) -> None:
        self.source = source
        self.findings: list[Diagnostic] = []

    def error(self, code: str, message: str, loc: Loc, *, hint: str | None = None) -> None:
        self.findings.append(Diagnostic(code=code, message=message, place=self.place(loc), hint=hint))

    def warning(self, code: str, message: str, loc: Loc, *, hint: str) -> None:
        self.findings.append(
            Diagnostic(code=code, message=message, place=self.place(loc), hint=hint, severity="warning")
        )

    def note(self, code: str, message: str, loc: Loc, *, hint: str | None) -> None:
        self.findings.append(Diagnostic(code=code, message=message, place=self.place(loc), hint=hint, severity="note"))

    def place(self, loc: Loc) -> Place | None:
        return self.source.place(*loc) if self.source is not None else None

    def stop(self) -> None:
        """Raises InvalidInput if there is an error."""
        if any(finding.severity == "error" for finding in self.findings):
            raise InvalidInput(self.findings)
