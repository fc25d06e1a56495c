"""XML of which every element knows file, line and column; no DTD, no entities, bounded size, depth and count."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, cast

from manipcli.core.errors import Diagnostic, InvalidInput, Place
from manipcli.description.bounds import bounds, raised

if TYPE_CHECKING:
    from xml.dom.minidom import Document, Node
    from xml.dom.minidom import Element as DomElement
    from xml.parsers.expat import ExpatError

_PLACE = "manipcli.place"
_TEXT_PLACE = "manipcli.text_place"
_DECLARED: Final = re.compile(rb"""\s*<\?xml\s[^>]*\bencoding\s*=""")
_XACRO: Final = "http://www.ros.org/wiki/xacro"


@dataclass(frozen=True, slots=True)
class Element:
    """An element of a description, after expansion. `place`: where the user wrote it; `text_place`: and its text."""

    tag: str
    attributes: Mapping[str, str]
    text: str
    children: tuple[Element, ...]
    place: Place | None
    text_place: Place | None = None

    @property
    def name(self) -> str:
        """Its attribute `name` without blanks around; '' where it has none."""
        return self.attributes.get("name", "").strip()

    def all(self, tag: str) -> tuple[Element, ...]:
        return tuple(child for child in self.children if child.tag == tag)

    def first(self, *path: str) -> Element | None:
        """The first child of a tag; of that, the first of the next tag of the path."""
        at: Element | None = self
        for tag in path:
            at = next((child for child in at.children if child.tag == tag), None) if at is not None else None
        return at


def shown_path(path: Path) -> str:
    """How messages name a file: relative to the working folder where it lies below that, else as given."""
    try:
        return str(path.relative_to(Path.cwd()))
    except ValueError:
        return str(path)


def invalid(code: str, message: str, place: Place | None = None, hint: str | None = None) -> InvalidInput:
    return InvalidInput([Diagnostic(code=code, message=message, place=place, hint=hint)])


def read_document(path: Path) -> Document:
    """The document of a file; `place_of` tells the place of its elements, of copies (cloneNode) too.

    Raises:
        InvalidInput: unreadable, not well-formed, a DOCTYPE, or beyond a bound.
    """
    file = shown_path(path)
    try:
        if not path.is_file():
            what = "is a folder" if path.is_dir() else "is no regular file" if path.exists() else "is not there"
            raise invalid("URDF001", f"'{file}' {what}", Place(file, 0, 0))
        with path.open("rb") as stream:
            data = stream.read(bounds().file_bytes + 1)
        if len(data) > bounds().file_bytes:
            message = f"the file is larger than {bounds().file_bytes / 1e6:g} MB"
            raise invalid("URDF052", message, Place(file, 1, 1), raised("file_bytes"))
    except OSError as error:
        raise invalid("URDF001", f"cannot read '{file}': {error.strerror}", Place(file, 0, 0)) from error
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
        bound = bounds()

        def place(self) -> Place:
            parser = self.getParser()
            return Place(file, parser.CurrentLineNumber, parser.CurrentColumnNumber + 1)

        def start_element_handler(self, name: str, attributes: list[str]) -> None:
            self.depth += 1
            self.count += 1
            if self.depth > self.bound.depth:
                message = f"elements are nested more than {self.bound.depth} deep"
                raise invalid("URDF052", message, self.place(), raised("depth"))
            if self.count > self.bound.elements:
                message = f"the file has more than {self.bound.elements} elements"
                raise invalid("URDF052", message, self.place(), raised("elements"))
            if any(len(text) > self.bound.attribute for text in attributes):
                message = f"an attribute is longer than {self.bound.attribute} characters"
                raise invalid("URDF052", message, self.place(), raised("attribute"))
            super().start_element_handler(name, attributes)
            self.curNode.setUserData(_PLACE, self.place(), copy_place)

        def character_data_handler_cdata(self, data: str) -> None:
            """Expat gathers text, and stands behind it when it hands it over."""
            node = self.curNode
            if node.nodeType == node.ELEMENT_NODE and node.getUserData(_TEXT_PLACE) is None and data.strip():
                node.setUserData(_TEXT_PLACE, _begin(self.place(), data.lstrip(), lines), copy_place)
            super().character_data_handler_cdata(data)

        def end_element_handler(self, name: str) -> None:
            self.depth -= 1
            super().end_element_handler(name)

        def start_doctype_decl_handler(self, *declaration: object) -> None:
            raise invalid("URDF051", "a DOCTYPE is not allowed in a description", self.place(), "delete it")

    if data.startswith((b"\xff\xfe", b"\xfe\xff")) or data[:2] in (b"<\0", b"\0<"):
        raise invalid("URDF001", "the file is UTF-16, which few programs read", Place(file, 1, 1), "save it as UTF-8")
    lines = data.split(b"\n")
    builder = Builder()
    try:
        document: Document = builder.parseString(data)
    except expat.ExpatError as error:
        message, place, hint = _told(error, data, file)
        begins = data.removeprefix(b"\xef\xbb\xbf").lstrip()[:1]
        other = None if begins in (b"<", b"") else "this is no XML; robot, controllers and task files: `manipcli check`"
        raise invalid("URDF001", message, place, other or hint or _open_element(builder.curNode)) from error
    except (LookupError, ValueError) as error:
        raise invalid("URDF001", f"not readable as XML: {error}", Place(file, 1, 1)) from error
    return document


def _told(error: ExpatError, data: bytes, file: str) -> tuple[str, Place, str | None]:
    """Message, place and hint (None: nothing better than that an element is open) for `data` of a `file`."""
    from xml.parsers.expat import ErrorString, errors

    words = ErrorString(error.code)
    lines = re.split(rb"\r\n|\r|\n", data)
    line = lines[error.lineno - 1] if 0 < error.lineno <= len(lines) else b""
    before, here = line[: error.offset].rstrip(), line[error.offset : error.offset + 1]
    place = Place(file, error.lineno, error.offset + 1)
    message, hint = f"not well-formed XML: {words}", None
    if words == errors.XML_ERROR_MISPLACED_XML_PI:
        hint = "nothing may stand before '<?xml', not even a blank"
    elif words == errors.XML_ERROR_UNBOUND_PREFIX:
        found = re.compile(rb"</?([\w.-]+):").match(line, error.offset)
        prefix = found.group(1).decode("utf-8", "replace")[:40] if found else ""
        if prefix:
            message = f"{message} '{prefix}'"
            hint = f'declare it in the root element: xmlns:{prefix}="{_XACRO if prefix == "xacro" else "..."}"'
    elif words == errors.XML_ERROR_INVALID_TOKEN:
        if line.startswith(b"<<<<<<<"):
            return "a merge conflict is not resolved", Place(file, error.lineno, 1), "keep one side, and no '<<<<<<<'"
        byte = None if _DECLARED.match(data) else _not_utf8(data, file)
        if byte is not None and byte[1].line == error.lineno:
            hint = (
                'save it as UTF-8: iconv -f latin1 -t utf-8; or name its encoding: <?xml version="1.0" encoding=...?>'
            )
            return byte[0], byte[1], hint
        if here == b"<":
            hint = "write < as &lt; inside a value, or close the quote before it"
        elif here == b"&" or before.endswith(b"&"):
            hint = "write & as &amp;, and < inside a value as &lt;"
        elif before.endswith(b"="):
            hint = 'put the value in quotes: "..."'
        elif before.endswith(b"--"):
            hint = "take '--' out of the comment"
    return message, place, hint


def _not_utf8(data: bytes, file: str) -> tuple[str, Place] | None:
    """The first byte that no text in UTF-8 has, and where."""
    try:
        data.decode("utf-8")
    except UnicodeDecodeError as error:
        before = data[: error.start].decode("utf-8").removeprefix("\ufeff")
        column = len(before) - before.rfind("\n")
        return f"the byte 0x{data[error.start]:02x} is not UTF-8", Place(file, before.count("\n") + 1, column)
    return None


def _begin(end: Place, text: str, lines: Sequence[bytes]) -> Place:
    """Where a text that stops before `end` begins; an entity in its first line counts as the character that it is."""
    first, newline, _ = text.partition("\n")
    line = max(end.line - text.count("\n"), 1)
    behind = end.column
    if newline and line <= len(lines):
        behind = len(lines[line - 1].removesuffix(b"\r").decode("utf-8", "replace")) + 1
    return Place(end.file, line, max(behind - len(first), 1))


def _open_element(node: Node | None) -> str | None:
    """The hint that names the element in which a document broke off."""
    if node is None or node.nodeType != node.ELEMENT_NODE:
        return None
    element = cast("DomElement", node)
    return f"<{element.tagName[:60]}> of line {place.line} is open" if (place := place_of(element)) else None


class _CopyPlace:
    """minidom calls `handle` for each element of a tree that is cloned."""

    def handle(self, operation: int, key: str, data: Place, src: Node, dst: Node) -> None:
        dst.setUserData(key, data, self)


def place_of(node: DomElement, key: str = _PLACE) -> Place | None:
    place = node.getUserData(key)
    return place if isinstance(place, Place) else None


def called_from(node: DomElement, calls: tuple[Place, ...]) -> None:
    """Leaves with an element that macros made it, unless it is known already."""
    place = place_of(node)
    if place is not None and not place.calls:
        node.setUserData(_PLACE, dataclasses.replace(place, calls=calls), _CopyPlace())


def element_of(node: DomElement, _depth: int = 0) -> Element:
    """The immutable form of a tree; comments and namespace declarations are left out.

    Raises:
        InvalidInput: nested deeper than the bound.
    """
    if _depth > bounds().depth:
        message = f"elements are nested more than {bounds().depth} deep"
        raise invalid("URDF052", message, place_of(node), raised("depth"))
    children: list[Element] = []
    text: list[str] = []
    for child in node.childNodes:
        if child.nodeType == child.ELEMENT_NODE:
            children.append(element_of(child, _depth + 1))
        elif child.nodeType in (child.TEXT_NODE, child.CDATA_SECTION_NODE):
            text.append(child.data)
    attributes = {name: value for name, value in node.attributes.items() if not name.startswith("xmlns")}
    return Element(
        tag=node.tagName,
        attributes=attributes,
        text="".join(text).strip(),
        children=tuple(children),
        place=place_of(node),
        text_place=place_of(node, _TEXT_PLACE),
    )
