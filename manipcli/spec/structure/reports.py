"""Findings of the structure of a task.

| number | mistake |
|---|---|
| 260 | an item with a verb and a word of structure, or with two words |
| 261 | a key without its word, next to another word, or inside instead of next to it |
| 262 | a key is missing, or is no list of steps |
| 263 | `repeat`: no or both of `times` and `each`; faulty rounds or values; lists of different lengths |
| 264 | a file that is missing, must not be read, or uses itself |
| 265 | a sub-task or a fragment with wrong or missing keys |
| 266 | a faulty declaration in `params` of a sub-task |
| 267 | `with`: an unknown or missing parameter |
| 268 | `with`: a value of another type |
| 269 | too many steps, blocks, files or values |
| 270 | an `if` on parameters that cannot be decided |
| 271 | a parameter of `each` that hides another (warning) |
| 272 | a parameter of `each` or of a sub-task that nothing uses (warning) |
| 273 | a body or frame that two files have |
| 274 | `parallel` without exactly two steps |
| 275 | an `if` on a value of `each` that holds in no round (warning) |
"""

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
