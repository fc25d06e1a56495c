"""Reader of numbers, names and frames of URDF elements; errors become findings, and reading continues."""

from __future__ import annotations

import math
import re
from collections.abc import Collection
from typing import Final

from manipcli.core.errors import Diagnostic, Place, Severity
from manipcli.core.geometry import Transform
from manipcli.core.text import did_you_mean, shorten
from manipcli.description.located_xml import Element

MOST_HINTS: Final = 50
MOST_NAMES: Final = 2000
"""Most searches for a similar name, and most candidates: a bound on the time for a file full of errors."""

LONGEST_NAME: Final = 200
"""Characters of a name."""
FARTHEST: Final = 1e6
"""[m, rad]: largest position, size or angle; beyond it engines in single precision fail."""
LARGEST: Final = 1e9
"""Largest mass, moment of inertia, damping and friction, in SI."""


def finite(word: str) -> float | None:
    """The finite number of a word in C notation (no `1_000`, ASCII digits only); else None."""
    try:
        value = float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) and word.isascii() and "_" not in word else None


_COMMA: Final = re.compile(r"\s*[-+]?\d*,\d+([eE][-+]?\d+)?\s*")


def _dotted(word: str) -> str | None:
    """The hint for a number with a decimal comma."""
    return f"use a dot: {word.strip().replace(',', '.')}" if _COMMA.fullmatch(word) else None


class Reader:
    """Collects findings while a description is read."""

    def __init__(self) -> None:
        self.findings: list[Diagnostic] = []
        self._hints = 0

    def report(
        self,
        code: str,
        message: str,
        place: Place | None,
        *,
        hint: str | None = None,
        severity: Severity = "error",
    ) -> None:
        self.findings.append(Diagnostic(code=code, message=message, place=place, hint=hint, severity=severity))

    def near(self, name: str, known: Collection[str]) -> str | None:
        """The hint with similar names, or None."""
        self._hints += 1
        if self._hints > MOST_HINTS or len(known) > MOST_NAMES or len(name) > 200:
            return None
        return did_you_mean(name, known)

    def name(self, element: Element, attribute: str = "name") -> str | None:
        """A non-empty printable name; else None with a finding."""
        value = element.attributes.get(attribute, "").strip()
        if not value:
            how = "an empty" if attribute in element.attributes else "no"
            self.report("URDF003", f"<{element.tag}> has {how} attribute '{attribute}'", element.place)
            return None
        if len(value) > LONGEST_NAME:
            message = f"<{element.tag}>: the name '{shorten(value)}' has {len(value)} characters"
            self.report("URDF003", message, element.place, hint=f"at most {LONGEST_NAME} are allowed")
            return None
        if not value.isprintable():
            self.report("URDF003", f"<{element.tag}>: invalid name {value[:40]!r}", element.place)
            return None
        return value

    def numbers(
        self, element: Element, attribute: str, count: int, *, most: float = math.inf
    ) -> tuple[float, ...] | None:
        """`count` finite numbers up to `most`; None if missing or (with a finding) invalid."""
        text = element.attributes.get(attribute)
        if text is None:
            return None
        words = text.split() if len(text) < 10_000 else [text]
        expected = "a number" if count == 1 else f"{count} numbers"
        written = f'<{element.tag} {attribute}="{shorten(text)}">'
        wrong = next((word for word in words if finite(word) is None), None)
        if wrong is not None:
            message = f"{written}: '{shorten(wrong)}' is not a finite number; expected {expected}"
            self.report("URDF004", message, element.place, hint=_dotted(wrong))
            return None
        if len(words) != count:
            self.report("URDF058", f"{written}: expected {expected}, found {len(words)}", element.place)
            return None
        if any(abs(float(word)) > most for word in words):
            self.report("URDF004", f"{written}: implausibly large; expected {most:g} or less", element.place)
            return None
        return tuple(float(word) + 0.0 for word in words)  # no -0.0, which is never written

    def number(
        self, element: Element, attribute: str, default: float | None = None, *, most: float = math.inf
    ) -> float | None:
        """One number; `default` if missing or (with a finding) invalid."""
        values = self.numbers(element, attribute, 1, most=most)
        return default if values is None else values[0]

    def required(self, element: Element, attribute: str, *, most: float) -> float | None:
        """One required number; None with a finding if missing or invalid."""
        if attribute not in element.attributes:
            self.missing(element, attribute)
            return None
        return self.number(element, attribute, most=most)

    def missing(self, element: Element, attribute: str) -> None:
        self.report("URDF059", f"<{element.tag}> has no attribute '{attribute}'", element.place)

    def text_number(self, element: Element | None, default: float, *, severity: Severity = "error") -> float:
        """The number in the text of an element; `default` without one, with a finding if the text is no number."""
        if element is None:
            return default
        value = finite(element.text)
        if value is None:
            message = f"<{element.tag}>{shorten(element.text)}</{element.tag}>: expected a finite number"
            if severity != "error":
                message += f"; {default:g} is used"
            self.report("URDF004", message, element.place, hint=_dotted(element.text), severity=severity)
            return default
        return value

    def origin(self, parent: Element) -> Transform:
        """The <origin> of an element; identity if missing."""
        element = parent.first("origin")
        if element is None:
            return Transform.identity()
        xyz = self.numbers(element, "xyz", 3, most=FARTHEST) or (0.0, 0.0, 0.0)
        quat = self.numbers(element, "quat_xyzw", 4)
        if quat is not None and math.hypot(*quat) > 1e-6:
            return Transform.of(xyz=xyz, quat_xyzw=quat).by_angles
        rpy = self.numbers(element, "rpy", 3, most=FARTHEST)
        return Transform.of(xyz=xyz, rpy=rpy) if rpy is not None and any(rpy) else Transform.of(xyz=xyz)
