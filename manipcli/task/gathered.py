"""Errors of several steps of reading, kept to be told together."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from manipcli.core.errors import Finding, InvalidInput, Place
from manipcli.spec.located import apart

T = TypeVar("T")


class Gathered:
    """Calls what may refuse its input, and keeps the findings of what does; `unknown`: as of `Source`."""

    def __init__(self) -> None:
        self.findings: list[Finding] = []
        self.unknown: frozenset[Place] = frozenset()

    def __call__(self, step: Callable[[], T]) -> T | None:
        """The result, or None where it was refused."""
        try:
            return step()
        except InvalidInput as invalid:
            self.findings += invalid.findings
            return None

    def refusal(self) -> InvalidInput:
        """All of them, in the order of the files and of their lines."""
        files = list(dict.fromkeys(finding.place.file for finding in self.findings if finding.place is not None))

        def position(finding: Finding) -> tuple[int, int, int]:
            place = finding.place
            return (-1, 0, 0) if place is None else (files.index(place.file), place.line, place.column)

        return InvalidInput(sorted(apart(self.findings, self.unknown), key=position))
