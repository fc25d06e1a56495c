"""Numbers, names and frames of URDF elements; what is wrong becomes a finding, and reading goes on."""

from __future__ import annotations

import math

from manipcli.core.errors import Finding, Place, Severity
from manipcli.core.geometry import Transform
from manipcli.model.located_xml import Element


class Reader:
    """Gathers findings while a description is read."""

    def __init__(self) -> None:
        self.findings: list[Finding] = []

    def report(
        self,
        code: str,
        message: str,
        place: Place | None,
        *,
        hint: str | None = None,
        severity: Severity = "error",
    ) -> None:
        self.findings.append(Finding(code=code, message=message, place=place, hint=hint, severity=severity))

    def name(self, element: Element, attribute: str = "name") -> str | None:
        """A name that is there and can be printed; else a finding and None."""
        value = element.attributes.get(attribute, "").strip()
        if not value:
            self.report("URDF003", f"<{element.tag}> has no attribute '{attribute}'", element.place)
            return None
        if not value.isprintable() or len(value) > 200:
            self.report("URDF003", f"<{element.tag}>: {value[:40]!r} is no usable name", element.place)
            return None
        return value

    def numbers(self, element: Element, attribute: str, count: int) -> tuple[float, ...] | None:
        """`count` finite numbers, or None where the attribute is missing or (with a finding) wrong."""
        text = element.attributes.get(attribute)
        if text is None:
            return None
        words = text.split()
        expected = "a number" if count == 1 else f"{count} numbers"
        try:
            values = tuple(float(word) for word in words)
        except ValueError:
            values = ()
        if len(values) != count or "_" in text or not all(math.isfinite(value) for value in values):
            message = f"<{element.tag} {attribute}=\"{text[:60]}\">: expected {expected}, finite"
            self.report("URDF004", message, element.place)
            return None
        return values

    def number(self, element: Element, attribute: str, default: float | None = None) -> float | None:
        """One number; `default` where it is missing or (with a finding) wrong."""
        values = self.numbers(element, attribute, 1)
        return default if values is None else values[0]

    def required(self, element: Element, attribute: str) -> float | None:
        """One number that must be there; None with a finding otherwise."""
        if attribute not in element.attributes:
            self.report("URDF004", f"<{element.tag}> has no attribute '{attribute}'", element.place)
            return None
        return self.number(element, attribute)

    def text_number(self, element: Element | None, default: float) -> float:
        """A number that stands as the text of an element."""
        if element is None:
            return default
        try:
            value = float(element.text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            self.report("URDF004", f"<{element.tag}>{element.text[:60]}: expected a finite number", element.place)
            return default
        return value

    def origin(self, parent: Element) -> Transform:
        """The <origin> of an element; identity where it has none."""
        element = parent.first("origin")
        if element is None:
            return Transform.identity()
        xyz = self.numbers(element, "xyz", 3) or (0.0, 0.0, 0.0)
        quat = self.numbers(element, "quat_xyzw", 4)
        if quat is not None and math.hypot(*quat) > 1e-6:
            return Transform.of(xyz=xyz, quat_xyzw=quat)
        rpy = self.numbers(element, "rpy", 3)
        return Transform.of(xyz=xyz, rpy=rpy) if rpy is not None and any(rpy) else Transform.of(xyz=xyz)
