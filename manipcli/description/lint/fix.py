"""Automatic fixes of a URDF file, edited in its text: the rest of the file keeps its bytes."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from xml.sax.saxutils import escape, quoteattr

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.core.text import shorten
from manipcli.description.expanded import Description
from manipcli.description.located_xml import Element
from manipcli.description.packages import NotFound, Packages
from manipcli.description.urdf.numbers import finite
from manipcli.description.urdf.schema_table import known_elements
from manipcli.spec.robot import UNIT_TOLERANCE

_NAMES: Final = frozenset({"name", "link", "joint", "filename", "type"})
_TAG: Final = re.compile(r"<[^\s/>]+")
_ATTRIBUTE: Final = re.compile(r"""\s*([^\s=/>"']+)\s*=\s*("[^"]*"|'[^']*')""")
_LINE_END: Final = re.compile("\r\n|\r|\n")


@dataclass(frozen=True, slots=True)
class Change:
    """A new `value` for `attribute` of the element at `place`, and the reason."""

    place: Place
    attribute: str
    value: str
    reason: str

    def __str__(self) -> str:
        return f"{self.place}: {self.reason}: {self.attribute}={quoteattr(shorten(self.value))}"


def mended(path: Path, description: Description) -> tuple[bytes, tuple[Change, ...]]:
    """The bytes of a plain URDF file with all safe fixes applied, and the list of changes.

    Axes are normalised; a robot without a name gets the file's; blanks around names and numbers are removed; an
    absolute mesh path becomes a package URI if that resolves to the same file.

    Raises:
        InvalidInput: the file is not UTF-8.
    """
    data = path.read_bytes()
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        raise InvalidInput([Diagnostic("USE042", f"'{path}' is not UTF-8; only UTF-8 files can be fixed")]) from None
    starts = [0, *(match.end() for match in _LINE_END.finditer(text))]
    changes = tuple(_changes(path, description))
    done = []
    edits: list[tuple[int, int, str]] = []
    for change in changes:
        edit = _edit(text, starts, change)
        if edit is not None:
            edits.append(edit)
            done.append(change)
    for start, end, new in sorted(edits, reverse=True):
        text = text[:start] + new + text[end:]
    return text.encode("utf-8"), tuple(done)


def _changes(path: Path, description: Description) -> Iterator[Change]:
    packages = Packages(path)
    for element, _ in known_elements(description.root):
        place = element.place
        if place is None:
            continue
        if element.tag == "robot" and not element.name:
            yield Change(place, "name", path.stem.partition(".")[0] or "robot", "name the robot after the file")
        for attribute, value in element.attributes.items():
            new, reason = _better(element, attribute, value, packages)
            if new != value and new:
                yield Change(place, attribute, new, reason)


def _better(element: Element, attribute: str, value: str, packages: Packages) -> tuple[str, str]:
    if (element.tag, attribute) == ("axis", "xyz"):
        return _unit(value), "normalise the axis to length 1"
    if (element.tag, attribute) == ("mesh", "filename"):
        return _portable(value.strip(), packages), "name the mesh by its package"
    if attribute in _NAMES:
        return value.strip(), "remove blanks around the name"
    words = value.split()
    return (" ".join(words) if all(finite(word) is not None for word in words) else value), "remove extra blanks"


def _unit(text: str) -> str:
    values = [finite(word) for word in text.split()[:4]]
    if len(values) != 3 or None in values:
        return text
    numbers = [value for value in values if value is not None]
    length = math.hypot(*numbers)
    if not 1e-9 < length < 1e9 or abs(length - 1.0) <= UNIT_TOLERANCE:
        return " ".join(text.split())
    return " ".join(f"{value / length + 0.0:.15g}" for value in numbers)


def _portable(uri: str, packages: Packages) -> str:
    if not (uri.startswith("file://") or Path(uri).is_absolute()):
        return uri
    try:
        path = packages.resolve(uri)
        new = packages.portable(path)
        return new if packages.resolve(new) == path else uri
    except NotFound:
        return uri


def _edit(text: str, starts: list[int], change: Change) -> tuple[int, int, str] | None:
    """(start, end, new text) of the change; None if the place is not certain."""
    if not 0 < change.place.line <= len(starts):
        return None
    at = starts[change.place.line - 1] + change.place.column - 1
    tag = _TAG.match(text, at)
    if tag is None:
        return None
    at = tag.end()
    while (found := _ATTRIBUTE.match(text, at)) is not None:
        if found[1] == change.attribute:
            return found.start(2) + 1, found.end(2) - 1, escape(change.value, {'"': "&quot;", "'": "&apos;"})
        at = found.end()
    new = f" {change.attribute}={quoteattr(change.value)}"
    return tag.end(), tag.end(), new
