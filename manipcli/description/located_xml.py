"""XML reader that keeps file, line and column of every element; without DTD and entities, bounded in size and depth."""

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
    """An element of a description, after expansion; `place`, `text_place`: positions of the element and of its text."""

    tag: str
    attributes: Mapping[str, str]
    text: str
    children: tuple[Element, ...]
    place: Place | None
    text_place: Place | None = None

    @property
    def name(self) -> str:
        """The attribute `name`, stripped; '' if missing."""
        return self.attributes.get("name", "").strip()

    def all(self, tag: str) -> tuple[Element, ...]:
        return tuple(child for child in self.children if child.tag == tag)

    def first(self, *path: str) -> Element | None:
        """The first child with the first tag of `path`, its first child with the second tag, and so on."""
        at: Element | None = self
        for tag in path:
            at = next((child for child in at.children if child.tag == tag), None) if at is not None else None
        return at


def shown_path(path: Path) -> str:
    """A path for messages: relative to the working directory if it is inside, else as given."""
    try:
        return str(path.relative_to(Path.cwd()))
    except ValueError:
        return str(path)


def invalid(code: str, message: str, place: Place | None = None, hint: str | None = None) -> InvalidInput:
    return InvalidInput([Diagnostic(code=code, message=message, place=place, hint=hint)])


def read_document(path: Path) -> Document:
    """The document of a file; `place_of` gives the place of its elements and of their copies (cloneNode).

    Raises:
        InvalidInput: unreadable, not well-formed, a DOCTYPE, or a bound is exceeded.
    """
    file = shown_path(path)
    try:
        if not path.is_file():
            what = "is a folder" if path.is_dir() else "is not a regular file" if path.exists() else "does not exist"
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
    """Like `read_document`, from the bytes of a file; `file` is its name in messages."""
    from xml.dom import expatbuilder
    from xml.parsers import expat

    copy_place = _CopyPlace()

    class Builder(expatbuilder.ExpatBuilderNS):
        """Builds a minidom tree and stores the place of each start tag at its element."""

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
            node = self.curNode  # expat reports the position after the text
            if node.nodeType == node.ELEMENT_NODE and node.getUserData(_TEXT_PLACE) is None and data.strip():
                node.setUserData(_TEXT_PLACE, _begin(self.place(), data.lstrip(), lines), copy_place)
            super().character_data_handler_cdata(data)

        def end_element_handler(self, name: str) -> None:
            self.depth -= 1
            super().end_element_handler(name)

        def start_doctype_decl_handler(self, *declaration: object) -> None:
            raise invalid("URDF051", "a DOCTYPE is not allowed in a description", self.place(), "delete it")

    if data.startswith((b"\xff\xfe", b"\xfe\xff")) or data[:2] in (b"<\0", b"\0<"):
        message = "the file is UTF-16, which few programs can read"
        raise invalid("URDF001", message, Place(file, 1, 1), "save it as UTF-8")
    lines = data.split(b"\n")
    builder = Builder()
    try:
        document: Document = builder.parseString(data)
    except expat.ExpatError as error:
        message, place, hint = _described(error, data, file)
        begins = data.removeprefix(b"\xef\xbb\xbf").lstrip()[:1]
        other = None if begins in (b"<", b"") else "not XML; for robot, controller and task files use `manipcli check`"
        raise invalid("URDF001", message, place, other or hint or _open_element(builder.curNode)) from error
    except (LookupError, ValueError) as error:
        raise invalid("URDF001", f"not valid XML: {error}", Place(file, 1, 1)) from error
    return document


def _described(error: ExpatError, data: bytes, file: str) -> tuple[str, Place, str | None]:
    """Message, place and hint (or None) of a syntax error."""
    from xml.parsers.expat import ErrorString, errors

    words = ErrorString(error.code)
    lines = re.split(rb"\r\n|\r|\n", data)
    line = lines[error.lineno - 1] if 0 < error.lineno <= len(lines) else b""
    before, here = line[: error.offset].rstrip(), line[error.offset : error.offset + 1]
    place = Place(file, error.lineno, error.offset + 1)
    message, hint = f"not well-formed XML: {words}", None
    if words == errors.XML_ERROR_MISPLACED_XML_PI:
        hint = "delete everything before '<?xml', including blanks"
    elif words == errors.XML_ERROR_UNBOUND_PREFIX:
        found = re.compile(rb"</?([\w.-]+):").match(line, error.offset)
        prefix = found.group(1).decode("utf-8", "replace")[:40] if found else ""
        if prefix:
            message = f"{message} '{prefix}'"
            hint = f'declare it in the root element: xmlns:{prefix}="{_XACRO if prefix == "xacro" else "..."}"'
    elif words == errors.XML_ERROR_INVALID_TOKEN:
        if line.startswith(b"<<<<<<<"):
            place = Place(file, error.lineno, 1)
            return "unresolved merge conflict", place, "keep one side, and delete the '<<<<<<<' markers"
        byte = None if _DECLARED.match(data) else _not_utf8(data, file)
        if byte is not None and byte[1].line == error.lineno:
            hint = 'save it as UTF-8: iconv -f latin1 -t utf-8; or declare it: <?xml version="1.0" encoding=...?>'
            return byte[0], byte[1], hint
        if here == b"<":
            hint = "write < as &lt; inside a value, or close the quote before it"
        elif here == b"&" or before.endswith(b"&"):
            hint = "write & as &amp;, and < inside a value as &lt;"
        elif before.endswith(b"="):
            hint = 'put the value in quotes: "..."'
        elif before.endswith(b"--"):
            hint = "remove '--' from the comment"
    return message, place, hint


def _not_utf8(data: bytes, file: str) -> tuple[str, Place] | None:
    """Message and place of the first byte that is not valid UTF-8."""
    try:
        data.decode("utf-8")
    except UnicodeDecodeError as error:
        before = data[: error.start].decode("utf-8").removeprefix("\ufeff")
        column = len(before) - before.rfind("\n")
        return f"the byte 0x{data[error.start]:02x} is not UTF-8", Place(file, before.count("\n") + 1, column)
    return None


def _begin(end: Place, text: str, lines: Sequence[bytes]) -> Place:
    """Start of a text that ends before `end`; an entity in its first line counts as one character."""
    first, newline, _ = text.partition("\n")
    line = max(end.line - text.count("\n"), 1)
    behind = end.column
    if newline and line <= len(lines):
        behind = len(lines[line - 1].removesuffix(b"\r").decode("utf-8", "replace")) + 1
    return Place(end.file, line, max(behind - len(first), 1))


def _open_element(node: Node | None) -> str | None:
    """The hint that names the element in which a document ends unexpectedly."""
    if node is None or node.nodeType != node.ELEMENT_NODE:
        return None
    element = cast("DomElement", node)
    return f"close <{element.tagName[:60]}> of line {place.line}" if (place := place_of(element)) else None


class _CopyPlace:
    """User data handler: minidom calls `handle` for each cloned element."""

    def handle(self, operation: int, key: str, data: Place, src: Node, dst: Node) -> None:
        dst.setUserData(key, data, self)


def place_of(node: DomElement, key: str = _PLACE) -> Place | None:
    place = node.getUserData(key)
    return place if isinstance(place, Place) else None


def called_from(node: DomElement, calls: tuple[Place, ...]) -> None:
    """Stores at an element the macro calls that created it, unless it already has some."""
    place = place_of(node)
    if place is not None and not place.calls:
        node.setUserData(_PLACE, dataclasses.replace(place, calls=calls), _CopyPlace())


def element_of(node: DomElement, _depth: int = 0) -> Element:
    """The immutable form of a tree, without comments and namespace declarations.

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
