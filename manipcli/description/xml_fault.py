"""What the parser's few words about XML that is none mean, and what to do."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from manipcli.core.errors import Place

if TYPE_CHECKING:
    from xml.parsers.expat import ExpatError

_DECLARED: Final = re.compile(rb"""\s*<\?xml\s[^>]*\bencoding\s*=""")
_XACRO: Final = "http://www.ros.org/wiki/xacro"


def told(error: ExpatError, data: bytes, file: str) -> tuple[str, Place, str | None]:
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
