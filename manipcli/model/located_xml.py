"""XML of which every element knows file, line and column; no DTD, no entities, bounded size, depth and count."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from manipcli.core.errors import Finding, InvalidInput, Place

if TYPE_CHECKING:
    from xml.dom.minidom import Document, Node
    from xml.dom.minidom import Element as DomElement

MAX_BYTES = 20_000_000
MAX_ELEMENTS = 50_000
MAX_DEPTH = 100
MAX_ATTRIBUTE = 65_536
_PLACE = "manipcli.place"


@dataclass(frozen=True, slots=True)
class Element:
    """An element of a description, after expansion. `place`: where the user wrote it."""

    tag: str
    attributes: Mapping[str, str]
    text: str
    children: tuple[Element, ...]
    place: Place | None

    def all(self, tag: str) -> tuple[Element, ...]:
        return tuple(child for child in self.children if child.tag == tag)

    def first(self, tag: str) -> Element | None:
        return next((child for child in self.children if child.tag == tag), None)


def shown_path(path: Path) -> str:
    """How messages name a file: relative to the working folder where it lies below that, else as given."""
    try:
        return str(path.relative_to(Path.cwd()))
    except ValueError:
        return str(path)


def invalid(code: str, message: str, place: Place | None = None, hint: str | None = None) -> InvalidInput:
    return InvalidInput([Finding(code=code, message=message, place=place, hint=hint)])


def read_document(path: Path) -> Document:
    """The document of a file; `place_of` tells the place of its elements, of copies (cloneNode) too.

    Raises:
        InvalidInput: unreadable, not well-formed, a DOCTYPE, or beyond a bound.
    """
    file = shown_path(path)
    try:
        if not path.is_file():
            raise invalid("URDF001", f"'{file}' is not a regular file")
        if path.stat().st_size > MAX_BYTES:
            raise invalid("URDF001", f"'{file}' is larger than {MAX_BYTES // 1_000_000} MB")
        data = path.read_bytes()
    except OSError as error:
        raise invalid("URDF001", f"cannot read '{file}': {error.strerror}") from error
    return parse_document(data, file)


def parse_document(data: bytes, file: str) -> Document:
    """As `read_document`, from the bytes of a file that messages call `file`."""
    from xml.dom import expatbuilder
    from xml.parsers import expat

    copy_place = _CopyPlace()

    class Builder(expatbuilder.ExpatBuilderNS):
        """Builds the usual minidom tree and leaves the place of each start tag with its element."""

        depth = 0
        count = 0

        def place(self) -> Place:
            parser = self.getParser()
            return Place(file, parser.CurrentLineNumber, parser.CurrentColumnNumber + 1)

        def start_element_handler(self, name: str, attributes: list[str]) -> None:
            self.depth += 1
            self.count += 1
            if self.depth > MAX_DEPTH or self.count > MAX_ELEMENTS:
                raise invalid("URDF001", f"more than {MAX_ELEMENTS} elements, or {MAX_DEPTH} nested", self.place())
            if any(len(text) > MAX_ATTRIBUTE for text in attributes):
                raise invalid("URDF001", f"an attribute is longer than {MAX_ATTRIBUTE} characters", self.place())
            super().start_element_handler(name, attributes)
            self.curNode.setUserData(_PLACE, self.place(), copy_place)

        def end_element_handler(self, name: str) -> None:
            self.depth -= 1
            super().end_element_handler(name)

        def start_doctype_decl_handler(self, *declaration: object) -> None:
            raise invalid("URDF001", "a DOCTYPE is not allowed in a description", self.place(), "delete it")

    try:
        document: Document = Builder().parseString(data)
    except expat.ExpatError as error:
        message = f"not well-formed XML: {expat.ErrorString(error.code)}"
        raise invalid("URDF001", message, Place(file, error.lineno, error.offset + 1)) from error
    except (LookupError, ValueError) as error:
        raise invalid("URDF001", f"not readable as XML: {error}", Place(file, 1, 1)) from error
    return document


class _CopyPlace:
    """minidom calls `handle` for each element of a tree that is cloned."""

    def handle(self, operation: int, key: str, data: Place, src: Node, dst: Node) -> None:
        dst.setUserData(key, data, self)


def place_of(node: DomElement) -> Place | None:
    place = node.getUserData(_PLACE)
    return place if isinstance(place, Place) else None


def element_of(node: DomElement, _depth: int = 0) -> Element:
    """The immutable form of a tree; comments and namespace declarations are left out.

    Raises:
        InvalidInput: nested deeper than the bound.
    """
    if _depth > MAX_DEPTH:
        raise invalid("URDF001", f"elements are nested deeper than {MAX_DEPTH}", place_of(node))
    children: list[Element] = []
    text: list[str] = []
    for child in node.childNodes:
        if child.nodeType == child.ELEMENT_NODE:
            children.append(element_of(child, _depth + 1))
        elif child.nodeType in (child.TEXT_NODE, child.CDATA_SECTION_NODE):
            text.append(child.data)
    attributes = {name: value for name, value in node.attributes.items() if not name.startswith("xmlns")}
    return Element(node.tagName, attributes, "".join(text).strip(), tuple(children), place_of(node))
