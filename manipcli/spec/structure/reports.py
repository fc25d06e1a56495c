"""Findings of the structure of a task."""

from __future__ import annotations

from manipcli.core.errors import Diagnostic, Loc, Place, Severity
from manipcli.spec.explain import with_origin
from manipcli.spec.source.tree import MappingNode, Node, ScalarNode, dotted


class Reports:
    """Collects findings; the same one in several rounds or uses of a file is kept once, with its first use."""

    def __init__(self) -> None:
        self._found: dict[tuple[str, Place | None, str], Diagnostic] = {}

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        """All findings."""
        return tuple(self._found.values())

    def add(self, finding: Diagnostic) -> None:
        """Adds a finding."""
        self._found.setdefault((finding.code, finding.place, finding.message), finding)

    def at(
        self, number: int, at: Loc, node: Node, message: str, hint: str | None = None, severity: Severity = "error"
    ) -> None:
        """Adds a finding at a node; `at` is its path in its file."""
        text = f"{dotted(at)}: {message}"
        self.add(Diagnostic(f"TASK{number}", text, node.place, with_origin(hint, node), severity))

    def at_key(
        self,
        number: int,
        at: Loc,
        block: MappingNode,
        key: str,
        message: str,
        hint: str | None = None,
        severity: Severity = "error",
    ) -> None:
        """Adds a finding at a key of a block."""
        self.at(number, at, ScalarNode(None, block.entries[key].key_place), message, hint, severity)
